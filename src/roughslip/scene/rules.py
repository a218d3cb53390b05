"""Rules that tie several keys of a scene together: conditions on values, and forms that exclude each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from roughslip.limits import (
    FIELD_GROUPS,
    FIELD_NUMBERS,
    FIELD_SAMPLES,
    FUNCTIONALS,
    MOST_NUMBERS,
    TRAINING_NODES,
    TRAINING_SPACING,
)
from roughslip.scene import accuracy, contact, friction, load, motion_rules, oscillator, ranges, roughness, size_rules
from roughslip.scene.auto import AUTO
from roughslip.scene.expansion import terms
from roughslip.scene.mistakes import (
    Mistake,
    Rule,
    Values,
    given,
    missing,
    not_together,
    refused,
    shown,
    strictly_increasing,
)
from roughslip.scene.plan import needs, stages_needed
from roughslip.scene.types import get

# Keys allowed only when another key has this value: the key, the other key, the value. Then they must be given.
ONLY_WITH = (("oscillator.friction_table", "oscillator.law", "table"),)

# In an overlay, by section: keys that a key replaces, where the overlay does not give those too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {}
for _part in (accuracy, load, friction, contact, roughness, oscillator, ranges):
    for _section, _keys in _part.REPLACES.items():
        REPLACES.setdefault(_section, {}).update(_keys)
for _key, _other, _ in ONLY_WITH:
    REPLACES.setdefault(_other.partition(".")[0], {})[_other.partition(".")[2]] = (_key.partition(".")[2],)


_MEMORY, _TERMS = f"{MOST_NUMBERS} (0.8 GB of memory)", ("expansion.variables", "expansion.degree")
_CELLS, _ROWS = size_rules.MOST_CELLS, 3  # of a strip at most, and across it at least
_DRAWS = 40  # over the square of accuracy.pressure: draws then add 1.36 / sqrt(10) of its half, with 95 %
_LENGTHS = "length_m margin_m width_m window_m window_spacing_m"
_MULTIPLES = {
    "cell_m": f"{_LENGTHS} expansion_spacing_m",
    "expansion_spacing_m": "length_m window_m window_spacing_m",
}
_AT_MOST = (
    ("strip.training_samples", "strip.samples"),
    ("ensemble.drawn_realisations", "ensemble.realisations"),
)
_EXTENDED = ("sobol", "monte_carlo")  # designs
_ASCENDING = ("strip.penetration_percentiles", "ensemble.damping_ratios", "survival.scatter_factors")
_HARDNESS, _EXTRAPOLATE = "material.hardness_pa", "numerics.extrapolate_mesh"
_WAVES = "roughness.fractal.wavelengths_m"


def training_columns(columns: float) -> int:
    """Columns of a strip that train the expansion, as from_scene.geometry counts them."""
    return math.ceil((columns - TRAINING_SPACING // 2) / TRAINING_SPACING) if columns < _CELLS else _CELLS


def _is_multiple(length: float, cell: float) -> bool:
    cells = length / cell
    return math.isfinite(cells) and abs(cells - round(cells)) <= 1e-9 * cells


def _fits_left_out(samples: int, modes: int, targets: list[str]) -> bool:
    """Whether the expansion at every node has more samples than terms in each of its leave-outs."""
    enough = samples >= FIELD_SAMPLES and samples - math.ceil(samples / FIELD_GROUPS) > modes + 1
    return enough or "figure_field" not in targets


_RULES = (
    Rule(("square.modes", "square.nodes"), lambda m, n: m <= n**2, "at most square.nodes^2 = {1}^2"),
    Rule(
        ("square.modes", "square.nodes"),
        lambda m, n: m > n**2 or m * n**2 <= MOST_NUMBERS,
        f"modes times nodes^2 at most {_MEMORY}, here with {{1}} nodes",
    ),
    Rule(
        ("expansion.variables", "square.modes"),
        lambda v, modes: v <= modes,
        "at most square.modes = {1}",
    ),
    *(
        rule
        for samples in ("expansion.samples", "square.latin_hypercube_samples")
        for rule in (
            Rule(
                (samples, "square.modes"),
                lambda n, modes: n * modes <= MOST_NUMBERS,
                f"samples times square.modes = {{1}} at most {_MEMORY}",
            ),
            Rule(
                (samples, *_TERMS),
                lambda n, v, d: n > terms(v, d),
                "more than the terms of the expansion, C({1} + {2}, {2})",
            ),
            Rule(
                (samples, *_TERMS),
                lambda n, v, d: n <= terms(v, d) or n * terms(v, d) <= MOST_NUMBERS,
                f"samples times terms, C({{1}} + {{2}}, {{2}}), at most {_MEMORY}",
            ),
        )
    ),
    Rule(
        ("expansion.samples", *_TERMS),
        lambda _, v, d: TRAINING_NODES * terms(v, d) * 2 ** terms(v, d).bit_length() <= MOST_NUMBERS,
        f"a lower expansion.degree, because more samples than C({{1}} + {{2}}, {{2}}), at {TRAINING_NODES} nodes each, "
        f"give tables above {_MEMORY}",
        of_auto=("expansion.samples",),
    ),
    Rule(
        ("expansion.draws", "accuracy.pressure", "expansion.samples", "targets"),
        lambda draws, error, _, targets: "figure2" not in targets or draws * error**2 >= _DRAWS,
        f"at least {_DRAWS} / accuracy.pressure^2, or the draws alone err by half of {{1}}",
        of_auto=("expansion.samples",),
    ),
    *(
        Rule((f"strip.{length}", f"strip.{step}"), _is_multiple, f"a whole multiple of strip.{step} = {{1}} [m]")
        for step, lengths in _MULTIPLES.items()
        for length in lengths.split()
    ),
    Rule(
        ("strip.length_m", "strip.window_m"),
        lambda length, window: length >= 4 * window,
        "at least four times strip.window_m = {1} [m], for lags of three windows",
    ),
    Rule(
        ("strip.window_spacing_m", "strip.window_m"),
        lambda spacing, window: 2 * spacing <= window * (1 + 1e-9),
        "at most half of strip.window_m = {1} [m], for lags within the window",
    ),
    Rule(
        ("strip.width_m", "strip.cell_m"),
        lambda width, cell: not _is_multiple(width, cell) or round(width / cell) >= _ROWS,
        f"at least {_ROWS} times strip.cell_m = {{1}} [m], for slope and curvature across the strip",
    ),
    Rule(
        ("strip.length_m", "roughness.correlation_length_m"),
        lambda length, correlation: length >= 8 * correlation,
        "at least eight times roughness.correlation_length_m = {1} [m]",
    ),
    Rule(
        (_WAVES, "strip.length_m"),
        lambda waves, length: waves[0] <= waves[1] <= length,
        "the shortest first, the longest at most strip.length_m = {1} [m]",
    ),
    Rule(
        (_WAVES, "strip.cell_m"),
        lambda waves, cell: waves[0] > 2 * cell,
        "a shortest wave of more than two cells, strip.cell_m = {1} [m]",
    ),
    Rule(
        ("strip.expansion_spacing_m", "strip.cell_m", "roughness.fractal"),
        lambda spacing, cell, fractal: spacing == cell or (fractal["wavelengths_m"] or [0.0])[0] > 2 * spacing,
        f"strip.cell_m = {{1}} [m], or less than half of the first of {_WAVES}",
    ),
    Rule(
        (_EXTRAPOLATE, "strip.cell_m", *(f"strip.{length}" for length in _LENGTHS.split())),
        lambda asked, cell, *lengths: not asked or all(_is_multiple(length, 2 * cell) for length in lengths),
        f"false, or each of strip.{_LENGTHS.replace(' ', ', ')} a whole multiple of two cells, 2 x {{1}} m",
    ),
    Rule(
        (_EXTRAPOLATE, "roughness.correlation_length_m", "strip.cell_m"),
        lambda asked, length, cell: not asked or length >= 4 * cell,
        "false, or roughness.correlation_length_m = {1} [m] at least four cells, 4 x {2} m",
    ),
    Rule(
        (_EXTRAPOLATE, _WAVES, "strip.cell_m"),
        lambda asked, waves, cell: not asked or waves[0] > 4 * cell,
        f"false, or the first of {_WAVES} = {{1}} more than four cells, 4 x {{2}} m",
    ),
    Rule(
        ("targets", "roughness.fractal"),
        lambda targets, _: not {"figure2", "figure_field"}.intersection(targets),
        "figure2 and figure_field expand the pressure in Gaussian variables, and roughness.fractal has a phase a wave",
    ),
    Rule(
        ("strip.cell_m", "strip.length_m", "strip.margin_m", "strip.width_m"),
        lambda cell, length, margin, width: (length + 2 * margin) / cell * (width / cell) < _CELLS + 0.5,
        f"at most {_CELLS} cells on the strip of {{1}} + 2 x {{2}} by {{3}} m",
    ),
    *(Rule((key,), strictly_increasing, "strictly increasing") for key in _ASCENDING),
    Rule(
        ("expansion.design", "expansion.samples"),
        lambda design, _: design in _EXTENDED,
        f"{' or '.join(_EXTENDED)} with expansion.samples = {AUTO}, to be extended",
        of_auto=("expansion.samples",),
    ),
    Rule(
        ("expansion.samples", "square.modes", "targets"),
        _fits_left_out,
        f"at least {FIELD_SAMPLES} for figure_field, and without a {FIELD_GROUPS}th of them more than its terms, "
        "square.modes = {1} and a constant",
    ),
    Rule(
        ("square.modes", "square.nodes", "expansion.samples", "targets"),
        lambda modes, nodes, samples, targets: (
            "figure_field" not in targets or FIELD_GROUPS * modes * nodes**2 <= FIELD_NUMBERS
        ),
        f"{FIELD_GROUPS} times the modes times square.nodes^2 = {{1}}^2 at most {FIELD_NUMBERS} (0.8 GB of memory) "
        "for figure_field",
    ),
    Rule(
        ("expansion.samples", "square.nodes", "targets"),
        lambda samples, nodes, targets: "figure_field" not in targets or samples * nodes**2 <= FIELD_NUMBERS,
        f"samples times square.nodes^2 = {{1}}^2 at most {FIELD_NUMBERS} (1.5 GB of memory) for figure_field",
    ),
    Rule(
        ("targets", _HARDNESS),
        lambda targets, _: "figure_field" not in targets,
        f"figure_field ranks the pressures of a node, and those at {_HARDNESS} are equal: leave it out",
    ),
    Rule(
        ("strip.penetration_percentiles", "friction.mean_at_median"),
        lambda percentiles, _: 50 in percentiles,
        "50 among them: friction.mean_at_median sets the shear strength there",
    ),
    Rule(
        ("strip.training_samples", "strip.length_m", "strip.cell_m", "expansion.degree"),
        lambda n, length, cell, d: n > 1 and n * training_columns(length / cell) > terms(FUNCTIONALS, d),
        f"at least 2, and enough that every {TRAINING_SPACING}th column gives more samples than "
        f"C({FUNCTIONALS} + {{3}}, {{3}})",
    ),
    *(Rule(pair, lambda n, most: n <= most, f"at most {pair[1]} = {{1}}") for pair in _AT_MOST),
    Rule(accuracy.STRIPS[::-1], lambda e, s: e >= 2 * s, "at least twice strip.samples = {1}"),
    *motion_rules.RULES,
    *size_rules.RULES,
)


def mistakes(scene: Values, faulty: set[str]) -> Iterator[Mistake]:
    """Every rule across keys that the scene breaks.

    scene : the merged scene, with None for every value that the schema refused
    faulty : dotted keys that the schema refused; rules that read them, or anything in or around them, are left out
    """

    def sound(key: str) -> bool:
        return not any(f"{bad}.".startswith(f"{key}.") or f"{key}.".startswith(f"{bad}.") for bad in faulty)

    if sound("targets"):
        yield from _unmet_needs(scene, sound)
    sections = {"friction": friction, "square": contact, "roughness": roughness, "oscillator": oscillator}
    modules = [module for name, module in sections.items() if isinstance(scene.get(name), dict)]
    for form in (accuracy, load, ranges, *modules):
        yield from (mistake for mistake in form.mistakes(scene) if all(map(sound, mistake.keys)))
    for key, other, word in ONLY_WITH:
        value, chosen = given(scene, key), get(scene, other)
        if not (sound(key) and sound(other)) or chosen is None:
            continue
        if chosen == word and value is None:
            yield missing(f"{other} = {word} needs it", key, other)
        elif chosen != word and value is not None:
            yield not_together(key, value, other, chosen, allowed=f"only {word} takes it")
    unread = _sections_not_read(scene) if scene.get("targets") and sound("targets") else set()
    whole = oscillator.with_frequency(scene)
    for keys, holds, allowed, of_auto in _RULES:
        values = [get(whole, key) for key in keys]
        known = all(value is not None for value in values) and all(map(sound, keys))
        known = known and [key for key, value in zip(keys, values, strict=True) if value == AUTO] == [*of_auto]
        if known and unread.isdisjoint(key.partition(".")[0] for key in keys) and not holds(*values):
            words = (shown(value) if isinstance(value, list) else value for value in values)
            yield refused(values[0], allowed.format(*words), *keys)


def _sections_not_read(scene: Values) -> set[str]:
    """Sections that no target reads; what an overlay inherits in them may break the rules without effect."""
    stages = stages_needed(scene)
    unread = set() if "friction" in stages else {"strip"}
    return unread if stages & {"chaos_square", "field_square"} else unread | {"square"}


def _unmet_needs(scene: Values, sound: Callable[[str], bool]) -> Iterator[Mistake]:
    """The sections and keys that the targets need and the scene lacks; a missing section stands for its keys."""
    absent: dict[str, list[str]] = {}
    for target in scene.get("targets", []):
        for key in needs(scene, target):
            lacking = key if (section := key.split(".")[0]) in scene else section
            if given(scene, lacking) is None and sound(lacking) and target not in absent.setdefault(lacking, []):
                absent[lacking].append(target)
    for key, targets in absent.items():
        reason = f"needed for {', '.join(targets)}"
        if key != "friction.mean_at_median":
            yield missing(reason, key, "targets")
        elif given(scene, friction.STATISTICS) is not None:  # else the rules of friction report it
            yield missing(f"{reason}, for which friction.statistics is no substitute", key, "targets")
