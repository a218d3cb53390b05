"""Bowden-Tabor friction on windows that slide along a strip, its statistics, and its stochastic process.

    mu, valid = friction_coefficient(area, force, shear_strength_pa=1e8, least_area_m2=1e-13)
    process = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.01), correlation_length_m=2.5e-4)
    mu_s = sample_path(process, spacing_m=1e-5, nodes=1000, seed=[1])

- window_sums, friction_coefficient: friction of windows from sums over columns of a strip
- window_statistics, autocorrelation, fit_beta: statistics with intervals from resampled strips, strip_weights
- FrictionProcess, CorrelationShape, sample_path, path_sampler: the process, paths of n values, and paths without end

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
