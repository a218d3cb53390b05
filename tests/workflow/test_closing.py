"""What the terminal shows at the end of a run."""

import json

from workflow.study.closing import MOST_WARNINGS, closing_lines


def test_answer_and_warnings_of_each_scene_that_the_run_made(tmp_path):
    """At most MOST_WARNINGS, and the number of the others; only of scenes that the run published, with their pages.
    The answer of `a` is from older targets: its costs do not hold that stage."""
    for name, count in (("b", MOST_WARNINGS), ("a", MOST_WARNINGS + 2), ("c", 0), ("d", 1)):
        (tmp_path / "results" / name).mkdir(parents=True)
        rows = [{"stage": "answer" if name == "b" else "scan"}]
        rows += [{"stage": "all", "warnings": [f"scan: {number}" for number in range(count)]}]
        (tmp_path / "results" / name / "costs.json").write_text(json.dumps(rows))
        (tmp_path / "results" / name / "answer.json").write_text(json.dumps({"summary": ["Certain.", "Below 5 %."]}))
    folder = tmp_path / "results"
    files = ("b/published.json", "a/published.json", "c/published.json", "report.html", "store/report/0/report.html")
    made = [f"{folder}/{file}" for file in files]
    assert closing_lines(made) == [
        *(f"a: warning: scan: {number}" for number in range(MOST_WARNINGS)),
        f"a: and 2 more warnings in {folder}/a/report.html",
        "b: Certain.",
        "b: Below 5 %.",
        *(f"b: warning: scan: {number}" for number in range(MOST_WARNINGS)),
        *(f"page: {folder}/{name}report.html" for name in ("a/", "b/", "c/", "")),
    ]
