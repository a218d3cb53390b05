"""What a friction record says as variables of a result."""

from __future__ import annotations

import numpy as np

from roughslip.probability.estimate import NORMAL_95
from roughslip.record.fit import FrictionScatter, RecordFit
from roughslip.record.slips import Sliding
from roughslip.store import Variable, with_interval

KINDS = ("additive", "multiplicative")
MOST_DRAWN = 2000  # samples of the record that are drawn


def of_fit(found: RecordFit, slid: Sliding, beta_shapes: tuple[float, float]) -> dict[str, Variable]:
    """Curve and scatter with their errors, and what else is in the record."""
    samples, curve = slid.samples, found.curve
    ends = (curve.friction, *curve.interval())
    words = {"curve_form": curve.form, "kind": found.kind, "shape": found.scatter(found.kind).shape}
    variables = {name: Variable((name,), np.array([word]), "1", name.replace("_", " ")) for name, word in words.items()}
    notes = np.array(found.notes + slid.notes or ("nothing",))
    variables |= {
        "note": Variable(("note",), notes, "1", "what the record leaves open"),
        "record_mean": Variable((), float(np.mean(found.mean)), "1", "mean friction coefficient over the record"),
        "curve_speed": Variable(("curve_speed",), curve.speeds_m_per_s, "m/s", "sliding speed"),
        "curve_factor": Variable(
            ("curve_speed", "draw"), curve.factor, "1", "F, with F F' the covariance of the curve"
        ),
        "curve_at_rest": Variable((), curve.at_rest, "1", "mean friction coefficient of the curve towards rest"),
        "curve_factor_at_rest": Variable(("draw",), curve.factor_at_rest, "1", "the row of F at rest"),
        "misfit": Variable((), curve.misfit, "1", "p-value that Stribeck's law fits"),
        "ratio": Variable((), found.ratio, "1", "log likelihood of multiplicative scatter over additive"),
        "beta_shapes": Variable(("shape_of_beta",), np.array(beta_shapes), "1", "shapes of the Beta distribution"),
        "period_length": Variable((), found.period_m, "m", "period of a revolution, or of what repeats"),
        **with_interval("curve", ("curve_speed",), ends, "1", "mean friction coefficient"),
    }
    for name in ("drift", "period", "ramps"):
        title = f"p-value that the record has no {'difference of ramps' if name == 'ramps' else name}"
        variables[name] = Variable((), getattr(found, name), "1", title)
    for name in ("skewness", "excess"):
        value, error = getattr(found, name)
        columns = (value, value - NORMAL_95 * error, value + NORMAL_95 * error)
        variables |= with_interval(name, (), columns, "1", f"{name} of the scatter")
    for kind in KINDS:
        variables |= _of_scatter(kind, found.scatter(kind))
    step = -(-samples.friction.size // MOST_DRAWN)
    drawn = {
        "sample_time": (samples.elapsed, "s", "time of sliding"),
        "sample_speed": (samples.speed, "m/s", "sliding speed"),
        "sample_slipped": (samples.slipped, "m", "slipped distance"),
        "sample_friction": (samples.friction, "1", "friction coefficient as measured"),
        "sample_explained": (found.explained, "1", "curve, drift and period"),
    }
    return variables | {
        name: Variable(("sample",), values[::step], unit, title) for name, (values, unit, title) in drawn.items()
    }


def _of_scatter(kind: str, scatter: FrictionScatter) -> dict[str, Variable]:
    """Standard deviation and length with intervals. Multiplicative scatter is that over the mean friction."""
    (low, high), (shortest, longest) = scatter.interval()
    return {
        **with_interval(
            f"{kind}_std", (), (scatter.standard_deviation, low, high), "1", f"standard deviation of {kind} scatter"
        ),
        **with_interval(
            f"{kind}_length", (), (scatter.correlation_length_m, shortest, longest), "m", f"correlation length, {kind}"
        ),
        f"{kind}_log_covariance": Variable(
            ("error", "other_error"), scatter.log_covariance, "1", "covariance of log standard deviation and log length"
        ),
        f"{kind}_shape": Variable((f"{kind}_shape",), np.array([scatter.shape]), "1", "shape of the autocorrelation"),
        f"{kind}_lengths": Variable((), scatter.lengths, "1", "correlation lengths in the record"),
        f"{kind}_identified": Variable((), int(scatter.identified), "1", "1 where the record can tell the scatter"),
    }
