"""What users hand to public functions: the right thing, or one error of the package before anything is done."""

import inspect
import re
import subprocess
import sys
from importlib import import_module
from inspect import getattr_static

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

from roughslip import Grid, MissingPackageError, ParameterError
from roughslip.chaos import hermite_basis, least_squares, multi_indices
from roughslip.contact import Influence, contact_shares, point_pressures, solve, solve_at, solve_load
from roughslip.friction import FrictionProcess, sample_path, strip_weights, window_statistics
from roughslip.oscillator import Machine, Oscillator, StribeckLaw, ensemble, simulate
from roughslip.probability import BetaDistribution, empirical_distribution
from roughslip.probability.estimate import wilson_interval

MODULES = ("", "surface", "scan", "contact", "chaos", "friction", "oscillator", "probability", "plot")
GRID = Grid(8, 6, 1e-6, 1e-6)
INFLUENCE, FIELD = Influence(GRID, 1e11), np.ones(GRID.shape)
MU = np.random.default_rng(4).normal(0.3, 0.03, (12, 9))
WEIGHTS = strip_weights(12, 50, np.random.default_rng(3))
BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
# Classes that the package makes, and its bases; users read them.
RESULTS = {
    *("CensoredFit", "ContactSolution"),
    *("NodePressures", "BetaFit", "CorrelationFit", "WindowStatistics", "Counts", "CycleCounts", "GrazingResponse"),
    *("Durations", "LimitCycle", "Motion", "Reattachment", "States", "Trajectory", "TroughMap"),
    *("EmpiricalDistribution", "Estimate", "ContactSweep"),
    *("Translation", "CovarianceFit", "ScanStatistics", "Topography"),
    "Covariance",
    *("FrictionLaw", "Answer", "Budget", "Uncertain"),
}
# Methods that the package calls: of solvers, also in single precision, of fits, and of laws from scenes.
INNER = {"apply", "on", "of_fit", "profile", "transform", "check_not_negative", "example", "from_scene", "steeper_than"}
INNER |= {"from_rows", "of_distance", "of_scale"}


def public():
    """Every public function, every class that users make, and every method of a class, with its name."""
    mpl.use("Agg")
    for module in (import_module(f"roughslip.{name}".rstrip(".")) for name in MODULES):
        for name in module.__all__:
            function = getattr(module, name)
            error = isinstance(function, type) and issubclass(function, Exception)
            if callable(function) and not error and name not in RESULTS:
                yield name, function
            if isinstance(function, type) and not error and not getattr(function, "_is_protocol", False):
                for method in set(dir(function)).difference(dir(tuple), INNER):
                    own = getattr_static(function, method)
                    if isinstance(own, staticmethod) or method.startswith("_") or name == "Covariance":  # a base
                        continue
                    if callable(getattr(function, method)):
                        yield f"{name}.{method}", getattr(function, method)


def refused(function, argument, value):
    """The line that refuses an argument, or what came in its place."""
    try:
        function(**{argument: value})
    except ParameterError as error:
        return str(error)
    except Exception as error:
        return repr(error)
    return "accepted"


def test_every_public_function_refuses_what_it_cannot_take():
    """Before it misses its other arguments. None, text, objects and masked entries."""
    masked = np.ma.masked_greater(np.arange(4.0), 2.0)
    wrong = []
    for name, function in public():
        for argument, parameter in inspect.signature(function).parameters.items():
            if parameter.kind == parameter.VAR_KEYWORD or argument == "self":
                continue
            hint = str(parameter.annotation)
            bad = {"masked": masked, "object": object()}
            if "None" not in hint and hint != "FrictionPath":
                bad["None"] = None
            if not re.search(r"\bstr\b|Kind|Form|Path\b", hint) or hint == "FrictionPath":
                bad["text"] = "text"
            for kind, value in bad.items():
                line = refused(function, argument, value)
                if not line.startswith((argument, name)):
                    wrong.append(f"{name}({argument}: {hint} = {kind}): {line}")
    assert not wrong, "\n".join(wrong)


def test_named_mistakes_end_in_one_line():
    """The law, the marginal, the seed and a result in place of another."""
    mu = empirical_distribution(np.random.default_rng(1).normal(0.3, 0.03, 500))
    process = FrictionProcess(BetaDistribution(2.1, 5.0, 0.2, 0.5), 1e-4)
    motion = simulate(BELT, StribeckLaw(0.3), duration_periods=3.0)
    cases = (
        (lambda: contact_shares(np.zeros(3)), r"pressure must have 2 dimensions, not the shape \(3,\)"),
        (lambda: sample_path(process, spacing_m=1e-5, nodes=9, seed=3), "seed must be a sequence, not 3"),
        (lambda: simulate(BELT, lambda v: 0.3), "law must be a FrictionLaw, not function"),
        (lambda: FrictionProcess(mu, 1e-4), "BetaDistribution or a QuantileDistribution, not EmpiricalDistribution"),
        (lambda: import_module("roughslip.plot").limit_cycle(motion, BELT), "motion must be a Trajectory, not Motion"),
        (lambda: window_statistics(MU, np.ones((9, 12), bool), WEIGHTS), r"mu and valid must be \(strips, windows\)"),
        (lambda: solve_at(INFLUENCE, FIELD, (np.array([8]), np.array([0]))), "nodes must lie on the mesh of 8 x 6"),
        (lambda: simulate(BELT, StribeckLaw(0.3), [np.ma.masked_less(MU[0], 0.3)], 1e-4), "path has masked entries"),
    )
    for call, line in cases:
        with pytest.raises(ParameterError, match=line):
            call()


def test_arrays_of_other_kinds_give_the_same():
    """DataArrays, lists, arrays without a masked entry, and of big-endian numbers or other order in memory."""
    heights = 1e-9 * np.round(3e3 * np.random.default_rng(2).standard_normal(GRID.shape))
    kinds = (
        xr.DataArray,
        np.ndarray.tolist,
        np.ma.masked_invalid,
        np.asfortranarray,
        lambda values: values.astype(values.dtype.newbyteorder(">")),
    )
    indices = multi_indices(6, 2)
    functions = (
        lambda array: solve_load(INFLUENCE, array(heights), 1e8).pressure,
        lambda array: solve(INFLUENCE, array(heights)).gap,
        lambda array: contact_shares(array(np.maximum(heights, 0.0))),
        lambda array: point_pressures(array(np.maximum(heights, 0.0)), (array(np.arange(5)), array(np.arange(5)))),
        lambda array: window_statistics(array(MU), array(np.ones(MU.shape, bool)), array(WEIGHTS)).std.value,
        lambda array: hermite_basis(array(1e6 * heights), array(indices)),
        lambda array: least_squares(array(heights), array(MU[0][:8])).coefficients,
        lambda array: simulate(BELT, StribeckLaw(0.3), array(1e-3 * MU.ravel()), 1.0, 5.0).position,
        lambda array: (
            ensemble(Machine(BELT, StribeckLaw(0.3)), [None], 1.0, 5.0, over={"damping": array(MU[0])}).cycles
        ),
        lambda array: wilson_interval(array(np.arange(3.0)), array(np.full(3, 9.0)))[0],
    )
    for number, function in enumerate(functions):
        for kind in kinds:
            np.testing.assert_array_equal(function(kind), function(np.asarray), err_msg=f"{number} {kind}")


def test_a_field_with_coordinates_brings_its_cells():
    """A penetration is counted from the highest node. Coordinates that are not equally spaced, that the arguments
    contradict, or of another unit or order are refused."""
    x, y = 3e-6 + GRID.x(), -1e-6 + 2.0 * GRID.y()
    plain = 1e-9 * np.random.default_rng(2).standard_normal(GRID.shape)
    heights = xr.DataArray(plain, {"x": x, "y": y.astype(np.float32)}, ("x", "y"))
    grid = Grid.of(heights)
    assert (grid.shape, grid.dx, grid.dy) == (GRID.shape, pytest.approx(1e-6), pytest.approx(2e-6))
    assert Grid.of(plain, 2e-6) == Grid.of(plain, 2e-6, 2e-6) == Grid(8, 6, 2e-6, 2e-6)
    assert solve(Influence(grid, 1e11), heights, penetration_m=1.5e-9).plane == plain.max() - 1.5e-9
    wrong = (
        (heights.assign_coords(x=x**2), {}, "heights.x must be two coordinates or more that rise in equal steps"),
        (heights[::-1], {}, "sort them with heights.sortby\\('x'\\)"),
        (heights.T, {}, "dimensions x and y in m, not 'y' in m"),
        (heights.assign_coords(x=("x", 1e6 * x, {"units": "µm"})), {}, "in m, not 'x' in µm"),
        (xr.DataArray(plain), {}, "need the edges dx and dy"),
        (heights, {"dx": 1e-6}, "not both"),
        (plain, {}, "need the edges dx and dy"),
    )
    for field, given, line in wrong:
        with pytest.raises(ParameterError, match=line):
            Grid.of(field, **given)
    assert Grid.of(xr.DataArray(plain), 2e-6) == Grid.of(plain, 2e-6)


def test_a_number_may_be_an_array_without_dimensions():
    """Such as the largest of a DataArray; what is masked is no number, nor is an array of one entry."""
    heights = np.zeros(GRID.shape)
    pressures = [solve_load(INFLUENCE, heights, load).mean_pressure for load in (1e6, np.array(1e6), xr.DataArray(1e6))]
    assert pressures == pytest.approx([1e6] * 3, rel=1e-12)
    for wrong in (np.ma.masked, np.array([1e6]), np.array(True), np.array(1j)):
        with pytest.raises(ParameterError, match="mean_pressure_pa must be a real number, not"):
            solve_load(INFLUENCE, heights, wrong)


def test_pictures_without_matplotlib_name_what_installs_it():
    """As an error of the package that is an ImportError too."""
    code = "import sys; sys.modules['matplotlib'] = None; import roughslip.plot"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.splitlines()[-1].startswith("roughslip.errors.MissingPackageError: pictures need matplotlib")
    assert "pip install 'roughslip[plot]'" in done.stderr
    assert issubclass(MissingPackageError, ImportError)
