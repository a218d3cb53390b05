"""The two forms of `expansion.samples`, a number or an error for which it is found, and the keys that go with each."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from roughslip.scene_roughness import Mistake
from roughslip.scene_yaml import shown

AUTO = "auto"
BEST = "best"  # number of variables
FEWEST, GIVEN, MOST = 2, 8, 12  # variables that it is chosen from, as in chaos/selection.py, and local functionals
EXTENDED = ("sobol", "monte_carlo")  # designs that can be
SAMPLES, ERROR, DESIGN = "expansion.samples", "expansion.cdf_error", "expansion.design"


def terms(variables: int | str, degree: int, best: int = GIVEN) -> int:
    """Terms of an expansion; where the best number of variables is to be found, those of so many."""
    return math.comb((best if isinstance(variables, str) else variables) + degree, degree)


# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"expansion": {"samples": ("cdf_error",)}}


def mistakes(expansion: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go with the samples; what the schema refuses is left to it."""
    samples, error, design = (expansion.get(key) for key in ("samples", "cdf_error", "design"))
    if samples == AUTO:
        if error is None:
            yield Mistake((ERROR, SAMPLES), f"missing; {SAMPLES} = {AUTO} needs it")
        if design is not None and design not in EXTENDED:
            text = f"{shown(design)} is not allowed; {' or '.join(EXTENDED)} with {SAMPLES} = {AUTO}, to be extended"
            yield Mistake((DESIGN, SAMPLES), text)
    elif samples is not None and error is not None:
        text = f"{shown(error)} is not allowed beside {SAMPLES} = {shown(samples)}; only {AUTO} takes it"
        yield Mistake((ERROR, SAMPLES), text)
