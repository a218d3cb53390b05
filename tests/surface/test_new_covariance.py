"""A new covariance model is one module and one name in the registry."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from roughslip.scene.roughness import covariance_shapes
from roughslip.surface.models import MODELS

ROOT = Path(__file__).parents[2]
MODEL = '''@dataclass(frozen=True)
class Autoregressive(IsotropicCovariance):
    """(1 + u) exp(-u), once differentiable."""

    kind = "autoregressive"

    def profile(self, u):
        return (1 + u) * np.exp(-u)

    def transform(self, k):
        return 6 * np.pi * (1 + k**2) ** -2.5
'''
PROGRAM = """
import numpy as np
from roughslip.grid import Grid
from roughslip.scene.schema import scene_schema
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.scan.fit_data import estimates
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

model = covariance_of("autoregressive", 2.0, 3.0)
assert "autoregressive" in str(scene_schema())
x = np.arange(-6.0, 7.0)
data = estimates(x[:, None], x[None, :], model(x[:, None], x) / 4.0, np.full((13, 13), 0.01))
found = fit_covariance("autoregressive", data, 2.0)
print(float(model(np.array(3.0))), found.parameters["correlation_length_m"])
print(embed(model, Grid(200, 200, 1.0, 1.0)).sample(np.random.default_rng(1)).std())
"""


def test_scenes_read_the_registry():
    assert covariance_shapes() == {kind: dict(model.shapes) for kind, model in sorted(MODELS.items())}


@pytest.mark.slow
def test_a_new_covariance_reaches_scenes_samples_and_fits(tmp_path):
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    models = tmp_path / "src" / "roughslip" / "surface" / "models.py"
    source = (
        models.read_text()
        .replace("MODELS: dict", MODEL + "\n\nMODELS: dict")
        .replace("in (Gaussian,", "in (Autoregressive, Gaussian,")
    )
    models.write_text(source)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path / "src")}
    run = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, env=environment, check=False)
    assert run.returncode == 0, run.stderr
    at_one_length, fitted, deviation = (float(word) for word in run.stdout.split())
    assert at_one_length == pytest.approx(4.0 / 2.718281828459045, rel=1e-12)
    assert fitted == pytest.approx(3.0, rel=1e-6)
    assert deviation == pytest.approx(2.0, rel=0.1)
