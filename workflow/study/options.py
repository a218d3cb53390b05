"""Numbers that `--config` gives on Snakemake's command line, or a profile."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from roughslip.errors import InputError
from roughslip.scene.strict_yaml import shown

WHOLE_NUMBERS = ("memory_mb", "problems", "reference_surfaces", "reference_strips")


def whole_numbers(config: Mapping[str, Any]) -> dict[str, int | None]:
    """Those of WHOLE_NUMBERS that are given, None for the others.

    Raises InputError with a line for each that is no whole number from 1.
    """
    wrong = [
        f"--config {name}: {shown(config[name])} is not allowed; a whole number from 1"
        for name in WHOLE_NUMBERS
        if name in config and (type(config[name]) is not int or config[name] < 1)
    ]
    if wrong:
        raise InputError(wrong)
    return {name: config.get(name) for name in WHOLE_NUMBERS}
