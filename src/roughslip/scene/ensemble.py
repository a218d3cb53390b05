"""Sections `ensemble`, `survival` and `answer` of a scene: the runs of the oscillator."""

from __future__ import annotations

from typing import Literal

from roughslip.scene.auto import AUTO, Auto
from roughslip.scene.fields import Section, choice, flag, integer, many, number, section

Process = Literal["recursion", "spectral"]
Marginal = Literal["beta", "empirical", "paper"]


@section
class Ensemble(Section):
    """Runs of figure 5."""

    realisations: Auto[int] = integer(
        "Realisations of the friction process for each damping ratio; fewer than 8 give no interval. With auto, as "
        "many as accuracy takes",
        at_least=8,
        at_most=1_000_000,
        or_auto=True,
        default=AUTO,
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, 2 pi/omega; reattachment statistics leave out the first ten",
        at_least=20,
        at_most=10000,
    )
    process: Process = choice(
        "Method that draws realisations of the friction process: recursion, exact and piece by piece; spectral, "
        "waves of random phase as in the paper, which keeps a whole realisation in memory",
        Process,
        default="recursion",
    )
    marginal: Marginal = choice(
        "Distribution of the friction process, at the mean and standard deviation of the windows: beta, fitted; "
        "empirical, the quantiles of the windows; paper, Beta(2.1, 5)",
        Marginal,
        default="beta",
    )
    nodes_per_correlation_length: Auto[int] = integer(
        "Nodes of a realisation of the friction process per correlation length; with auto, as few as accuracy allows",
        at_least=2,
        at_most=1000,
        or_auto=True,
        default=AUTO,
    )
    count_by_period: bool = flag(
        "Whether the runs without scatter end with their first cycle, which all later ones repeat, and are counted by "
        "its period; not with excitation",
        default=False,
    )
    damping_ratios: Auto[tuple[float, ...]] = many(
        "Damping ratios of figure 5 (c), strictly increasing; auto for a list around the scene's own limits",
        number("A damping ratio, as oscillator.damping_ratio", at_least=0, at_most=10),
        most=200,
        or_auto=True,
        default=AUTO,
    )
    drawn_realisations: int = integer(
        "Realisations drawn in figure 5 (a); only their whole trajectories are stored", at_least=1, at_most=1000
    )


@section
class Survival(Section):
    """Lifetimes of stick-slip and of steady sliding near the limit of existence, of figure_lifetimes."""

    scatter_factors: tuple[float, ...] = many(
        "Multiples of the standard deviation of friction, strictly increasing",
        number("A multiple", above=0, at_most=100),
        most=20,
    )
    points: int = integer(
        "Damping ratios around the limit of existence, as far from it as the scatter moves it", at_least=2, at_most=200
    )
    realisations: int = integer(
        "Realisations of the friction process at each, from rest on the belt and from steady sliding",
        at_least=8,
        at_most=10000,
    )
    duration_periods: float = number("Duration of a run in natural periods", at_least=20, at_most=10000)


@section
class Answer(Section):
    """Runs that tell whether stick-slip occurs, and where it ceases or begins: answer.json."""

    realisations: int = integer(
        "Realisations of the friction process, the same at every value; fewer than 72 do not bound a probability of "
        "5 %",
        at_least=72,
        at_most=10000,
        default=100,
    )
    duration_periods: Auto[float] = number(
        "Duration of a run after its first departure, in natural periods, of which the second half counts; auto: what "
        "the vibration's decay, the cycle and the correlation of friction take, 40 to 400",
        at_least=20,
        at_most=1_000_000,
        or_auto=True,
        default=AUTO,
    )
