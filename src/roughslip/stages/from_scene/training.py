"""Which nodes of the solved strips train the expansion: what the contact stage stores and the fit reads."""

from __future__ import annotations

import numpy as np

from roughslip.limits import TRAINING_SPACING


def training_columns(middle: slice) -> np.ndarray:
    """Columns of a strip whose pressure and gap train the expansion, all of them on its stationary middle."""
    return np.arange(middle.start + TRAINING_SPACING // 2, middle.stop, TRAINING_SPACING)
