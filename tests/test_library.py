"""What a user of the package relies on: public names, results as Datasets, paths of n values, pictures."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

from roughslip import Grid, ParameterError, to_xarray
from roughslip.contact import Influence, solve
from roughslip.friction import FrictionProcess, path_sampler, sample_path, strip_weights, window_statistics
from roughslip.oscillator import Machine, Oscillator, StribeckLaw, ensemble, simulate, trajectory
from roughslip.probability import BetaDistribution

SUBJECTS = ("surface", "scan", "contact", "chaos", "friction", "oscillator", "probability", "record")
GRID = Grid(8, 6, 1e-6, 2e-6)
BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)


@pytest.mark.parametrize("package", ["roughslip", *(f"roughslip.{subject}" for subject in SUBJECTS)])
def test_public_names_are_found_and_explained(package):
    """Each line of the list is read."""
    module = import_module(package)
    folder = Path(module.__file__).parent
    lines = [line for line in (folder / "__init__.pyi").read_text("utf-8").splitlines() if line.startswith("from")]
    assert len(lines) == len(module.__all__) == len(set(module.__all__))
    for name in module.__all__:
        public = getattr(module, name)
        assert not callable(public) or (public.__doc__ or "").strip()
    assert set(module.__all__) <= set(dir(module))
    with pytest.raises(AttributeError, match="no public name 'solv'"):
        _ = module.solv


def test_a_module_hides_no_function_of_its_name_and_is_imported_at_first_use():
    """An import of a module binds its name in the package. A stage starts fast, and re-runs only after an edit of what
    it uses."""
    code = (
        "import sys, roughslip.surface.covariance; print(*(m for m in sys.modules if m.startswith('roughslip.s')))\n"
        "import roughslip.contact.solve; from roughslip.contact import solve; print(solve.__name__)\n"
        "print(roughslip.friction.strip_weights.__name__)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split("\n")[:3] == ["roughslip.surface roughslip.surface.covariance", "solve", "strip_weights"]


def test_results_become_datasets_with_coordinates_and_units():
    """Dimensions and units are read from docstrings: of a field, of events, and of statistics with intervals."""
    solution = solve(Influence(GRID, 1e11), np.random.default_rng(1).standard_normal(GRID.shape) * 1e-9)
    field = to_xarray(solution, GRID)
    assert float(field["pressure"].sel(x=2.5e-6, y=3e-6, method="nearest")) == solution.pressure[2, 1]
    units = {"pressure": "Pa", "gap": "m", "residual": "1", "x": "m"}
    assert {name: field[name].attrs["units"] for name in units} == units
    assert field.attrs == {"method": solution.method}

    events = to_xarray(simulate(BELT, StribeckLaw(0.3), duration_periods=3.0))
    assert events["position"].dims == events["backwards"].dims == ("events",)
    machine, over = Machine(BELT, StribeckLaw(0.3)), {"damping": [0.1, 0.2], "load": [2e3, 3e3, 4e3]}
    counts = to_xarray(ensemble(machine, [None], duration_periods=3.0, over=over))
    assert counts["cycles"].dims == ("runs", "damping", "load")
    assert float(counts["load"].sel(load=3e3)) == 3e3
    drawn = to_xarray(trajectory(BELT, StribeckLaw(0.3), duration_periods=1.0))
    assert float(drawn["position"].sel(time=0.0)) == 0.0

    mu = np.random.default_rng(2).normal(0.3, 0.03, (12, 9))
    of_windows = window_statistics(mu, np.ones(mu.shape, bool), strip_weights(12, 50, np.random.default_rng(3)))
    statistics = to_xarray(of_windows)
    assert float(statistics["mean_low"]) == of_windows.mean.low < statistics["mean"] == of_windows.mean.value

    with pytest.raises(ParameterError, match="result of this package, not list"):
        to_xarray([1.0])


def test_pictures_show_the_numbers():
    """In the units of their axes; the phase plane holds the last periods."""
    mpl.use("Agg")
    from roughslip import plot

    heights = np.arange(48.0).reshape(GRID.shape) * 1e-6
    solution = solve(Influence(GRID, 1e11), heights - 40.5e-6)
    motion = trajectory(BELT, StribeckLaw(0.3), duration_periods=5.0)
    drawn = Figure().subplots(1, 4)
    image = plot.surface(heights, GRID, axes=drawn[0]).images[0]
    assert image.get_array()[5, 7] == pytest.approx(47.0)
    assert image.get_extent() == pytest.approx((0, 8, 0, 12))
    pressure = plot.pressure(solution, GRID, axes=drawn[1]).images[0].get_array()
    assert np.ma.masked_invalid(pressure).count() == np.count_nonzero(solution.contact)
    path = plot.friction_path(np.array([0.2, 0.4]), 5e-4, axes=drawn[2]).lines[0]
    np.testing.assert_allclose(path.get_xydata(), [[0.0, 0.2], [0.5, 0.4]])
    cycle = plot.limit_cycle(motion, BELT, periods=2.0, axes=drawn[3]).lines[0]
    np.testing.assert_allclose(cycle.get_xdata(), 1e3 * motion.position[-801:])
    with pytest.raises(ParameterError, match="on a mesh of"):
        plot.surface(heights.T, GRID, axes=drawn[0])


def test_a_path_of_n_values_is_the_beginning_of_that_without_end():
    process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.03), 3e-4)
    endless = path_sampler(process, 1e-4, 1.0).realisation([5])
    expected = np.concatenate([piece for piece, _ in zip(endless, range(2), strict=False)])[:5000]
    np.testing.assert_array_equal(sample_path(process, spacing_m=1e-4, nodes=5000, seed=[5]), expected)
    with pytest.raises(ParameterError, match="at least 2 nodes"):
        sample_path(process, spacing_m=1e-4, nodes=1, seed=[5])
