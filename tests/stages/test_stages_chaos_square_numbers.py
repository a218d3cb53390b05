"""What stage chaos_square writes of a contact that a linear expansion in local variables meets exactly."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from roughslip.chaos.designs import monte_carlo
from roughslip.chaos.hermite import even_terms, hermite_basis, multi_indices
from roughslip.contact.influence import Influence
from roughslip.scene.types import scene_of
from roughslip.stages import chaos_square, design, karhunen_loeve
from roughslip.stages.from_scene import expansion, geometry, nodes, surface_model
from roughslip.stages.result_tables import centre_distribution

MODES, SAMPLES, DRAWS, MONTE_CARLO = 16, 300, 20_000, 1500
CONFIGURATION = {
    "seed": 7,
    "roughness": {"covariance": "gaussian", "rms_height_m": 2e-7, "correlation_length_m": 3e-5},
    "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    "square": {"edge_m": 6e-5, "nodes": 4, "modes": MODES, "latin_hypercube_samples": SAMPLES},
    "expansion": {"target": "trial_pressure", "variables": 4, "degree": 2, "samples": 200, "draws": DRAWS},
}
MEAN, SCATTER = -2e7, 5e7  # Pa, of the trial pressure at the centre: in contact with probability Phi(-0.4)
# To the height and to what the curvature along x adds to it. To the slopes there is none: by symmetry it would vanish.
RESPONSE = np.array([0.6, 0.0, 0.0, -0.8])


def trial_pressure(xi: np.ndarray, variables: np.ndarray) -> np.ndarray:
    return MEAN + SCATTER * xi @ variables.T @ RESPONSE


@pytest.fixture(scope="module")
def modes(run):
    return run(karhunen_loeve, CONFIGURATION)


@pytest.fixture(scope="module")
def designs(run, modes):
    return run(design, CONFIGURATION, surface=modes.path)


@pytest.fixture(scope="module")
def variables(modes):
    """(4, 4, MODES) at the four central nodes, which are all that train on so coarse a mesh."""
    model, grid = surface_model.gaussian_model(scene_of(CONFIGURATION)), geometry.square_grid(scene_of(CONFIGURATION))
    return expansion.directions(model, grid, modes["modes"], nodes.training_nodes(model, grid), 4)[0]


@pytest.fixture(scope="module")
def batches(stored, designs, variables):
    """Monte Carlo in two batches, named in another order than numbered, its four central nodes alike; of the Latin
    hypercube the centre alone counts; the design of our expansion has at each node what the variables there say."""
    stiffness = 1 / Influence(geometry.square_grid(scene_of(CONFIGURATION)), 2.1e11 / (1 - 0.3**2)).diagonal
    drawn = [monte_carlo([7, geometry.STREAM_MONTE_CARLO, number], MODES) for number in range(MONTE_CARLO)]

    def batch(name: str, method: str, first: int, xi: np.ndarray):
        trial = np.tile(trial_pressure(xi, variables[0])[:, None], 4)
        if method == "latin_hypercube":
            trial[:, 1:] *= -1
        if method == "expansion":
            trial = np.column_stack([trial_pressure(xi, one) for one in variables])
        shape = ("sample", "node")
        fields = {"pressure": (shape, np.maximum(trial, 0)), "gap": (shape, np.maximum(-trial, 0) / stiffness)}
        return stored(name, {"first": first, "design": method}, **fields)

    return [
        batch("b.nc", "monte_carlo", 0, np.array(drawn[:1000])),
        batch("a.nc", "monte_carlo", 1000, np.array(drawn[1000:])),
        *(batch(f"{name}.nc", name, 0, designs[name]) for name in ("latin_hypercube", "expansion")),
    ]


@pytest.fixture(scope="module")
def expanded(run, modes, designs, batches):
    """What the stage writes where the scene says this of the expansion."""

    def expand(**changes):
        configuration = CONFIGURATION | {"expansion": CONFIGURATION["expansion"] | changes}
        with pytest.MonkeyPatch.context() as patch:  # intervals have tests of their own
            patch.setattr(centre_distribution, "REPLICATES", 20)
            patch.setattr(centre_distribution, "REFIT_BLOCKS", 1)
            return run(chaos_square, configuration, surface=modes.path, designs=designs.path, contact=batches)

    return expand


@pytest.fixture(scope="module")
def found(expanded):
    return expanded()


def test_expansions_that_are_exact_have_no_error(found):
    """Eq. (8) and ours; at the Monte Carlo samples themselves they are its pressures. Eq. (9) is of another shape."""
    assert list(found["method"]) == ["monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip"]
    assert list(found["fit"]) == ["equation_8", "equation_9", "roughslip"]
    assert np.all(found["fit_leave_one_out"][[0, 2]] < 1e-20)
    assert found["fit_leave_one_out"][1] > 1e-6
    contacts = MONTE_CARLO * norm.cdf(MEAN / SCATTER)
    np.testing.assert_array_less(found["fit_distance_at_contact"][[0, 2]], 2 / contacts)  # rounding may swap two ranks
    probability = norm.cdf(MEAN / SCATTER)
    deviation = 2 * math.sqrt(SAMPLES * probability * (1 - probability))
    in_contact = found["fit_samples"][0]
    assert in_contact == found["fit_samples"][1] == pytest.approx(SAMPLES * probability, abs=deviation)


def test_variables_are_those_of_the_centre_and_the_basis_has_all_nodes(found, modes, designs, variables):
    height = modes["modes"][:, 2, 2]
    np.testing.assert_allclose(found["direction"][0], height / np.linalg.norm(height), atol=1e-12)
    np.testing.assert_array_equal(found["direction"], variables[0])
    rows = np.concatenate([designs["expansion"] @ one.T for one in variables])
    signs = np.array([[0, 0], [1, 0], [0, 1], [0, 0]])  # height, slopes, curvature: mirrored along x, along y
    basis = hermite_basis(rows, even_terms(multi_indices(4, 2), signs))
    assert basis.shape == (4 * 200, 8)  # 1, h, c, h^2, h c, c^2, and the squares of the slopes
    assert found["fit_condition_number"][2] == pytest.approx(np.linalg.cond(basis / np.linalg.norm(basis, axis=0)))
    assert found["cross_validated"] < 1e-20
    assert found["fit_samples"][2] == 4 * 200


def test_modes_explain_what_the_response_has_of_them(found, variables):
    """A linear response: first and total index are the squares of its coefficients."""
    shares = (RESPONSE @ variables[0]) ** 2
    np.testing.assert_allclose(found["sobol_first"], shares, atol=1e-12)
    np.testing.assert_allclose(found["sobol_total"], shares, atol=1e-12)


def test_distributions_are_those_of_a_cut_normal(found, designs, variables):
    """P(r > 0) = Phi(m/s), E max(r, 0) = m Phi(m/s) + s phi(m/s), within four standard errors of their draws."""
    ratio = MEAN / SCATTER
    probability, mean = norm.cdf(ratio), MEAN * norm.cdf(ratio) + SCATTER * norm.pdf(ratio)
    deviation = math.sqrt((MEAN**2 + SCATTER**2) * norm.cdf(ratio) + MEAN * SCATTER * norm.pdf(ratio) - mean**2)
    exact = (norm.cdf((found["pressure"] - MEAN) / SCATTER) - 1 + probability) / probability
    for row, count in ((0, MONTE_CARLO), (1, SAMPLES), (4, DRAWS)):
        error = 4 / math.sqrt(count)
        assert found["contact_probability"][row] == pytest.approx(probability, abs=error / 2)
        assert found["mean_pressure"][row] == pytest.approx(mean, abs=error * deviation)
        np.testing.assert_allclose(found["cumulative"][row], exact, atol=error / 2 / math.sqrt(probability))
        low, high = found["contact_probability_low"][row], found["contact_probability_high"][row]
        assert low <= found["contact_probability"][row] <= high
    assert found["fit_positive_share"][2] == pytest.approx(probability, abs=2 / math.sqrt(DRAWS))
    assert found["fit_positive_share"][2] == found["contact_probability"][4]
    in_contact = trial_pressure(designs["latin_hypercube"], variables[0]) > 0
    assert found["contact_probability"][1] == pytest.approx(np.mean(in_contact), abs=1e-12)
    # the fit of samples in contact does not know how many there were: that is of the Latin hypercube
    assert found["contact_probability"][2] == found["contact_probability"][3] == found["contact_probability"][1]
    np.testing.assert_array_equal(found["samples"], [4 * MONTE_CARLO, SAMPLES, DRAWS, DRAWS, DRAWS])
    np.testing.assert_array_equal(found["distance"][0], 0.0)
    contacts = MONTE_CARLO * probability
    assert np.all(found["distance_in_contact"][[2, 4]] < 1.63 * math.sqrt(1 / contacts + 1 / (DRAWS * probability)))
    assert found["distance_between_variants"] == pytest.approx(found["distance_in_contact"][3], abs=0.1)
    assert found["captured_variance"] == pytest.approx(1.0)


def test_raw_modes_are_the_variables_at_the_centre_where_the_scene_says_so(expanded, designs, variables):
    """Three of sixteen modes leave what they do not hold of the response, the square of its part in the others, and
    what ten coefficients from 200 samples cost, to within three standard deviations of sqrt(2 / 200)."""
    found = expanded(rotation="none", variables=3)
    np.testing.assert_array_equal(found["direction"], np.eye(MODES)[:3])
    assert found["fit_samples"][2] == 200
    left = 1 - np.sum((RESPONSE @ variables[0])[:3] ** 2)
    assert found["cross_validated"] == pytest.approx(left * (1 + 10 / 200), rel=0.3)
    assert list(found["count"]) == [found.attributes["variables"]] == [3]


def test_a_regression_finds_the_response_that_two_functionals_make(expanded):
    """The response is linear in the modes, so that its direction alone leaves nothing, up to four nodes that differ."""
    found = expanded(rotation="regression", variables=1)
    assert found["direction"].shape == (1, MODES)
    assert found["cross_validated"] < 0.01
    assert expanded(variables=1)["cross_validated"] > 0.05


def test_the_best_number_of_variables_is_told_with_those_it_was_chosen_from(expanded, variables):
    """Height and curvature give the response exactly; of two variables it is not among, and six have nothing to add."""
    found = expanded(variables="best")
    assert list(found["count"][:2]) == [2, 4]
    assert found.attributes["variables"] == 4
    np.testing.assert_array_equal(found["direction"], variables[0])
    assert found["count_score"][0] > 0.1
    assert np.nanmax(found["count_score"][1:]) < 1e-6
    assert found["count_error"][int(np.nanargmin(found["count_score"]))] == 0


@pytest.mark.parametrize(("asked", "taken"), [(3, 3), (10, 8)])
def test_the_paper_takes_the_same_variables_but_eight_at_most(expanded, designs, variables, asked, taken):
    found = expanded(rotation="none", variables=asked)
    assert len(found["direction"]) == asked
    in_contact = trial_pressure(designs["latin_hypercube"], variables[0]) > 0
    basis = hermite_basis(designs["latin_hypercube"][in_contact, :taken], multi_indices(taken, 2))
    assert found["fit_condition_number"][0] == pytest.approx(np.linalg.cond(basis / np.linalg.norm(basis, axis=0)))
    assert np.isfinite(found["fit_distance_at_contact"]).all()
