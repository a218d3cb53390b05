"""The page that compares variants: numbers of the answer in units for readers, the same in SI in the table."""

from roughslip import store
from roughslip.report.answer import summary
from roughslip.report.sweep_page import Row, sweep_page, sweep_table
from roughslip.stages.sweep import TITLES, of_answer, row
from tests.report.test_report import Page
from tests.report.test_report_answer import MACHINE


def test_a_variant_has_its_answer_and_how_far_it_is():
    """A letter stands at 320 + 300 log(limit / own) / log(100): m at 1 / 50 and D at 1.172."""
    numbers = of_answer(MACHINE | {"summary": summary(MACHINE)})
    assert numbers["limit_damping"] == (0.19923, 0.1904, 0.2103)
    assert "limit_load" not in numbers
    rows = [Row("mine", {"oscillator.damping_ratio": 0.17}, numbers, MACHINE), Row("mine-1", {"a.b": None}, {})]
    page = Page(sweep_page(rows, "Of <mine>.", TITLES))
    assert page.mistakes == page.open == []
    text = " ".join(" ".join(page.text).split())
    for part in ("Of <mine>", "4.77 mm", "4.73 to 4.81", "0.199", "0.19 to 0.21", "not given"):
        assert part in text
    assert [(attrs["x"], attrs["y"]) for attrs in page.all("text")] == [("330.3", "13"), ("65.2", "13")]
    head, first, second = sweep_table(rows, TITLES).splitlines()
    assert head.startswith("scene,oscillator.damping_ratio,probability,probability_low,probability_high,friction_mean")
    assert first.startswith("mine,0.17,1,0.963,1,0.4,,")
    assert second.startswith("mine-1,not given,,,")


def test_a_variant_without_an_answer_has_the_numbers_that_its_files_hold(tmp_path):
    """Friction under a load has no statistics by penetration; an answer that is not given has no numbers."""
    held = {"oscillator/deterministic.nc": ("hopf_damping", 0.2), "friction/statistics.nc": ("mean", 0.3)}
    files = {file: {name: store.Variable((), value, "1", name)} for file, (name, value) in held.items()}
    paths = {name: tmp_path / str(number) for number, name in enumerate((*files, "answer.json"))}
    for name, variables in files.items():
        store.write(paths[name], variables, store.Key({}, "code"))
    store.write_json(paths["answer.json"], {"given": False})
    assert row("mine", {}, paths) == Row("mine", {}, {"hopf_damping": (0.2, None, None)})
