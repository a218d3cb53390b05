"""The manual agrees with the kept results, the scenes that it shows are valid and use every key, and snippets run."""

import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest
import yaml

from roughslip.report.sections import by_chance, holding
from roughslip.scene.loader import load
from roughslip.scene.schema import keys

ROOT = Path(__file__).resolve().parents[1]


def kept_claims() -> dict[str, list]:
    scenes = ("paper", "resolved")
    return {scene: json.loads((ROOT / f"results/reference/{scene}/claims.json").read_text()) for scene in scenes}


def test_the_table_of_verdicts_and_their_chance_are_those_of_the_kept_results():
    """The headlines of both scenes, and how many readings hold."""
    rows = []
    for pair in zip(*kept_claims().values(), strict=True):
        headlines = " | ".join(claim["headline"] for claim in pair)
        rows.append(f"| {pair[0]['statement']} | {headlines} | {'; '.join(map(holding, pair))} |")
    page = (ROOT / "docs/results.md").read_text()
    assert [line for line in page.splitlines() if line in rows] == rows
    text = " ".join(page.split())
    said = {scene: re.findall(r"[\d.]+", by_chance(claims)) for scene, claims in kept_claims().items()}
    (decided, chance), (others, other) = ((numbers[0], numbers[2]) for numbers in said.values())
    assert f"{decided} verdicts on readings are decided in `paper` and {others} in `resolved`" in text
    assert f"{chance} and {other} of them would be wrong by chance" in text


def test_every_picture_and_page_that_the_readme_links_exists():
    links = [part.partition(")")[0] for part in (ROOT / "README.md").read_text().split("](")[1:]]
    assert links
    assert [link for link in links if not (ROOT / link).is_file()] == []


def dotted(scene: dict, prefix: str = "") -> Iterator[str]:
    """Every key of a scene by its dotted name, sections among them."""
    for key, value in scene.items():
        yield prefix + key
        if isinstance(value, dict):
            yield from dotted(value, f"{prefix}{key}.")


def test_scenes_that_documents_show_are_valid_and_with_the_shipped_ones_use_every_key(tmp_path):
    """So each has an example that loads."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    shown = [part.partition("```")[0] for page in pages for part in page.read_text().split("```yaml\n")[1:]]
    shipped = {scene.name: scene.read_text() for scene in (ROOT / "config/scenes").glob("*.yaml")}
    for name, text in shipped.items():
        (tmp_path / name).write_text(text)
    loaded = {}
    for text in shown:
        (tmp_path / "mine.yaml").write_text(text)
        scene = load("mine", tmp_path)
        loaded[scene["description"]] = scene
    assert len(loaded) >= 8
    assert loaded["A softer pad on the same disc"]["oscillator"]["normal_force_n"] == 1200.0
    assert set(loaded["Our disc, after its scan"]["roughness"]) == {"scan"}
    used = {key for text in (*shipped.values(), *shown) for key in dotted(yaml.safe_load(text))}
    sections = {key for key, part in keys() if "properties" in json.dumps(part)}
    assert sorted(set(dict(keys())) - sections - used) == []


@pytest.mark.slow  # compiles contact and motion, and searches limits
def test_each_snippet_runs_by_itself(monkeypatch):
    """They hold numbers to check, and none is of a function that is gone."""
    monkeypatch.syspath_prepend(ROOT / "docs")
    shown = import_module("api_pages").snippets()
    for name, code in shown.items():
        package, _, function = name.rpartition(".")
        assert function in import_module(package).__all__
        exec(compile(code, name, "exec"), {"__name__": name})  # noqa: S102 - our own examples
    assert shown
