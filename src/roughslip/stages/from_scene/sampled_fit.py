"""The best of the models fitted to a scan whose surfaces can be sampled on the meshes of the scene."""

from collections.abc import Sequence

from roughslip.errors import IllPosedError, ParameterError
from roughslip.grid import Grid
from roughslip.probability import EmpiricalDistribution, FamilyDistribution
from roughslip.scan.covariance_fit import CovarianceFit
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, surface_model
from roughslip.surface import model as surface

UNSAMPLED = {"figure_scan", "figure2", "figure_field"}  # targets that draw no strips; squares are expanded in modes


def meshes(scene: Scene, scan: Grid) -> dict[str, Grid]:
    """On which surfaces of the scene are sampled, by name. scan : the mesh of the scan, on which its twins are"""
    if UNSAMPLED.issuperset(scene.targets) or scene.strip.cell_m is None:
        return {"scan": scan}
    return {"scan": scan, "strip": geometry.strip_grid(scene), "expansion of a strip": geometry.lattice(scene).grid}


def best_sampled(
    fits: Sequence[CovarianceFit],
    marginal: FamilyDistribution | EmpiricalDistribution | None,
    correct_correlation: bool,
    on: dict[str, Grid],
    endless: int | None = None,
) -> tuple[CovarianceFit, list[str]]:
    """The first of the fits whose surfaces can be sampled on every mesh, and a line for each one before it.

    on : meshes by name
    endless : axis of a lay that is taken as infinitely long

    Raises IllPosedError, which names the keys, where none of them can be.
    """
    left: list[str] = []
    for fit in fits:
        kind = fit.covariance.kind
        try:
            model = surface.gaussian_model(fit.covariance, None, marginal, correct_correlation=correct_correlation)
            model = surface_model.with_lay(model, endless, model.lengths_m[0])
        except IllPosedError as error:
            left.append(f"{kind} cannot have these heights ({error})")
            continue
        for name, grid in on.items():
            try:
                model.sampler(grid)
            except (IllPosedError, ParameterError) as error:
                reason = str(error).partition(";")[0]
                left.append(f"{kind} cannot be sampled on the mesh of the {name}, {grid.nx} x {grid.ny} ({reason})")
                break
        else:
            return fit, left
    raise IllPosedError(
        f"no surface of this model of the scan can be sampled: {'; '.join(left)}. Take roughness.scan.covariance: "
        f"{'best or ' if len(fits) == 1 else ''}measured, or a high-pass roughness.scan.cutoff_m"
    )
