"""Stage chaos_square on a contact that a linear expansion meets exactly, and the distribution given contact."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from roughslip.chaos import centre_distribution
from roughslip.chaos.centre_distribution import cumulative_given_contact
from roughslip.chaos.hermite import even_terms, hermite_basis, multi_indices
from roughslip.contact.influence import Influence
from roughslip.errors import IllPosedError
from roughslip.scene.types import scene_of
from roughslip.study import chaos_square, karhunen_loeve
from roughslip.study.from_scene import expansion, geometry, surface_model
from roughslip.study.from_scene.geometry import latin_hypercubes, training_design, variables_of
from tests.study.scenes import CONTACT, changed

MODES, SAMPLES, DRAWS, MONTE_CARLO = 16, 8000, 20_000, 1500
CONFIGURATION = changed(
    CONTACT,
    roughness={"correlation_length_m": 3e-5},
    square={"nodes": 4, "modes": MODES, "latin_hypercube_samples": SAMPLES},
    expansion={"target": "trial_pressure", "degree": 2, "samples": 200},
    numerics={"contact_area": "nodes"},
)
AT_EDGES = 4e6  # Pa, that cells in contact bear too much
MEAN, SCATTER = -2e7, 5e7  # Pa, of the trial pressure at the centre: in contact with probability Phi(-0.4)
PROBABILITY = norm.cdf(MEAN / SCATTER)
# To the height and to what the curvature along x adds to it. To the slopes there is none: by symmetry it would vanish.
RESPONSE = np.array([0.6, 0.0, 0.0, -0.8])


def trial_pressure(xi: np.ndarray, variables: np.ndarray) -> np.ndarray:
    return MEAN + SCATTER * xi @ variables.T @ RESPONSE


@pytest.fixture(scope="module", autouse=True)
def small():
    """Fewer variables and draws."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chaos_square, "FUNCTIONALS", 4)
        patch.setattr(chaos_square, "DRAWS", DRAWS)
        yield


@pytest.fixture(scope="module")
def modes(run):
    return run(karhunen_loeve, CONFIGURATION)


@pytest.fixture(scope="module")
def variables(modes):
    """(4, 4, MODES) at the four central nodes, which are all that train on so coarse a mesh."""
    model, grid = surface_model.gaussian_model(scene_of(CONFIGURATION)), geometry.square_grid(scene_of(CONFIGURATION))
    return expansion.directions(model, grid, modes["modes"], geometry.training_nodes(model.lengths_m, grid), 4)[0]


@pytest.fixture(scope="module")
def batches(stored, variables):
    """Monte Carlo in two batches, named in another order than numbered, with four equal central nodes.

    Of the Latin hypercubes only the centre counts. The design of our expansion follows the variables at each node.
    """
    scene = scene_of(CONFIGURATION)
    stiffness = 1 / Influence(geometry.square_grid(scene), 2.1e11 / (1 - 0.3**2)).diagonal
    drawn = [variables_of(7, number, MODES) for number in range(MONTE_CARLO)]

    def batch(name: str, method: str, first: int, xi: np.ndarray):
        trial = np.tile(trial_pressure(xi, variables[0])[:, None], 4)
        if method == "latin_hypercube":
            trial[:, 1:] *= -1
        if method == "expansion":
            trial = np.column_stack([trial_pressure(xi, one) for one in variables])
        shape = ("sample", "node")
        fields = {"pressure": (shape, np.maximum(trial, 0)), "gap": (shape, np.maximum(-trial, 0) / stiffness)}
        if method == "expansion":
            fields["point_pressure"] = shape, np.maximum(trial - AT_EDGES, 0)
        return stored(name, {"first": first, "design": method}, **fields)

    return [
        batch("b.nc", "monte_carlo", 0, np.array(drawn[:1000])),
        batch("a.nc", "monte_carlo", 1000, np.array(drawn[1000:])),
        batch("l.nc", "latin_hypercube", 0, np.concatenate(list(latin_hypercubes(scene, MODES)))),
        batch("e.nc", "expansion", 0, training_design(scene, MODES)),
    ]


@pytest.fixture(scope="module")
def expanded(run, modes, batches):
    """What the stage writes where the scene says this of the contact area."""

    def expand(contact_area="nodes"):
        with pytest.MonkeyPatch.context() as patch:  # intervals have tests of their own
            patch.setattr(centre_distribution, "REPLICATES", 20)
            patch.setattr(centre_distribution, "BLOCKS", 1)
            scene = changed(CONFIGURATION, numerics={"contact_area": contact_area})
            return run(chaos_square, scene, surface=modes.path, contact=batches)

    return expand


@pytest.fixture(scope="module")
def distributions(expanded):
    return expanded()


def test_expansions_that_are_exact_have_no_error(distributions, modes, variables):
    """Eq. (8) and ours; eq. (9) is of another shape. Ours has the even terms at all training nodes."""
    assert list(distributions["method"]) == ["monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip"]
    assert list(distributions["fit"]) == ["equation_8", "equation_9", "roughslip"]
    assert np.all(distributions["fit_leave_one_out"][[0, 2]] < 1e-20)
    assert distributions["fit_leave_one_out"][1] > 1e-6
    in_contact = distributions["fit_samples"][0]
    deviation = 2 * math.sqrt(SAMPLES / 2 * PROBABILITY * (1 - PROBABILITY))
    assert in_contact == distributions["fit_samples"][1] == pytest.approx(SAMPLES / 2 * PROBABILITY, abs=deviation)
    height = modes["modes"][:, 2, 2]
    np.testing.assert_allclose(variables[0, 0], height / np.linalg.norm(height), atol=1e-12)
    rows = np.concatenate([training_design(scene_of(CONFIGURATION), MODES) @ one.T for one in variables])
    signs = np.array([[0, 0], [1, 0], [0, 1], [0, 0]])  # height, slopes, curvature: mirrored along x, along y
    basis = hermite_basis(rows, even_terms(multi_indices(4, 2), signs))
    assert basis.shape == (4 * 200, 8)  # 1, h, c, h^2, h c, c^2, and the squares of the slopes
    condition = np.linalg.cond(basis / np.linalg.norm(basis, axis=0))
    assert distributions["fit_condition_number"][2] == pytest.approx(condition)
    assert distributions["fit_samples"][2] == 4 * 200


def test_distributions_are_those_of_a_cut_normal(distributions, variables):
    """P(p <= x | p > 0) by the normal law, within four standard errors of the draws; K/K_t is that of the designs."""
    exact = (norm.cdf((distributions["pressure"] - MEAN) / SCATTER) - 1 + PROBABILITY) / PROBABILITY
    for row, count in ((0, MONTE_CARLO), (1, SAMPLES), (2, 20_000), (4, DRAWS)):
        tolerance = 2 / math.sqrt(count * PROBABILITY)
        np.testing.assert_allclose(distributions["cumulative"][row], exact, atol=tolerance)
        share, low, high = (distributions[f"contact_probability{end}"][row] for end in ("", "_low", "_high"))
        assert share == pytest.approx(PROBABILITY, abs=2 / math.sqrt(count))
        assert low <= share <= high
    assert distributions["fit_positive_share"][2] == distributions["contact_probability"][4]
    xi = np.concatenate(list(latin_hypercubes(scene_of(CONFIGURATION), MODES)))
    in_contact = trial_pressure(xi, variables[0]) > 0
    np.testing.assert_allclose(distributions["contact_probability"][1:4], np.mean(in_contact), atol=1e-12)
    assert distributions["distance"][0] == 0.0
    contacts = MONTE_CARLO * PROBABILITY
    limit = 1.63 * math.sqrt(1 / contacts + 1 / (DRAWS * PROBABILITY))
    assert np.all(distributions["distance_in_contact"][[2, 4]] < limit)
    assert distributions["distance_between_variants"] == pytest.approx(distributions["distance_in_contact"][3], abs=0.1)
    assert distributions["captured_variance"] == pytest.approx(1.0)


def test_equations_given_contact_are_those_of_a_direct_sample_given_contact(distributions, variables):
    """Eq. (8) is exact here, so it is the cut normal; eq. (9) is what its fit by hand gives at the direct sample.

    The solved surfaces err by 1.63 / sqrt(n), one in a hundred. Over all surfaces eq. (9), which has no end at zero, is
    in contact everywhere.
    """
    xi = next(latin_hypercubes(scene_of(CONFIGURATION), MODES))
    pressure = trial_pressure(xi, variables[0])
    basis = hermite_basis((xi @ variables[0].T)[pressure > 0], multi_indices(4, 2))
    coefficients = np.linalg.lstsq(basis, np.log(pressure[pressure > 0]), rcond=None)[0]
    u = np.random.default_rng(21).standard_normal((400_000, 4))
    direct = np.exp(hermite_basis(u[MEAN + SCATTER * u @ RESPONSE > 0], multi_indices(4, 2)) @ coefficients)
    exact = (norm.cdf((distributions["pressure"] - MEAN) / SCATTER) - 1 + PROBABILITY) / PROBABILITY
    surfaces = int(distributions["given_surfaces"])
    assert surfaces == pytest.approx(MONTE_CARLO * PROBABILITY, abs=4 * math.sqrt(MONTE_CARLO * 0.25))
    for row, truth in enumerate((exact, cumulative_given_contact(direct, distributions["pressure"]))):
        np.testing.assert_allclose(distributions["given_cumulative"][row], truth, atol=1.63 / math.sqrt(surfaces))
    np.testing.assert_array_equal(distributions["given_positive_share"], 1.0)
    true = np.max(np.abs(cumulative_given_contact(direct, distributions["pressure"]) - exact))
    assert distributions["given_distance_low"][1] <= true + 0.01
    assert true - 0.01 <= distributions["given_distance_high"][1]
    assert distributions["given_between_low"] <= true + 0.01
    assert distributions["given_distance"][0] < distributions["given_distance_high"][0] < 0.1
    assert distributions["fit_positive_share"][1] == 1.0
    assert distributions["distance_in_contact"][3] > 2 * distributions["given_distance"][1]


def test_draws_bear_less_by_what_cells_at_edges_bear_too_much(expanded, distributions):
    """Of the training nodes all bear AT_EDGES too much, so the expansion is in contact with Phi((m - AT_EDGES) / s)."""
    corrected, points = expanded("corrected"), norm.cdf((MEAN - AT_EDGES) / SCATTER)
    assert distributions["contact_probability"][4] == pytest.approx(PROBABILITY, abs=2 / math.sqrt(DRAWS))
    assert corrected["contact_probability"][4] == pytest.approx(points, abs=4 * math.sqrt(points / 800))
    np.testing.assert_array_equal(corrected["contact_probability"][:2], distributions["contact_probability"][:2])


def test_an_equation_that_is_refused_is_stored_as_nan(run, modes, batches):
    def refuse(*arguments, **options):
        raise IllPosedError("design 2 of 2: no sample is in contact")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(chaos_square, "fit_equation", refuse)
        result = run(chaos_square, CONFIGURATION, "refused", surface=modes.path, contact=batches)
    assert len([line for line in run.warnings if "design 2 of 2" in line and "stored as NaN" in line]) == 2
    for name in ("given_distance", "given_cumulative", "given_between", "distance_between_variants"):
        assert np.isnan(result[name]).all()
    assert np.isnan(result["cumulative"][2:4]).all()
    assert np.all(result["contact_probability"][2:4] == result["contact_probability"][1])
