"""Stage stick_slip_map: the probability of stick-slip over damping and belt velocity, with the deterministic limits."""

from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError
from roughslip.friction.recursion import recursion
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_law import FrictionLaw
from roughslip.oscillator.limits import existence_limit, hopf_damping
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.survival import cycling_share
from roughslip.scene.declarations import Stage
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="stick_slip_map",
    reads="seed oscillator map numerics.oscillator_tolerance",
    reads_if_given="ensemble.marginal ensemble.interpolation friction.statistics",
    optional={"friction": "friction"},
    result="oscillator/map.nc",
    memory_mb=620,
)

NODES = 4  # per correlation length: whether a mass sticks again depends on integrals over many of them


def limits(belt: Oscillator, law: FrictionLaw) -> tuple[float, float, str]:
    """Hopf damping and existence limit, NaN where there is no cycle, and why there is none."""
    try:
        return hopf_damping(belt, law), existence_limit(belt, law), ""
    except (IllPosedError, ConvergenceError) as error:
        return hopf_damping(belt, law), np.nan, str(error)


def work(job: Job) -> None:
    """Write the share of stick-slip in the second half of the runs at every point, and limits at every velocity.

    The same paths serve every point, so that neighbours err together and the map is smooth.
    """
    scene = job.scene
    asked = scene.map
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    process = mass_on_belt.friction_process(scene, numbers, job.arguments.friction)
    (slow, fast), (light, heavy) = asked.belt_velocities_m_per_s, asked.damping_ratios
    velocities = np.geomspace(slow, fast, asked.points)
    dampings = np.linspace(light, heavy, asked.points)
    periods, runs = asked.duration_periods, asked.realisations
    options = mass_on_belt.motion_options(scene)
    belts = [replace(belt, belt_velocity_m_per_s=float(velocity)) for velocity in velocities]
    lengths = [mass_on_belt.path_length(one, periods, options.friction_follows) for one in belts]
    share, steps = np.empty((runs, len(velocities), len(dampings))), 0
    sticks = 0
    with job.usage.core():
        *limit_curves, reasons = zip(*(limits(one, law) for one in belts), strict=True)
        paths = recursion(process, process.correlation_length_m / NODES)
        for number in range(runs):
            nodes = mass_on_belt.path_nodes(paths, max(lengths), [scene.seed, geometry.STREAM_MAP, number])
            for row, (one, length) in enumerate(zip(belts, lengths, strict=True)):
                path = nodes[: int(np.ceil(length / paths.spacing)) + 2]
                for column, ratio in enumerate(dampings):
                    damped = replace(one, damping_ratio=float(ratio))
                    motion = simulate(damped, law, path, paths.spacing, periods, options)
                    share[number, row, column] = cycling_share(motion, 0.5 * periods)
                    steps, sticks = steps + motion.steps, sticks + motion.cycles + motion.micro_slips
            job.usage.progress(number + 1, runs)
    without = [(velocity, why) for velocity, why in zip(velocities, reasons, strict=True) if why]
    if without:
        where = f"{len(without)} of {len(velocities)} belt velocities, from {without[0][0]:.3g} m/s"
        job.usage.warn(f"no existence limit at {where}: {without[0][1]}; stored as NaN")
    job.usage.count(runs=share.size, steps=steps)
    job.usage.skip({skip_reasons.STICK: sticks, skip_reasons.KEPT: share.size - runs})
    error = stdtrit(runs - 1, 0.975) * share.std(axis=0, ddof=1) / np.sqrt(runs)
    point, velocity = ("velocity", "damping"), ("velocity",)
    title = "probability of stick-slip"
    variables = {
        "belt_velocity": store.Variable(velocity, velocities, "m s-1", "belt velocity v0"),
        "damping_ratio": store.Variable(("damping",), dampings, "1", "damping ratio D"),
        "probability": store.Variable(point, share.mean(axis=0), "1", f"{title}, share of the second half of the runs"),
        "probability_error": store.Variable(point, error, "1", f"{title}, half width of Student's 95 % interval"),
        "hopf_damping": store.Variable(
            velocity, np.array(limit_curves[0]), "1", "damping ratio below which steady sliding is unstable"
        ),
        "existence_limit": store.Variable(
            velocity, np.array(limit_curves[1]), "1", "damping ratio above which the stick-slip cycle does not exist"
        ),
        "nominal_damping": store.Variable((), belt.damping_ratio, "1", "the scene's damping ratio"),
        "nominal_velocity": store.Variable((), belt.belt_velocity_m_per_s, "m s-1", "the scene's belt velocity"),
        "map_periods": store.Variable((), periods, "1", "natural periods of a run"),
        "map_runs": store.Variable((), runs, "1", "runs at a point"),
    }
    store.write(job.arguments.output, variables, job.key)


if __name__ == "__main__":
    execute(STAGE, work)
