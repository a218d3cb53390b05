"""CPU seconds of whole scenes by stage, with compiling ("cold") and without ("warm").

python -m workflow.benchmarks.study measures smoke and the default scenes, a row a scene. With --shows it prints the
numbers of the last run of smoke next to the kept ones.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from roughslip import store

SCENES = ("smoke", "paper", "resolved")
KEPT = Path("results/reference/evidence/study.json")


def seconds(results: Path, scene: str) -> dict[str, float]:
    """CPU seconds by stage, and of "all", of a scene that was run."""
    rows = json.loads((results / scene / "costs.json").read_text(encoding="utf-8"))
    return {row["stage"]: row["cpu_seconds"] for row in rows}


def measured() -> list[dict[str, Any]]:
    """A row for each scene, cold and warm, from two runs of all scenes in a folder of their own, a job at a time."""
    root, rows = Path.cwd(), []
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "NUMBA_CACHE_DIR": f"{folder}/numba"}
        for code in ("cold", "warm"):
            where = Path(folder, code)
            command = [sys.executable, "-m", "snakemake", "-s", str(root / "Snakefile"), "-j1", "-d", str(where)]
            subprocess.run([*command, *SCENES], env=environment, check=True)
            rows += [{"case": f"scene={one} code={code}", "seconds": seconds(where / "results", one)} for one in SCENES]
    return rows


def shown(own: dict[str, float], kept: dict[str, float]) -> str:
    """A line for each stage: the seconds of two runs, and the whole last."""
    names = [*sorted({*own, *kept} - {"all"}), "all"]
    return "\n".join(f"{name:16}{own.get(name, 0.0):8.1f} CPU s, kept {kept.get(name, 0.0):8.1f}" for name in names)


def main() -> None:
    """Measure, or print."""
    if "--shows" in sys.argv:
        rows = json.loads(KEPT.read_text(encoding="utf-8"))["rows"] if KEPT.is_file() else []
        kept = {row["case"]: row["seconds"] for row in rows}.get("scene=smoke code=warm", {})
        print(shown(seconds(Path("results"), "smoke"), kept))
        return
    text = json.dumps({"versions": store.versions(), "rows": measured()}, indent=1)
    store.write_text(Path("results/benchmarks/study.json"), f"{text}\n")


if __name__ == "__main__":
    main()
