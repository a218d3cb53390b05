"""Random rough surfaces.

covariance_of, MODELS : covariance models by name; Covariance, StationaryCovariance : what they have in common
plane_height : where a rigid plane stands

Modules: embedding for exact samples, karhunen_loeve for expansions, fractal for plane waves of random phase,
measured_covariance for tables, model for heights of any distribution.
"""

from roughslip.surface.covariance import Covariance, StationaryCovariance, plane_height
from roughslip.surface.models import MODELS, covariance_of

__all__ = ["MODELS", "Covariance", "StationaryCovariance", "covariance_of", "plane_height"]
