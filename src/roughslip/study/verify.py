"""Stage verify: compare this run with the kept results, and every result file with its checksum."""

from dataclasses import asdict
from pathlib import Path

from roughslip import store
from roughslip.errors import StoreError
from roughslip.scene.types import Scene
from roughslip.study.files import checksum
from roughslip.study.job import Job
from roughslip.verdicts.kept_results import Compared, compared_claims, compared_friction, compared_summaries


def compared(folder: Path, kept: Path) -> list[Compared]:
    """Claims and summary of a scene, and its friction where a direct reference is kept."""
    rows = compared_claims(*(store.read_json(where / "claims.json") for where in (folder, kept)))
    rows += compared_summaries(*((where / "summary.csv").read_text(encoding="utf-8") for where in (folder, kept)))
    if (kept / "friction.nc").is_file():
        statistics = store.read(folder / "friction" / "statistics.nc")
        rows += compared_friction(statistics, store.read(kept / "friction.nc"))
    return rows


def recorded(folder: Path) -> dict[Path, str]:
    """Checksums of all files of a scene by their names, from the records of cost."""
    records = [store.read_json(path) for path in sorted((folder / "usage").glob("*.json"))]
    return {folder / name: file["sha256"] for record in records for name, file in record["made"].items()}


def work(scene: Scene, job: Job) -> None:
    """Write what was compared, and in words what moved; raise StoreError with a line for all that disagrees."""
    lines: list[str] = []
    moved: list[str] = []
    tables: dict[str, list[Compared]] = {}
    count = 0
    for folder in job.paths("scenes"):
        files = recorded(folder)
        count += len(files)
        lines += [
            f"{file}: its contents differ from the checksum of its record; {store.rebuild(file)}"
            for file, sha256 in files.items()
            if not file.is_file() or checksum(file) != sha256
        ]
        rows = compared(folder, job.path("reference") / folder.name)
        lines += [
            f"{folder}: {row.name}: {row.ours} for {row.kept}; allowed: {row.allowed}" for row in rows if not row.agrees
        ]
        moved += [f"  {folder.name}: {row.name}: {row.ours}, kept {row.kept}" for row in rows if row.moved]
        tables[folder.name] = rows
        job.count(files=len(files), numbers=len(rows), moved=sum(row.moved for row in rows))
    store.write_json(job.output, {name: [asdict(row) for row in rows] for name, rows in tables.items()})
    numbers = sum(map(len, tables.values()))
    head = f"{numbers} numbers and verdicts agree with the kept ones, {count} files agree with their checksums"
    store.write_text(job.outputs["text"], "\n".join((f"{head}; {len(moved)} moved within what is allowed", *moved, "")))
    if lines:
        raise StoreError("\n".join((f"{len(lines)} of what was compared disagree:", *lines)))
