"""The friction laws by name, and the functions of a law that compiled code calls."""

from __future__ import annotations

import importlib.util
import sys
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

from roughslip.errors import ParameterError
from roughslip.oscillator.base_law import (  # noqa: F401
    CONTRACTED,
    LAWS,
    FrictionLaw,
    excess_force,
    friction,
    friction_curvature,
    friction_slope,
    only_row,
    row_at,
    row_ends,
    row_spacing,
)

# The registry: each module of the folder adds its law to LAWS.
from roughslip.oscillator.friction_laws import *  # noqa: F403
from roughslip.oscillator.function_law import friction_law


def law_from_scene(section: Any, mean: float) -> FrictionLaw:
    """The friction law that the section `oscillator` of a scene names, with the mean friction coefficient.

    `my_laws.py:BoPavelescu` is a class in a file of the user, which inherits `FrictionLaw`; or a function of speed, in
    place of the mean. Raises ParameterError where the file has neither.
    """
    if section.law in LAWS:
        return LAWS[section.law].from_scene(section, mean)
    found = _in_file(section.law)
    if isinstance(found, FunctionType):
        return friction_law(found, static=section.static_friction)
    if isinstance(found, type) and issubclass(found, FrictionLaw):
        return found.from_scene(section, mean)
    raise ParameterError(
        f"{section.law} is neither a function of speed nor a class that inherits roughslip.oscillator.FrictionLaw; "
        "scene key: oscillator.law"
    )


@cache
def _in_file(name: str) -> Any:
    """What a file of the user calls so, as `my_laws.py:Mine`. The module has a name by which compiled code finds it."""
    file, _, own = name.rpartition(":")
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    if spec is None or spec.loader is None or not Path(file).is_file():
        raise ParameterError(f"there is no file {file!r} with a friction law; scene key: oscillator.law")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return getattr(module, own, None)
