"""The figures draw what is stored and nothing else, the same bytes each time, with all in its place.

Warnings are errors in every test of this project, so a figure that warns fails here.
"""

import matplotlib as mpl
import numpy as np
import pytest
from scipy import stats

from roughslip.figures.figure2 import CONTACT, METHODS, figure2, figure2_traps
from roughslip.figures.figure2 import DRAWN as DRAWN_2
from roughslip.figures.figure3 import DRAWN as DRAWN_3
from roughslip.figures.figure3 import figure3, figure3_law
from roughslip.figures.figure5 import DRAWN as DRAWN_5
from roughslip.figures.figure5 import figure5
from roughslip.figures.figure_budget import DRAWN as BUDGET_DRAWN
from roughslip.figures.figure_budget import figure_budget
from roughslip.figures.figure_chain import DRAWN as CHAIN_DRAWN
from roughslip.figures.figure_chain import figure_chain
from roughslip.figures.figure_scan import DRAWN as SCAN_DRAWN
from roughslip.figures.figure_scan import NUMBERS, figure_scan
from roughslip.figures.friction_against_load import DRAWN as LOADS_DRAWN
from roughslip.figures.friction_against_load import friction_against_load
from roughslip.figures.stick_slip import DRAWN as STICK_SLIP_DRAWN
from roughslip.figures.stick_slip import figure_map
from roughslip.figures.style import save
from tests.figures.drawn import (
    DAMPING,
    Recorded,
    assert_all_is_in_its_place,
    assert_no_legend_covers_data,
    budget_result,
    chain_result,
    friction,
    loads_result,
    map_result,
    oscillator,
    refused,
    scan_alone,
    scan_result,
    square,
    with_outliers,
)

FIGURES = {
    "figure2": (figure2, DRAWN_2["figure2"], square()),
    "figure2_traps": (figure2_traps, DRAWN_2["figure2_traps"], square()),
    "figure3": (figure3, DRAWN_3["figure3"], friction()),
    "figure3_law": (figure3_law, DRAWN_3["figure3_law"], friction()),
    "figure5": (figure5, DRAWN_5["figure5"], oscillator()),
    "figure_chain": (figure_chain, CHAIN_DRAWN["figure_chain"], chain_result()),
    "scan": (figure_scan, SCAN_DRAWN["figure_scan"], scan_result()),
    "map": (figure_map, STICK_SLIP_DRAWN["figure_map"], map_result()),
    "budget": (figure_budget, BUDGET_DRAWN["figure_budget"], budget_result()),
    "loads": (friction_against_load, LOADS_DRAWN["friction_against_load"], loads_result()),
}
LAID_OUT = ("figure2", "figure3_law")  # in the fast tests: legends, most panels
NONE = np.array(np.nan)
LIMITS = ("hopf_damping", "existence_limit")
NO_LIMITS = {"deterministic_hopf_damping": NONE, "deterministic_existence_limit": NONE}
NO_CYCLE = {"reattachment_mean": NONE, "reattachment_std": NONE, "deterministic_reattachment": NONE}
EXCITED = oscillator() | NO_LIMITS | {"deterministic_reattachment": NONE}
NEVER_UNSTABLE = oscillator() | NO_LIMITS | {"deterministic_hopf_damping": np.array(-0.4)}
CASES = {
    "figure2": {
        "full": square(),
        "GPa": square(scale=2e9),
        "few in contact": square(count=6) | {"cumulative": np.tile(np.arange(1, 7) / 8, (5, 1))},
        "refused": refused(),
    },
    "figure2_traps": {"full": square(), "GPa": square(scale=2e9), "refused": refused()},
    "figure3": {"eleven levels": friction(), "one level": friction([50]), "light": friction(lightest=7.0)},
    "figure3_law": {
        "eleven levels": friction(),
        "three levels": friction([10, 50, 90]),
        "one level": friction([50]),
        "long correlation": friction(length=5e-3),
        "hardly any contact": friction(lightest=7.0),
    },
    "figure5": {
        "full": oscillator(),
        "four runs and three dampings": oscillator(4, np.array([0.17, 0.3, 0.34])),
        "one run and one damping": oscillator(1, np.array([0.17])),
        "excited": EXCITED,
        "no cycle": oscillator() | NO_CYCLE,
        "never unstable": NEVER_UNSTABLE,
    },
    "figure_chain": {"GPa": chain_result(), "flat": chain_result() | {"pressure": np.zeros((8, 8))}},
    "scan": {
        "whole": scan_result(),
        "small": scan_result(sufficient=0),
        "no twins": scan_alone(),
        "outliers": with_outliers(),
    },
    "map": {
        "from zero": map_result(),
        "stick-slip everywhere": map_result() | {"probability": np.ones((12, 12))},
        "no limits": map_result(9, ("mass", "load"), 0.02) | {name: np.full(9, np.nan) for name in LIMITS},
    },
    "budget": {
        "six sources": budget_result(),
        "nothing uncertain": budget_result(("",), ("probability", "damping")),
    },
    "loads": {"heavy": loads_result(), "light": loads_result(0.01)},
}


@pytest.mark.parametrize(
    "name", ["map" if name == "map" else pytest.param(name, marks=pytest.mark.slow) for name in FIGURES]
)
def test_a_figure_reads_the_stored_variables_and_leaves_the_same_bytes(name, tmp_path):
    """Also where a matplotlibrc in the working folder or at home asks for another look."""
    draw, drawn, result = FIGURES[name]
    result = Recorded({variable: result[variable] for variable in drawn})
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        figure = draw(result)
        for kind in ("png", "svg"):
            save(figure, tmp_path / folder / f"a.{kind}")
        mpl.rcParams.update({"savefig.bbox": "tight", "lines.antialiased": False, "axes.facecolor": "0.9"})
    assert result.read == set(drawn)
    assert len(drawn) == len(set(drawn))
    for kind in ("png", "svg"):
        content = (tmp_path / "one" / f"a.{kind}").read_bytes()
        assert content == (tmp_path / "two" / f"a.{kind}").read_bytes()
        assert b"atplotlib v" not in content  # a new version would make new bytes of the same picture
        assert b"dc:date" not in content


@pytest.mark.parametrize(
    ("name", "case"),
    [
        pytest.param(name, case, marks=[] if number == 0 and name in LAID_OUT else [pytest.mark.slow])
        for name, cases in CASES.items()
        for number, case in enumerate(cases)
    ],
)
def test_all_is_in_its_place(name, case):
    figure = FIGURES[name][0](CASES[name][case])
    assert_all_is_in_its_place(figure)
    if name.startswith("figure"):
        assert_no_legend_covers_data(figure)


def line(axes, label):
    (line,) = [each for each in axes.lines if each.get_label() == label]
    return line.get_data()


def test_figure2_draws_the_paper_s_four_curves_given_contact():
    """Monte Carlo, the samples of one design, and the fits to it at surfaces in contact, as the paper has them."""
    result = square()
    linear, logarithmic, probability = figure2(result).axes
    curves = [result["cumulative"][0], result["design_cumulative"], *result["given_cumulative"]]
    labels = [label for label, _ in METHODS.values()][:4]
    for axes in (linear, logarithmic):
        assert [one.get_label() for one in axes.lines] == labels
        for label, curve in zip(labels, curves, strict=True):
            x, y = line(axes, label)
            np.testing.assert_allclose(x, 1e-6 * result["pressure"])
            np.testing.assert_array_equal(y, curve)
    for number, method in enumerate(CONTACT):
        row = list(METHODS).index(method)
        interval, value = probability.lines[2 * number : 2 * number + 2]
        np.testing.assert_allclose(value.get_data(), [[100 * result["contact_probability"][row]], [-number]])
        ends = [100 * result[f"contact_probability_{end}"][row] for end in ("low", "high")]
        np.testing.assert_allclose(interval.get_xdata(), ends)
    assert linear.get_xlabel().endswith("[MPa]")
    assert figure2(square(scale=2e9)).axes[0].get_xlabel().endswith("[GPa]")
    looks = [look for _, look in METHODS.values()]  # methods differ in style too, for print in grey
    assert len({(look["linestyle"], look.get("linewidth")) for look in looks}) == len(looks)


def test_figure2_traps_draws_all_surfaces_and_where_the_fit_has_samples():
    result = square()
    linear, _, variable = figure2_traps(result).axes
    for row, (label, _) in enumerate(METHODS.values()):
        np.testing.assert_array_equal(line(linear, label)[1], result["cumulative"][row])
    texts = [text.get_text() for text in linear.texts]
    assert texts == ["distance 0.020", "distance 0.140", "distance 0.760", "distance 0.013"]
    texts = [text.get_text() for text in figure2_traps(refused()).axes[0].texts]
    assert texts == ["distance 0.020", "fit refused", "fit refused", "distance 0.013"]
    x, density = line(variable, "all surfaces: drawn")
    assert np.sum(density[1:] * np.diff(x)) == pytest.approx(1.0, abs=1e-3)  # the standard normal
    np.testing.assert_array_equal(variable.patches[0].get_data().values, result["first_variable"])


def test_figure3_draws_the_stored_numbers():
    result = friction()
    mean, std, variation = figure3(result).axes
    for axes, name in ((mean, "mean"), (std, "std")):
        for row, label in enumerate(("solved contact", "expansion")):
            np.testing.assert_array_equal(line(axes, label), [result["percentile"], result[name][row]])
        np.testing.assert_array_equal(line(axes, "combined")[1], result[f"combined_{name}"])
        band = axes.collections[0].get_paths()[0].vertices[:, 1]
        assert (band.min(), band.max()) == (result[f"{name}_low"][0].min(), result[f"{name}_high"][0].max())
    np.testing.assert_array_equal(line(mean, "$\\mu_{fit}$"), [result["fit_percentile"], result["fit"]])
    np.testing.assert_array_equal(line(variation, "combined")[1], result["combined_variation"])


def test_figure3_law_draws_the_stored_numbers():
    result = friction(lightest=7.0)
    correlation, lengths, marginal, nearest, skewness, kurtosis = figure3_law(result).axes
    filled, outlined = nearest.patches
    assert filled.get_label() == "at 10 %, distance 0.032"  # at 5 % the skewness is 7.3
    np.testing.assert_array_equal(filled.get_data().values, result["standard_histogram"][1])
    np.testing.assert_array_equal(outlined.get_data().values, result["standard_histogram"][5])
    x, y = line(correlation, "median penetration")
    np.testing.assert_allclose(x, 1e6 * result["lag"])
    np.testing.assert_array_equal(y, result["combined_autocorrelation"][5])
    np.testing.assert_array_equal(line(correlation, "triangle of the window")[1], result["triangle"])
    np.testing.assert_allclose(line(correlation, "exponential, 300 µm")[1], np.exp(-result["lag"] / 300e-6))
    assert len(correlation.lines) == 10 + 4 + 1  # other levels, four curves, the zero line
    np.testing.assert_allclose(line(lengths, "rough surfaces")[1], 300.0)
    np.testing.assert_allclose(line(lengths, "triangle of the window")[1], 320.0)
    np.testing.assert_allclose(line(lengths, "paper")[1], 250.0)
    u = np.linspace(-8, 8, 4001)
    for label in ("fitted Beta at bound", "paper, Beta(2.1, 5)", "normal"):
        x, y = line(marginal, label)
        np.testing.assert_allclose(
            np.trapezoid(np.interp(u, x, y, 0, 0), u), 1.0, atol=5e-3
        )  # densities, on 400 points
    (stairs,) = marginal.patches
    np.testing.assert_array_equal(stairs.get_data().values, result["standard_histogram"][5])
    papers = stats.beta(2.1, 5.0).stats("sk")
    for axes, name, paper in zip((skewness, kurtosis), ("skewness", "kurtosis"), papers, strict=True):
        np.testing.assert_array_equal(line(axes, "rough surfaces"), [result["percentile"], result[f"combined_{name}"]])
        assert line(axes, "paper, Beta(2.1, 5)")[1][0] == pytest.approx(paper, abs=5e-4)
        assert axes.get_yscale() == "symlog"
    assert figure3_law(friction()).axes[4].get_yscale() == "linear"


def test_figure5_draws_the_stored_numbers():
    result = oscillator()
    cycle, histogram, loss, counts = figure5(result).axes
    np.testing.assert_allclose(
        line(cycle, "deterministic"),
        [1e3 * result["deterministic_position"], 1e3 * result["deterministic_velocity"]],
    )
    np.testing.assert_allclose(cycle.lines[3].get_ydata(), 1e3 * result["velocity"][3])
    (stairs,) = histogram.patches
    values, edges, _ = stairs.get_data()
    np.testing.assert_allclose(edges, 1e3 * result["histogram_edge"])
    assert np.sum(values * np.diff(edges)) == pytest.approx(1.0)
    x, y = line(histogram, "fitted normal")
    assert (x[np.argmax(y)], np.trapezoid(y, x)) == (pytest.approx(3.3, abs=0.01), pytest.approx(1.0, abs=1e-3))
    np.testing.assert_array_equal(loss.lines[0].get_xydata(), np.stack([DAMPING, result["difference"]], axis=1))
    for label, name in (
        ("$M_d$, without scatter", "deterministic_cycles"),
        ("$E[M_S]$, with scatter", "mean_cycles"),
    ):
        np.testing.assert_array_equal(line(counts, label), [DAMPING, result[name]])
    labels = counts.get_legend_handles_labels()[1]
    assert labels[-2:] == ["sliding unstable below 0.2311", "cycle exists below 0.3244"]


def test_limits_that_do_not_exist_or_lie_off_the_list_are_not_drawn():
    for result in (EXCITED, NEVER_UNSTABLE):
        counts = figure5(result).axes[3]
        assert len(counts.get_legend_handles_labels()[1]) == 2
        assert counts.get_xlim()[0] > 0
    histogram = figure5(oscillator() | NO_CYCLE).axes[1]
    assert [text.get_text() for text in histogram.texts] == ["too few cycles at this damping"]


def test_the_scan_draws_the_stored_numbers():
    result = scan_result()
    figure = figure_scan(result)
    assert figure.get_suptitle().replace("\n", " ") == f"Read: {result['read'][0]}"
    density, correlation, spectrum, numbers = figure.axes[2:6]
    lines = {line.get_label(): line.get_data() for line in correlation.lines}
    np.testing.assert_allclose(lines["scan, along x"], [1e6 * result["lag_x"][30:], result["correlation"][30:, 10]])
    np.testing.assert_allclose(lines["twins, along y"][1], result["twin_correlation_y"][:, 10:].mean(axis=0))
    np.testing.assert_allclose(density.lines[0].get_ydata(), 1e-6 * result["density"])
    np.testing.assert_allclose(spectrum.lines[1].get_ydata(), 1e24 * result["twin_power"].mean(axis=0))
    # twins spread to two half widths of the interval
    assert numbers.lines[1].get_xdata().max() == pytest.approx(2.0)
    assert [label.get_text() for label in numbers.get_yticklabels()] == [label for label, _, _ in NUMBERS.values()]
    # of 19 equally spaced over -2 to 2, nine lie within -1 to 1
    assert [text.get_text() for text in numbers.texts[:2]] == ["9 of 19", "0.3 µm (0.27 to 0.33)"]


def test_a_scan_without_twins_is_drawn_alone_with_the_reason():
    axes = figure_scan(scan_alone()).axes
    assert "roughness.scan.marginal: gaussian" in axes[1].texts[0].get_text().replace("\n", " ")
    assert [len(one.get_legend_handles_labels()[1]) for one in axes[2:6]] == [1, 2, 1, 1]  # the scan alone
    assert axes[0].images[0].get_array().shape == (48, 64)


def test_outliers_are_circled_and_colours_cover_the_bulk():
    """Three spikes of 30 Sq in heights of 0.3 µm: Sq of all is 0.4 µm, and colours reach 2.5 times 0.3 µm."""
    axes = figure_scan(with_outliers()).axes
    assert axes[0].images[0].get_clim()[1] == pytest.approx(0.75, rel=0.03)
    np.testing.assert_allclose(axes[0].lines[0].get_xydata(), [[3.5, 4.5], [10.5, 20.5], [60.5, 2.5]])
    assert axes[0].get_title(loc="left") == "(a) scan, 3 outliers circled"
    assert axes[1].get_title(loc="left") == "(b) a sampled twin"


def test_an_interval_of_ten_times_the_value_cannot_tell():
    """Of a positive number; a skewness of 0.01 with an interval of a tenth excludes much."""
    result = scan_result()
    result |= {"rms_height_low": np.array(1e-9), "rms_height_high": np.array(3.2e-6)}
    result |= {"skewness": np.array(0.01), "skewness_low": np.array(-0.1), "skewness_high": np.array(0.1)}
    said = [text.get_text() for text in figure_scan(result).axes[5].texts[::2]]
    assert [word == "cannot tell" for word in said[:4]] == [True, False, False, False]
    result["rms_height_high"] = np.array(2.9e-6)  # just below ten values
    assert figure_scan(result).axes[5].texts[0].get_text() != "cannot tell"


def test_the_map_draws_the_stored_numbers():
    arrays = map_result()
    over = figure_map(arrays).axes[0]
    mesh = over.collections[0]
    np.testing.assert_allclose(mesh.get_array(), arrays["probability"].T)
    assert mesh.get_clim() == (0, 1)
    dots, limit, hopf, own = over.lines
    assert len(dots.get_xdata()) == np.count_nonzero(arrays["is_computed"])
    np.testing.assert_allclose(limit.get_xdata(), arrays["existence_limit"])
    np.testing.assert_allclose(hopf.get_xdata(), arrays["hopf_damping"])
    assert (over.get_xscale(), over.get_yscale()) == ("linear", "log")
    assert (own.get_xdata()[0], own.get_ydata()[0]) == (0.17, 0.948)


def test_the_chain_draws_the_stored_numbers():
    arrays = chain_result()
    surface, contact, path, cycle = figure_chain(arrays).axes[:4]
    np.testing.assert_allclose(surface.images[0].get_array(), 1e6 * arrays["height"].T)
    np.testing.assert_allclose(contact.images[0].get_array(), 1e-9 * arrays["pressure"].T)
    np.testing.assert_allclose(line(path, "one path"), [1e3 * arrays["path"], arrays["friction"][0]])
    assert line(path, "mean 0.3")[1] == [0.3, 0.3]
    np.testing.assert_allclose(line(cycle, "deterministic")[0], 1e3 * arrays["deterministic_position"])


def test_titles_say_what_the_data_show():
    """No contact, and no stick without scatter, are said in the title; a picture with them has the plain title."""
    arrays = chain_result()
    bare = arrays | {"pressure": 0 * arrays["pressure"], "deterministic_reattachment": np.array(np.nan)}
    titles = [[axes.get_title(loc="left") for axes in figure_chain(one).axes[:4]] for one in (arrays, bare)]
    assert "contact pressure, penetration 50 %" in titles[0][1]
    assert "limit cycle at D" in titles[0][3]
    assert "no contact here, penetration 50 %" in titles[1][1]
    assert "no stick-slip cycle at D" in titles[1][3]
    assert "no stick-slip cycle at D" in figure5(oscillator() | bare).axes[0].get_title(loc="left")
