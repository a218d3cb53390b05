"""Makes tribometer.csv, a synthetic friction record whose truth is known: python config/records/tribometer.py

A pin of mass M on a spring and a damper is pressed by N newtons on a turning disc. The disc's speed falls and rises
twice between SPEEDS. Friction is mu(v) = 0.25 / (1 + 20 v) + 0.2 + 0.02 v^2 with v in m/s, with additive scatter:
standard deviation 0.015, autocorrelation exp(-s / 5 mm) over the slipped distance, a normal distribution. The disc
wobbles by 0.004, once a revolution, and friction drifts by 0.01 over the record. The load cell measures the force in
spring and damper through a first-order low-pass of 1 ms, with white noise. Below some 70 mm/s the pin sticks and
slips.
"""

import sys
from pathlib import Path

import numpy as np

MASS, STIFFNESS, DAMPING, LOAD = 2.0, 800.0, 16.0, 20.0  # kg, N/m, N s/m, N
SPEEDS, RADIUS = (0.01, 0.2), 0.04  # m/s, m
SECONDS, RATE, INNER = 30.0, 400, 20  # s, samples a second, steps of the integration in one
DEVIATION, LENGTH, WOBBLE, DRIFT = 0.015, 5e-3, 0.004, 0.01
TIME_CONSTANT, NOISE = 1e-3, 0.002  # s, N


def mu(v: np.ndarray | float) -> np.ndarray | float:
    """Mean friction at a sliding speed [m/s]."""
    return 0.25 / (1.0 + 20.0 * v) + 0.2 + 0.02 * v * v


def record(seconds: float = SECONDS, seed: int = 19, speeds: tuple[float, float] = SPEEDS) -> np.ndarray:
    """(n, 4) time [s], speed of the disc [m/s], force [N], load [N]."""
    dt, steps = 1.0 / (RATE * INNER), int(seconds * RATE) * INNER
    generator = np.random.default_rng(seed)
    share = np.abs(np.arange(steps) * dt / seconds * 4.0 % 2.0 - 1.0)
    belt = speeds[0] * (speeds[1] / speeds[0]) ** share
    kicks = generator.standard_normal(steps)
    x, velocity, slipped, scatter, shown, rows = LOAD * mu(belt[0]) / STIFFNESS, 0.0, 0.0, 0.0, None, []
    for t in range(steps):
        more = DEVIATION * scatter + WOBBLE * np.cos(slipped / RADIUS) + DRIFT * (t / steps - 0.5)
        sliding = max(belt[t] - velocity, 0.0)
        held = STIFFNESS * x + DAMPING * velocity
        velocity += dt / MASS * (LOAD * (mu(sliding) + more) - held)
        velocity = min(velocity, belt[t])  # friction can hold the pin on the disc, and no more
        x += dt * velocity
        way = dt * max(belt[t] - velocity, 0.0)
        keep = np.exp(-way / LENGTH)
        scatter = keep * scatter + np.sqrt(1.0 - keep * keep) * kicks[t]
        slipped += way
        force = STIFFNESS * x + DAMPING * velocity
        shown = force if shown is None else shown + (force - shown) * (1.0 - np.exp(-dt / TIME_CONSTANT))
        if (t + 1) % INNER == 0:
            rows.append(((t + 1) * dt, belt[t], shown + NOISE * generator.standard_normal(), LOAD))
    return np.array(rows)


if __name__ == "__main__":
    file = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).with_suffix(".csv"))
    header = "time [s],speed [mm/s],force [N],load [N]"
    np.savetxt(file, record() * [1, 1e3, 1, 1], "%.4f,%.2f,%.3f,%g", header=header, comments="")
