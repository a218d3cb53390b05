"""Random rough surfaces.

    surface = gaussian_model(covariance_of("gaussian", 1e-6, 2e-5))
    heights = surface.heights(surface.sampler(grid)(np.random.default_rng(1)))

- covariance_of, self_affine, MODELS: covariance models; a scan's table by measured_model
- Covariance: what a model of your own inherits
- gaussian_model, WeierstrassMandelbrot: surfaces to draw on any mesh, with heights of any distribution
- karhunen_loeve: modes
- rms_slope: of a covariance, or between nodes

`__init__.pyi` lists all public names and their modules.
"""

from roughslip.public_names import public_names

__getattr__, __dir__, __all__ = public_names(__name__, __file__)
