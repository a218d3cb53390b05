import math

import pytest

from roughslip.contact.material import Material
from roughslip.errors import ParameterError


def test_plane_strain_modulus() -> None:
    assert Material(210e9, 0.3).plane_strain_modulus_pa == pytest.approx(210e9 / 0.91, rel=1e-15)
    assert Material(1.0, 0.5).plane_strain_modulus_pa == pytest.approx(4 / 3, rel=1e-15)


@pytest.mark.parametrize("young", [0.0, -1.0, math.inf, math.nan])
def test_refuses_young_modulus(young: float) -> None:
    with pytest.raises(ParameterError, match="Young"):
        Material(young, 0.3)


@pytest.mark.parametrize("poisson", [-1.0, 0.51, math.nan, math.inf])
def test_refuses_poisson_ratio(poisson: float) -> None:
    with pytest.raises(ParameterError, match="Poisson"):
        Material(1.0, poisson)
