"""Rules that bound the memory of a scene: each bounds the largest tables of a stage, 1 to 3 GB at the bound."""

from __future__ import annotations

from roughslip.limits import MOST_WINDOWS
from roughslip.scene.contact import CELLS
from roughslip.scene.mistakes import Rule

MOST_TRAINING = 400_000_000  # pressures at all cells of the training strips: 3.2 GB
MOST_PERIODS = 10_000_000  # natural periods of all runs: 2.5 GB of events

_LEVELS = "strip.penetration_percentiles"


def _cells(cell: float, length: float, margin: float, width: float) -> float:
    """Cells of a strip; another rule refuses more than CELLS."""
    return (length + 2 * margin) / cell * (width / cell)


RULES = (
    *(
        Rule(
            (strips, _LEVELS, "strip.length_m", "strip.window_m", "strip.window_spacing_m"),
            lambda n, levels, length, window, spacing: (
                n * len(levels) * ((length - window) / spacing + 1) <= MOST_WINDOWS
            ),
            f"strips times {_LEVELS} times windows of a strip at most {MOST_WINDOWS} (2.5 GB of memory)",
        )
        for strips in ("strip.samples", "strip.expansion_samples")
    ),
    Rule(
        ("strip.training_samples", _LEVELS, "strip.cell_m", "strip.length_m", "strip.margin_m", "strip.width_m"),
        lambda n, levels, *lengths: not MOST_TRAINING / n / len(levels) < _cells(*lengths) <= CELLS,
        f"strips times {_LEVELS} times cells of a strip at most {MOST_TRAINING} (3.2 GB of memory)",
    ),
    Rule(
        ("ensemble.realisations", "ensemble.duration_periods"),
        lambda runs, periods: runs * periods <= MOST_PERIODS,
        f"realisations times ensemble.duration_periods = {{1}} at most {MOST_PERIODS} (2.5 GB of memory)",
    ),
    Rule(
        ("ensemble.realisations", "ensemble.damping_ratios"),
        lambda runs, ratios: runs * len(ratios) <= MOST_PERIODS,
        f"realisations times the number of ensemble.damping_ratios at most {MOST_PERIODS} (2 GB of memory)",
    ),
)
