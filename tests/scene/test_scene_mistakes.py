"""A mistake in a scene file has its line; mistakes.txt lists mistakes and lines."""

from pathlib import Path

import pytest

from tests.scene.shipped import FIGURES, KINDS, KNOWN, lines_of

_, *MISTAKES = (Path(__file__).parent / "mistakes.txt").read_text(encoding="utf-8").split("\n\n")


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_has_its_line(mine, mistake):
    text, line = mistake.strip().split("\n-> ")
    text = text if "extends:" in text else f"extends: paper\n{text}"
    for name, words in (("{FIGURES}", FIGURES), ("{KINDS}", KINDS), ("{KNOWN}", KNOWN)):
        line = line.replace(name, words)
    assert lines_of(mine, text) == [f"scenes/mine.yaml: {line}"]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("", "empty; a scene file holds keys and values"),
        ("# nothing\n", "empty; a scene file holds keys and values"),
        ("- 1\n- 2\n", "[1, 2] is not allowed; a scene file holds keys and values"),
        ("text\n", "'text' is not allowed; a scene file holds keys and values"),
        (b"seed: 1  # \xb5m\n", "not UTF-8 text; byte 11 is 0xb5"),
        (
            b"a: \x00\n",
            "not valid YAML: unacceptable character #x0000: special characters are not allowed in "
            '"<unicode string>", position 3',
        ),
        (
            "a: 'b\n",
            "line 2, column 1: not valid YAML: found unexpected end of stream, while scanning a quoted scalar that "
            "begins in line 1",
        ),
        ("a:\n\tb: 1\n", "line 2, column 1: not valid YAML: found character '\\t' that cannot start any token"),
        ("a: 1\n---\na: 1\n", "line 2, column 1: not valid YAML: but found another document"),
        ('a: "\\Uffffffff"\n', "not valid YAML: "),
        ("a: " + "[" * 5000, "not valid YAML: nested too deeply"),
        ("# " + "x" * 100_000, "larger than 100000 bytes, which no scene needs"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_file_that_is_no_scene(mine, content, line):
    (found,) = lines_of(mine, content)
    assert found.startswith(f"scenes/mine.yaml: {line}")
    assert "\n" not in found
