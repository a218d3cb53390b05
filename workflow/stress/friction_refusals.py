"""Bad input to friction, each kind once: a ParameterError and nothing else is the answer to all of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.friction.bowden_tabor import friction_coefficient, window_sums
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.distribution_families import fit_candidates
from roughslip.friction.load_sharing import average_beta
from roughslip.friction.marginal import distance_to_beta, fit_beta, scaled_beta
from roughslip.friction.paths import prepare
from roughslip.friction.penetration_law import between, penetration_law
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.friction.resampling import strip_weights
from roughslip.friction.statistics import combine, ratio_of_sums, trend, window_statistics
from roughslip.friction.white_noise_baseline import white_autocorrelation
from roughslip.probability import BetaDistribution, QuantileDistribution

NAN, INFINITY = math.nan, math.inf
NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, "nan": NAN, "infinite": INFINITY, "text": "long", "none": None}
NOT_WHOLE = {"zero": 0, "negative": -1, "half": 2.5, "nan": NAN, "text": "four", "none": None}

GENERATOR = np.random.default_rng(3)
MU = 0.3 + 0.1 * GENERATOR.random((6, 12))
VALID = np.ones(MU.shape, dtype=bool)
WEIGHTS = strip_weights(6, 40, np.random.default_rng(4))
LAGS = 1e-6 * np.arange(8.0)
CURVE = autocorrelation(MU, VALID, 8, WEIGHTS)
LEVELS = np.array([5.0, 50.0, 95.0])
STATISTICS = [window_statistics(level * MU, VALID, WEIGHTS).mean for level in (3.0, 2.0, 1.0)]
BETA = BetaDistribution(2.1, 5.0, 0.2, 0.6)
PROCESS = FrictionProcess(BETA, 1e-4)
OF_WINDOWS: dict[str, Callable[..., object]] = {
    "statistics": window_statistics,
    "beta": fit_beta,
    "candidates": fit_candidates,
    "scaled": scaled_beta,
    "distance": distance_to_beta,
    "autocorrelation": lambda mu, valid, weights: autocorrelation(mu, valid, 4, weights),
    "ratio": lambda area, _, weights: ratio_of_sums(area, MU, 1.0, weights),
    "control": lambda mu, valid, weights: combine((MU, VALID), (mu, valid), (MU + 0.1, VALID), WEIGHTS, weights),
}


def _put(good: np.ndarray, value: Any) -> np.ndarray:
    bad = good.copy()
    bad.flat[3] = value
    return bad


def _not_an_array(good: np.ndarray) -> dict[str, Any]:
    """What is no array like a good one, by name."""
    return {
        "nan": _put(good, NAN),
        "infinite": _put(good, INFINITY),
        "a number": 1.0,
        "of one dimension more": good[..., None],
        "text": np.full(good.shape, "high"),
        "a word": "high",
        "none": None,
        "complex": good + 1e-9j,
        "objects": np.full(good.shape, None),
        "ragged": [[1.0, 2.0], [3.0]],
    }


def _not_weights() -> dict[str, Any]:
    return {
        "none": None,
        "a word": "often",
        "floats": WEIGHTS.astype(float),
        "negative": _put(WEIGHTS, -1),
        "of other strips": WEIGHTS[:, :4],
        "too few": WEIGHTS[:20],
        "without the sample": WEIGHTS[1:],
        "one row": WEIGHTS[0],
    }


def _windows() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    bad: Any
    for of, call in OF_WINDOWS.items():
        calls |= {f"{of} of mu {name}": partial(call, bad, VALID, WEIGHTS) for name, bad in _not_an_array(MU).items()}
        calls |= {f"{of} of weights {name}": partial(call, MU, VALID, bad) for name, bad in _not_weights().items()}
        if of == "ratio":
            continue
        calls |= {
            f"{of} of valid as numbers": partial(call, MU, VALID.astype(float), WEIGHTS),
            f"{of} of valid of another shape": partial(call, MU, VALID[:, :3], WEIGHTS),
            f"{of} of valid as none": partial(call, MU, None, WEIGHTS),
        }
    for name, bad in _not_an_array(MU).items():
        if name in ("a number", "of one dimension more"):
            continue
        calls |= {
            f"sums of {name}": partial(window_sums, bad, 3, 1),
            f"friction of area {name}": partial(friction_coefficient, bad, MU, 1.0, 0.1),
            f"friction of force {name}": partial(friction_coefficient, MU, bad, 1.0, 0.1),
        }
    for name, bad in NOT_WHOLE.items():
        calls |= {
            f"window {name}": partial(window_sums, MU, bad, 1),
            f"stride {name}": partial(window_sums, MU, 3, bad),
            f"windows in parallel {name}": partial(average_beta, 2.1, 5.0, 0.2, 0.6, bad),
            f"replicates {name}": partial(strip_weights, 6, bad, GENERATOR),
            f"measurements {name}": partial(white_autocorrelation, 4, 40, 5, 1, 4, bad, GENERATOR),
            f"columns of a window {name}": partial(white_autocorrelation, 4, 40, bad, 1, 4, 40, GENERATOR),
        }
    for name, bad in NOT_POSITIVE.items():
        calls |= {
            f"strength {name}": partial(friction_coefficient, MU, MU, bad, 0.1),
            f"least area {name}": partial(friction_coefficient, MU, MU, 1.0, bad),
            f"shape of a distance {name}": partial(distance_to_beta, MU, VALID, WEIGHTS, bad, 5.0),
        }
    return calls | {
        "a window of more than the strip": partial(window_sums, MU, 13, 1),
        "contact without force": partial(friction_coefficient, MU, 0 * MU, 1.0, 0.1),
        "negative area": partial(friction_coefficient, -MU, MU, 1.0, 0.1),
        "negative friction": partial(window_statistics, -MU, VALID, WEIGHTS),
        "other replicates of the many": partial(
            combine, (MU, VALID), (MU, VALID), (MU, VALID), WEIGHTS, np.concatenate((WEIGHTS, WEIGHTS[1:]))
        ),
        "a control of other strips": partial(
            combine, (MU, VALID), (MU[:, :3], VALID[:, :3]), (MU, VALID), WEIGHTS, WEIGHTS
        ),
    }


def _curves() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    bad: Any
    for name, bad in _not_an_array(LAGS).items():
        calls |= {f"lags {name}": partial(correlation_fit, bad, CURVE, 4e-6)}
    for name, bad in _not_an_array(np.linspace(5.0, 95.0, 4)).items():
        calls |= {
            f"levels {name}": partial(penetration_law, bad, STATISTICS + STATISTICS[:1]),
            f"levels of a trend {name}": partial(trend, bad, np.arange(4.0), np.ones((4, 40))),
            f"values of a trend {name}": partial(trend, np.arange(4.0), bad, np.ones((4, 40))),
        }
    law = penetration_law(LEVELS, STATISTICS)
    for name, bad in {"below": 4.0, "above": 96.0, "nan": NAN, "text": "deep", "none": None}.items():
        calls |= {
            f"penetration {name}": partial(law.at, bad),
            f"slope at a penetration {name}": partial(law.slope, bad),
            f"between levels {name}": partial(between, LEVELS, np.array([0.3, 0.2, 0.1]), bad),
        }
    for name, bad in NOT_POSITIVE.items():
        calls |= {f"window of a fit {name}": partial(correlation_fit, LAGS, CURVE, bad)}
    return calls | {
        "lags that fall": partial(correlation_fit, LAGS[::-1], CURVE, 4e-6),
        "lags that do not begin at zero": partial(correlation_fit, LAGS + 1e-6, CURVE, 4e-6),
        "lags of another curve": partial(correlation_fit, 1e-6 * np.arange(9.0), CURVE, 4e-6),
        "levels that fall": partial(penetration_law, LEVELS[::-1], STATISTICS),
        "levels without a statistic": partial(penetration_law, LEVELS, STATISTICS[:2]),
    }


def _paths() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    bad: Any
    for name, bad in NOT_POSITIVE.items():
        calls |= {
            f"shape a {name}": partial(BetaDistribution, bad, 5.0, 0.0, 1.0),
            f"shape b {name}": partial(BetaDistribution, 2.1, bad, 0.0, 1.0),
            f"correlation length {name}": partial(FrictionProcess, BETA, bad),
            f"spacing of a recursion {name}": partial(recursion, PROCESS, bad),
        }
        for method in ("embedding", "spectral"):
            calls |= {
                f"spacing of {method} {name}": partial(prepare, PROCESS, bad, 1e-3, method),
                f"length of {method} {name}": partial(prepare, PROCESS, 1e-5, bad, method),
            }
    for name, bad in {"nan": NAN, "infinite": INFINITY, "text": "low", "none": None}.items():
        calls |= {
            f"lower end {name}": partial(BetaDistribution, 2.1, 5.0, bad, 1.0),
            f"upper end {name}": partial(BetaDistribution, 2.1, 5.0, 0.0, bad),
            f"mean of quantiles {name}": partial(QuantileDistribution, np.arange(20.0), bad, 0.1),
            f"deviation of quantiles {name}": partial(QuantileDistribution, np.arange(20.0), 0.3, bad),
        }
    for name, bad in _not_an_array(np.arange(20.0)).items():
        calls[f"quantiles {name}"] = partial(QuantileDistribution, bad, 0.3, 0.1)
    built = recursion(PROCESS, 1e-5)
    for name, bad in NOT_WHOLE.items():
        calls[f"nodes of a piece {name}"] = partial(built.realisation, [1], bad)
    return calls | {
        "ends in the wrong order": partial(BetaDistribution, 2.1, 5.0, 1.0, 0.0),
        "quantiles that fall": partial(QuantileDistribution, -np.arange(20.0), 0.3, 0.1),
        "too few quantiles": partial(QuantileDistribution, np.arange(5.0), 0.3, 0.1),
        "a spacing far too fine": partial(recursion, PROCESS, 1e-12),
        "a spacing far too wide": partial(recursion, PROCESS, 1.0),
        "a path far too long": partial(prepare, PROCESS, 1e-9, 1.0, "embedding"),
        "a method that is not known": partial(prepare, PROCESS, 1e-5, 1e-3, "wavelets"),
    }


REFUSED = {**_windows(), **_curves(), **_paths()}
