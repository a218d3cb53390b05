"""The law of scatter: its theory against closed forms and plain sums, and the law against solved cells."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction import scatter_of_friction
from roughslip.friction.scatter_law import (
    FITTED,
    correlation_of_slopes,
    mean_over_window,
    pair_covariance,
    roughness_of,
)
from roughslip.surface import covariance_of

LENGTH = 1.13e-5
GAUSSIAN = covariance_of("gaussian", rms_height_m=1e-7, correlation_length_m=LENGTH)
KEPT = Path(__file__).resolve().parents[2] / "results/reference/scatter_law/law.json"


def test_shot_noise_at_light_load():
    """All of the stress shared: 2 / sqrt(2 pi) int x exp(-x^2 / 2) (1 - x sqrt(2 / pi))^2 dx, which is
    sqrt(2 / pi) (4 / pi - 1), over A^2 = 2 p^2 / pi, times p."""
    pressure = 1e-4
    found = pair_covariance(np.array([1.0]), pressure)[0] * 2.0 * pressure / math.pi
    assert found == pytest.approx(math.sqrt(2.0 / math.pi) * (4.0 / math.pi - 1.0), rel=3e-4)


@pytest.mark.parametrize("pressure", [0.3, 1.0, 2.0])
def test_far_apart_it_is_the_scatter_of_the_slope(pressure):
    """Expanded about p, the area given a stress x is A + ... + (x - p)^2 A'' / 2, and A'' = 2 dA / d s^2: so C is
    2 rho^2 (d ln A / d s^2)^2 for rho far below p^2."""
    rho = 1e-4 * pressure**2
    area, bend = math.erf(pressure / math.sqrt(2)), -math.sqrt(2 / math.pi) * pressure * math.exp(-(pressure**2) / 2)
    found = pair_covariance(np.array([rho]), pressure)[0]
    linear = rho * (math.sqrt(2 / math.pi) * math.exp(-(pressure**2) / 2) / area - 1 / pressure) ** 2
    assert found - linear == pytest.approx(2 * rho**2 * (bend / (2 * area)) ** 2, rel=0.02, abs=3e-3 * linear)


def test_covariance_grows_with_what_is_shared():
    """Where nothing is shared there is no covariance, and the more is shared the more there is."""
    assert pair_covariance(np.array([0.0, 1e-6]), 0.5) == pytest.approx([0.0, 0.0], abs=1e-6)
    found = pair_covariance(np.linspace(0.0, 1.0, 200), 0.02)
    assert (np.diff(found) > 0.0).all()


def test_roughness_of_a_gaussian_covariance():
    """h' = 2 Sq / l; alpha = 1 (32 / l^4) / (4 / l^2)^2 = 2; rho = (1 - r^2 / l^2) exp(-r^2 / l^2)."""
    rough = roughness_of(GAUSSIAN, 3e-5)
    assert rough.slope == pytest.approx(2e-7 / LENGTH, rel=1e-3)
    assert rough.bandwidth == pytest.approx(2.0, rel=0.02)
    r = np.linspace(0.0, 3.0, 7)
    found = correlation_of_slopes(GAUSSIAN, rough, 0.6 * r * LENGTH, 0.8 * r * LENGTH)
    assert found == pytest.approx((1 - r**2) * np.exp(-(r**2)), abs=2e-3)


@pytest.mark.parametrize("window", [(256e-6, 32e-6), (8e-6, 8e-6)])
def test_mean_over_a_window_is_the_plain_sum(window):
    """Over all pairs of a fine mesh: the triangles of the distances, by the midpoint rule."""
    rough, load = roughness_of(GAUSSIAN, 3e-5), 0.03
    x, y = ((np.arange(-n + 0.5, n) / n * edge) for n, edge in zip((1200, 300), window, strict=True))
    rho = correlation_of_slopes(GAUSSIAN, rough, x[:, None], y[None, :])
    weight = (1 - np.abs(x) / window[0])[:, None] * (1 - np.abs(y) / window[1])[None, :]
    shares = np.linspace(0.0, 1.0, 4001)
    values = np.interp(rho, shares, pair_covariance(shares, 2 * load))
    assert mean_over_window(GAUSSIAN, rough, load, window) == pytest.approx(
        np.sum(weight * values) / weight.sum(), rel=5e-3
    )


def test_units_do_not_matter_and_large_windows_average():
    """Lengths, heights and moduli scale out; four times the area of a large window halves the scatter."""
    first = scatter_of_friction(GAUSSIAN, 1e11, 5e7, (3e-4, 3e-4))
    other = covariance_of("gaussian", rms_height_m=3e-4, correlation_length_m=1e3 * LENGTH)
    assert scatter_of_friction(other, 1e9, 5e5 * 3.0, (0.3, 0.3)) == pytest.approx(first, rel=1e-6)
    pads = [scatter_of_friction(GAUSSIAN, 1e11, 5e7, (edge, edge)) for edge in (1e-2, 2e-2)]
    assert pads[0] / pads[1] == pytest.approx(2.0, rel=2e-3)


def test_independent_solves_of_another_programme():
    """Belts of 1024 x 128 nodes, 256 windows of 256 x 32 cells and 64 of 512 x 64: CV known to 4 and 9 %."""
    for window, rows in (
        ((256e-6, 32e-6), {0.003: 0.412, 0.01: 0.241, 0.03: 0.154, 0.1: 0.104}),
        ((512e-6, 64e-6), {0.003: 0.211, 0.01: 0.114, 0.03: 0.076, 0.1: 0.053}),
    ):
        for load, measured in rows.items():
            pressure = load * 1e11 * 2e-7 / LENGTH
            assert scatter_of_friction(GAUSSIAN, 1e11, pressure, window) == pytest.approx(measured, rel=0.13)


def test_heights_without_a_slope_and_no_load_are_refused():
    rough = covariance_of("exponential", rms_height_m=1e-7, correlation_length_m=LENGTH)
    with pytest.raises(IllPosedError, match=r"cut the spectrum off"):
        scatter_of_friction(rough, 1e11, 5e7, (1e-4, 1e-4))
    with pytest.raises(ParameterError, match="the pressure"):
        scatter_of_friction(GAUSSIAN, 1e11, 0.0, (1e-4, 1e-4))


def test_the_constants_are_those_of_the_kept_study():
    kept = json.loads(KEPT.read_text(encoding="utf-8"))
    assert pytest.approx(kept["constants"], abs=5e-4) == FITTED
    assert kept["rms_error_judged"] < 0.1
