"""Figure 2: distribution of the pressure at the centre of the square."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from roughslip.figures.style import Shown, draw_curve, heads, panels, pressure_unit, with_ends

METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "monte_carlo": ("Monte Carlo (MCS)", {"color": "0.15", "linestyle": "-", "linewidth": 2.2}),
    "latin_hypercube": ("Latin hypercube (LHS)", {"color": "C0", "linestyle": ":", "linewidth": 1.8}),
    "equation_8": ("PC, eq. (8)", {"color": "C1", "linestyle": "--"}),
    "equation_9": ("PC, eq. (9)", {"color": "C3", "linestyle": "-."}),
    "roughslip": ("PC, all samples", {"color": "C2", "linestyle": "-", "linewidth": 1.2}),
}
"""Label and look of each method of sampling or expansion; they differ in line style as well as in colour."""

CONTACT = {"monte_carlo": "Monte Carlo", "latin_hypercube": "$K/K_t$, LHS", "roughslip": "PC, all samples"}
LOWEST = 1e-3  # probability, of the logarithmic panels: a design has some 600 samples in contact


def figure2(result: Shown) -> Figure:
    """The paper's panel is (a), the distribution given contact; then low probabilities, and who is in contact.

    Monte Carlo and the Latin hypercube samples of one design, and the expansions fitted to these at surfaces in contact
    """
    figure, (linear, logarithmic, probability) = panels(3, 1, 4.0)
    curves = {"monte_carlo": with_ends(result, "cumulative", method="monte_carlo")}
    curves["latin_hypercube"] = with_ends(result, "design_cumulative")
    curves |= {str(name): with_ends(result, "given_cumulative", variant=name) for name in result["variant"].values}
    unit, name = pressure_unit(float(result["pressure"].max()))
    pressure = unit * result["pressure"]
    for method, (value, *ends) in curves.items():
        label, look = METHODS[method]
        for axes, floor in ((linear, 0.0), (logarithmic, 1e-9)):
            shown = [np.where(value > floor, value, np.nan), *(np.maximum(end, floor) for end in ends)]
            draw_curve(axes, pressure, shown, look | {"label": label}, alpha=0.15)
    solved = curves["monte_carlo"][0]
    first, last = (min(int(np.searchsorted(solved, end)), len(pressure) - 1) for end in (LOWEST / 3, 0.999))
    linear.set(xlabel=f"pressure at the centre [{name}]", ylabel="cumulative probability", ylim=(0, 1))
    linear.set_xlim(0, float(pressure[last]))
    logarithmic.set(xscale="log", yscale="log", ylim=(LOWEST, 1.2), xlabel=f"pressure at the centre [{name}]")
    logarithmic.set_ylabel("cumulative probability")
    if pressure[first] < pressure[-1]:  # not where all low probabilities lie at one pressure, as at the hardness
        logarithmic.set_xlim(pressure[first], pressure[-1])
    for row, (method, label) in enumerate(CONTACT.items()):
        colour = METHODS[method][1]["color"]
        share, low, high = with_ends(result, "contact_probability", 100.0, method=method)
        probability.plot([low, high], [-row, -row], "|-", color=colour)
        probability.plot(share, -row, "o", color=colour)
        probability.annotate(label, (share, -row), xytext=(0, 8), textcoords="offset points", ha="center")
    probability.set(xlabel="probability of contact [%]", ylim=(-2.5, 0.8), yticks=[])
    probability.margins(x=0.3)
    figure.legend(*linear.get_legend_handles_labels(), loc="outside lower center", ncols=len(curves))
    heads(figure.axes, "distribution given contact", "low probabilities", "probability of contact")
    return figure
