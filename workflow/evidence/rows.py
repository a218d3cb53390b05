"""Rows of results: the name of a case, and work spread over processes.

A case is `key=value` pairs joined by spaces. Rows of one case may be compared.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any, TypeVar

from roughslip.stages.runtime.parent import die_with_parent

Row = dict[str, Any]
Item = TypeVar("Item")
Result = TypeVar("Result")


def case(**pairs: object) -> str:
    """Return the name of a case: `key=value` pairs joined by spaces."""
    return " ".join(f"{key}={value}" for key, value in pairs.items())


def fields(name: str) -> dict[str, str]:
    """Return the pairs of a case's name."""
    return dict(pair.split("=", 1) for pair in name.split(" "))


def power(value: float) -> str:
    """Return a tolerance as it stands in the name of a case, for example 1e-6."""
    mantissa, exponent = f"{value:e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def map_parallel(work: Callable[[Item], Result], items: Iterable[Item], jobs: int = 1, chunk: int = 1) -> list[Result]:
    """Return `work(item)` of every item in their order, computed by so many new processes.

    work : a function at the top of a module, which new processes can import
    chunk : items that a process takes at a time

    The processes end with this one, even if it is killed.
    """
    with ProcessPoolExecutor(jobs, get_context("spawn"), die_with_parent) as pool:
        return list(pool.map(work, items, chunksize=chunk))
