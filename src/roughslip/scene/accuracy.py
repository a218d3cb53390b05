"""Section `accuracy` of a scene, and the numbers that follow from it where the scene says auto.

Errors by cells are a x^p at x = cell / correlation length. Of strips it is the error of friction after extrapolation.
Of the square it is that of the distribution of the pressure, with and without the error at edges of contacts. Modes
that are left out leave it a share of their variance. Measured on smooth heights at percentiles 20 to 95, docs/notebook.
Pilots then show what remains on the scene's own surface. Where that is too much, they refuse it with advice.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, gcd, lcm
from typing import Any

from roughslip.limits import LARGEST_ACCURACY, SHARES
from roughslip.scene.contact import MOST_NODES
from roughslip.scene.fields import AUTO, Section, number, section
from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused


@section
class Accuracy(Section):
    """Half widths of 95 % intervals that the study keeps, with as few samples as they take.

    A number a stands for friction_mean, friction_std and pressure = a, and cycles = 100 a.
    """

    friction_mean: float = number(
        "Of the mean friction coefficient at penetrations from 20 to 95 %, over it. It holds few strips and, with "
        "numerics.extrapolate_mesh, the mesh. It finds strip.samples and strip.expansion_samples",
        above=0,
        maximum=LARGEST_ACCURACY["friction_mean"],
        default=None,
    )
    friction_std: float = number(
        "Of the standard deviation of the friction coefficient, in the same way",
        above=0,
        maximum=LARGEST_ACCURACY["friction_std"],
        default=None,
    )
    pressure: float = number(
        "Of the distribution of the pressure at the centre of the square, at any pressure. Half of it is for few "
        "samples, and half for cells and missing modes. It finds square.monte_carlo_samples and expansion.samples, and "
        "square.nodes and square.variance_share where they are auto",
        minimum=0.002,
        maximum=LARGEST_ACCURACY["pressure"],
        default=None,
    )
    cycles: float = number(
        "Of the mean number of cycles at every damping ratio, in cycles. It holds few runs and the spacing of the "
        "nodes of friction paths. It finds ensemble.realisations and ensemble.nodes_per_correlation_length",
        above=0,
        maximum=LARGEST_ACCURACY["cycles"],
        default=None,
    )
    cost_limit_cpu_s: float = number(
        "CPU time of the strips, and of the runs, by the model of cost, above which an accuracy is refused before "
        "they are computed",
        "s",
        above=0,
        maximum=1e9,
        default=3600.0,
    )


SCAN, NODES = "roughness.scan", "square.nodes"
CELL_SHARE = 0.7  # of what is asked of friction, for the cells; the rest is for few strips
ERRORS = {"friction_mean": 0.175, "friction_std": 1.23}  # a
ORDER = 1.75  # p
COARSEST = 1 / 4  # x at most: a quarter of the correlation length
LENGTHS = tuple(f"strip.{name}_m" for name in ("length", "margin", "width", "window", "window_spacing"))
SPACING = "strip.expansion_spacing_m"
# Relative error of the scatter of friction, below which the solver's part of it stays at a residual, with the residual
RESIDUALS = ((2e-2, 1e-4), (5e-3, 1e-5), (0.0, 1e-6))
SQUARE_CELLS = {"corrected": (0.1, 2), "nodes": (0.06, 1)}  # a, p by numerics.contact_area
SQUARE_MODES = 0.4  # error of the distribution over the variance that is left out
SQUARE_SHARES = 0.1, 0.2  # of accuracy.pressure for cells and for modes
FEWEST_MODES = 0.8  # share of the variance at least

KOLMOGOROV_95 = 1.358  # 95 % quantile of sqrt(n) sup |F_n - F|
SHARE = 0.5  # of accuracy.pressure, for few samples
EXPANSION_SHARE = 0.1  # for the expansion, whose distance from the samples is shown
STRIPS = ("strip.samples", "strip.expansion_samples")
PRESSURES = ("square.monte_carlo_samples", "expansion.samples")
RUNS = ("ensemble.realisations", "ensemble.nodes_per_correlation_length")
FINDS = {"friction_mean": STRIPS, "friction_std": STRIPS, "pressure": PRESSURES, "cycles": RUNS}
NUMBERS = (*STRIPS, *PRESSURES, *RUNS)
REPLACES: dict[str, tuple[str, ...]] = {f"accuracy.{name}": keys for name, keys in FINDS.items()}


def of_all(value: float) -> dict[str, float]:
    """The section that a single number stands for."""
    return {"friction_mean": value, "friction_std": value, "pressure": value, "cycles": 100.0 * value}


def with_sample_counts(scene: Values) -> Values:
    """The scene without accuracies that find nothing, and with the samples that an error of a distribution takes.

    The latter do not depend on the distribution: A. N. Kolmogorov, G. Ist. Ital. Attuari 4 (1933) 83.
    """
    asked = {name: value for name, value in scene.get("accuracy", {}).items() if name not in FINDS}
    for name, keys in FINDS.items():
        if scene.get("accuracy", {}).get(name) is not None and any(_value(scene, key) == AUTO for key in keys):
            asked[name] = scene["accuracy"][name]
    whole = {key: value for key, value in scene.items() if key != "accuracy"}
    for part, _, name in (key.partition(".") for key in NUMBERS):
        if part in whole:
            whole[part] = {name: AUTO, **whole[part]}
    if not asked.keys() & FINDS.keys():
        return whole
    whole["accuracy"] = asked
    if "pressure" in asked and _value(scene, PRESSURES[0]) == AUTO and "square" in scene:
        samples = ceil((KOLMOGOROV_95 / (SHARE * asked["pressure"])) ** 2)
        whole["square"] |= {"monte_carlo_samples": samples}
    return whole


def mistakes(scene: Values) -> Iterator[Mistake]:
    """What is auto needs its accuracy."""
    asked = scene.get("accuracy") or {}
    for keys in (STRIPS, PRESSURES, RUNS):
        absent = [name for name, numbers in FINDS.items() if numbers == keys and asked.get(name) is None]
        left_open = [key for key in keys if _value(scene, key) == AUTO]
        if absent and left_open:
            yield missing(f"{left_open[0]} = {AUTO} needs it", f"accuracy.{absent[0]}", left_open[0])
    solved, minimum = _value(scene, STRIPS[0]), (_value(scene, "strip.training_samples") or 0) + SHARES
    if _value(scene, STRIPS[1]) == AUTO and isinstance(solved, int) and solved < minimum:
        allowed = f"{AUTO}, or with accuracy at least strip.training_samples and {SHARES} more"
        yield refused(solved, allowed, STRIPS[0], "accuracy.friction_mean")


def unused_accuracy(document: Values) -> Iterator[Mistake]:
    """An accuracy in a file that gives all the numbers itself."""
    asked = document.get("accuracy")
    if isinstance(asked, dict) and asked.keys() & FINDS.keys():
        by_hand = {name: [_value(document, key) for key in FINDS[name]] for name in asked if name in FINDS}
        if all(isinstance(value, int) for values in by_hand.values() for value in values):
            key = FINDS[min(by_hand)][0]
            yield not_together("accuracy", asked, key, _value(document, key), allowed=f"{AUTO} there")


def _value(scene: Values, key: str) -> Any:
    """The value of a number of samples; None where its section is not there or was refused."""
    section_name, _, name = key.partition(".")
    part = scene.get(section_name)
    return part.get(name, AUTO if key in NUMBERS else None) if isinstance(part, dict) else None


def discretised(scene: Values) -> tuple[Values, list[Mistake]]:
    """The scene with numbers where it says auto, and a mistake where what they follow from is not given."""
    mistakes = []
    for key, (number_of, needed, others) in AUTO_KEYS.items():
        if given(scene, key) != AUTO:
            continue
        number, (section, _, name) = number_of(scene), key.partition(".")
        if number is None:
            by_hand = needed.partition(",")[0]
            with_scan = f"with {SCAN} {by_hand}, for cells of at most a quarter of its shortest correlation length"
            mistakes.append(refused(AUTO, with_scan if given(scene, SCAN) and SCAN in others else needed, key, *others))
        elif key == NODES and number > MOST_NODES:
            allowed = f"at most {MOST_NODES}; auto takes so many for accuracy.pressure"
            mistakes.append(refused(number, allowed, key, *others))
        else:
            scene = scene | {section: scene[section] | {name: number}}
    return scene, mistakes


def cell_m(asked: dict[str, float], length_m: float, sizes_m: list[float]) -> float:
    """The coarsest cell of which all sizes are even multiples, and which leaves CELL_SHARE of what is asked.

    asked : half width by name of ERRORS; length_m : correlation length; sizes_m : lengths on the strip
    """
    from fractions import Fraction  # with decimal, for such scenes alone

    maximum = min([COARSEST, *((CELL_SHARE * asked[name] / a) ** (1 / ORDER) for name, a in ERRORS.items())]) * length_m
    sizes = [Fraction(repr(size)) for size in sizes_m]  # as decimal numbers
    parts = lcm(*(size.denominator for size in sizes))
    common = Fraction(gcd(*(int(size * parts) for size in sizes)), 2 * parts)  # half of what measures all sizes
    return float(common / ceil(float(common) / maximum * (1 - 1e-9)))


def tolerance(asked: dict[str, float]) -> float:
    """The largest residual of RESIDUALS whose error is a tenth of what is asked of the scatter, or less."""
    return next(residual for minimum, residual in RESIDUALS if asked["friction_std"] >= minimum)


def _strip_cell(scene: Values) -> float | None:
    """Of the strip. None where accuracies of friction, a correlation length or a size are missing."""
    asked, length = _asked(scene), _shortest_length(scene)
    sizes = [_positive(scene, key) for key in LENGTHS if given(scene, key) != 0]
    sizes += [2 * _positive(scene, SPACING)] if given(scene, SPACING) else []
    return cell_m(asked, length, sizes) if asked and length and all(sizes) else None


def _tolerance(scene: Values) -> float | None:
    """Of contact solves. None where accuracies of friction are missing."""
    asked = _asked(scene)
    return tolerance(asked) if asked else None


def square_nodes(scene: Values) -> int | None:
    """Nodes along an edge of the square. None where accuracy.pressure, the edge or a correlation length is missing."""
    asked, edge, length = (
        _positive(scene, "accuracy.pressure"),
        _positive(scene, "square.edge_m"),
        _shortest_length(scene),
    )
    law = SQUARE_CELLS.get(given(scene, "numerics.contact_area"))
    if not (asked and edge and length and law):
        return None
    maximum = min(COARSEST, (SQUARE_SHARES[0] * asked / law[0]) ** (1 / law[1]))
    return ceil(edge / (maximum * length))


def square_share(scene: Values) -> float | None:
    """Of the variance, for the modes of the square. None where accuracy.pressure is missing."""
    asked = _positive(scene, "accuracy.pressure")
    return max(FEWEST_MODES, round(1 - SQUARE_SHARES[1] * asked / SQUARE_MODES, 4)) if asked else None


def _shortest_length(scene: Values) -> float:
    """Correlation length [m] of the heights, across the belt where it is shorter there; 0 where it is missing."""
    length = _positive(scene, "roughness.correlation_length_m")
    return min(length, _positive(scene, "roughness.correlation_length_across_m") or length)


def _asked(scene: Values) -> dict[str, float] | None:
    """Accuracies of friction; None where not all are given."""
    values = {name: _positive(scene, f"accuracy.{name}") for name in ERRORS}
    return values if all(values.values()) else None


def _positive(scene: Values, key: str) -> float:
    """A number of a scene that is above zero, else 0."""
    value = given(scene, key)
    return float(value) if isinstance(value, (int, float)) and value > 0 else 0.0


# By key: the number, what is needed, and the other keys of the message
AUTO_KEYS: dict[str, tuple[Callable[[Values], float | None], str, tuple[str, ...]]] = {
    "strip.cell_m": (
        _strip_cell,
        "a number > 0 [m], or auto with accuracy of friction (mean and std) and a correlation length",
        (SCAN, "accuracy.friction_std"),
    ),
    "numerics.contact_tolerance": (
        _tolerance,
        "a number from 1e-14 to 0.001, or auto with accuracy of friction (mean and std)",
        ("accuracy.friction_std",),
    ),
    NODES: (
        square_nodes,
        "a whole number from 2 to 1024, or auto with accuracy.pressure and a correlation length",
        (SCAN, "accuracy.pressure"),
    ),
    "square.variance_share": (
        square_share,
        "a number > 0 and <= 1, or auto with accuracy.pressure",
        ("accuracy.pressure",),
    ),
}
