"""Rules that tie several keys of a scene together: those of each section, those between sections, those of targets."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS, TRAINING_NODES, TRAINING_SPACING, VARIABLE_COUNTS
from roughslip.scene import ensemble, expansion, friction, oscillator, roughness, running, square, stick_slip_map
from roughslip.scene.expansion import AUTO, BEST, terms
from roughslip.scene.mistakes import Mistake, Values, given, missing, refused, strictly_increasing
from roughslip.scene.plan import needs, stages_needed

# In an overlay, by section: keys that a key replaces, where the overlay does not give those too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    **friction.REPLACES,
    **square.REPLACES,
    **roughness.REPLACES,
    **expansion.REPLACES,
    **oscillator.REPLACES,
    **ensemble.REPLACES,
}


class _Rule(NamedTuple):
    keys: tuple[str, ...]  # of the values that `holds` takes; the first is the one refused
    holds: Callable[..., bool]
    allowed: str  # a format of the same values


FEWEST, MOST = VARIABLE_COUNTS[0], VARIABLE_COUNTS[-1]
_MEMORY = f"{MOST_NUMBERS} (0.8 GB of memory)"
_TERMS = ("expansion.variables", "expansion.degree")
_CELLS, _ROWS = 4_000_000, 3  # of a strip at most, and across it at least
_DRAWS = 10  # over the square of cdf_error: draws then add 1.36 / sqrt(10) of that error, with 95 %
_MULTIPLES = {
    "cell_m": "length_m margin_m width_m window_m window_spacing_m expansion_spacing_m",
    "expansion_spacing_m": "length_m window_m window_spacing_m",
}


def training_columns(columns: float) -> int:
    """Columns of a strip that train the expansion, as from_scene.geometry counts them."""
    return math.ceil((columns - TRAINING_SPACING // 2) / TRAINING_SPACING) if columns < _CELLS else _CELLS


def _is_multiple(length: float, cell: float) -> bool:
    cells = length / cell
    return math.isfinite(cells) and abs(cells - round(cells)) <= 1e-9 * cells


_RULES = (
    _Rule(("square.modes", "square.nodes"), lambda m, n: m <= n**2, "at most square.nodes^2 = {1}^2"),
    _Rule(
        ("square.modes", "square.nodes"),
        lambda m, n: m > n**2 or m * n**2 <= MOST_NUMBERS,
        f"modes times nodes^2 at most {_MEMORY}, here with {{1}} nodes",
    ),
    _Rule(
        ("expansion.variables", "square.modes"),
        lambda v, modes: (FUNCTIONALS if v == BEST else v) <= modes,
        f"at most square.modes = {{1}}, of which {BEST} takes {FUNCTIONALS} or more",
    ),
    *(
        rule
        for samples in ("expansion.samples", "square.latin_hypercube_samples")
        for rule in (
            _Rule(
                (samples, "square.modes"),
                lambda n, modes: n == AUTO or n * modes <= MOST_NUMBERS,
                f"samples times square.modes = {{1}} at most {_MEMORY}",
            ),
            _Rule(
                (samples, *_TERMS),
                lambda n, v, d: n == AUTO or n > terms(v, d, FEWEST),
                "more than the terms of the expansion, C({1} + {2}, {2})",
            ),
            _Rule(
                (samples, *_TERMS),
                lambda n, v, d: n == AUTO or n <= terms(v, d, FEWEST) or n * terms(v, d, MOST) <= MOST_NUMBERS,
                f"samples times terms, C({{1}} + {{2}}, {{2}}), at most {_MEMORY}",
            ),
        )
    ),
    _Rule(
        ("expansion.samples", *_TERMS),
        lambda n, v, d: n != AUTO or TRAINING_NODES * terms(v, d, MOST) * 2 ** terms(v, d).bit_length() <= MOST_NUMBERS,
        f"a lower expansion.degree, because more samples than C({{1}} + {{2}}, {{2}}), at {TRAINING_NODES} nodes each, "
        f"give tables above {_MEMORY}",
    ),
    _Rule(
        ("expansion.draws", "expansion.cdf_error"),
        lambda draws, error: draws * error**2 >= _DRAWS,
        f"at least {_DRAWS} / expansion.cdf_error^2, or the draws alone err by as much as {{1}}",
    ),
    *(
        _Rule((f"strip.{length}", f"strip.{step}"), _is_multiple, f"a whole multiple of strip.{step} = {{1}} [m]")
        for step, lengths in _MULTIPLES.items()
        for length in lengths.split()
    ),
    _Rule(
        ("strip.length_m", "strip.window_m"),
        lambda length, window: length >= 4 * window,
        "at least four times strip.window_m = {1} [m], for lags of three windows",
    ),
    _Rule(
        ("strip.window_spacing_m", "strip.window_m"),
        lambda spacing, window: 2 * spacing <= window * (1 + 1e-9),
        "at most half of strip.window_m = {1} [m], for lags within the window",
    ),
    _Rule(
        ("strip.width_m", "strip.cell_m"),
        lambda width, cell: not _is_multiple(width, cell) or round(width / cell) >= _ROWS,
        f"at least {_ROWS} times strip.cell_m = {{1}} [m], for slope and curvature across the strip",
    ),
    _Rule(
        ("strip.length_m", "roughness.correlation_length_m"),
        lambda length, correlation: length >= 8 * correlation,
        "at least eight times roughness.correlation_length_m = {1} [m]",
    ),
    _Rule(
        ("roughness.fractal.longest_wavelength_m", "roughness.fractal.shortest_wavelength_m"),
        lambda longest, shortest: longest >= shortest,
        "at least roughness.fractal.shortest_wavelength_m = {1} [m]",
    ),
    _Rule(
        ("roughness.fractal.longest_wavelength_m", "strip.length_m"),
        lambda longest, length: longest <= length,
        "at most strip.length_m = {1} [m]",
    ),
    _Rule(
        ("roughness.fractal.shortest_wavelength_m", "strip.cell_m"),
        lambda shortest, cell: shortest > 2 * cell,
        "more than two cells, strip.cell_m = {1} [m]",
    ),
    _Rule(
        ("strip.expansion_spacing_m", "strip.cell_m", "roughness.fractal"),
        lambda spacing, cell, fractal: spacing == cell or fractal.get("shortest_wavelength_m", 0.0) > 2 * spacing,
        "strip.cell_m = {1} [m], or less than half of roughness.fractal.shortest_wavelength_m",
    ),
    _Rule(
        ("targets", "roughness.fractal"),
        lambda targets, _: not {"figure2", "figure_field"}.intersection(targets),
        "figure2 and figure_field expand the pressure in Gaussian variables, and roughness.fractal has a phase a wave",
    ),
    _Rule(
        ("strip.cell_m", "strip.length_m", "strip.margin_m", "strip.width_m"),
        lambda cell, length, margin, width: (length + 2 * margin) / cell * (width / cell) < _CELLS + 0.5,
        f"at most {_CELLS} cells on the strip of {{1}} + 2 x {{2}} by {{3}} m",
    ),
    _Rule(("strip.penetration_percentiles",), strictly_increasing, "strictly increasing percentiles"),
    _Rule(
        ("strip.penetration_percentiles", "friction.mean_at_median"),
        lambda percentiles, _: 50 in percentiles,
        "50 among them: friction.mean_at_median sets the shear strength there",
    ),
    _Rule(
        ("strip.training_samples", "strip.length_m", "strip.cell_m", "expansion.degree"),
        lambda n, length, cell, d: n > 1 and n * training_columns(length / cell) > terms(FUNCTIONALS, d),
        f"at least 2, and enough that every {TRAINING_SPACING}th column gives more samples than "
        f"C({FUNCTIONALS} + {{3}}, {{3}})",
    ),
    _Rule(
        ("expansion.target", "strip.training_samples"),
        lambda target, _: target != "censored",
        "trial_pressure, squared_pressure or best: along the strip no regression is censored",
    ),
    _Rule(("strip.training_samples", "strip.samples"), lambda t, s: t <= s, "at most strip.samples = {1}"),
    _Rule(("strip.expansion_samples", "strip.samples"), lambda e, s: e >= 2 * s, "at least twice strip.samples = {1}"),
    _Rule(
        ("ensemble.discarded_periods", "ensemble.duration_periods"),
        lambda discarded, duration: discarded < duration,
        "less than ensemble.duration_periods = {1}",
    ),
    _Rule(
        ("ensemble.drawn_realisations", "ensemble.realisations"),
        lambda drawn, realisations: drawn <= realisations,
        "at most ensemble.realisations = {1}",
    ),
    _Rule(("ensemble.damping_ratios",), strictly_increasing, "strictly increasing damping ratios"),
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
    found: list[Mistake] = []
    for section in _SECTIONS:
        if isinstance(scene.get(section), dict):
            found += _SECTIONS[section].mistakes(scene)
    found += stick_slip_map.mistakes(scene)
    yield from (mistake for mistake in found if all(map(sound, mistake.keys)))
    unread = _sections_not_read(scene) if scene.get("targets") and sound("targets") else set()
    for keys, holds, allowed in _RULES:
        values = [given(scene, key) for key in keys]
        known = all(value is not None for value in values) and all(map(sound, keys))
        if known and unread.isdisjoint(key.partition(".")[0] for key in keys) and not holds(*values):
            yield refused(values[0], allowed.format(*values), *keys)


_SECTIONS = {
    "friction": friction,
    "square": square,
    "expansion": expansion,
    "batches": running,
    "oscillator": oscillator,
    "ensemble": ensemble,
    "roughness": roughness,
}


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
            section = key.split(".")[0]
            lacking = key if section in scene else section
            if given(scene, lacking) is None and sound(lacking) and target not in absent.setdefault(lacking, []):
                absent[lacking].append(target)
    for key, targets in absent.items():
        reason = f"needed for {', '.join(targets)}"
        if key != "friction.mean_at_median":
            yield missing(reason, key, "targets")
        elif given(scene, friction.STATISTICS) is not None:  # else the rules of friction report it
            yield missing(f"{reason}, for which friction.statistics is no substitute", key, "targets")
