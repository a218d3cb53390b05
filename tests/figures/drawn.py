"""Results to draw, and checks that hold of every figure."""

from itertools import pairwise

import numpy as np

from roughslip.figures.figure2 import METHODS
from roughslip.figures.figure_chain import CYCLE
from roughslip.figures.figure_scan import NUMBERS

DAMPING = np.array([0.05, 0.1, 0.17, 0.2, 0.23, 0.25, 0.27, 0.28, 0.29, 0.3, 0.31, 0.32, 0.3225, 0.325, 0.34, 0.4])


class Recorded(dict):
    """A result that remembers what was read."""

    def __init__(self, arrays):
        super().__init__(arrays)
        self.read = set()

    def __getitem__(self, name):
        self.read.add(name)
        return super().__getitem__(name)


def with_interval(name, value, half):
    value = np.asarray(value, dtype=float)
    return {name: value, f"{name}_low": value - half, f"{name}_high": value + half}


def assert_all_is_in_its_place(figure):
    """Nothing is cut at the edges of the picture, no title reaches the next panel, and no legend covers data.

    At the size that is saved; a point of slack for rounding. The layout is made and nothing is drawn.
    """
    figure.get_layout_engine().execute(figure)
    if figure.get_suptitle():
        box = figure._suptitle.get_window_extent()
        assert figure.bbox.x0 < box.x0 < box.x1 < figure.bbox.x1
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1 + 1
        assert figure.bbox.y0 <= box.y0
        assert box.y1 <= figure.bbox.y1 + 1
        assert np.all(np.isfinite([*axes.get_xlim(), *axes.get_ylim()]))
    titles = [axes._left_title.get_window_extent() for axes in figure.axes if axes.get_title(loc="left")]
    for one, after in pairwise(titles):
        assert one.x1 < after.x0 or one.y0 > after.y1


def assert_no_legend_covers_data(figure):
    """In a figure that has been laid out."""
    for axes in figure.axes:
        if (legend := axes.get_legend()) is None:
            continue
        inside, box = axes.get_window_extent(), legend.get_window_extent()
        assert box.x0 >= inside.x0 - 1
        assert box.x1 <= inside.x1 + 1, axes.get_title(loc="left")
        assert box.y1 <= inside.y1 + 1
        for artist in (*axes.lines, *axes.patches):
            path = artist.get_path().transformed(artist.get_transform())
            assert not path.intersects_bbox(box, filled=False), (axes.get_title(loc="left"), artist.get_label())
        for collection in axes.collections:
            for path in collection.get_paths():
                assert not path.transformed(collection.get_transform()).intersects_bbox(box, filled=False)


def square(*, count=200, scale=1e8):
    """Exponential pressures; eq. (9) far off, as it is in the study."""
    pressure = scale * np.geomspace(1e-3, 8.0, count)
    curve = 1 - np.exp(-pressure / scale)
    rows = np.array([curve, curve, curve**0.8, curve**0.1, curve**1.1])
    given = np.array([curve**1.1, curve**0.8])
    shares = [0.16, 0.158, 0.158, 0.158, 0.165]
    return {
        "method": np.array(list(METHODS)),
        "pressure": pressure,
        "distance_in_contact": np.array([0.0, 0.02, 0.14, 0.76, 0.013]),
        **{
            name: np.clip(values, 0, 1)
            for one, curves in (("cumulative", rows), ("design_cumulative", curve**0.9), ("given_cumulative", given))
            for name, values in with_interval(one, curves, 0.03).items()
        },
        **with_interval("contact_probability", shares, 0.01),
        "variant": np.array(list(METHODS)[2:4]),
        "first_variable": np.exp(-((np.linspace(-4, 6, 50) - 1.5) ** 2)) / np.sqrt(np.pi),
        "first_variable_edge": np.linspace(-4, 6, 51),
    }


def refused():
    """Eqs. (8) and (9) with no more samples in contact than coefficients."""
    result = square()
    for name in ("cumulative", "cumulative_low", "cumulative_high", "distance_in_contact"):
        result[name] = np.where(
            np.array([0, 0, 1, 1, 0]).reshape(-1, *[1] * (result[name].ndim - 1)), np.nan, result[name]
        )
    return result | {name: np.nan * result[name] for name in result if name.startswith("given_")}


def friction(percentile=(5, 10, 20, 30, 40, 50, 60, 70, 80, 90, 95), length=300e-6, lightest=0.0):
    percentile = np.array(percentile, dtype=float)
    lag = 15e-6 * np.arange(121)
    mean, std = 0.4 - 0.001 * percentile, 0.1 / (1 + percentile / 10)
    both = np.ones((2, 1))
    skewness = 0.3 + lightest * (percentile == percentile[0])
    curves = np.exp(-lag / length) * np.ones((len(percentile), 1))
    return {
        "source": np.array(["solved", "expansion"]),
        "percentile": percentile,
        "lag": lag,
        "triangle": np.maximum(0, 1 - lag / 600e-6),
        "length_name": np.array(["least_squares", "one_over_e", "log_line"]),
        "triangle_length": np.array([320e-6, 379e-6, 271e-6]),
        **{f"beta_{name}": np.full(len(percentile), v) for name, v in zip("ab", (299.7, 300.0), strict=True)},
        "beta_at_bound": np.ones(len(percentile), dtype=np.int8),
        "beta_lower": np.full(len(percentile), 0.2),
        "beta_upper": np.full(len(percentile), 0.5),
        **with_interval("combined_mean", mean, 0.002),
        **with_interval("combined_std", std, 0.002),
        **with_interval("combined_variation", std / mean, 0.01),
        **with_interval("mean", both * mean, 0.004),
        **with_interval("std", both * std, 0.004),
        **with_interval("combined_autocorrelation", curves, 0.2),
        "fit_percentile": percentile,
        **with_interval("fit", mean, 0.002),
        **with_interval("combined_length_least_squares", np.full(len(percentile), length), 30e-6),
        "beta_distance_standardised": 0.03 + 0.0002 * percentile,
        "beta_nearest": np.array(int(lightest > 0.0)),
        "standard_edge": np.linspace(-4.0, 6.0, 41),
        "standard_histogram": np.exp(-(np.linspace(-4, 6, 40) ** 2) / 2) / 2.5 * np.ones((len(percentile), 1)),
        **with_interval("combined_skewness", skewness, 0.2),
        **with_interval("combined_kurtosis", skewness**2, 0.4),
    }


def oscillator(runs=12, damping=DAMPING):
    """The shape that Figure 5 has: M_d near 91 up to the limit, then 0; the ensemble loses the cycle before it."""
    angle = np.linspace(0, 2 * np.pi, 400)
    cycles = np.where(damping < 0.3244, 91, 0)
    mean = 91 / (1 + np.exp((damping - 0.3) / 0.01))
    edges = np.linspace(2e-3, 5e-3, 49)
    density = np.exp(-((edges[1:] - 3.3e-3) ** 2) / (2 * 3e-4**2))
    return {
        "position": np.array([7e-3 + (4e-3 + 1e-4 * k) * np.cos(angle) for k in range(runs)]),
        "velocity": np.array([(3e-3 + 1e-4 * k) * np.sin(angle) for k in range(runs)]),
        "deterministic_position": 7e-3 + 4e-3 * np.cos(angle),
        "deterministic_velocity": 3e-3 * np.sin(angle),
        "histogram": density / density.sum() / np.diff(edges),
        "histogram_edge": edges,
        "reattachment_mean": np.array(3.3e-3),
        "reattachment_std": np.array(3e-4),
        "deterministic_reattachment": np.array(3.28e-3),
        "nominal_damping": np.array(0.17),
        "damping_ratio": damping,
        "deterministic_cycles": cycles,
        "mean_cycles": mean,
        **with_interval("difference", cycles - mean, 2.0),
        "friction_percentile": np.array(50.0),
        "deterministic_hopf_damping": np.array(0.2311),
        "deterministic_existence_limit": np.array(0.3244),
    }


def sampled(name, value, spread):
    return {f"twin_{name}": np.asarray(value) + spread * np.linspace(-1, 1, 19)[(..., *[None] * np.ndim(value))]}


def scan_result(*, sufficient=1):
    """A surface of Sq 0.3 um with grooves along x, whose numbers lie in intervals of a tenth of them."""
    lag_x, lag_y = 1e-6 * np.arange(-30, 31), 1e-6 * np.arange(-10, 11)
    table = np.exp(-np.hypot(lag_x[:, None] / 1e-5, lag_y / 3e-6))
    edges = 6e-8 * np.arange(-20, 16)
    density = np.exp(-((edges[1:] / 3e-7) ** 2) / 2) / 3e-7 / np.sqrt(2 * np.pi)
    wavenumber = np.geomspace(1e5, 6e6, 20)
    power = 1e-24 / (1 + (wavenumber / 3e5) ** 3)
    heights = 3e-7 * np.random.default_rng(1).standard_normal((64, 48))
    values = dict(zip(NUMBERS, (3e-7, -0.6, 4.1, 1e-5, 3e-6, 0.01), strict=True))
    result = {
        "map": heights, "twin_map": heights[::-1],
        "map_x": 1e-6 * np.arange(0.5, 64), "map_y": 1e-6 * np.arange(0.5, 48),
        "lag_x": lag_x, "lag_y": lag_y, "density_edge": edges, "wavenumber": wavenumber, "sufficient": sufficient,
        "no_twins": np.array([""]), "outliers": np.array(0), "map_outlier": np.zeros((64, 48), dtype=int),
        "read": np.array(
            [
                "channel 'Surface topography, levelled' of 3 with heights (Surface topography, levelled, Raw) in µm; "
                "506 x 461 of 512 x 512 points used, 11.1% cut off as empty rim, 0.5123 x 0.5123 µm apart; "
                "1234 missing (0.53 %), interpolated"
            ]
        ),
        "model": np.array(["self affine covariance, hurst 0.812, bandwidth 35.2, best of 5 models"]),
        **with_interval("correlation", table, 0.05),
        **with_interval("density", density, 0.05 / 3e-7),
        "power": power, "power_low": power / 2, "power_high": power * 2,
        **sampled("correlation_x", table[:, 10], 0.02),
        **sampled("correlation_y", table[30], 0.02),
        **sampled("density", density, 0.02 / 3e-7),
        "twin_power": np.outer(np.linspace(0.9, 1.1, 19), power),
    }  # fmt: skip
    for name, value in values.items():
        result |= with_interval(name, value, abs(value) / 10) | sampled(name, value, abs(value) / 5)
    return result


def scan_alone():
    """The same without twins, as where its model cannot be sampled."""
    result = {name: value for name, value in scan_result().items() if not name.startswith("twin_")}
    why = "heights cannot be sampled. What may help: roughness.scan.marginal: gaussian"
    return result | {"no_twins": np.array([why])}


def with_outliers():
    """Three of 30 Sq."""
    result = scan_result()
    marked = np.zeros((64, 48), dtype=int)
    marked[[3, 10, 60], [4, 20, 2]] = 1
    return result | {"map": result["map"] + 9e-6 * marked, "outliers": np.array(3), "map_outlier": marked}


def map_result(points=12, names=("damping", "belt_velocity"), first=0.0):
    """Made up: a limit that falls along the second axis."""
    x, y = (
        (np.linspace(0, 0.6, points) if first == 0.0 else np.geomspace(first, 0.6, points)),
        np.geomspace(0.1, 2.0, points),
    )
    limit = 0.5 / (1 + y)
    share = 1 / (1 + np.exp((x[:, None] - limit) / 0.03))
    arrays = {
        "map_x": x,
        "map_y": y,
        "map_x_own": np.array(0.17),
        "map_y_own": np.array(0.948),
        "map_parameters": np.array(names),
        "map_runs": np.array(20),
        "is_computed": (np.indices((points, points)).sum(axis=0) % 3 == 0).astype(int),
        "prediction_error": np.array(0.03),
        "hopf_damping": 0.8 * limit,
        "existence_limit": np.where(y > 1.5, np.nan, limit),
    }
    return arrays | with_interval("probability", share, 0.1)


def budget_result(
    sources=(
        "friction curve",
        "contact solves",
        "natural frequency",
        "damping",
        "belt velocity",
        "normal force",
    ),
    results=("probability", "damping", "belt_velocity", "load"),
):
    """Made up: first indices that fall, and total ones above them."""
    first = np.tile(0.6 * 0.4 ** np.arange(len(sources)), (len(results), 1))
    arrays = {"source_name": np.array(sources), "result_name": np.array(results), "outcome": 0.8 * first[0]}
    arrays |= {"outcome_scatter": np.array(0.3), "averaged_probability": np.array(0.62)}
    return arrays | with_interval("first", first, 0.1) | {"total": 1.2 * first}


def loads_result(most=1.0):
    """Made up: five loads, the second of the scene; near full contact every window touches."""
    pressure = 1e6 * 10.0 ** np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    arrays = with_interval("real_area", most * pressure / 1e7, 1e-4) | with_interval(
        "mean", 0.3 - 1e-8 * pressure, 0.01
    )
    arrays |= with_interval("variation", 20.0 / pressure, 1e-6)
    arrays |= with_interval("no_contact", (1 - most) * np.linspace(0.9, 0.0, 5), 0.0)
    over_loads = {f"over_loads_{name}": values for name, values in arrays.items()}
    return over_loads | {"over_loads_nominal_pressure": pressure, "nominal_pressure": pressure[1]}


def chain_result(nodes=8):
    """Made up: a slope in contact at its upper half, two paths, and the cycles of the oscillator."""
    x = 1e-6 * (np.arange(nodes) + 0.5)
    height = np.add.outer(x, np.zeros(nodes)) / 100
    path = 3e-5 * np.arange(81)
    arrays = oscillator()
    return {
        "x": x,
        "y": x,
        "height": height,
        "pressure": 1e11 * np.maximum(height - height.mean(), 0.0) / height.max(),
        "pressed_by": np.array(["penetration 50 %"]),
        "path": path,
        "friction": 0.3 + 0.05 * np.sin(2e3 * np.array([path, 2 * path])),
        "friction_mean": np.array(0.3),
        **{name: arrays[name] for name in CYCLE},
    }
