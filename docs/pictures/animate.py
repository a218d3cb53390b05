"""Draw stick_slip.gif: the mass on the belt, its phase plane, and friction against the relative velocity.

Oscillator and friction are those of Figure 5 of the scene `resolved`. Run it in this folder: python animate.py
"""

import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from roughslip.friction import FrictionProcess, sample_path
from roughslip.oscillator import MotionOptions, Oscillator, StribeckLaw, trajectory
from roughslip.probability import BetaDistribution

MEAN, DEVIATION, LENGTH = 0.3, 0.033, 3.2e-4  # of the friction coefficient, and its correlation length [m]
BEGIN, PERIODS = 20, 5  # natural periods before the first picture, and shown
PICTURES, SAMPLES = 16, 400  # a natural period
TRAILS = (2.5, 1.0)  # natural periods that the traces show
STICK, SLIP, SOFT = "#d55e00", "#0173b2", "0.8"  # apart for colour-blind readers too

belt = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
law = StribeckLaw(fit=MEAN)
process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, MEAN, DEVIATION), LENGTH)
path = sample_path(process, spacing_m=LENGTH / 8, nodes=40_000, seed=[3])
run = trajectory(belt, law, path, LENGTH / 8, BEGIN + PERIODS, MotionOptions(samples_per_period=SAMPLES))
settled = trajectory(belt, law, duration_periods=BEGIN + 2.0)

# Friction: in slip from eq. (13) and the path, in stick what holds the mass against spring and damper.
x, u = run.position, run.velocity
slipping = belt.V - u > 1e-9 * belt.V
slipped = np.concatenate(([0.0], np.cumsum((belt.V - u)[1:] * np.diff(run.time))))
speed = belt.natural_frequency_rad_per_s * (belt.V - u)


def of_speed(v):
    """The mean curve, eq. (13)."""
    return MEAN / (1 + 1.42 * v) + 0.4 - MEAN + 0.01 * v**2


scattered = of_speed(speed) + np.interp(slipped, LENGTH / 8 * np.arange(path.size), path)
friction = np.where(slipping, scattered, (x + 2 * belt.damping_ratio * u) / belt.F)

figure = Figure(figsize=(6.0, 3.9), layout="constrained", dpi=108)
grid = figure.add_gridspec(2, 2, height_ratios=(1, 2.2))
scene, plane, curve = (figure.add_subplot(place) for place in (grid[0, :], grid[1, 0], grid[1, 1]))

scene.set(xlim=(-14, 22), ylim=(-1.9, 3.2), aspect="equal")
scene.axis("off")
scene.plot([-13, -13], [0, 3], color="0.2", lw=3)
scene.plot([-14, 22], [0, 0], color="0.2", lw=2)
marks = scene.plot([], [], color="0.5", lw=2)[0]
spring, rod, piston = (scene.plot([], [], color="0.2", lw=1.2)[0] for _ in range(3))
mass = scene.add_patch(Rectangle((0, 0.15), 4, 2.6, ec="0.2"))
word = scene.text(0, 1.4, "", color="white", ha="center", va="center", weight="bold")
scene.annotate("", (21.5, -1.2), (16, -1.2), arrowprops={"arrowstyle": "->"})
scene.text(15.6, -1.2, "belt $v_0$", ha="right", va="center")

shown = settled.time >= 2 * np.pi * BEGIN
plane.plot(1e3 * settled.position[shown], 1e3 * settled.velocity[shown], color=SOFT, lw=4, label="without scatter")
plane.set(
    xlabel="displacement $X_1$ [mm]", ylabel="velocity $X_2 = \\dot x / \\omega$ [mm]", xlim=(0, 14), ylim=(-7, 5)
)
v = np.linspace(0, 2.9, 100)
curve.plot(v, of_speed(v), color=SOFT, lw=4, label="mean curve, eq. (13)")
curve.set(xlabel="relative velocity [m/s]", ylabel="friction coefficient", xlim=(-0.15, 2.9), ylim=(0, 0.62))
for axes in (plane, curve):
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="upper right", frameon=False, fontsize="small")
trails = [axes.plot([], [], color=SLIP, lw=1)[0] for axes in (plane, curve)]
dots = [axes.plot([], [], "o", ms=8)[0] for axes in (plane, curve)]
first, step = SAMPLES * BEGIN, SAMPLES // PICTURES


def draw(number):
    """The picture of this number: everything that moves."""
    now = first + number * step
    place, colour = 1e3 * x[now], SLIP if slipping[now] else STICK
    mass.set(x=place, facecolor=colour)
    word.set(x=place + 2, text="slip" if slipping[now] else "stick")
    travel = (1e3 * belt.V * (run.time[now] - run.time[first])) % 3.0
    ticks = np.arange(-16, 24, 3.0) + travel
    marks.set_data(*np.hstack([[[tick, tick - 0.5, np.nan], [0, -0.6, np.nan]] for tick in ticks if tick > -13.5]))
    turns = np.linspace(-13, place, 23)
    spring.set_data(turns, 2.1 + 0.4 * np.array([0, 0, *(1, -1) * 9, 0, 0, 0])[:23])
    rod.set_data([-13, -6, np.nan, -5, place], [0.9, 0.9, np.nan, 0.9, 0.9])
    piston.set_data([-4.4, -6, -6, -4.4, np.nan, -5, -5], [0.5, 0.5, 1.3, 1.3, np.nan, 0.6, 1.2])
    for trail, dot, periods, across, up in zip(
        trails, dots, TRAILS, (1e3 * x, speed), (1e3 * u, friction), strict=True
    ):
        last = slice(max(first, now - int(periods * SAMPLES)), now + 1, 4)
        trail.set_data(across[last], up[last])
        dot.set_data([across[now]], [up[now]])
        dot.set_color(colour)


FuncAnimation(figure, draw, PERIODS * PICTURES).save("stick_slip.gif", PillowWriter(fps=16))
