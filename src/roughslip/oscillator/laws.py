"""The friction laws by name, and the functions of a law that compiled code calls."""

from __future__ import annotations

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

# The registry: each module adds its law to LAWS.
from roughslip.oscillator.friction_laws import coulomb, stribeck, table  # noqa: F401
