"""The files of a full run that the repository keeps, for readers and for comparison."""

from __future__ import annotations

import shutil
from pathlib import Path

from roughslip.atomic_write import replacing
from roughslip.errors import StoreError

KEPT = ("figure2.png", "figure3.png", "figure5.png", "claims.json", "costs.json", "summary.csv")


def keep(results: Path, reference: Path) -> None:
    """Copy the kept files of a scene's results. Raises StoreError where one is missing: the scene is not complete."""
    missing = [name for name in KEPT if not (results / name).is_file()]
    if missing:
        raise StoreError(f"{results}: lacks {', '.join(missing)}; only scenes with every target can be kept")
    for name in KEPT:
        with replacing(reference / name) as temporary:
            shutil.copyfile(results / name, temporary)
