"""Which targets a scene lets its square and its strip expand."""

import pytest

from roughslip.chaos.pressure import KINDS
from roughslip.grid import Grid
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import expansion


class Surface:
    rms_height_m, lengths_m = 5e-8, (1e-5, 1e-5)


GRID = Grid(8, 8, 1e-6, 1e-6)


def configuration(target):
    return {
        "expansion": {"target": target},
        "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    }


@pytest.mark.parametrize("named", [*KINDS, "best"])
def test_the_square_tries_what_is_named_or_all(named):
    found = expansion.targets(scene_of(configuration(named)), Surface(), GRID)
    assert tuple(target.kind for target in found) == (KINDS if named == "best" else (named,))


@pytest.mark.parametrize(("named", "taken"), [("trial_pressure", "trial_pressure"), ("best", "squared_pressure")])
def test_the_strip_takes_what_is_named_or_what_serves_on_every_mesh(named, taken):
    assert expansion.strip_target(scene_of(configuration(named)), Surface(), GRID).kind == taken
