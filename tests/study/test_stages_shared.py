"""From a scene, and from the model of a scan, to meshes, windows, nodes, surfaces, targets and variables.

What all stages share: errors in one line, the record of cost, their end, the sum of costs, the report.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError, InputError
from roughslip.grid import Grid
from roughslip.probability import BetaDistribution, empirical_distribution
from roughslip.scan.statistics import scan_statistics
from roughslip.scan.topography import topography
from roughslip.scene.types import scene_of
from roughslip.study import scan as scan_stage
from roughslip.study.from_scene import geometry, surface_model
from roughslip.study.from_scene.expansion import directions
from roughslip.study.from_scene.geometry import central_nodes, training_nodes
from roughslip.study.job import main
from roughslip.study.page import read_scene, total_costs
from roughslip.surface.model import GaussianModel, gaussian_model
from roughslip.surface.models import covariance_of
from roughslip.surface.modes import karhunen_loeve
from tests.study.conftest import job_of

# Of the paper's scene: lengths that are no whole numbers of cells in floating point.
STRIP = {
    "width_m": 2.5e-5,
    "cell_m": 2.5e-6,
    "window_m": 6e-4,
    "window_spacing_m": 1.5e-5,
}


def test_blocks_lie_on_the_middle_of_the_strip():
    """160 of 15 um fill 2.4 mm, four windows. Half a window is solved beyond either end."""
    scene = scene_of({"strip": STRIP})
    grid, within = geometry.strip_grid(scene), geometry.middle(scene)
    assert grid.shape == (960 + 2 * 120, 10)
    assert (grid.nx * grid.dx, grid.ny * grid.dy) == pytest.approx((3e-3, 2.5e-5))
    assert within == slice(120, 1080)
    assert geometry.block_nodes(scene) == (6, 10)


FIELD = {"covariance": "exponential", "rms_height_m": 2e-7, "correlation_length_m": 5e-6}


def model_of(**roughness):
    return surface_model.surface_model(scene_of({"roughness": FIELD | roughness}))


def test_a_field_with_every_key_and_a_distribution_of_heights():
    """The correction reaches the covariance that is asked, where a Gaussian field has one for it."""
    model = model_of(covariance="matern", smoothness=1.5, correlation_length_across_m=2e-6, lay_rad=0.3)
    assert model.covariance == covariance_of("matern", 2e-7, 5e-6, 2e-6, 0.3, smoothness=1.5)
    assert (model.lengths_m, model.marginal) == (model.covariance.axis_lengths_m, None)
    law = [5.0, 2.1]
    model, corrected = model_of(beta_shapes=law), model_of(beta_shapes=law, correct_correlation=True)
    assert model.marginal == BetaDistribution.of_moments(5.0, 2.1, 0.0, 2e-7)
    assert model.covariance == covariance_of("exponential", 2e-7, 5e-6)
    lag = np.array(5e-6)
    assert corrected.covariance.wanted(lag) == model.covariance(lag) < corrected.covariance(lag)
    with pytest.raises(IllPosedError, match="no Gaussian field"):
        model_of(covariance="gaussian", beta_shapes=law, correct_correlation=True)


def test_the_band_of_a_fractal_is_that_of_the_scene():
    roughness = {"rms_height_m": 2e-7, "hurst": 0.8, "wavelengths_m": [8e-6, 6e-5]}
    law = surface_model.surface_model(scene_of({"roughness": roughness})).law
    assert (law.hurst, law.longest_wavelength_m, law.shortest_wavelength_m) == (0.8, 6e-5, 8e-6)


@pytest.mark.parametrize("covariance", [None, covariance_of("matern", 2e-7, 5e-6, 2e-6, 0.1, smoothness=0.8)])
@pytest.mark.parametrize("kind", ["gaussian", "empirical"])
def test_the_model_of_a_scan_comes_back_from_disk(tmp_path, covariance, kind):
    heights = BetaDistribution.of_moments(2.1, 5.0, 0.0, 2e-7)
    truth = gaussian_model(covariance_of("exponential", 2e-7, 5e-6), (5e-6, 5e-6), heights)
    field = truth.sampler(Grid(160, 160, 1e-6, 1e-6))(np.random.default_rng(1))
    scan = topography(truth.heights(field), 1e-6, 1e-6, "a scan")
    statistics = scan_statistics(scan)
    law = None if kind == "gaussian" else empirical_distribution(scan.heights, 2e-7)
    variables, attributes = surface_model.stored_model(covariance, law, False, 2e-7)
    path = tmp_path / "scan.nc"
    variables |= scan_stage.of_scan(scan, statistics, scan.missing)
    store.write(path, variables, store.Key({"seed": 1}, "code"), attributes)
    model = surface_model.restored_model(store.read(path))
    assert model.rms_height_m == pytest.approx(2e-7, rel=1e-12)
    if covariance is None:
        assert model.lengths_m == (statistics.autocorrelation.length_x.value, statistics.autocorrelation.length_y.value)
        near = model.covariance(statistics.autocorrelation.lag_x, 0.0) / 4e-14
        table = statistics.autocorrelation.correlation.value[:, len(statistics.autocorrelation.lag_y) // 2]
        inner = np.abs(statistics.autocorrelation.lag_x) < 5e-6
        np.testing.assert_allclose(near[inner], table[inner], atol=0.05)
    else:
        assert model.covariance == covariance
    score = np.linspace(-3, 3, 7)
    if law is None:
        assert model.marginal is None
    else:
        np.testing.assert_array_equal(model.marginal.from_gaussian(score), law.from_gaussian(score))


SURFACE = GaussianModel(covariance_of("gaussian", 1.0, 6.0), (6.0, 6.0))


@pytest.mark.parametrize(
    ("nx", "ny", "nodes"),
    [
        (10, 10, [(5, 5), (5, 4), (4, 5), (4, 4)]),
        (9, 9, [(4, 4)]),
        (10, 9, [(5, 4), (4, 4)]),
    ],
)
def test_central_nodes_are_the_centre_and_its_mirror_images(nx, ny, nodes):
    grid = Grid(nx, ny, 1.0, 1.0)
    places_ = list(zip(*map(np.ndarray.tolist, central_nodes(SURFACE.lengths_m, grid)[:2]), strict=True))
    assert places_ == nodes
    assert places_[0] == grid.centre
    assert {(nx - 1 - i, ny - 1 - j) for i, j in places_} == set(places_)


def test_training_nodes_lie_half_a_length_from_the_central_ones():
    """Lengths of 6 and 12 cells: nodes 3 and 6 cells out; each with its mirror images, the centre first."""
    grid = Grid(32, 31, 1.0, 1.0)
    nodes = training_nodes((6.0, 12.0), grid)
    pairs = set(zip(nodes.x.tolist(), nodes.y.tolist(), strict=True))
    assert pairs == {(i, j) for i in (12, 15, 16, 19) for j in (9, 15, 21)}
    assert (nodes.x[0], nodes.y[0]) == grid.centre
    outermost = (3.5**2 - 0.5**2) / 6**2 + 6**2 / 12**2
    assert nodes.distance2[[0, -1]] == pytest.approx([0.0, outermost])
    assert np.all(np.diff(nodes.distance2) >= 0)
    # half of 2.9 cells is one cell; half of 6 is 3, which on 6 nodes is the border
    for n, length in ((10, 2.9), (6, 6.0)):
        small = Grid(n, n, 1.0, 1.0)
        assert np.array_equal(training_nodes((length, length), small), central_nodes((length, length), small))


def test_variables_are_local_functionals_as_long_as_they_are_independent():
    surface, grid = GaussianModel(covariance_of("gaussian", 1.0, 6.0), (6.0, 6.0)), Grid(24, 24, 1.0, 1.0)
    modes, places = karhunen_loeve(surface.covariance, grid, 60).modes, training_nodes(surface.lengths_m, grid)
    variables = directions(surface, grid, modes, places, 3)[0]
    for one, x, y in zip(variables, places.x, places.y, strict=True):
        np.testing.assert_allclose(one[0], modes[:, x, y] / np.linalg.norm(modes[:, x, y]), atol=1e-12)
    with pytest.raises(IllPosedError, match="6 variables of the expansion depend"):
        directions(surface, grid, modes[:5], places, 6)


@pytest.mark.parametrize(("lay", "symmetries"), [(0.0, 2), (0.6, 1)])
def test_signs_of_the_variables_are_those_of_surfaces_turned_with_their_nodes(lay, symmetries):
    """Mirrored along x and along y; where the lay is aslant, turned by half a turn. A turned surface of the modes is
    one of the modes again, as their covariance stays the same."""
    covariance = covariance_of("gaussian", 1.0, 6.0, 9.0, lay)
    surface, grid = GaussianModel(covariance, covariance.axis_lengths_m), Grid(24, 24, 1.0, 1.0)
    modes = karhunen_loeve(covariance, grid, 30).modes
    places = training_nodes(surface.lengths_m, grid)
    even, odd = directions(surface, grid, modes, places, 8)
    assert odd.shape == (8, symmetries)
    flips = [(0,), (1,)] if symmetries == 2 else [(0, 1)]
    at = {node: number for number, node in enumerate(zip(places.x.tolist(), places.y.tolist(), strict=True))}
    flat = modes.reshape(30, -1).T
    for flip, signs in zip(flips, odd.T, strict=True):
        turn, left, *_ = np.linalg.lstsq(flat, np.flip(modes, [1 + axis for axis in flip]).reshape(30, -1).T)
        assert np.all(left < 1e-20)
        for (x, y), number in at.items():
            image = at[23 - x if 0 in flip else x, 23 - y if 1 in flip else y]
            np.testing.assert_allclose(even[image] @ turn, even[number] * (-1.0) ** signs[:, None], atol=1e-7)


SOURCE = Path(__file__).resolve().parents[2] / "src"


@pytest.mark.parametrize(
    ("error", "lines"),
    [
        (ConvergenceError("no end", 1e-3, 7), ["contact: error: no end (residual reached 1.000e-03, work 7)"]),
        (InputError(["first mistake", "second mistake"]), ["contact: error: first mistake", "second mistake"]),
    ],
)
def test_an_error_of_the_package_is_a_message(tmp_path, monkeypatch, capsys, error, lines):
    """And no record is left. A mistake of ours keeps its traceback."""
    raised = [error, ZeroDivisionError()]

    def work(scene, job):
        raise raised.pop(0)

    module = ModuleType("contact")
    module.work = work
    monkeypatch.setitem(sys.modules, "roughslip.study.contact", module)
    key = tmp_path / "contact" / "0" / "key.json"
    key.parent.mkdir(parents=True)
    entry = {"stage": "contact", "configuration": {"seed": 5}, "code": "abc"}
    entry |= {name: {} for name in ("sources", "inputs", "outputs", "files")}
    key.write_text(json.dumps(entry), encoding="utf-8")
    monkeypatch.setattr(sys, "argv", ["stage", "--key", str(key), "--first", "0", "--last", "2"])
    with pytest.raises(SystemExit) as stop:
        main()
    assert stop.value.code == 1
    assert capsys.readouterr().err.splitlines() == lines
    assert sorted(path.name for path in key.parent.iterdir()) == ["key.json"]
    with pytest.raises(ZeroDivisionError):
        main()


def test_record_holds_costs_counts_and_warnings(tmp_path, capsys):
    job = job_of("contact", {"seed": 5}, tmp_path / "contact.nc")
    job.count(solves=3, convolutions=40)
    job.count(solves=2)
    job.warn("few strips", "long waves", "few strips")
    record = json.loads(json.dumps(job.record()))
    assert (record["stage"], record["jobs"]) == ("contact", 1)
    assert record["did"] == {"convolutions": 40, "solves": 5}
    assert record["warnings"] == ["few strips", "long waves"]  # each once, and in the log
    assert capsys.readouterr().err.splitlines() == ["contact: warning: few strips", "contact: warning: long waves"]
    assert record["cpu_seconds"] == pytest.approx(time.process_time(), abs=0.2)
    assert record["peak_memory_mib"] > 10


@pytest.mark.skipif(sys.platform != "linux", reason="Linux only")
def test_a_job_dies_with_its_parent(tmp_path):
    """The child holds the other end of the pipe: reading it ends when the child is gone, long before its 60 s.

    The stage is still importing numpy, as it does for seconds on a busy machine.
    """
    (tmp_path / "numpy.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    parent = (
        "import os, subprocess, sys; from roughslip.study import PARENT\n"
        "os.environ[PARENT] = str(os.getpid()); subprocess.run([sys.executable, '-m', 'roughslip.study'])"
    )
    command = [sys.executable, "-c", parent]
    process = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True, cwd=tmp_path)
    assert process.stdout.readline() == "ready\n"
    process.kill()
    assert process.communicate(timeout=20)[0] == ""


def test_ctrl_c_ends_a_stage_without_a_traceback(tmp_path):
    """While it imports numpy. A test that runs in the background of a shell would hand on that Ctrl-C is ignored."""
    (tmp_path / "numpy.py").write_text("import time; print('ready', flush=True); time.sleep(60)")
    process = subprocess.Popen(
        [sys.executable, "-m", "roughslip.study"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    assert process.communicate(timeout=20) == ("", "")
    assert process.returncode == -signal.SIGINT


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(SOURCE)}


def record(stage, cpu, peak, **did):
    numbers = {"cpu_seconds": cpu, "wall_seconds": 2 * cpu, "peak_memory_mib": peak}
    return {"stage": stage, "jobs": 1, **numbers, "did": did, "warnings": []}


def test_costs_add_up_and_memory_is_that_of_the_largest_job():
    """Counts of zero are kept."""
    jobs = [
        record("friction", 0.0, 90.0, windows=10),
        record("contact", 10.0, 300.0, solves=3, convolutions=40),
        record("contact", 20.0, 250.0, solves=4),
    ]
    jobs[1]["warnings"], jobs[2]["warnings"] = ["b", "c"], ["a", "b"]
    contact, _, everything = total_costs(jobs, ["of the scene"])
    assert contact == {
        "stage": "contact",
        "jobs": 2,
        "cpu_seconds": 30.0,
        "wall_seconds": 60.0,
        "peak_memory_mib": 300.0,
        "did": {"convolutions": 40, "solves": 7},
        "warnings": ["b", "c", "a"],
    }
    assert everything["warnings"] == ["of the scene", "contact: b", "contact: c", "contact: a"]
    assert (everything["stage"], everything["jobs"]) == ("all", 3)
    assert everything["did"] == {"convolutions": 40, "solves": 7, "windows": 10}


CAPTIONS = {"figure2": "Pressure.", "figure5": "Cycles."}


@pytest.fixture
def scene(tmp_path):
    """A scene that ran one stage for Figure 5, in a folder where Figure 2 was made before."""
    (tmp_path / "keys").mkdir()
    for stage, configuration in (
        ("page", {"description": "Mine", "targets": ["figure5"], "captions": {}}),
        ("cycles", {"oscillator": {"damping_ratio": 0.17}}),
        ("deterministic", {"oscillator": {"mass_kg": 1.0}}),
        ("figures", {"description": "Mine"}),
        ("contact_square", {"oscillator": {"damping_ratio": 0.4}, "square": {"nodes": 10}}),
    ):
        key = {"configuration": configuration, "code": "abc"}
        (tmp_path / "keys" / f"{stage}.json").write_text(json.dumps(key), encoding="utf-8")
    for name in ("figure2", "figure5"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
        (tmp_path / f"{name}.svg").write_text(f"<svg>{name}</svg>")
    costs = [{"stage": stage} for stage in ("cycles", "deterministic", "figures", "all")]
    (tmp_path / "costs.json").write_text(json.dumps(costs), encoding="utf-8")
    (tmp_path / "claims.json").write_text("[]", encoding="utf-8")
    return tmp_path


def files_of(folder: Path) -> dict[str, Path]:
    names = ("costs.json", "claims.json", "figure5.png", "figure5.svg")
    keys = (f"keys/{stage}.json" for stage in ("page", "cycles", "deterministic", "figures", "contact_square"))
    return {name: folder / name for name in (*names, *keys)}


def test_only_what_this_run_made_is_shown(scene):
    page_scene = read_scene("mine", files_of(scene), CAPTIONS, Path("results/mine"))
    assert (page_scene.name, page_scene.description, page_scene.folder, page_scene.file) == ("mine", "Mine", "", "")
    assert page_scene.figures == {"figure5": b"<svg>figure5</svg>"}
    assert json.loads(page_scene.configuration) == {
        "description": "Mine",
        "targets": ["figure5"],
        "oscillator": {"damping_ratio": 0.17, "mass_kg": 1.0},
    }


def test_links_lead_from_the_joint_page_to_files_of_the_scene(scene, monkeypatch):
    """The scene file too."""
    monkeypatch.chdir(scene)
    file = scene / "config/scenes/mine.yaml"
    file.parent.mkdir(parents=True)
    file.write_text("{}")
    page_scene = read_scene("mine", files_of(scene), CAPTIONS, Path("results"))
    assert (page_scene.folder, page_scene.file) == ("mine/", "../config/scenes/mine.yaml")
