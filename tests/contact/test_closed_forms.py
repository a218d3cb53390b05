"""The closed forms against each other and against quadrature; solvers are tested against them elsewhere."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from roughslip.contact.closed_forms import (
    SQUARE_CAPACITANCE,
    CircularPunch,
    CrossedWaves,
    HertzSphere,
    SineWave,
    square_punch_force_n,
)
from roughslip.errors import ParameterError

SPHERE = HertzSphere(radius_m=1e-3, penetration_m=1e-7, plane_strain_modulus_pa=1.1e11)
PUNCH = CircularPunch(radius_m=2e-6, penetration_m=3e-9, plane_strain_modulus_pa=7e10)


def sine_wave(load: float) -> SineWave:
    return SineWave(2e-7, 3e-5, 5e10, load * math.pi * 5e10 * 2e-7 / 3e-5)


def axial_displacement(pressure, radius: float, modulus: float) -> float:
    """u(0) = 1/(pi E*) int p / r dA, with r = radius sin t so that the edge is smooth."""
    integral, _ = quad(lambda t: float(pressure(np.array(radius * math.sin(t)))) * math.cos(t), 0, math.pi / 2)
    return 2 * radius * integral / modulus


@pytest.mark.parametrize(("body", "radius"), [(SPHERE, SPHERE.contact_radius_m), (PUNCH, PUNCH.radius_m)])
def test_pressure_carries_the_force_and_lifts_the_axis_by_the_penetration(body, radius: float) -> None:
    """With r = a sin t the pressure of a punch rises as 1 / cos t, and r dr is a^2 sin t cos t dt."""
    force, _ = quad(
        lambda t: math.sin(t) * math.cos(t) * float(body.pressure_pa(np.array(radius * math.sin(t)))), 0, math.pi / 2
    )
    assert 2 * math.pi * radius**2 * force == pytest.approx(body.force_n, rel=1e-8)
    lift = axial_displacement(body.pressure_pa, radius, body.plane_strain_modulus_pa)
    assert lift == pytest.approx(body.penetration_m, rel=1e-8)
    assert np.all(body.pressure_pa(np.array([1.0, 1.5, 1e3]) * radius) == 0)


def test_hertz_by_force_and_at_yield() -> None:
    again = HertzSphere.under_force(SPHERE.radius_m, SPHERE.force_n, SPHERE.plane_strain_modulus_pa)
    assert again.penetration_m == pytest.approx(SPHERE.penetration_m, rel=1e-14)
    yielding = HertzSphere.at_yield(SPHERE.radius_m, 3e9, SPHERE.plane_strain_modulus_pa)
    assert yielding.peak_pressure_pa == pytest.approx(3e9, rel=1e-14)


def test_hertz_energy_is_the_integral_of_the_force() -> None:
    """Also half the work of pressure on displacement d - r^2 / (2 R), half-spaces being linear."""
    energy, _ = quad(lambda d: HertzSphere(1e-3, d, 1.1e11).force_n, 0, SPHERE.penetration_m)
    assert SPHERE.elastic_energy_j == pytest.approx(energy, rel=1e-8)

    def density(r: float) -> float:
        lift = SPHERE.penetration_m - r**2 / (2 * SPHERE.radius_m)
        return math.pi * r * float(SPHERE.pressure_pa(np.array(r))) * lift

    assert quad(density, 0, SPHERE.contact_radius_m)[0] == pytest.approx(energy, rel=1e-8)


def test_square_punch_between_circles() -> None:
    """Capacitance grows with the set, and of all plates of one area the disc has the least (Polya and Szego)."""
    disc = 2 / math.pi**1.5  # 2 E* a d over pi E* edge d, for the disc of the same area
    assert disc < SQUARE_CAPACITANCE < math.sqrt(2) * disc * math.sqrt(math.pi) / 2
    assert square_punch_force_n(2.0, 3.0, 5.0) == pytest.approx(30 * math.pi * SQUARE_CAPACITANCE, rel=1e-15)


@pytest.mark.parametrize("load", [0.01, 0.5, 0.97, 1.0])
def test_sine_wave_pressure_fills_the_contact_and_carries_the_load(load: float) -> None:
    wave = sine_wave(load)
    half_width = wave.area_fraction * wave.wavelength_m / 2
    assert np.all(wave.pressure_pa(np.array([0.0, 0.999]) * half_width) > 0)
    beyond = np.linspace(min(1.001 * half_width, wave.wavelength_m / 2), wave.wavelength_m / 2, 5)
    assert np.all(wave.pressure_pa(beyond) == 0)
    total, _ = quad(
        lambda t: float(wave.pressure_pa(half_width * math.sin(t))) * half_width * math.cos(t), 0, math.pi / 2
    )
    assert 2 * total / wave.wavelength_m == pytest.approx(wave.mean_pressure_pa, rel=1e-8)


@pytest.mark.parametrize("load", [0.05, 0.5, 0.9])
def test_sine_wave_meets_the_plane_all_over_the_contact(load: float) -> None:
    """Displacement from its mean under one mode exp(i q x) is 2 p / (E* q): height less displacement is the plane in
    contact and below it outside. The modes of a pressure with a root at its edge fall as k^-3/2 and those of the
    displacement as k^-5/2. The sum beyond K = 8192 is of the order K^-3/2 = 1.3e-6 (measured 4.3e-6)."""
    wave, n = sine_wave(load), 2**14
    x = np.arange(n) / n * wave.wavelength_m
    spectrum = np.fft.rfft(wave.pressure_pa(x))
    q = 2 * np.pi / wave.wavelength_m * np.arange(spectrum.size)
    spectrum[1:] *= 2 / (wave.plane_strain_modulus_pa * q[1:])
    spectrum[0] = 0.0
    surface = wave.amplitude_m * np.cos(2 * np.pi * x / wave.wavelength_m) - np.fft.irfft(spectrum, n)
    pressed = wave.pressure_pa(x) > 0
    np.testing.assert_allclose(surface[pressed], wave.plane_m, rtol=0, atol=1e-5 * wave.amplitude_m)
    assert np.all(surface[~pressed] < wave.plane_m + 1e-5 * wave.amplitude_m)


def test_sine_wave_energy_is_the_integral_of_the_pressure() -> None:
    """dW = -p d(plane) per area, by central differences of step 1e-4, whose error is of order 1e-8. In full contact W
    is that of a full wave, p* D / 4."""
    for load in (0.1, 0.5, 0.9):
        less, wave, more = sine_wave(load - 1e-4), sine_wave(load), sine_wave(load + 1e-4)
        work = wave.mean_pressure_pa * (less.plane_m - more.plane_m)
        assert more.elastic_energy_j_m2 - less.elastic_energy_j_m2 == pytest.approx(work, rel=1e-6)
    full = sine_wave(1.0)
    assert full.elastic_energy_j_m2 == pytest.approx(full.full_contact_pressure_pa * full.amplitude_m / 4, rel=1e-14)
    assert (full.plane_m, full.area_fraction) == (0.0, 1.0)


def test_light_contact_of_crossed_waves_is_hertz_at_every_crest() -> None:
    waves = CrossedWaves(2e-7, 3e-5, 5e10)
    pressure = 1e-4 * waves.full_contact_pressure_pa
    radius = waves.wavelength_m**2 / (4 * math.pi**2 * waves.amplitude_m)
    crest = HertzSphere.under_force(radius, pressure * waves.wavelength_m**2 / 2, waves.plane_strain_modulus_pa)
    fraction = 2 * math.pi * crest.contact_radius_m**2 / waves.wavelength_m**2
    assert waves.light_area_fraction(pressure) == pytest.approx(fraction, rel=1e-13)


def test_nearly_full_contact_of_crossed_waves_closes_penny_cracks() -> None:
    """Full contact has the pressure p + p* cos cos, by u = 2 p / (E* |q|). About a trough it is
    p - p* + 2 pi^2 p* (r/l)^2, negative near r = 0. A crack of radius b removes the tension. Its edge has no stress
    intensity: int_0^b sigma r / sqrt(b^2 - r^2) dr = 0 (Sneddon). A cell has two troughs."""
    waves = CrossedWaves(2e-7, 3e-5, 5e10)
    wave_number = 2 * math.pi * math.sqrt(2) / waves.wavelength_m
    full = waves.plane_strain_modulus_pa * wave_number / 2 * waves.amplitude_m
    assert waves.full_contact_pressure_pa == pytest.approx(full, rel=1e-14)
    missing = 1e-3
    open_fraction = waves.open_fraction((1 - missing) * full)
    b = math.sqrt(open_fraction / (2 * math.pi))  # in wavelengths
    intensity, _ = quad(
        lambda t: (missing - 2 * math.pi**2 * (b * math.sin(t)) ** 2) * b * math.sin(t), 0, math.pi / 2, epsabs=1e-12
    )
    assert abs(intensity) < 1e-9 * missing * b
    assert waves.open_fraction(full) == 0


@pytest.mark.parametrize("bad", [0.0, -1.0, math.inf, math.nan])
def test_refuses_parameters(bad: float) -> None:
    for problem in (HertzSphere, CircularPunch, CrossedWaves):
        for place in range(3):
            values = [1.0, 1.0, 1.0]
            values[place] = bad
            with pytest.raises(ParameterError, match="positive and finite"):
                problem(*values)
    with pytest.raises(ParameterError, match="positive and finite"):
        SineWave(1.0, 1.0, 1.0, bad)
    with pytest.raises(ParameterError, match="full contact"):
        sine_wave(1.001)
