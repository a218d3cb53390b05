"""What users hand to public functions: the right thing, or one error of the package before anything is done.

Also of a good call, each argument in turn is replaced by what is no such value. Only a ParameterError may answer.
"""

import inspect
import math
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial
from importlib import import_module
from inspect import getattr_static
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr

from roughslip import Grid, IllPosedError, ParameterError
from roughslip.chaos import hermite_basis, least_squares, multi_indices, pressure_target
from roughslip.contact import Influence, contact_shares, solve, solve_load
from roughslip.friction import Friction, FrictionProcess, sample_path, strip_weights, window_statistics
from roughslip.oscillator import Machine, Oscillator, StribeckLaw, ensemble, simulate
from roughslip.probability import BetaDistribution
from roughslip.surface import covariance_of

MODULES = ("", "surface", "scan", "contact", "chaos", "friction", "oscillator", "probability", "plot")
GRID = Grid(8, 6, 1e-6, 1e-6)
INFLUENCE = Influence(GRID, 1e11)
MU = np.random.default_rng(4).normal(0.3, 0.03, (12, 9))
WEIGHTS = strip_weights(12, 50, np.random.default_rng(3))
BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
# Classes that the package makes, and its bases; users read them.
RESULTS = {*("ContactSolution", "Motion", "Trajectory", "Estimate", "ScanStatistics", "Topography", "Covariance")}
# Methods that the package calls: of solvers, also in single precision, of fits, and of laws from scenes.
INNER = {"apply", "of_fit", "profile", "transform", "from_scene", "from_rows"}
INNER |= {"of_distance", "of_scale", "slopes_by_lines"}


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


def test_arrays_of_other_kinds_give_the_same():
    """DataArrays, lists, arrays without a masked entry, and of big-endian numbers or other order in memory."""
    heights = 1e-9 * np.round(3e3 * np.random.default_rng(2).standard_normal(GRID.shape))
    big_endian = lambda values: values.astype(values.dtype.newbyteorder(">"))  # noqa: E731
    functions = (
        lambda array: solve_load(INFLUENCE, array(heights), 1e8).pressure,
        lambda array: contact_shares(array(np.maximum(heights, 0.0))),
        lambda array: window_statistics(array(MU), array(np.ones(MU.shape, bool)), array(WEIGHTS)).std.value,
        lambda array: hermite_basis(array(1e6 * heights), array(multi_indices(6, 2))),
        lambda array: simulate(BELT, StribeckLaw(0.3), array(1e-3 * MU.ravel()), 1.0, 5.0).position,
        lambda array: ensemble(Machine(BELT, StribeckLaw(0.3)), [None], 1.0, 5.0, over={"load": array(MU[0])}).cycles,
    )
    for number, function in enumerate(functions):
        for kind in (xr.DataArray, np.ndarray.tolist, np.ma.masked_invalid, np.asfortranarray, big_endian):
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


def test_pictures_without_matplotlib_name_what_installs_it():
    """As an error of the package that is an ImportError too."""
    code = "import sys; sys.modules['matplotlib'] = None; import roughslip.plot"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stderr.splitlines()[-1].startswith("roughslip.errors.MissingPackageError: pictures need matplotlib")
    assert "pip install 'roughslip[plot]'" in done.stderr


def test_an_error_names_arguments_and_in_a_scene_its_keys_too():
    """The second for users of scenes alone; an error passed on keeps them."""
    with pytest.raises(IllPosedError, match=r"^2 samples .* too few .* a lower degree$") as caught:
        least_squares(np.ones((2, 3)), np.ones(2))
    assert caught.value.in_scene.startswith(f"{caught.value}; scene keys: expansion.samples or strip")


OF_BELT = asdict(BELT) | {"excitation_force_n": 1.0, "excitation_frequency_rad_per_s": 316.0}
BETA = BetaDistribution(2.1, 5.0, 0.2, 0.6)
HEIGHTS, POINTS = 1e-9 * np.arange(48.0).reshape(GRID.shape), np.random.default_rng(1).uniform(-1, 1, (60, 2))
SUMMITS = ("influence_diagonal", "plane_strain_modulus_pa", "rms_height_m", "correlation_length_m")
GOOD = {
    "contact": [
        partial(Grid, nx=4, ny=3, dx=1e-6, dy=1e-6),
        partial(Influence, grid=GRID, plane_strain_modulus_pa=2e11),
        partial(solve, INFLUENCE, HEIGHTS, tolerance=1e-6),
        partial(solve_load, INFLUENCE, heights=HEIGHTS, mean_pressure_pa=5e5),
    ],
    "surface": [
        partial(covariance_of, "gaussian", rms_height_m=1.0, correlation_length_m=1.0, lay_rad=0.1),
        partial(covariance_of, "self_affine", 1e-7, 1e-5, hurst=0.8, bandwidth=1e5),
        partial(covariance_of, "matern", 1.0, 1.0, smoothness=1.5),
    ],
    "chaos": [
        partial(hermite_basis, xi=POINTS, indices=multi_indices(2, 2)),
        partial(least_squares, basis=hermite_basis(POINTS, multi_indices(2, 2)), target=POINTS[:, 0]),
        partial(multi_indices, variables=2, degree=2),
        partial(pressure_target, "squared_pressure", **dict.fromkeys(SUMMITS, 1.0)),
    ],
    "friction": [
        partial(window_statistics, mu=MU, valid=np.ones(MU.shape, bool), weights=WEIGHTS),
        partial(Friction, mean=0.3, deviation=0.03, length_m=1e-3),
        partial(BetaDistribution, a=2.1, b=5.0, lower=0.0, upper=1.0),
        partial(FrictionProcess, BETA, correlation_length_m=1e-4),
        partial(sample_path, FrictionProcess(BETA, 1e-4), spacing_m=1e-5, nodes=9, seed=[3]),
    ],
    "oscillator": [
        partial(Oscillator, **OF_BELT),
        partial(StribeckLaw, fit=0.3, static=0.4, decay_s_per_m=1.42, quadratic_s2_per_m2=0.01),
        partial(simulate, Oscillator(**OF_BELT), StribeckLaw(0.3), 1e-3 * MU[0], spacing_m=1.0, duration_periods=3.0),
    ],
}
SIGNED = {"lower", "upper", "poisson_ratio", "lay_rad"}  # numbers of either sign
ZERO = {"damping_ratio", "belt_velocity_m_per_s", "excitation_force_n", "excitation_frequency_rad_per_s", "degree"}
ZERO |= {"fit", "static", "kinetic", "decay_s_per_m", "quadratic_s2_per_m2", "deviation"}
ZERO |= {"influence_diagonal"}  # numbers that may be zero


def bad_values(name: str, good: Any) -> Iterator[Any]:
    """What may not stand in place of a good value of that name."""
    if isinstance(good, np.ndarray) and good.dtype.kind == "f":
        for value in (math.nan, math.inf):
            spoilt = good.copy()
            spoilt.flat[0] = value
            yield spoilt
        yield from (good[None, None], good + 1e-9j, np.full(good.shape, "high"), "high", None, [[1.0, 2.0], [3.0]])
    elif isinstance(good, np.ndarray):
        yield from (good[..., None, None], np.full(good.shape, None), "often", None)
    elif isinstance(good, (int, float)):
        yield from (math.nan, math.inf, "four", *([2.5] if isinstance(good, int) else []))
        yield from ([] if name in SIGNED else [-1] if name in ZERO else [-1, 0])


@pytest.mark.parametrize("subject", GOOD)
def test_bad_input_is_refused(subject):
    """By a ParameterError alone that names the argument, and without a warning. The good call itself passes."""
    wrong = []
    for good in GOOD[subject]:
        good()
        for name, value in good.keywords.items():
            for bad in bad_values(name, value):
                try:
                    good(**{name: bad})
                    wrong.append(f"{good.func.__name__}({name}={bad}) is accepted")
                except Exception as error:
                    if not isinstance(error, ParameterError) or name not in str(error):
                        wrong.append(f"{good.func.__name__}({name}={bad}): {error!r}")
    assert not wrong, "\n".join(wrong)
