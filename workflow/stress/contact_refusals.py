"""Bad input to contact, each kind once: a ParameterError and nothing else is the answer to all of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.contact.influence import Influence, Material
from roughslip.contact.solve import solve, solve_load, sweep
from roughslip.grid import Grid

GRID = Grid(4, 3, 1e-6, 1e-6)
MODULUS = 2e11
NAN, INFINITY = math.nan, math.inf

NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, "nan": NAN}
NOT_FINITE = {"nan": NAN, "infinite": INFINITY, "minus infinite": -INFINITY}


def _heights() -> np.ndarray:
    return 1e-9 * np.arange(12.0).reshape(4, 3)


def _with(value: float) -> np.ndarray:
    heights = _heights()
    heights[1, 2] = value
    return heights


def _not_a_field() -> dict[str, Any]:
    """What is no field on the mesh, by name."""
    return {
        **{name: _with(value) for name, value in NOT_FINITE.items()},
        "empty": np.empty((0, 0)),
        "empty rows": np.empty((4, 0)),
        "one-dimensional": np.zeros(12),
        "three-dimensional": np.zeros((4, 3, 1)),
        "transposed": np.zeros((3, 4)),
        "a number": 1e-9,
        "complex": _heights() + 1e-9j,
        "text": np.full((4, 3), "high"),
        "a word": "high",
        "none": None,
        "ragged": [[1.0, 2.0], [3.0]],
        "objects": np.full((4, 3), None),
    }


def _refused() -> dict[str, Callable[[], object]]:
    free, cell = Influence(GRID, MODULUS), Influence(GRID, MODULUS, periodic=True)
    z = _heights()
    calls: dict[str, Callable[[], object]] = {}
    bad: Any  # of the wrong type as well
    for name, bad in _not_a_field().items():
        calls |= {
            f"solve interference {name}": partial(solve, free, bad),
            f"solve initial pressure {name}": partial(solve, free, z, initial_pressure=bad),
            f"load heights {name}": partial(solve_load, free, bad, 1e6),
            f"load initial pressure {name}": partial(solve_load, free, z, 1e6, initial_pressure=bad),
            f"periodic load heights {name}": partial(solve_load, cell, bad, 1e6),
            f"sweep heights {name}": partial(sweep, free, bad, [0.0]),
        }
    del calls["solve initial pressure none"], calls["load initial pressure none"]  # none is none
    for name, bad in {**NOT_POSITIVE, "text": "hard"}.items():
        calls |= {
            f"solve hardness {name}": partial(solve, free, z, hardness_pa=bad),
            f"load hardness {name}": partial(solve_load, free, z, 1e6, hardness_pa=bad),
            f"sweep hardness {name}": partial(sweep, free, z, [0.0], hardness_pa=bad),
        }
    for name, bad in {**NOT_POSITIVE, "infinite": INFINITY, "text": "much"}.items():
        calls |= {
            f"load {name}": partial(solve_load, free, z, bad),
            f"periodic load {name}": partial(solve_load, cell, z, bad),
            f"modulus {name}": partial(Influence, GRID, bad),
            f"periodic modulus {name}": partial(Influence, GRID, bad, periodic=True),
            f"Young's modulus {name}": partial(Material, bad, 0.3),
            f"cell edge {name}": partial(Grid, 4, 3, bad, 1e-6),
        }
    for name, bad in {**NOT_POSITIVE, "one": 1.0, "text": "tight"}.items():
        calls |= {
            f"solve tolerance {name}": partial(solve, free, z, bad),
            f"load tolerance {name}": partial(solve_load, free, z, 1e6, bad),
            f"sweep tolerance {name}": partial(sweep, free, z, [0.0], bad),
        }
    for name, bad in {**NOT_FINITE, "text": "low"}.items():
        calls[f"sweep plane {name}"] = partial(sweep, free, z, [0.0, bad])
    for name, bad in {"-1": -1.0, "-2": -2.0, "0.51": 0.51, "nan": NAN, "infinite": INFINITY, "text": "soft"}.items():
        calls[f"Poisson's ratio {name}"] = partial(Material, MODULUS, bad)
    for name, bad in {"0": 0, "-1": -1, "2.5": 2.5, "nan": NAN, "text": "four"}.items():
        calls[f"nodes {name}"] = partial(Grid, bad, 3, 1e-6, 1e-6)
    return calls | {
        "solve on a periodic cell": lambda: solve(cell, z),
        "sweep on a periodic cell": lambda: sweep(cell, z, [0.0]),
        "load at the hardness": lambda: solve_load(free, z, 1e6, hardness_pa=1e6),
        "load above the hardness": lambda: solve_load(free, z, 2e6, hardness_pa=1e6),
        "periodic load above the hardness": lambda: solve_load(cell, z, 2e6, hardness_pa=1e6),
        "solve initial pressure negative": lambda: solve(free, z, initial_pressure=_with(-1.0)),
        "load initial pressure negative": lambda: solve_load(free, z, 1e6, initial_pressure=_with(-1.0)),
    }


REFUSED = _refused()
