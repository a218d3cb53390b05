"""Section `accuracy` of a scene, and the numbers of samples that follow from it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from roughslip.limits import LARGEST_ACCURACY, SHARES
from roughslip.scene.auto import AUTO
from roughslip.scene.fields import Section, number, section
from roughslip.scene.mistakes import Mistake, Values, missing, not_together, refused


@section
class Accuracy(Section):
    """Half widths of 95 % intervals that the study keeps, with as few samples as they take.

    A number a stands for friction_mean, friction_std and pressure = a, and cycles = 100 a.
    """

    friction_mean: float = number(
        "Of the mean friction coefficient at penetrations from 20 to 95 %, over it. It holds few strips and, with "
        "numerics.extrapolate_mesh, the mesh. It finds strip.samples and strip.expansion_samples",
        above=0,
        at_most=LARGEST_ACCURACY["friction_mean"],
        default=None,
    )
    friction_std: float = number(
        "Of the standard deviation of the friction coefficient, in the same way",
        above=0,
        at_most=LARGEST_ACCURACY["friction_std"],
        default=None,
    )
    pressure: float = number(
        "Of the distribution of the pressure at the centre of the square, at any pressure. Half of it is for few "
        "samples, and half for cells and missing modes. It finds square.monte_carlo_samples and expansion.samples, and "
        "square.nodes and square.variance_share where they are auto",
        at_least=0.002,
        at_most=LARGEST_ACCURACY["pressure"],
        default=None,
    )
    cycles: float = number(
        "Of the mean number of cycles at every damping ratio, in cycles. It holds few runs and the spacing of the "
        "nodes of friction paths. It finds ensemble.realisations and ensemble.nodes_per_correlation_length",
        above=0,
        at_most=LARGEST_ACCURACY["cycles"],
        default=None,
    )
    cost_limit_cpu_s: float = number(
        "CPU time of the strips, and of the runs, by the model of cost, above which an accuracy is refused before "
        "they are computed",
        "s",
        above=0,
        at_most=1e9,
        default=3600.0,
    )
    verdict_limit_cpu_s: float = number(
        "CPU time of the strips, by the same model, up to which strips are added to those that the accuracy takes, "
        "where they decide verdicts on friction; 0 adds none",
        "s",
        at_least=0,
        at_most=1e9,
        default=0.0,
    )


KOLMOGOROV_95 = 1.358  # 95 % quantile of sqrt(n) sup |F_n - F|
SHARE = 0.5  # of accuracy.pressure, for few samples
EXPANSION_SHARE = 0.1  # for the expansion, whose distance from the samples is shown
STRIPS = ("strip.samples", "strip.expansion_samples")
PRESSURES = ("square.monte_carlo_samples", "expansion.samples")
RUNS = ("ensemble.realisations", "ensemble.nodes_per_correlation_length")
FINDS = {"friction_mean": STRIPS, "friction_std": STRIPS, "pressure": PRESSURES, "cycles": RUNS}
NUMBERS = (*STRIPS, *PRESSURES, *RUNS)
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"": {f"accuracy.{name}": keys for name, keys in FINDS.items()}}


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
        samples = math.ceil((KOLMOGOROV_95 / (SHARE * asked["pressure"])) ** 2)
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
    solved, least = _value(scene, STRIPS[0]), (_value(scene, "strip.training_samples") or 0) + SHARES
    if _value(scene, STRIPS[1]) == AUTO and isinstance(solved, int) and solved < least:
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
