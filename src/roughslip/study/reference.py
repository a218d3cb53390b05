"""Stage reference: the small results that the repository keeps, copied from a full run."""

import shutil
from pathlib import Path

from roughslip.atomic_write import replacing
from roughslip.errors import StoreError
from roughslip.scene.types import Scene
from roughslip.study.job import Job

KEPT = (*("figure_chain.png", "figure2.png", "figure3.png", "figure5.png"), "claims.json", "costs.json", "summary.csv")


def keep(results: Path, reference: Path) -> None:
    """Copy the kept files of a scene's results. Raises StoreError where one is missing: the scene is not complete."""
    missing = [name for name in KEPT if not (results / name).is_file()]
    if missing:
        raise StoreError(f"{results}: lacks {', '.join(missing)}; only scenes with every target can be kept")
    for name in KEPT:
        with replacing(reference / name) as temporary:
            shutil.copyfile(results / name, temporary)


def work(scene: Scene, job: Job) -> None:
    """Copy the figures, claims, costs and summaries of each scene below the output folder."""
    for folder in job.paths("scenes"):
        keep(folder, job.output / folder.name)
    job.count(files=len(KEPT) * len(job.paths("scenes")))
