"""Stage oscillator: a batch of realisations of the friction process, each run at every damping ratio of the scene."""

import numpy as np

from roughslip import store
from roughslip.oscillator.counts import ensemble_counts
from roughslip.oscillator.motion import simulate, trajectory
from roughslip.oscillator.path import KeptPath
from roughslip.scene.declarations import Batches, Stage
from roughslip.stages.from_scene import geometry, mass_on_belt, shares
from roughslip.stages.from_scene.own_limits import damping_ratios
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="oscillator",
    reads="seed oscillator ensemble",
    reads_if_given="friction.statistics",
    optional={"friction": "friction", "allocation": "ensemble_pilot"},
    result="oscillator/ensemble-{first}-{last}.nc",
    batches=Batches(totals={"": "ensemble.realisations"}, asked="accuracy.cycles", shares=2),
    memory_mb=520,
    memory_doubles={
        "path_nodes": 10,
        "drawn_realisations": 32_000,
        "batch dampings": 18,
        "batch periods": 24,
        "periods": 2000,
    },
)


def work(job: Job) -> None:
    """Write counts per realisation and damping, reattachment points at the scene's damping, a few trajectories."""
    scene, arguments = job.scene, job.arguments
    ensemble = scene.ensemble
    numbers = mass_on_belt.friction_numbers(scene, arguments.friction)
    belt, law = mass_on_belt.oscillator(scene), mass_on_belt.law(scene, numbers.mean)
    process = mass_on_belt.friction_process(scene, numbers, arguments.friction)
    found = {} if arguments.allocation is None else store.read(arguments.allocation)
    nodes = int(found["nodes_per_correlation_length"]) if found else int(ensemble.nodes_per_correlation_length)
    taken = shares.numbers_of(job, "runs")
    periods, discarded = ensemble.duration_periods, mass_on_belt.DISCARDED_PERIODS
    dampings = damping_ratios(scene, numbers, arguments.friction)
    count = len(taken)
    cycles, micro_slips = np.empty((2, count, len(dampings)), dtype=np.int32)
    last_cycle, stick_slip = np.empty((2, count, len(dampings)))
    nominal_last_cycle = np.empty(count)
    cuts = np.empty((count, len(dampings)), dtype=np.int64)
    reattachments, owners, drawn, options = [], [], [], mass_on_belt.motion_options(scene)
    length = mass_on_belt.path_length(belt, periods)
    steps = evaluations = sticks = unread = 0
    with job.usage.core():
        paths = mass_on_belt.friction_paths(scene, process, nodes)
        for row, number in enumerate(taken):
            path = KeptPath(paths.realisation([scene.seed, geometry.STREAM_PROCESS, number]))
            counts = ensemble_counts(belt, law, path, paths.spacing, periods, dampings, options)
            cycles[row], micro_slips[row], cuts[row] = counts.cycles, counts.micro_slips, counts.cuts
            last_cycle[row], stick_slip[row] = counts.last_cycle, counts.stick_slip
            steps, evaluations = steps + counts.steps, evaluations + counts.evaluations
            nominal = simulate(belt, law, path, paths.spacing, periods, options)
            places = nominal.reattachments(discarded)
            nominal_last_cycle[row] = nominal.last_cycle
            sticks += int(np.sum(counts.cycles + counts.micro_slips)) + nominal.cycles + nominal.micro_slips
            reattachments.append(places)
            owners.append(np.full(len(places), number))
            if number < ensemble.drawn_realisations:
                until = discarded + mass_on_belt.DRAWN_PERIODS
                drawn.append(trajectory(belt, law, path, paths.spacing, until, options))
            unread += max(int(np.ceil(length / paths.spacing)) + 1 - path.nodes, 0)
            job.usage.progress(row + 1, count)
    job.usage.count(
        runs=count * len(dampings),
        cycles=int(cycles.sum()),
        steps=steps,
        evaluations=evaluations,
        negative_friction_cut=int(cuts.sum()),
    )
    not_stored = count * len(dampings) + len(drawn)
    job.usage.skip({skip_reasons.STICK: sticks, skip_reasons.KEPT: not_stored, skip_reasons.UNREAD: unread})
    run, event = ("realisation", "damping"), ("event",)
    cut = "steps and sticks at which negative friction was cut to zero"
    variables = {
        "damping_ratio": store.Variable(run[1:], np.array(dampings), "1", "damping ratio D"),
        "realisation": store.Variable(run[:1], np.array(taken), "1", "number of the run"),
        "cycles": store.Variable(run, cycles, "1", "cycles M_S"),
        "micro_slips": store.Variable(run, micro_slips, "1", "reattachments without a cycle"),
        "negative_friction": store.Variable(run, cuts, "1", cut),
        "last_cycle": store.Variable(run, last_cycle, "1", "natural periods until the last cycle, 0 for none"),
        "stick_slip": store.Variable(run, stick_slip, "1", "share of the time in either state that is stick-slip"),
        "nominal_last_cycle": store.Variable(run[:1], nominal_last_cycle, "1", "the same at the scene's own damping"),
        "reattachment": store.Variable(event, np.concatenate(reattachments), "m", "X at the start of stick"),
        "reattachment_realisation": store.Variable(event, np.concatenate(owners), "1", "its realisation"),
    }
    if drawn:
        kept = drawn[0].time >= 2 * np.pi * discarded
        variables["time"] = store.Variable(("time",), drawn[0].time[kept], "1", "tau = omega t")
        for name, title in (("position", "X"), ("velocity", "X' = dX/dtau")):
            values = np.array([getattr(one, name)[kept] for one in drawn])
            variables[name] = store.Variable(("drawn", "time"), values, "m", title)
    store.write(arguments.output, variables, job.key, {"first": taken.start})


if __name__ == "__main__":
    execute(STAGE, work)
