"""The README agrees with the kept results; the scenes in the documents are valid."""

import json
import re
from collections.abc import Iterator
from pathlib import Path

import yaml

from roughslip.report.sections import BY_CHANCE, by_chance, under_which
from roughslip.scene.schema import scene_schema
from tests.scene.shipped import properties

ROOT = Path(__file__).resolve().parents[1]
SCENES = ("paper", "resolved")
DECIDED = ("reproduced", "contradicted")


def row(pair):
    """The headlines of both scenes, and under which reading each statement holds."""
    under = list(dict.fromkeys(under_which(claim) for claim in pair))
    return f"| {pair[0]['statement']} | {' | '.join(claim['headline'] for claim in pair)} | {'; '.join(under)} |"


def test_the_table_of_verdicts_is_that_of_the_kept_results():
    kept = [json.loads((ROOT / f"results/reference/{scene}/claims.json").read_text()) for scene in SCENES]
    rows = [row(pair) for pair in zip(*kept, strict=True)]
    found = [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("| ")]
    assert [line for line in found if line in rows] == rows


def test_the_results_say_how_hard_the_kept_verdicts_are():
    text = " ".join((ROOT / "docs/results.md").read_text().split())
    for scene in SCENES:
        kept = json.loads((ROOT / f"results/reference/{scene}/claims.json").read_text())
        decided = [one for claim in kept for one in claim["readings"] if one["verdict"] in DECIDED]
        hard = [one for one in decided if one["at_half"]]
        stand = [one for one in hard if one["at_half"] == one["at_twice"] == one["verdict"]]
        assert f"{len(stand)} of {len(hard)} in `{scene}`" in text
        assert by_chance(kept).startswith(f"{len(decided)} verdicts")
        assert re.search(rf"\b{len(decided)}\b.* {BY_CHANCE * len(decided):.1f} .*wrong by chance", text)


def test_it_is_short_and_every_picture_and_page_that_it_links_exists():
    text = (ROOT / "README.md").read_text()
    links = [part.partition(")")[0] for part in text.split("](")[1:]]
    assert len(links) >= 6
    assert len(text.encode()) <= 8000  # read at a sitting; more is in docs/
    assert [link for link in links if not (ROOT / link).is_file()] == []


def shown_scenes() -> list[str]:
    """Every scene in a block of the README or the manual."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    return [part.partition("```")[0] for page in pages for part in page.read_text().split("```yaml\n")[1:]]


def test_every_key_is_used_by_a_shipped_scene_or_one_that_the_manual_shows():
    """So each has an example that loads."""
    texts = [scene.read_text() for scene in (ROOT / "config/scenes").glob("*.yaml")] + shown_scenes()
    used = {key for text in texts for key in dotted(yaml.safe_load(text))}
    values = {key for key, part in properties(scene_schema()).items() if not has_keys(part)} - {"sweep"}
    assert sorted(values - used) == []


def dotted(scene: dict, prefix: str = "") -> Iterator[str]:
    """Every key of a scene by its dotted name, sections among them."""
    for key, value in scene.items():
        yield prefix + key
        if isinstance(value, dict):
            yield from dotted(value, f"{prefix}{key}.")


def has_keys(part: dict) -> bool:
    """Whether a part of the schema is a section."""
    return "properties" in part or any("properties" in one for one in part.get("anyOf", ()))


def test_the_scenes_that_it_shows_are_valid(tmp_path):
    from roughslip.scene.loader import load

    shown = shown_scenes()
    for scene in (ROOT / "config/scenes").glob("*.yaml"):
        (tmp_path / scene.name).write_text(scene.read_text())
    loaded = {}
    for text in shown:
        (tmp_path / "mine.yaml").write_text(text)
        scene = load("mine", tmp_path)
        loaded[scene["description"]] = scene
    assert len(loaded) >= 8
    assert loaded["A softer pad on the same disc"]["oscillator"]["normal_force_n"] == 1200.0
    assert set(loaded["Our disc, after its scan"]["roughness"]) == {"scan"}
    assert loaded["Which change ends the squeal?"]["targets"][-1] == "figure_map"
