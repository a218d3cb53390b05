"""A figure stage saves the picture twice and the numbers in it, with their units and what made them."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from roughslip import store
from roughslip.errors import StoreError
from roughslip.stages.runtime.drawing import draw_and_save

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


def test_a_variable_that_the_result_lacks_is_named(job):
    with pytest.raises(StoreError, match="holds no variable 'missing'"):
        draw_and_save(job, draw, ["drawn", "missing"])
