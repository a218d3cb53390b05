"""The reference of the pressure at the centre of a scene's square, gathered from the solves of `pressure_solves`.

The four central nodes of a surface are alike but not independent. So every standard error takes the sum over a surface
as one observation (clusters), a share given contact as the ratio of two such sums (W. G. Cochran, Sampling
Techniques, 1977, section 2.11), and a quantile gets half of what lies between the quantiles at its probability less and
plus the standard error there (R. S. Woodruff, J. Am. Stat. Assoc. 47 (1952) 635). The mean pressure is kept twice, as
the mean of the solves and better known by `control`.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.errors import InputError
from workflow.references.control import controlled_means

PROBABILITIES = (0.01, 0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 0.999)  # of the quantiles given contact
STEPS = 380  # of the table of the distribution, equal in the probability given contact; the first and last are parted
TAIL = 10  # again, in geometric progression
LEAST = 1e-5  # from here


def levels_of(pressure: np.ndarray) -> np.ndarray:
    """Levels [Pa], ascending, from zero to the largest pressure : (...), at which the distribution is kept."""
    even = np.linspace(0.0, 1.0, STEPS + 1)
    tail = np.geomspace(LEAST, even[1], TAIL, endpoint=False)
    probabilities = np.sort(np.concatenate([even, tail, 1.0 - tail]))
    return np.concatenate([[0.0], np.quantile(pressure[pressure > 0], probabilities)])


def cumulative(pressure: np.ndarray, levels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Shares of pressures : (surfaces, nodes) at most as large as levels : (n,), and their standard errors, clustered.

    A surface with m of its n nodes below a level adds (m / n)^2 to the sum of squares. Sorted along the nodes, its r-th
    smallest pressure raises m from r - 1 to r, so that sums of squares are sums of (2 r - 1) / n^2 over the ranks.
    """
    surfaces, nodes = pressure.shape
    ranked = np.sort(pressure, axis=1)
    counts = np.stack([np.searchsorted(np.sort(ranked[:, rank]), levels, side="right") for rank in range(nodes)])
    share = counts.sum(axis=0) / (nodes * surfaces)
    squares = (2 * np.arange(nodes) + 1) @ counts / nodes**2
    return share, np.sqrt(np.maximum(squares / surfaces - share**2, 0.0) / (surfaces - 1))


def mean_and_error(values: np.ndarray) -> tuple[float, float]:
    """Mean over values : (surfaces, nodes) and its standard error, clustered."""
    of_surface = values.mean(axis=1, dtype=np.float64)
    return float(of_surface.mean()), float(of_surface.std(ddof=1) / np.sqrt(len(of_surface)))


def quantiles_given_contact(pressure: np.ndarray, probabilities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quantiles [Pa] of the positive ones among pressures : (surfaces, nodes), and their standard errors."""
    positive = np.sort(pressure[pressure > 0].astype(np.float64))
    found = np.quantile(positive, probabilities)
    contacts = np.count_nonzero(pressure > 0, axis=1)
    halves = np.empty(len(found))
    for place, (level, probability) in enumerate(zip(found, probabilities, strict=True)):
        below = np.count_nonzero((pressure > 0) & (pressure <= level), axis=1)
        error = np.sqrt(np.sum((below - probability * contacts) ** 2.0)) / contacts.sum()
        ends = np.quantile(positive, np.clip([probability - error, probability + error], 0.0, 1.0))
        halves[place] = 0.5 * (ends[1] - ends[0])
    return found, halves


def gathered(pressure: np.ndarray, percentiles: np.ndarray) -> dict[str, store.Variable]:
    """What is kept of pressures : (surfaces, penetrations, nodes) [Pa].

    Raises InputError for a penetration without contact or with fewer than two surfaces.
    """
    if len(pressure) < 2 or not (pressure > 0).any(axis=(0, 2)).all():
        raise InputError(["a reference needs two surfaces and contact at every penetration: gather more surfaces"])
    probabilities, rows = np.array(PROBABILITIES), []
    for number in range(len(percentiles)):
        nodes = np.ascontiguousarray(pressure[:, number])
        levels = levels_of(nodes.astype(np.float64))
        shares = cumulative(nodes, levels)
        contact = 1.0 - shares[0][0], shares[1][0]
        rows.append((levels, *shares, *contact, *mean_and_error(nodes), *quantiles_given_contact(nodes, probabilities)))
    table, one, given = ("penetration", "level"), ("penetration",), ("penetration", "probability")
    of = "standard error of the "
    described = (
        ("level", table, "Pa", "levels of the distribution, from zero to the largest pressure"),
        ("cumulative", table, "1", "share of the pressures that are at most the level, zeros included"),
        ("cumulative_standard_error", table, "1", of + "share, by surfaces"),
        ("contact_probability", one, "1", "share of the pressures above zero"),
        ("contact_probability_standard_error", one, "1", of + "contact probability, by surfaces"),
        ("mean_pressure", one, "Pa", "mean pressure, zeros included"),
        ("mean_pressure_standard_error", one, "Pa", of + "mean pressure, by surfaces"),
        ("quantile", given, "Pa", "quantiles of the pressure given contact"),
        ("quantile_standard_error", given, "Pa", of + "quantiles, by surfaces"),
    )
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    found = {
        name: store.Variable(dimensions, column, units, title)
        for (name, dimensions, units, title), column in zip(described, columns, strict=True)
    }
    found["probability"] = store.Variable(("probability",), probabilities, "1", "probabilities of the quantiles")
    found["percentile"] = store.Variable(one, percentiles, "percent", "penetration")
    found["surfaces"] = store.Variable((), len(pressure), "1", "surfaces that were solved")
    found["nodes"] = store.Variable((), pressure.shape[2], "1", "nodes of a surface whose pressure counts")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--key", type=Path, required=True, help="the key file of the solves")
    parser.add_argument("--solves", type=Path, nargs="+", required=True)
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()
    batches = store.read_all(arguments.solves)
    pressure = np.concatenate([batch["pressure"] for batch in batches])
    gap = np.concatenate([batch["gap"] for batch in batches])
    key = store.read_key(arguments.key)
    found = gathered(pressure, batches[0]["percentile"])
    mean, error = controlled_means(key.configuration, pressure, gap)
    title = "mean pressure, zeros included, with an expansion of it as control variate"
    found["controlled_mean_pressure"] = store.Variable(("penetration",), mean, "Pa", title)
    title = "standard error of the " + title
    found["controlled_mean_pressure_standard_error"] = store.Variable(("penetration",), error, "Pa", title)
    store.write(arguments.output, found, key)


if __name__ == "__main__":
    main()
