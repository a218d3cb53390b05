"""Stage basins: from which states the mass comes to stick-slip without scatter, and from which to steady sliding."""

import math

import numpy as np

from roughslip import store
from roughslip.oscillator.basins import basin_share, unstable_cycle
from roughslip.oscillator.limits import departure_point, equilibrium
from roughslip.oscillator.motion import trajectory
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="basins",
    reads="seed oscillator",
    reads_if_given="friction.statistics friction.scatter",
    optional={"friction": "friction friction_under_load record"},
    result="oscillator/basins.nc",
    memory_mb=620,
)

STATES = 1000  # a share to 3 %
BOX = 1.5  # half its edges, over the distance of the departure from steady sliding
SETTLED, SHOWN = 100.0, 4.0  # natural periods until the motion from rest is drawn, and how many are


def work(job: Job) -> None:
    """Write the end of the motion from states of a box about steady sliding, its share, and the two cycles."""
    scene = job.scene
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers)
    rest, omega = equilibrium(belt, law), belt.natural_frequency_rad_per_s
    reach = BOX * math.hypot(departure_point(belt, law) - rest, belt.V)
    with job.usage.core():
        box = (rest - reach, rest + reach), (-reach, reach)
        basin = basin_share(belt, law, box, STATES, (scene.seed, geometry.STREAM_BASINS))
        drawn = trajectory(belt, law, None, 0.0, SETTLED + SHOWN)
        last = drawn.time >= 2.0 * math.pi * SETTLED
        unstable = unstable_cycle(belt, law)
    job.usage.count(runs=STATES)
    state = ("state",)
    share = basin.share, basin.low, basin.high
    variables = {
        "basin_position": store.Variable(state, basin.states[:, 0], "m", "position"),
        "basin_velocity": store.Variable(state, omega * basin.states[:, 1], "m s-1", "velocity"),
        "ends_in_stick_slip": store.Variable(state, basin.stick_slip.astype(np.int8), "1", "1 where it stick-slips"),
    } | store.with_interval("basin_share", (), share, "1", "share of the states that end in stick-slip")
    for name, x, u in (("from_rest", drawn.position[last], drawn.velocity[last]), ("unstable", *unstable.T)):
        variables[f"{name}_position"] = store.Variable((name,), x, "m", f"position, {name}")
        variables[f"{name}_velocity"] = store.Variable((name,), omega * u, "m s-1", f"velocity, {name}")
    store.write(job.arguments.output, variables, job.key)
