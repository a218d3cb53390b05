"""From which initial states the mass comes to stick-slip without scatter, and from which to steady sliding."""

from matplotlib.figure import Figure

from roughslip.figures.style import Arrays, despine, legend_above, panels, with_interval_names

CURVES = {"from_rest": ("from rest on the belt", "-"), "unstable": ("unstable cycle", "--")}
DRAWN = {
    "figure_basins": [
        *("basin_position", "basin_velocity", "ends_in_stick_slip", *with_interval_names("basin_share")),
        *(f"{name}_{part}" for name in CURVES for part in ("position", "velocity")),
    ]
}


def figure_basins(result: Arrays) -> Figure:
    """States of the plane by where they end, the motion from rest, and the unstable cycle between."""
    figure, _ = panels(1, 1, 6.0)
    (axes,) = figure.axes
    sticks = result["ends_in_stick_slip"] > 0
    for chosen, colour, label in ((sticks, "C3", "ends in stick-slip"), (~sticks, "C0", "ends in steady sliding")):
        x, v = result["basin_position"][chosen], result["basin_velocity"][chosen]
        axes.plot(1e3 * x, v, ".", color=colour, ms=3.0, label=label)
    for name, (label, style) in CURVES.items():
        x, v = result[f"{name}_position"], result[f"{name}_velocity"]
        if x.size:
            axes.plot(1e3 * x, v, style, color="0.1", lw=1.2, label=label)
    axes.set(xlabel="position $x$ [mm]", ylabel="velocity [m/s]")
    legend_above(axes)
    low, high = (100 * float(result[f"basin_share_{end}"]) for end in ("low", "high"))
    share = 100 * float(result["basin_share"])
    axes.set_title(f"{share:.0f} % of the states end in stick-slip [{low:.0f}, {high:.0f}]", loc="left")
    despine(axes)
    return figure
