"""The whole study from Python: run a scene, read its verdicts and results. Needs a clone of the project and its .venv.

python examples/whole_study.py [scene]    a minute for `smoke`, the tiny scene that it runs by default
"""

import json
import subprocess
import sys
from pathlib import Path

from roughslip import read

PROJECT = Path(__file__).resolve().parents[1]
scene = sys.argv[1] if len(sys.argv) > 1 else "smoke"
subprocess.run([sys.executable, "-m", "snakemake", "-j2", scene, "--quiet"], cwd=PROJECT, check=True)

folder = PROJECT / "results" / scene
for claim in json.loads((folder / "claims.json").read_text(encoding="utf-8")):
    print(f"{claim['verdict']:22} {claim['statement']}")

friction = read(folder / "friction" / "statistics.nc")  # of xarray, with units
for percentile, mu in zip(friction["percentile"].values, friction["combined_mean"].values, strict=True):
    print(f"at {percentile:g} % of the heights above the plane: friction coefficient {mu:.3f}")
print(f"the page: {folder / 'report.html'}")
