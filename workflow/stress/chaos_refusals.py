"""Bad input to polynomial chaos, each kind once: a ParameterError and nothing else is the answer to all of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.chaos.censored import censored_regression
from roughslip.chaos.designs import design
from roughslip.chaos.distribution import cumulative_given_contact, kolmogorov_distance, wilson_interval
from roughslip.chaos.enrichment import enrich
from roughslip.chaos.functionals import NO_SYMMETRY, Stencil, local_functionals, whitening
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.local import Samples, fit_local
from roughslip.chaos.pressure import PressureTarget, fit_in_contact
from roughslip.chaos.regression import least_squares
from roughslip.chaos.residual_distribution import residual_scatter
from roughslip.chaos.sensitivity import sensitivity
from roughslip.chaos.strip import fit_strip

NAN, INFINITY = math.nan, math.inf
NOT_WHOLE = {"2.5": 2.5, "nan": NAN, "text": "four", "none": None}

K, V = 60, 2
POINTS = np.random.default_rng(1).uniform(-1, 1, (K, V))
TARGET = POINTS[:, 0] + 0.3 * np.random.default_rng(2).standard_normal(K)
INDICES = multi_indices(V, 2)
TABLE = hermite_basis(POINTS, INDICES)
TRIAL = PressureTarget("trial_pressure", 1.0)


def _not_an_array(good: np.ndarray) -> dict[str, Any]:
    """What is no array like a good one, by name."""

    def put(value: float) -> np.ndarray:
        bad = good.copy()
        bad.flat[3] = value
        return bad

    return {
        "nan": put(NAN),
        "infinite": put(INFINITY),
        "minus infinite": put(-INFINITY),
        "a number": 1.0,
        "empty": good[:0],
        "of one dimension more": good[..., None],
        "complex": good + 1e-9j,
        "text": np.full(good.shape, "high"),
        "a word": "high",
        "none": None,
        "a list": good.tolist(),
        "objects": np.full(good.shape, None),
    }


def _samples(name: str, bad: object) -> Samples:
    parts = {
        "variables": np.zeros((30, 1, 2)),
        "distance2": np.zeros(1),
        "pressure": np.ones((30, 1)),
        "gap": np.zeros((30, 1)),
    }
    return Samples(**(parts | {name: bad}))


def _enrich(asked: Any = 0.1, least: Any = 20, most: Any = 40) -> object:
    def never(*_: object) -> Any:
        raise AssertionError("solved in spite of bad input")

    return enrich(never, never, asked, least=least, most=most, seed=[1])


def _arrays() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    heights, functionals, values = np.ones((9, 5)), np.ones((30, 4, 8)), np.ones((30, 4, 1))
    for name, bad in _not_an_array(POINTS).items():
        calls |= {
            f"basis at points {name}": partial(hermite_basis, bad, INDICES),
        }
    del calls["basis at points empty"]  # of none there are no values
    for name, bad in _not_an_array(TABLE).items():
        calls |= {
            f"least squares basis {name}": partial(least_squares, bad, TARGET),
            f"in contact basis {name}": partial(fit_in_contact, bad, np.abs(TARGET), logarithm=False),
            f"censored basis {name}": partial(censored_regression, bad, TARGET),
        }
    for name, bad in _not_an_array(TARGET).items():
        calls |= {
            f"least squares target {name}": partial(least_squares, TABLE, bad),
            f"least squares weights {name}": partial(least_squares, TABLE, TARGET, bad),
            f"in contact pressure {name}": partial(fit_in_contact, TABLE, bad, logarithm=True),
            f"censored target {name}": partial(censored_regression, TABLE, bad),
            f"scatter predictions {name}": partial(residual_scatter, bad, TARGET),
            f"scatter targets {name}": partial(residual_scatter, TARGET, bad),
        }
    del calls["least squares weights none"]  # none are all alike
    for name, bad in _not_an_array(np.ones(6)).items():
        calls[f"sensitivity coefficients {name}"] = partial(sensitivity, INDICES, bad)
    for part, shape in {"variables": (30, 1, 2), "distance2": (1,), "pressure": (30, 1), "gap": (30, 1)}.items():
        for name, bad in _not_an_array(np.ones((4, *shape[1:]) if part != "distance2" else (5,))).items():
            calls[f"samples {part} {name}"] = partial(_samples, part, bad)
    for name, bad in _not_an_array(functionals).items():
        calls[f"strip functionals {name}"] = partial(fit_strip, bad, values, 1, Stencil((1, 1), (2, 2)), TRIAL)
    for name, bad in _not_an_array(values).items():
        calls[f"strip targets {name}"] = partial(fit_strip, functionals, bad, 1, Stencil((1, 1), (2, 2)), TRIAL)
    for name in ("nan", "infinite", "a number", "complex", "text", "a word", "none", "objects"):
        calls |= {
            f"functionals of heights {name}": partial(
                local_functionals, _not_an_array(heights)[name], Stencil((1, 1), (2, 2))
            ),
            f"whitening of samples {name}": partial(whitening, _not_an_array(functionals[:, 0])[name], NO_SYMMETRY),
        }
    return calls


def _scalars() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    bad: Any  # of the wrong type as well
    for name, bad in {"0": 0, "-1": -1, **NOT_WHOLE}.items():
        calls |= {
            f"variables {name}": partial(multi_indices, bad, 2),
            f"design samples {name}": partial(design, "sobol", [1], bad, 2),
            f"design variables {name}": partial(design, "latin_hypercube", [1], 4, bad),
            f"Monte Carlo samples {name}": partial(design, "monte_carlo", [1], bad, 2),
            f"enrich least {name}": partial(_enrich, least=bad),
            f"enrich most {name}": partial(_enrich, most=bad),
        }
    for name, bad in {"-1": -1, **NOT_WHOLE}.items():
        calls |= {
            f"degree {name}": partial(multi_indices, 2, bad),
            f"local degree {name}": partial(fit_local, _known(), bad, TRIAL),
            f"half width {name}": partial(Stencil, (bad, 1), (2, 2)),
        }
    for name, bad in {"0": 0.0, "-1": -1.0, "2": 2.0, "nan": NAN, "text": "half"}.items():
        calls |= {
            f"enrich asked {name}": partial(_enrich, asked=bad),
        }
    for name, bad in {"0": 0.0, "-1": -1.0, "nan": NAN, "infinite": INFINITY, "text": "soft", "none": None}.items():
        calls[f"stiffness of the gap {name}"] = partial(PressureTarget, "trial_pressure", bad)
    for name, bad in {"-1": -1.0, "nan": NAN, "infinite": INFINITY, "text": "soft", "none": None}.items():
        calls[f"cell pressure {name}"] = partial(PressureTarget, "squared_pressure", 1.0, bad)
    return calls


def _known() -> Samples:
    u = np.random.default_rng(3).standard_normal((120, 1, 2))
    return Samples(u, np.zeros(1), np.maximum(u[..., 0], 0), np.maximum(-u[..., 0], 0))


def _others() -> dict[str, Callable[[], object]]:
    censored = PressureTarget("censored", 1.0)
    return {
        "more terms than fit": lambda: multi_indices(500, 15),
        "points of other variables": lambda: hermite_basis(POINTS[:, :1], INDICES),
        "negative weights": lambda: least_squares(TABLE, TARGET, -np.ones(K)),
        "no weights": lambda: least_squares(TABLE, TARGET, np.zeros(K)),
        "negative pressures": lambda: _samples("pressure", -np.ones((30, 1))),
        "negative gaps out of contact": lambda: Samples(
            np.zeros((30, 1, 2)), np.zeros(1), np.zeros((30, 1)), -np.ones((30, 1))
        ),
        "a target that is not known": lambda: PressureTarget("cubed_pressure", 1.0),  # type: ignore[arg-type]
        "a censored strip": lambda: fit_strip(
            np.random.default_rng(4).standard_normal((60, 4, 8)),
            np.ones((60, 4, 1)),
            1,
            Stencil((1, 1), (2, 2)),
            censored,
        ),
        "a design that is not known": lambda: design("halton", [1], 4, 2),
        "more successes than trials": lambda: wilson_interval(3, 2),
        "NaN among pressures": lambda: kolmogorov_distance(np.array([1.0, NAN]), np.ones(2)),
        "NaN given contact": lambda: cumulative_given_contact(np.array([1.0, NAN]), np.ones(2)),
        "least above most": lambda: _enrich(least=60, most=40),
    }


REFUSED = _arrays() | _scalars() | _others()
