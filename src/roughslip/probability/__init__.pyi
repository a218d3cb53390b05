from roughslip.probability.distributions import BetaDistribution as BetaDistribution
from roughslip.probability.distributions import beta_moments as beta_moments
from roughslip.probability.distributions import empirical_distribution as empirical_distribution
from roughslip.probability.estimate import Estimate as Estimate
from roughslip.probability.estimate import Source as Source
from roughslip.probability.estimate import variance_split as variance_split
from roughslip.probability.estimate import wilson_interval as wilson_interval
from roughslip.probability.translation import translate as translate
