"""Draw speed.png from the kept benchmarks: times of contact and oscillator solves against public solvers.

Run it in the folder of the project: PYTHONPATH=src:. python docs/pictures/speed.py
"""

import json
from pathlib import Path

import seaborn as sns

from roughslip.figures.style import heads, panels, save
from workflow.benchmarks.plot import LOOKS, of_case, plot_methods, seconds

KEPT = Path("results/reference/evidence")
CONTACT = "surface=gauss level=50 tolerance=1e-10"

contact, oscillator = (json.loads((KEPT / f"{name}.json").read_text())["rows"] for name in ("contact", "oscillator"))
figure, (growth, precision) = panels(2, 1, 4.2)
for method, (label, look) in LOOKS.items():
    found = [row for row in contact if row["method"] == method and row["case"].endswith(CONTACT)]
    if found:
        growth.plot([int(of_case(row, "n")) for row in found], [seconds(row) for row in found], label=label, **look)
growth.set(xscale="log", yscale="log", xlabel="nodes on an edge", ylabel="time of a solve [s]", ylim=(None, 100))
growth.set_xticks([64, 128, 256, 512, 1024, 2048], ["64", "128", "256", "512", "1024", "2048"])
growth.minorticks_off()
plot_methods(precision, [row for row in oscillator if of_case(row, "motion") == "deterministic"], seconds)
precision.set(xlabel="time of a cycle [s]", ylabel="relative error", ylim=(None, 10))
for axes in (growth, precision):
    axes.legend(
        loc="upper left" if axes is growth else "upper center", fontsize="x-small", ncols=1 + (axes is precision)
    )
heads((growth, precision), "contact, equal residual", "mass on the belt")
sns.despine(figure)
save(figure, Path("docs/pictures/speed.png"))
