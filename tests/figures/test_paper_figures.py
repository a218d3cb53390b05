"""The figures draw what is stored and nothing else, the same bytes each time, with no legend over data.

Warnings are errors in every test of this project, so a figure that warns fails here.
"""

from itertools import pairwise

import matplotlib as mpl
import numpy as np
import pytest

from roughslip.figures.figure2 import DRAWN as DRAWN_2
from roughslip.figures.figure2 import METHODS, figure2
from roughslip.figures.figure3 import DRAWN as FRICTIONS
from roughslip.figures.figure3 import FAMILIES, PAPER_MOMENTS, figure3, figure3_law
from roughslip.figures.figure5 import DRAWN as DRAWN_5
from roughslip.figures.figure5 import figure5
from roughslip.figures.style import save
from tests.figures.drawn import Recorded, with_interval

FIGURES = {"figure2": figure2, "figure3": figure3, "figure3_law": figure3_law, "figure5": figure5}
DRAWN = {"figure2": DRAWN_2, "figure5": DRAWN_5, **FRICTIONS}
DAMPING = np.array([0.05, 0.1, 0.17, 0.2, 0.23, 0.25, 0.27, 0.28, 0.29, 0.3, 0.31, 0.32, 0.3225, 0.325, 0.34, 0.4])


def square(*, count=200, scale=1e8):
    """Exponential pressures; eq. (9) far off, as it is in the study."""
    pressure = scale * np.geomspace(1e-3, 8.0, count)
    curve = 1 - np.exp(-pressure / scale)
    rows = np.array([curve, curve, curve**0.8, curve**0.1, curve**1.1])
    shares = [0.16, 0.158, 0.158, 0.158, 0.165]
    return {
        "method": np.array(list(METHODS)),
        "pressure": pressure,
        "distance_in_contact": np.array([0.0, 0.02, 0.14, 0.76, 0.013]),
        **{name: np.clip(values, 0, 1) for name, values in with_interval("cumulative", rows, 0.03).items()},
        **with_interval("contact_probability", shares, 0.01),
    }


def refused():
    """Eqs. (8) and (9) with no more samples in contact than coefficients."""
    result = square()
    for name in ("cumulative", "cumulative_low", "cumulative_high", "distance_in_contact"):
        result[name] = np.where(
            np.array([0, 0, 1, 1, 0]).reshape(-1, *[1] * (result[name].ndim - 1)), np.nan, result[name]
        )
    return result


def friction(percentile=(5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95), length=300e-6, lightest=0.0):
    percentile = np.array(percentile, dtype=float)
    lag = 15e-6 * np.arange(121)
    mean, std = 0.4 - 0.001 * percentile, 0.1 / (1 + percentile / 10)
    both = np.ones((2, 1))
    skewness = 0.3 + lightest * (percentile == percentile[0])
    curves = np.exp(-lag / length) * np.ones((2, len(percentile), 1))
    middle = 0.4 - 0.05
    edges = np.linspace(middle - 0.05, middle + 0.1, 41)
    density = np.exp(-(((edges[1:] - middle) / 0.0167) ** 2) / 2)
    return {
        "source": np.array(["solved", "expansion"]),
        "percentile": percentile,
        "lag": lag,
        "triangle": np.maximum(0, 1 - lag / 600e-6),
        "histogram": density / density.sum() / np.diff(edges),
        "histogram_edge": edges,
        **{f"beta_{name}": np.full((2, len(percentile)), v) for name, v in zip("ab", (299.7, 300.0), strict=True)},
        "beta_at_bound": np.ones((2, len(percentile)), dtype=np.int8),
        "beta_lower": np.full((2, len(percentile)), 0.2),
        "beta_upper": np.full((2, len(percentile)), 0.5),
        **with_interval("combined_mean", mean, 0.002),
        **with_interval("combined_std", std, 0.002),
        **with_interval("mean", both * mean, 0.004),
        **with_interval("std", both * std, 0.004),
        **with_interval("autocorrelation", curves, 0.2),
        "fit_percentile": percentile,
        **with_interval("fit", mean, 0.002),
        "family": np.array(list(FAMILIES)),
        "p_equal_law": np.array(0.0025 if len(percentile) > 1 else np.nan),
        "p_equal_correlation": np.array(0.12 if len(percentile) > 1 else np.nan),
        **with_interval("white_autocorrelation", np.maximum(0, 1 - lag / 600e-6), 0.1),
        **with_interval("length_least_squares", np.full((2, len(percentile)), length), 30e-6),
        **with_interval("white_length", 320e-6, 40e-6),
        **with_interval("beta_misfit", both * 0.02 * np.ones(len(percentile)), 0.01),
        **with_interval("family_distance", np.array([[0.06], [0.03], [0.029]]) * np.ones(len(percentile)), 0.01),
        **with_interval("skewness", both * skewness, 0.2),
        **with_interval("kurtosis", both * skewness**2, 0.4),
    }


def oscillator(runs=12, damping=DAMPING):
    """The shape that Figure 5 has: M_d near 91 up to the limit, then 0; the ensemble loses the cycle before it."""
    angle = np.linspace(0, 2 * np.pi, 400)
    cycles = np.where(damping < 0.3244, 91, 0)
    mean = 91 / (1 + np.exp((damping - 0.3) / 0.01))
    edges = np.linspace(2e-3, 5e-3, 49)
    density = np.exp(-((edges[1:] - 3.3e-3) ** 2) / (2 * 3e-4**2))
    return {
        "position": np.array([7e-3 + (4e-3 + 1e-4 * k) * np.cos(angle) for k in range(runs)]),
        "velocity": np.array([(3e-3 + 1e-4 * k) * np.sin(angle) for k in range(runs)]),
        "deterministic_position": 7e-3 + 4e-3 * np.cos(angle),
        "deterministic_velocity": 3e-3 * np.sin(angle),
        "histogram": density / density.sum() / np.diff(edges),
        "histogram_edge": edges,
        "reattachment_mean": np.array(3.3e-3),
        "reattachment_std": np.array(3e-4),
        "deterministic_reattachment": np.array(3.28e-3),
        "nominal_damping": np.array(0.17),
        "damping_ratio": damping,
        "deterministic_cycles": cycles,
        "mean_cycles": mean,
        **with_interval("difference", cycles - mean, 2.0),
        "deterministic_hopf_damping": np.array(0.2311),
        "deterministic_existence_limit": np.array(0.3244),
    }


NONE = np.array(np.nan)
NO_LIMITS = {"deterministic_hopf_damping": NONE, "deterministic_existence_limit": NONE}
NO_CYCLE = {"reattachment_mean": NONE, "reattachment_std": NONE, "deterministic_reattachment": NONE}
FULL = {"figure2": square(), "figure3": friction(), "figure3_law": friction(), "figure5": oscillator()}
CASES = {
    "figure2": ("figure2", square()),
    "figure2, GPa": ("figure2", square(scale=2e9)),
    "figure2, few in contact": ("figure2", square(count=6) | {"cumulative": np.tile(np.arange(1, 7) / 8, (5, 1))}),
    "figure2, refused": ("figure2", refused()),
    **{
        f"{name}, {case}": (name, result)
        for name in ("figure3", "figure3_law")
        for case, result in {
            "eleven levels": friction(),
            "three levels": friction([10, 50, 90]),
            "one level": friction([50]),
            "long correlation": friction(length=5e-3),
            "hardly any contact": friction(lightest=7.0),
        }.items()
    },
    "figure5": ("figure5", oscillator()),
    "figure5, four runs and three dampings": ("figure5", oscillator(4, np.array([0.17, 0.3, 0.34]))),
    "figure5, one run and one damping": ("figure5", oscillator(1, np.array([0.17]))),
    "figure5, excited": ("figure5", oscillator() | NO_LIMITS | {"deterministic_reattachment": NONE}),
    "figure5, no cycle": ("figure5", oscillator() | NO_CYCLE),
    "figure5, never unstable": ("figure5", oscillator() | NO_LIMITS | {"deterministic_hopf_damping": np.array(-0.4)}),
}


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_reads_the_stored_variables_and_no_more(name):
    result = Recorded({variable: FULL[name][variable] for variable in DRAWN[name]})
    FIGURES[name](result)
    assert result.read == set(DRAWN[name])
    assert len(DRAWN[name]) == len(set(DRAWN[name]))


@pytest.mark.parametrize("name", FIGURES)
def test_the_same_numbers_give_the_same_bytes(name, tmp_path):
    figure = FIGURES[name](FULL[name])
    for file in ("a.svg", "a.png"):
        save(figure, tmp_path / file)
    save(FIGURES[name](FULL[name]), tmp_path / "b.svg")  # whose text holds all that is drawn
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    for file in ("a.svg", "a.png"):
        content = (tmp_path / file).read_bytes()
        assert b"atplotlib v" not in content  # a new version would make new bytes of the same picture
        assert b"dc:date" not in content


def test_a_user_s_matplotlibrc_changes_nothing(tmp_path):
    """It may lie in the working folder or at home; other bytes would be no reproduction."""
    save(figure2(FULL["figure2"]), tmp_path / "a.png")
    mpl.rcParams.update({"savefig.bbox": "tight", "lines.antialiased": False, "axes.facecolor": "0.9"})
    save(figure2(FULL["figure2"]), tmp_path / "b.png")
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


@pytest.mark.parametrize("case", CASES)
def test_no_legend_covers_data_or_leaves_its_axes(case):
    """At the size that is saved; a point of slack for rounding."""
    name, result = CASES[case]
    figure = FIGURES[name](result)
    figure.draw_without_rendering()
    for axes in figure.axes:
        inside = axes.get_window_extent()
        data = [*axes.lines, *axes.patches]
        assert all(np.isfinite([*axes.get_xlim(), *axes.get_ylim()]))
        if (legend := axes.get_legend()) is None:
            continue
        box = legend.get_window_extent()
        assert box.x0 >= inside.x0 - 1
        assert box.x1 <= inside.x1 + 1, (axes.get_title(loc="left"), box.x1 - inside.x1)
        assert box.y1 <= inside.y1 + 1
        for artist in data:
            path = artist.get_path().transformed(artist.get_transform())
            assert not path.intersects_bbox(box, filled=False), (axes.get_title(loc="left"), artist.get_label())
        for collection in axes.collections:
            for path in collection.get_paths():
                assert not path.transformed(collection.get_transform()).intersects_bbox(box, filled=False)


@pytest.mark.parametrize("name", FIGURES)
def test_titles_and_labels_fit_their_panel(name):
    """No title reaches into the next panel, and nothing is cut at the edge of the picture."""
    figure = FIGURES[name](FULL[name])
    figure.draw_without_rendering()
    whole = figure.bbox
    boxes = [axes.get_tightbbox() for axes in figure.axes]
    for box in boxes:
        assert whole.x0 <= box.x0
        assert box.x1 <= whole.x1
        assert whole.y0 <= box.y0
        assert box.y1 <= whole.y1
    for first, second in pairwise(boxes):
        assert first.x1 <= second.x0 or first.y0 >= second.y1


def line(axes, label):
    (found,) = [each for each in axes.lines if each.get_label() == label]
    return found.get_data()


def test_figure2_draws_the_stored_numbers():
    result = square()
    linear, logarithmic, probability = figure2(result).axes
    for row, (label, _) in enumerate(METHODS.values()):
        for axes in (linear, logarithmic):
            x, y = line(axes, label)
            np.testing.assert_allclose(x, 1e-6 * result["pressure"])
            np.testing.assert_array_equal(y, result["cumulative"][row])
        interval, value = probability.lines[2 * row : 2 * row + 2]
        np.testing.assert_allclose(value.get_data(), [[100 * result["contact_probability"][row]], [-row]])
        ends = [100 * result[f"contact_probability_{end}"][row] for end in ("low", "high")]
        np.testing.assert_allclose(interval.get_xdata(), ends)
    texts = [text.get_text() for text in probability.texts]
    assert texts == ["distance 0.020", "distance 0.140", "distance 0.760", "distance 0.013"]
    texts = [text.get_text() for text in figure2(refused()).axes[2].texts]
    assert texts == ["distance 0.020", "fit refused", "fit refused", "distance 0.013"]
    assert linear.get_xlabel().endswith("[MPa]")
    assert figure2(square(scale=2e9)).axes[0].get_xlabel().endswith("[GPa]")


def test_figure3_draws_the_stored_numbers():
    result = friction()
    mean, std = figure3(result).axes
    for axes, name in ((mean, "mean"), (std, "std")):
        for row, label in enumerate(("solved contact", "expansion")):
            np.testing.assert_array_equal(line(axes, label), [result["percentile"], result[name][row]])
        np.testing.assert_array_equal(line(axes, "expansion as control")[1], result[f"combined_{name}"])
    np.testing.assert_array_equal(line(mean, "$\\mu_{fit}$"), [result["fit_percentile"], result["fit"]])


def test_figure3_law_draws_the_stored_numbers():
    result = friction(lightest=7.0)
    correlation, lengths, marginal, distances, skewness, kurtosis = figure3_law(result).axes
    x, y = line(correlation, "median penetration")
    np.testing.assert_allclose(x, 1e6 * result["lag"])
    np.testing.assert_array_equal(y, result["autocorrelation"][0, 5])
    np.testing.assert_array_equal(line(correlation, "triangle of the window")[1], result["triangle"])
    np.testing.assert_array_equal(line(correlation, "white pressure")[1], result["white_autocorrelation"])
    np.testing.assert_allclose(line(correlation, "exponential, 300 µm")[1], np.exp(-result["lag"] / 300e-6))
    assert len(correlation.lines) == 10 + 5 + 1  # other levels, five curves, the zero line
    np.testing.assert_allclose(line(lengths, "solved contact")[1], 300.0)
    np.testing.assert_allclose(line(lengths, "white pressure")[1], 320.0)
    np.testing.assert_allclose(line(lengths, "paper")[1], 250.0)
    u = np.linspace(-8, 8, 4001)
    for label in ("fitted Beta at bound", "paper, Beta(2.1, 5)", "normal"):
        x, y = line(marginal, label)
        np.testing.assert_allclose(
            np.trapezoid(np.interp(u, x, y, 0, 0), u), 1.0, atol=5e-3
        )  # densities, on 400 points
    (stairs,) = marginal.patches
    values, edges, _ = stairs.get_data()
    assert np.sum(values * np.diff(edges)) == pytest.approx(1.0)
    np.testing.assert_array_equal(line(distances, "fitted Beta")[1], result["beta_misfit"][0])
    for row, family in enumerate(FAMILIES):
        np.testing.assert_array_equal(line(distances, family)[1], result["family_distance"][row])
    for axes, name, paper in ((skewness, "skewness", 0.560), (kurtosis, "kurtosis", -0.171)):
        np.testing.assert_array_equal(line(axes, "solved contact"), [result["percentile"], result[name][0]])
        assert line(axes, "paper, Beta(2.1, 5)")[1][0] == pytest.approx(paper, abs=5e-4)
        assert axes.get_yscale() == "symlog"
    assert correlation.get_title(loc="left").endswith("$p$ = 0.12")
    assert distances.get_title(loc="left").endswith("$p$ = 0.0025")
    assert figure3_law(friction()).axes[4].get_yscale() == "linear"


def test_the_moments_of_the_papers_beta_are_its_moments():
    from scipy import stats

    skewness, kurtosis = stats.beta(2.1, 5.0).stats("sk")
    assert (PAPER_MOMENTS["skewness"], PAPER_MOMENTS["kurtosis"]) == (
        pytest.approx(skewness, abs=5e-4),
        pytest.approx(kurtosis, abs=5e-4),
    )


def test_figure5_draws_the_stored_numbers():
    result = oscillator()
    cycle, histogram, loss = figure5(result).axes
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
    for label, name in (
        ("$M_d - E[M_S]$", "difference"),
        ("$M_d$", "deterministic_cycles"),
        ("$E[M_S]$", "mean_cycles"),
    ):
        np.testing.assert_array_equal(line(loss, label), [DAMPING, result[name]])
    labels = loss.get_legend_handles_labels()[1]
    assert labels[-2:] == ["sliding unstable below 0.2311", "cycle exists below 0.3244"]


def test_limits_that_do_not_exist_or_lie_off_the_list_are_not_drawn():
    for case in ("figure5, excited", "figure5, never unstable"):
        loss = figure5(CASES[case][1]).axes[2]
        assert len(loss.get_legend_handles_labels()[1]) == 3
        assert loss.get_xlim()[0] > 0
    histogram = figure5(CASES["figure5, no cycle"][1]).axes[1]
    assert [text.get_text() for text in histogram.texts] == ["too few cycles at this damping"]


def test_methods_differ_in_style_and_in_grey():
    """For a reader who sees no colours, and in print."""
    looks = [look for _, look in METHODS.values()]
    assert len({(look["linestyle"], look.get("linewidth")) for look in looks}) == len(looks)
