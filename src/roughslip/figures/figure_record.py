"""The figure of a friction record: its curve, the scatter about it, and synthetic records next to it."""

from textwrap import fill

from matplotlib.figure import Figure

from roughslip.figures.style import Shown, draw_curve, heads, legend_above, panels, with_ends

RECORD, CURVE, TWIN = "0.15", "C0", "C1"
WIDEST = 150  # letters in a line across the figure


def figure_record(result: Shown) -> Figure:
    """Record, curve with its band, residuals, autocovariance, and two synthetic records."""
    figure, grid = panels(3, 2, 4.3)
    time, friction, explained = (result[f"sample_{name}"] for name in ("time", "friction", "explained"))
    speed, kind, form = result["sample_speed"], str(result["kind"].item()), str(result["curve_form"].item())
    kind = "additive or multiplicative" if kind == "cannot tell" else kind
    axes = grid.ravel()
    axes[0].plot(time, friction, color=RECORD, lw=0.5, label="measured")
    axes[0].plot(time, explained, color=CURVE, lw=1.2, label="curve, drift and period")
    axes[1].plot(1e3 * speed, friction, ".", color="0.7", ms=1.5, label="measured")
    look = {"color": CURVE, "lw": 1.6, "label": f"{form} (95 %)"}
    draw_curve(axes[1], 1e3 * result["curve_speed"], with_ends(result, "curve"), look, alpha=0.4)
    axes[1].set(xlabel="sliding speed [mm/s]", ylabel="friction coefficient", xscale="log")
    axes[2].plot(time, friction - explained, color=RECORD, lw=0.5)
    axes[2].set(xlabel="time of sliding [s]", ylabel="residual of friction")
    axes[3].plot(1e3 * result["lag"], result["covariance"], ".", color=RECORD, label="residuals, noise at 0")
    axes[3].plot(1e3 * result["lag"], result["covariance_fit"], color=CURVE, label="fitted scatter, exponential")
    if "surface_covariance" in result:
        by_law = result["surface_covariance"]
        axes[3].plot(1e3 * result["lag"], by_law, color="C2", label="surface, law of scatter to 10 %")
        axes[3].fill_between(1e3 * result["lag"], 0.81 * by_law, 1.21 * by_law, color="C2", alpha=0.3, lw=0.0)
    share = float(result["additive_std_low"]) ** 2, float(result["additive_std_high"]) ** 2
    axes[3].vlines(0.0, *share, color=CURVE, lw=4.0, alpha=0.4)
    axes[3].axhline(0.0, color="0.6", lw=0.6)
    axes[3].set(xlabel="slipped distance [mm]", ylabel="autocovariance")
    labels = {"xlabel": "time of sliding [s]", "ylabel": "friction coefficient"}
    axes[0].set(**labels)
    for panel, twin in zip(axes[4:], result["twin"], strict=True):
        panel.plot(time, twin, color=TWIN, lw=0.5)
        panel.set(ylim=axes[0].get_ylim(), **labels)
    for panel in (axes[0], axes[1]):
        legend_above(panel)
    legend_above(axes[3], columns=1)
    heads(axes, "the record", "mean curve", "residuals", f"scatter, {kind}", "a synthetic record", "another one")
    notes = f"Notes: {'; '.join(map(str, result['note'].values))}"
    figure.suptitle(fill(notes, WIDEST, max_lines=3, placeholder=" ..."), fontsize="small")
    return figure
