"""CPU seconds of whole scenes by stage, with compiling ("cold") and without ("warm"), a row a scene.

With --shows it prints those of the last run of smoke next to the kept ones.
"""

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
    """CPU seconds by stage, the whole last, of a scene that was run."""
    return {row["stage"]: row["cpu_seconds"] for row in store.read_json(results / scene / "costs.json")}


def measured() -> list[dict[str, Any]]:
    """Rows from two runs of all scenes in folders of their own, a job at a time."""
    rows, snakefile = [], str(Path("Snakefile").resolve())
    with tempfile.TemporaryDirectory() as folder:
        for code in ("cold", "warm"):
            command = [sys.executable, "-m", "snakemake", "-s", snakefile, "-j1", "-d", f"{folder}/{code}", *SCENES]
            subprocess.run(command, env={**os.environ, "NUMBA_CACHE_DIR": f"{folder}/numba"}, check=True)
            results = Path(folder, code, "results")
            rows += [{"case": f"scene={one} code={code}", "seconds": seconds(results, one)} for one in SCENES]
    return rows


if __name__ == "__main__":
    if "--shows" in sys.argv:
        kept = {row["case"]: row["seconds"] for row in (store.read_json(KEPT)["rows"] if KEPT.is_file() else ())}
        before = kept.get("scene=smoke code=warm", {})
        for name, own in seconds(Path("results"), "smoke").items():
            print(f"{name:16}{own:8.1f} CPU s, kept {before.get(name, 0.0):8.1f}")
    else:
        text = json.dumps({"versions": store.versions(), "rows": measured()}, indent=1)
        store.write_text(Path("results/benchmarks/study.json"), f"{text}\n")
