"""Properties of every figure, drawn from the numbers that runs left in `data`: with their units, thinned where a
dimension has more than 50 (times by 20, points of maps by 4 or 8).

They are of smoke, disc_brake (the budget, friction against load), tribometer and measured, with `covariance: best`.
Those of vibration in the map are made up. Warnings are errors in every test, so a figure that warns fails here.
"""

from importlib import import_module
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from scipy import stats

from roughslip.figures.style import Shown, save

DATA = Path(__file__).with_name("data")
FIGURES = {  # by name the module that draws it
    "figure2": "figure2",
    "figure3": "figure3",
    "figure3_law": "figure3",
    "figure5": "figure5",
    "figure_chain": "figure5",
    "figure_map": "stick_slip",
    "figure_budget": "stick_slip",
    "friction_against_load": "figure3",
    "figure_record": "figure_record",
    "figure_scan": "figure_scan",
}
NAN = ("deterministic_hopf_damping", "deterministic_existence_limit", "deterministic_reattachment")
NO_CYCLE = ("reattachment_mean", "reattachment_std", "deterministic_reattachment")
# Numbers that a figure uses and does not draw as they are: ends of a map, moments, texts.
UNSHOWN = ("x", "y", "map", "vibration", "map_x", "map_y", "density_edge", "mean", "std")
UNSHOWN += tuple(f"beta_{name}" for name in ("a", "b", "lower", "upper", "distance_standardised"))
SOME = 0.04  # of an array: of several rows a figure may draw one, or their least and largest
FACTORS = 10.0 ** np.array([0, 2, 3, 6, -3, -6, -9, 24])  # of units


def numbers(name: str) -> xr.Dataset:
    with xr.open_dataset(DATA / f"{name}.nc") as opened:
        return opened.load()


def drawn(name, results=None):
    """The figure, and the names of the variables that it takes."""
    shown = Shown(numbers(name) if results is None else results)
    return getattr(import_module(f"roughslip.figures.{FIGURES[name]}"), name)(shown), list(shown.taken)


def without(results, names):
    """The numbers of these names do not exist."""
    return results.assign({name: results[name] * np.nan for name in names if name in results})


def cases(name):
    """What else a run can leave: one penetration, refused fits, no limit, no cycle, no model, nothing uncertain."""
    results = numbers(name)
    yield results
    if name.startswith("figure2"):
        yield without(results, [one for one in results if one.startswith("given_")])
        yield results.assign(cumulative=0 * results["cumulative"])  # all contact at the highest pressure
        yield results.assign(pressure=("pressure", 2e9 * results["pressure"].values / results["pressure"].values.max()))
    if name.startswith("figure3"):
        yield results.sel(level=[50.0])
    if name == "figure5":
        yield without(results, NAN)
        yield without(results, NO_CYCLE)
        yield results.isel(damping=[0], drawn=[0])
    if name == "figure_chain":
        yield results.assign(pressure=0 * results["pressure"])
    if name == "figure_map":
        yield results.assign(probability=0 * results["probability"] + 1)
        yield without(results, ["hopf_damping", "existence_limit"])
        yield without(results, ["vibration_limit"]).assign(vibration=0 * results["vibration"])
    if name == "figure_budget":
        yield results.isel(source=[0], result=[0])
    if name == "figure_scan":
        results = results.drop_vars(["model_correlation", "model_power"])
        none = "none: heights cannot be sampled. What may help: roughness.scan.marginal: gaussian"
        marked = xr.zeros_like(results["map_outlier"])
        marked[3, 4] = marked[10, 12] = 1
        yield results.assign(map_outlier=marked, outliers=2, model=("model", [none]))


@pytest.mark.slow
@pytest.mark.parametrize("name", FIGURES)
def test_all_is_in_its_place_in_every_case(name):
    """Nothing is cut at the edges, every axis has finite limits and says what it is.

    At the size that is saved; a point of slack for rounding. The layout is made and nothing is drawn.
    """
    for results in cases(name):
        figure, _ = drawn(name, results)
        figure.get_layout_engine().execute(figure)
        page = figure.bbox.padded(1)
        for axes in figure.axes:
            box = axes.get_tightbbox()
            assert page.x0 <= box.x0 < box.x1 <= page.x1
            assert page.y0 <= box.y0 < box.y1 <= page.y1
            assert np.all(np.isfinite([*axes.get_xlim(), *axes.get_ylim()]))
            assert not axes.axison or axes.get_xlabel() or axes.get_ylabel()


def all_numbers(figure):
    """Every number in the data of the artists of a figure, sorted."""
    found = []
    for axes in figure.axes:
        found += [np.ravel(line.get_xydata()) for line in axes.lines]
        found += [np.ravel(image.get_array()) for image in axes.images]
        found += [np.ravel(mesh.get_array()) for mesh in axes.collections if mesh.get_array() is not None]
        found += [np.ravel(path.vertices) for one in axes.collections for path in one.get_paths()]
        found += [np.ravel(patch.get_path().vertices) for patch in axes.patches]
        found += [[bar.get_width()] for bars in axes.containers for bar in bars]
    values = np.concatenate([np.asarray(part, dtype=float) for part in found])
    return np.sort(values[np.isfinite(values)])


@pytest.mark.parametrize("name", FIGURES)
def test_what_is_drawn_is_what_is_stored(name):
    """Each array of numbers that the figure takes stands in it, in some unit, but for those at the edge of its axes."""
    results = numbers(name)
    figure, taken = drawn(name)
    there = all_numbers(figure)
    for variable in taken:
        values = np.ravel(results[variable].values)
        if values.dtype.kind != "f" or values.size < 3 or variable in UNSHOWN:
            continue
        values = values[np.isfinite(values)]
        assert max(share_of(factor * values, there) for factor in FACTORS) > SOME, variable


def share_of(values, there):
    """The share of numbers that are there, to rounding."""
    place = np.clip(np.searchsorted(there, values), 1, len(there) - 1)
    near = np.minimum(np.abs(there[place] - values), np.abs(there[place - 1] - values))
    return np.mean(near <= 1e-9 * np.abs(values))


def test_a_figure_leaves_the_same_bytes(tmp_path):
    """Also where a matplotlibrc in the working folder or at home asks for another look."""
    files = {}
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        figure, _ = drawn("figure_map")
        for kind in ("png", "svg"):
            save(figure, tmp_path / folder / f"a.{kind}")
            files[folder, kind] = (tmp_path / folder / f"a.{kind}").read_bytes()
        mpl.rcParams.update({"savefig.bbox": "tight", "lines.antialiased": False, "axes.facecolor": "0.9"})
    for kind in ("png", "svg"):
        assert files["one", kind] == files["two", kind]
        assert b"atplotlib v" not in files["one", kind]  # a new version would make new bytes of the same picture
        assert b"dc:date" not in files["one", kind]


def line(axes, label):
    (found,) = [one for one in axes.lines if one.get_label() == label]
    return np.asarray(found.get_xdata(), dtype=float), np.asarray(found.get_ydata(), dtype=float)


def test_curves_that_a_figure_computes_are_those_of_scipy():
    """The paper's Beta, standardised, and the normal density in Figure 3; in Figure 5 the normal of equal moments."""
    figure, _ = drawn("figure3_law")
    marginal = figure.axes[2]
    beta = stats.beta(2.1, 5.0)
    x, y = line(marginal, "paper, Beta(2.1, 5)")
    np.testing.assert_allclose(y, beta.std() * beta.pdf(beta.mean() + beta.std() * x), rtol=1e-9)
    x, y = line(marginal, "normal")
    np.testing.assert_allclose(y, stats.norm.pdf(x), rtol=1e-9)
    results, (figure, _) = numbers("figure5"), drawn("figure5")
    x, y = line(figure.axes[1], "fitted normal")
    mean, std = 1e3 * float(results["reattachment_mean"]), 1e3 * float(results["reattachment_std"])
    np.testing.assert_allclose(y, stats.norm(mean, std).pdf(x), rtol=1e-9)
    density, edges = results["histogram"].values, results["histogram_edge"].values
    assert np.sum(density * np.diff(edges)) == pytest.approx(1.0)
    x, y = line(drawn("figure3_law")[0].axes[0], "paper, 250 µm")
    np.testing.assert_allclose(y, np.exp(-x / 250.0), rtol=1e-12)
