"""Probability that surfaces, scans and friction share: distributions, translations of Gaussian variables, estimates."""

from roughslip.probability.distributions import (
    FAMILIES,
    BetaDistribution,
    FamilyDistribution,
    QuantileDistribution,
    beta_moments,
    distribution_of_moments,
)
from roughslip.probability.empirical import EmpiricalDistribution, empirical_distribution, fit_distribution
from roughslip.probability.estimate import TAILS, Estimate
from roughslip.probability.translation import Distribution, Translation, tabulate, translate

__all__ = [
    "FAMILIES",
    "TAILS",
    "BetaDistribution",
    "Distribution",
    "EmpiricalDistribution",
    "Estimate",
    "FamilyDistribution",
    "QuantileDistribution",
    "Translation",
    "beta_moments",
    "distribution_of_moments",
    "empirical_distribution",
    "fit_distribution",
    "tabulate",
    "translate",
]
