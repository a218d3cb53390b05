"""Stages of figures: each draws the results of another stage, and writes the numbers that it draws.

The code of such a stage is this module with the one that draws it, so an edit of one figure draws no other again.
"""

from importlib import import_module

from roughslip.scene.declarations import figure
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import draw_and_save

STAGES = [
    figure(
        name="figure2",
        of="chaos_square",
        caption="Figure 2. Pressure at the centre of the square, given contact: (a) as in the paper, (b) at low "
        "probabilities, and (c) the probability of contact. Both expansions (PC) are fitted to one Latin hypercube "
        "design (LHS) and evaluated at solved surfaces in contact that no fit has seen, with bands over all designs.",
    ),
    figure(
        name="figure2_traps",
        of="chaos_square",
        draws="figure2",
        target="figure2",
        caption="A trap of Figure 2. (a) and (b): the fits of both variants at variables drawn over all surfaces, of "
        "which pressures above zero count, and our own expansion of all samples. (c): the variables of surfaces in "
        "contact, to which the fits belong, next to those drawn.",
    ),
    figure(
        name="figure3",
        of="friction",
        caption="Figure 3. Friction coefficient of the test surface against penetration: as in the paper (a) mean and "
        "(b) standard deviation, and (c) their ratio. Combined: solved contact with the expansion as control variate, "
        "and the curve through it is the mean friction coefficient that the oscillator takes.",
    ),
    figure(
        name="figure3_law",
        of="friction",
        draws="figure3",
        target="figure3",
        caption="The distribution of the friction coefficient: its autocorrelation next to that of white pressure in "
        "the same windows, exponential lengths, and the marginal at median penetration. Below: distances from "
        "families of distributions, skewness and excess kurtosis.",
    ),
    figure(
        name="friction_against_load",
        of="friction",
        reads="load",
        caption="Friction against load: real area of contact, mean and coefficient of variation of the friction "
        "coefficient of the pad, and windows without contact, over two decades of nominal pressure. The shear strength "
        "is that which gives the pad its mean under the load of the scene, marked. Bands are 95 % intervals.",
    ),
    figure(
        name="figure5",
        of="cycles",
        caption="Figure 5. As in the paper (a) the limit cycle, (b) the point where the mass sticks again, and (c) "
        "the cycles lost to the scatter against damping; (d) the cycles themselves. The paper's dimensionless numbers "
        "are ours in metres.",
    ),
    figure(
        name="figure_map",
        of="stick_slip_map",
        draws="stick_slip",
        caption="Where stick-slip occurs: its probability over two parameters, with dots at the points that were run. "
        "Lines without scatter, where one axis is damping: the cycle exists left of the solid one, steady sliding is "
        "unstable left of the dashed one.",
    ),
    figure(
        name="figure_record",
        of="record",
        comes_with="record",
        caption="A measured friction record: over time, over sliding speed with the mean curve and its 95 % band, what "
        "the curve, drift and period leave, and the autocovariance of that with the fit. Below: synthetic records of "
        "the fitted process, on the scale of the measured one.",
    ),
    figure(
        name="figure_budget",
        of="budget",
        caption="What is worth measuring: the part of each source of uncertainty in the variance of whether it "
        "stick-slips, with the scatter of friction itself, and Sobol' indices of the limits of the cycle: wide bars "
        "total, narrow ones first, lines their 95 % intervals.",
    ),
    figure(
        name="figure_scan",
        of="synthetic_surfaces",
        comes_with="scan",
        caption="A scan, and surfaces sampled from the models fitted to it: map of the scan and of one sampled "
        "surface, density of heights, autocorrelation, radially averaged power spectrum. Bands around the scan are 95 "
        "% intervals, bands of the sampled surfaces reach from the least to the largest of them.",
    ),
]


def work(job: Job) -> None:
    """Draw a figure by the function of its name, and write its numbers."""
    (draws,) = (stage.draws for stage in STAGES if stage.name == job.usage.stage)
    module = import_module(f"roughslip.figures.{draws}")
    draw_and_save(job, getattr(module, job.usage.stage), module.DRAWN[job.usage.stage])
