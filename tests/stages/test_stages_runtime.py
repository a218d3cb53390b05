"""What all stages share: options, errors in one line, pictures, their end, the record of cost, its sum, the report."""

import json
import math
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from numba import njit

from roughslip import store
from roughslip.chaos.hermite import multi_indices
from roughslip.contact.influence import DIRECT_SUM_LIMIT, Influence
from roughslip.contact.solve import solve, sweep
from roughslip.errors import ConvergenceError, InputError, StoreError
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import LOOPS, counts_by_period
from roughslip.oscillator.motion import ensemble_counts
from roughslip.scene.declarations import Stage
from roughslip.scene.types import scene_of
from roughslip.stages.costs import total
from roughslip.stages.from_scene import elastic
from roughslip.stages.report import merged, read_scene, represented
from roughslip.stages.runtime import command, skip_reasons
from roughslip.stages.runtime.command import execute
from roughslip.stages.runtime.drawing import draw_and_save
from roughslip.stages.runtime.usage import Usage, peak_memory_mib

STAGE = Stage(name="contact", result="contact.nc")
SOURCE = Path(__file__).resolve().parents[2] / "src"


@pytest.fixture
def run(tmp_path, monkeypatch):
    """Run a stage in this process, which must outlive its parent's death signal."""
    monkeypatch.setattr(command, "die_with_parent", lambda: None)
    key = tmp_path / "key.json"
    key.write_text(json.dumps({"configuration": {"seed": 5}, "code": "abc"}), encoding="utf-8")

    def run(work, *arguments, stage=STAGE):
        shared = ["--key", str(key), "--output", str(tmp_path / "out.nc"), "--usage", str(tmp_path / "usage.json")]
        monkeypatch.setattr(sys, "argv", ["stage", *shared, *arguments])
        execute(stage, work)

    run.folder = tmp_path
    return run


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ConvergenceError("no end", 1e-3, 7), ["contact: no end (residual reached 1.000e-03, work 7)"]),
        (InputError(["first mistake", "second mistake"]), ["contact: first mistake", "second mistake"]),
    ],
)
def test_an_error_of_the_package_is_a_message_and_exit_1(run, capsys, error, lines):
    def work(job):
        raise error

    with pytest.raises(SystemExit) as stop:
        run(work)
    assert stop.value.code == 1
    assert capsys.readouterr().err.splitlines() == lines
    assert sorted(path.name for path in run.folder.iterdir()) == ["key.json"]  # and no record of cost
    with pytest.raises(ZeroDivisionError):  # a mistake of ours keeps its traceback
        run(lambda job: 1 / 0)


def test_a_stage_gets_its_slice_and_its_arguments_and_leaves_its_record(run):
    seen = {}

    def work(job):
        seen.update(vars(job.arguments), configuration=job.key.configuration)
        job.usage.count(solves=3)

    stage = Stage(
        name="contact",
        inputs={"surface": ""},
        many={"contact": ""},
        optional={"friction": "", "scan": ""},
        result="contact/{design}-{first}-{last}.nc",
        outputs={"png": ""},
    )
    arguments = "--surface s.nc --contact a.nc b.nc --design lhs --png f.png --first 4 --last 8 --friction"
    run(work, *arguments.split(), stage=stage)  # the optional file under the last is one that the scene does not have
    expected = {"surface": Path("s.nc"), "contact": [Path("a.nc"), Path("b.nc")], "png": Path("f.png")}
    expected |= {"design": "lhs", "first": 4, "last": 8, "friction": None, "scan": None, "configuration": {"seed": 5}}
    assert {name: seen[name] for name in expected} == expected
    record = json.loads((run.folder / "usage.json").read_text())
    assert (record["stage"], record["did"]) == ("contact", {"solves": 3})


KEY = store.Key({"description": "Mine"}, "abc")


@pytest.fixture
def job(tmp_path):
    variables = {
        "drawn": store.Variable(("x",), np.arange(3.0), "Pa", "what is drawn"),
        "other": store.Variable(("x",), np.arange(3.0), "m", "what is not"),
    }
    store.write(tmp_path / "result.nc", variables, store.Key({"seed": 1}, "of the result"))
    names = {"png": "out/f.png", "svg": "out/f.svg", "output": "out/f.nc"}
    paths = {option: tmp_path / name for option, name in names.items()}
    return SimpleNamespace(arguments=SimpleNamespace(**paths, results=[tmp_path / "result.nc"]), key=KEY)


def draw(result):
    figure = Figure(figsize=(1, 1))
    figure.subplots().plot(result["drawn"])
    return figure


def test_two_pictures_and_the_numbers_in_them(job):
    draw_and_save(job, draw, ["drawn"])
    folder = job.arguments.png.parent
    assert sorted(path.name for path in folder.iterdir()) == ["f.nc", "f.png", "f.svg"]
    assert job.arguments.png.read_bytes().startswith(b"\x89PNG")
    assert b"<svg" in job.arguments.svg.read_bytes()
    stored = store.read(job.arguments.output)
    assert list(stored) == ["drawn"]
    assert (stored.variable("drawn").units, list(stored["drawn"])) == ("Pa", [0.0, 1.0, 2.0])
    assert json.loads(stored.attributes["configuration"]) == KEY.configuration
    with pytest.raises(StoreError, match="holds no variable 'missing'"):
        draw_and_save(job, draw, ["drawn", "missing"])


def spend(cpu_seconds: float) -> None:
    start = time.process_time()
    while time.process_time() - start < cpu_seconds:
        pass


def test_record_holds_costs_and_counts(tmp_path):
    path = tmp_path / "usage.json"
    with Usage(path, "contact") as usage:
        usage.count(solves=3, convolutions=40)
        usage.count(solves=2)
        usage.skip({"solves: no contact": np.int64(1), "nodes: below the plane": 0})
        usage.skip({"solves: no contact": 2})
        with usage.core():
            spend(0.05)
        spend(0.05)
        with usage.core():
            spend(0.05)
    record = json.loads(path.read_text())
    assert (record["stage"], record["jobs"]) == ("contact", 1)
    assert record["did"] == {"convolutions": 40, "solves": 5}
    assert record["skipped"] == {"nodes: below the plane": 0, "solves: no contact": 3}
    assert 0.1 <= record["core_cpu_seconds"] < 0.15  # the two blocks, without the time between them
    assert record["cpu_seconds"] == pytest.approx(time.process_time(), abs=0.1)
    assert [file.name for file in tmp_path.iterdir()] == ["usage.json"]


@pytest.mark.slow
def test_compiling_is_not_core(tmp_path):
    @njit
    def inner(x):
        return np.sort(x)[::-1] + np.cumsum(x)

    @njit
    def outer(x):
        return inner(x) * inner(x + 1.0)

    usage = Usage(tmp_path / "usage.json", "contact")
    start = time.process_time()
    with usage.core():
        outer(np.arange(4.0))
        spend(0.05)
    spent = time.process_time() - start
    assert spent > 0.3, "compiling this took some 0.7 s when the test was written"
    assert 0.05 <= usage.core_cpu_seconds < 0.05 + 0.2 * (spent - 0.05)  # nested compilations are not taken off twice


@pytest.mark.skipif(sys.platform not in ("linux", "darwin"), reason="no peak memory on this platform")
def test_peak_memory_sees_an_array_of_known_size():
    script = (
        "from roughslip.stages.runtime.usage import peak_memory_mib\n"
        "before = peak_memory_mib(); block = bytearray(64 * 2**20); block[::4096] = b'x' * 2**14\n"
        "del block; print(peak_memory_mib() - before)"
    )
    grown = float(subprocess.run([sys.executable, "-c", script], env=environment(), capture_output=True).stdout)
    assert grown == pytest.approx(64, abs=1)  # pages and the interpreter's own blocks
    assert peak_memory_mib() > grown


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's own time of start is read on Linux only")
def test_wall_time_runs_from_the_start_of_the_process():
    script = "import time; time.sleep(0.3); from roughslip.stages.runtime.usage import Usage; "
    script += "print(Usage('x', 'y').record()['wall_seconds'])"
    out = subprocess.run([sys.executable, "-c", script], env=environment(), capture_output=True, text=True).stdout
    assert 0.29 <= float(out) < 5.0  # to one clock tick; slow machines


WAITING_STAGE = (
    "import time; from roughslip.stages.runtime.usage import die_with_parent\n"
    "die_with_parent(); print('ready', flush=True); time.sleep(60)"
)
POOL = """
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
import time
from roughslip.stages.runtime.usage import die_with_parent

def work(number):
    print("ready", flush=True)
    time.sleep(60)

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn"), die_with_parent) as pool:
        pool.submit(work, 1).result()
"""


@pytest.mark.skipif(sys.platform != "linux", reason="Linux only")
@pytest.mark.parametrize("kind", ["stage", "processes of a campaign"])
def test_a_job_dies_with_its_parent(tmp_path, kind):
    """The child holds the other end of the pipe: reading it ends when the child is gone, long before its 60 s.

    A campaign is a job that starts processes: `python -m workflow.job campaign`.
    """
    command = [sys.executable, "-c", WAITING_STAGE]
    if kind != "stage":
        (tmp_path / "workflow").mkdir()
        (tmp_path / "workflow" / "campaign.py").write_text(POOL)
        shutil.copy(SOURCE.parent / "workflow" / "job.py", tmp_path / "workflow" / "job.py")
        command = [sys.executable, "-m", "workflow.job", "campaign"]
    parent = (
        "import os, subprocess; from roughslip.stages.runtime.usage import PARENT\n"
        f"os.environ[PARENT] = str(os.getpid()); subprocess.run({command!r})"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", parent], env=environment(), stdout=subprocess.PIPE, text=True, cwd=tmp_path
    )
    assert process.stdout.readline() == "ready\n"
    process.kill()
    assert process.communicate(timeout=20)[0] == ""


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(SOURCE)}


def record(stage, cpu, core, peak, **did):
    numbers = {"cpu_seconds": cpu, "wall_seconds": 2 * cpu, "core_cpu_seconds": core, "peak_memory_mib": peak}
    return {"stage": stage, "jobs": 1, **numbers, "did": did, "skipped": {"solves: no contact": did.get("solves", 0)}}


def test_costs_add_up_and_memory_is_that_of_the_largest_job():
    """Counts of zero are kept; a job may be too short for the clock, or its platform measure no memory. Stages that did
    not run stand in the last row."""
    jobs = [
        record("friction", 0.0, 0.0, None, windows=10),
        record("contact", 10.0, 9.0, 300.0, solves=3, convolutions=40),
        record("contact", 20.0, 18.0, 250.0, solves=4),
    ]
    contact, friction, everything = total(jobs, {"spacing": "given", "design": "not asked for"})
    assert contact == {
        "stage": "contact",
        "jobs": 2,
        "cpu_seconds": 30.0,
        "wall_seconds": 60.0,
        "core_cpu_seconds": 27.0,
        "core_share": 0.9,
        "peak_memory_mib": 300.0,
        "did": {"convolutions": 40, "solves": 7},
        "skipped": {"solves: no contact": 7},
    }
    assert (friction["core_share"], friction["peak_memory_mib"]) == (0.0, None)
    assert friction["skipped"] == {"solves: no contact": 0}
    assert (everything["stage"], everything["jobs"], everything["core_share"]) == ("all", 3, 0.9)
    assert everything["did"] == {"convolutions": 40, "solves": 7, "windows": 10}
    assert everything["not_needed"] == {"design": "not asked for", "spacing": "given"}


def summit(n: int, radius: float) -> tuple[Influence, np.ndarray]:
    """A paraboloid that stands over the plane on a disc of so many nodes' radius, in the middle of n x n."""
    x = np.arange(n) - n // 2
    return Influence(Grid(n, n, 1e-6, 1e-6), 1e11), 1e-9 * (radius**2 - x[:, None] ** 2 - x**2)


def counted(*solutions) -> dict[str, int]:
    counts = elastic.empty_skip_counts()
    for solution in solutions:
        elastic.count_solve(counts, solution)
    return {name: number for name, number in counts.items() if number}


def test_what_solves_leave_out_is_counted():
    """No contact is no solve; few nodes are solved alone and summed one by one; a square of 57 nodes holds a disc, and
    57^2 < 64^2 starts from nothing; sweeps start warm, and large meshes from coarser ones."""
    influence, u_bar = summit(16, 3.0)
    assert counted(solve(influence, u_bar - 1e-6)) == {skip_reasons.NO_CONTACT: 1}
    assert set(elastic.empty_skip_counts()) == set(skip_reasons.OF_SOLVES)
    inside = np.count_nonzero(u_bar > 0)
    assert counted(solve(influence, u_bar)) == {skip_reasons.BELOW: 256 - inside, skip_reasons.SUMMED: 1}
    influence, u_bar = summit(32, 9.0)
    found = solve(influence, u_bar)
    assert np.count_nonzero(found.pressure) > DIRECT_SUM_LIMIT
    assert counted(found, found) == {skip_reasons.BELOW: 2 * (1024 - np.count_nonzero(u_bar > 0))}
    influence, u_bar = summit(128, 28.5)
    assert counted(solve(influence, u_bar)) == {skip_reasons.CROPPED: 128**2 - 57**2}
    influence, u_bar = summit(128, 90.0)
    swept = sweep(influence, u_bar, [0.0, -1e-7, -2e-7])
    assert counted(*swept) == {skip_reasons.NESTED: 1, skip_reasons.WARM: 2}


def test_periods_that_are_counted_and_not_followed():
    """A run by the period ends behind its first cycle: half a period of stick, and LOOPS of slip at D = 0.17."""
    belt, law = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
    followed = counts_by_period(belt, law, 100.0, [0.17, 0.17])
    assert ensemble_counts(belt, law, None, 0.0, 100.0, [0.17, 0.17]).periods == 200.0
    first = (belt.F * law.static - 2 * belt.damping_ratio * belt.V) / belt.V / (2 * math.pi)
    assert followed.periods == pytest.approx(2 * (first + LOOPS / math.sqrt(1 - 0.17**2)))


def test_terms_that_a_basis_leaves_out():
    assert skip_reasons.forbidden_terms(multi_indices(8, 3)[:75], 3) == 90


CAPTIONS = {"figure2": "Pressure.", "figure5": "Cycles."}


def test_slices_of_several_stages_merge_at_every_depth():
    slices = [
        {"seed": 1, "strip": {"cell_m": 2.0, "margin": {"left": 1}}},
        {"strip": {"length_m": 3.0, "margin": {"right": 2}}, "targets": ["figure3"]},
    ]
    strip = {"cell_m": 2.0, "length_m": 3.0, "margin": {"left": 1, "right": 2}}
    assert merged(slices) == {"seed": 1, "strip": strip, "targets": ["figure3"]}


@pytest.fixture
def scene(tmp_path):
    """A scene that ran claims and one stage for Figure 5, in a folder where Figure 2 was made before."""
    (tmp_path / "keys").mkdir()
    for stage, configuration in (
        ("claims", {"description": "Mine", "targets": ["figure5"]}),
        ("cycles", {"oscillator": {"damping_ratio": 0.17}}),
        ("figure5", {"description": "Mine"}),
        ("contact_square", {"oscillator": {"damping_ratio": 0.4}, "square": {"nodes": 10}}),
    ):
        key = {"configuration": configuration, "code": "abc"}
        (tmp_path / "keys" / f"{stage}.json").write_text(json.dumps(key), encoding="utf-8")
    for name in ("figure2", "figure5"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
    costs = [{"stage": stage} for stage in ("claims", "cycles", "figure5", "all")]
    (tmp_path / "costs.json").write_text(json.dumps(costs), encoding="utf-8")
    (tmp_path / "claims.json").write_text("[]", encoding="utf-8")
    return tmp_path


def test_only_what_this_run_made_is_shown(scene):
    found = read_scene(scene, CAPTIONS)
    assert (found.name, found.description) == (scene.name, "Mine")
    assert found.figures == {"figure5": b"figure5"}
    assert json.loads(found.configuration) == {
        "description": "Mine",
        "targets": ["figure5"],
        "oscillator": {"damping_ratio": 0.17},
    }


@pytest.mark.parametrize("name", ["figure5.png", "claims.json", "costs.json", "keys/cycles.json"])
def test_what_is_missing_is_named(scene, name):
    (scene / name).unlink()
    with pytest.raises(StoreError, match=name.partition("/")[2] or name):
        read_scene(scene, CAPTIONS)


@pytest.mark.parametrize(
    ("stage", "targets", "figure"),
    [
        ("karhunen_loeve", ("figure2", "figure_field"), "figure2"),
        ("karhunen_loeve", ("figure_field",), "figure_field"),
        ("contact_strip", ("figure2", "figure3"), "figure3"),
        ("contact_strip", ("figure2", "figure5"), "figure5"),
    ],
)
def test_how_a_surface_is_represented_stands_below_the_figure_it_leads_to(tmp_path, stage, targets, figure):
    names = ("captured_variance", "captured_at_centre", "captured_at_corner", "eigenvalue")
    variables = {name: store.Variable(("mode",), np.ones(1), "1", name) for name in names[3:]}
    variables |= {name: store.Variable((), 0.9, "1", name) for name in names[:3]}
    store.write(tmp_path / "surface" / "modes.nc", variables, store.Key({}, "abc"))
    scene = {
        "roughness": {"covariance": "gaussian", "rms_height_m": 1e-7, "correlation_length_m": 1e-7},
        "square": {"variance_share": 0.95},
        "strip": {"length_m": 2.0e-4, "margin_m": 0.0, "width_m": 4e-5, "cell_m": 1e-6},
        "targets": targets,
    }
    assert represented(tmp_path, [stage], scene_of(scene)).keys() == {figure}
