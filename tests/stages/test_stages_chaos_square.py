"""Stage chaos_square on a contact that a linear expansion meets exactly, and the distribution given contact."""

import math

import numpy as np
import pytest
from scipy.stats import norm

from roughslip.chaos import centre_distribution
from roughslip.chaos.centre_distribution import (
    EdgeCorrection,
    Reference,
    moved_local,
)
from roughslip.chaos.hermite import even_terms, hermite_basis, multi_indices
from roughslip.chaos.sampling import cumulative_given_contact, kolmogorov_distance, monte_carlo
from roughslip.contact.influence import Influence
from roughslip.scene.types import scene_of
from roughslip.stages import chaos_square, design, karhunen_loeve
from roughslip.stages.from_scene import expansion, geometry, surface_model
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.result_tables.given_contact import Members, Sampled, given_contact
from tests.stages.scenes import CONTACT, changed

MODES, SAMPLES, DRAWS, MONTE_CARLO = 16, 300, 20_000, 1500
CONFIGURATION = changed(
    CONTACT,
    roughness={"correlation_length_m": 3e-5},
    square={"nodes": 4, "modes": MODES, "latin_hypercube_samples": SAMPLES},
    expansion={"target": "trial_pressure", "variables": 4, "degree": 2, "samples": 200, "draws": DRAWS},
    numerics={"contact_area": "nodes"},
)
AT_EDGES = 4e6  # Pa, that cells in contact bear too much
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
    return expansion.directions(model, grid, modes["modes"], geometry.training_nodes(model.lengths_m, grid), 4)[0]


@pytest.fixture(scope="module")
def batches(stored, designs, variables):
    """Monte Carlo in two batches, named in another order than numbered, with four equal central nodes.

    Of the Latin hypercube only the centre counts. The design of our expansion follows the variables at each node.
    """
    stiffness = 1 / Influence(geometry.square_grid(scene_of(CONFIGURATION)), 2.1e11 / (1 - 0.3**2)).diagonal
    drawn = [monte_carlo([7, Stream.MONTE_CARLO, number], MODES) for number in range(MONTE_CARLO)]

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
        *(batch(f"{name}.nc", name, 0, designs[name]) for name in ("latin_hypercube", "expansion")),
    ]


@pytest.fixture(scope="module")
def expanded(run, modes, designs, batches):
    """What the stage writes where the scene says this of the expansion."""

    def expand(contact_area="nodes", **changes):
        with pytest.MonkeyPatch.context() as patch:  # intervals have tests of their own
            patch.setattr(centre_distribution, "REPLICATES", 20)
            patch.setattr(centre_distribution, "REFIT_BLOCKS", 1)
            scene = changed(CONFIGURATION, expansion=changes, numerics={"contact_area": contact_area})
            return run(chaos_square, scene, surface=modes.path, designs=designs.path, contact=batches)

    return expand


@pytest.fixture(scope="module")
def distributions(expanded):
    return expanded()


def test_expansions_that_are_exact_have_no_error(distributions):
    """Eq. (8) and ours; at the Monte Carlo samples themselves they are its pressures. Eq. (9) is of another shape."""
    assert list(distributions["method"]) == ["monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip"]
    assert list(distributions["fit"]) == ["equation_8", "equation_9", "roughslip"]
    assert np.all(distributions["fit_leave_one_out"][[0, 2]] < 1e-20)
    assert distributions["fit_leave_one_out"][1] > 1e-6
    contacts = MONTE_CARLO * norm.cdf(MEAN / SCATTER)
    np.testing.assert_array_less(
        distributions["fit_distance_at_contact"][[0, 2]], 2 / contacts
    )  # rounding may swap two ranks
    probability = norm.cdf(MEAN / SCATTER)
    deviation = 2 * math.sqrt(SAMPLES * probability * (1 - probability))
    in_contact = distributions["fit_samples"][0]
    assert in_contact == distributions["fit_samples"][1] == pytest.approx(SAMPLES * probability, abs=deviation)


def test_variables_are_those_of_the_centre_and_the_basis_has_all_nodes(distributions, modes, designs, variables):
    height = modes["modes"][:, 2, 2]
    np.testing.assert_allclose(distributions["direction"][0], height / np.linalg.norm(height), atol=1e-12)
    np.testing.assert_array_equal(distributions["direction"], variables[0])
    rows = np.concatenate([designs["expansion"] @ one.T for one in variables])
    signs = np.array([[0, 0], [1, 0], [0, 1], [0, 0]])  # height, slopes, curvature: mirrored along x, along y
    basis = hermite_basis(rows, even_terms(multi_indices(4, 2), signs))
    assert basis.shape == (4 * 200, 8)  # 1, h, c, h^2, h c, c^2, and the squares of the slopes
    assert distributions["fit_condition_number"][2] == pytest.approx(
        np.linalg.cond(basis / np.linalg.norm(basis, axis=0))
    )
    assert distributions["cross_validated"] < 1e-20
    assert distributions["fit_samples"][2] == 4 * 200
    shares = (RESPONSE @ variables[0]) ** 2  # of a linear response: first and total index are its squared coefficients
    np.testing.assert_allclose(
        [distributions["sobol_first"], distributions["sobol_total"]], [shares, shares], atol=1e-12
    )


def test_distributions_are_those_of_a_cut_normal(distributions, designs, variables):
    """P(r > 0) = Phi(m/s), E max(r, 0) = m Phi(m/s) + s phi(m/s), within four standard errors of their draws."""
    ratio = MEAN / SCATTER
    probability, mean = norm.cdf(ratio), MEAN * norm.cdf(ratio) + SCATTER * norm.pdf(ratio)
    deviation = math.sqrt((MEAN**2 + SCATTER**2) * norm.cdf(ratio) + MEAN * SCATTER * norm.pdf(ratio) - mean**2)
    exact = (norm.cdf((distributions["pressure"] - MEAN) / SCATTER) - 1 + probability) / probability
    for row, count in ((0, MONTE_CARLO), (1, SAMPLES), (4, DRAWS)):
        error = 4 / math.sqrt(count)
        assert distributions["contact_probability"][row] == pytest.approx(probability, abs=error / 2)
        assert distributions["mean_pressure"][row] == pytest.approx(mean, abs=error * deviation)
        np.testing.assert_allclose(distributions["cumulative"][row], exact, atol=error / 2 / math.sqrt(probability))
        low, high = distributions["contact_probability_low"][row], distributions["contact_probability_high"][row]
        assert low <= distributions["contact_probability"][row] <= high
    assert distributions["fit_positive_share"][2] == pytest.approx(probability, abs=2 / math.sqrt(DRAWS))
    assert distributions["fit_positive_share"][2] == distributions["contact_probability"][4]
    in_contact = trial_pressure(designs["latin_hypercube"], variables[0]) > 0
    assert distributions["contact_probability"][1] == pytest.approx(np.mean(in_contact), abs=1e-12)
    # the fit of samples in contact does not know how many there were: that is of the Latin hypercube
    assert (
        distributions["contact_probability"][2]
        == distributions["contact_probability"][3]
        == distributions["contact_probability"][1]
    )
    np.testing.assert_array_equal(distributions["samples"], [4 * MONTE_CARLO, SAMPLES, DRAWS, DRAWS, DRAWS])
    np.testing.assert_array_equal(distributions["distance"][0], 0.0)
    contacts = MONTE_CARLO * probability
    assert np.all(
        distributions["distance_in_contact"][[2, 4]] < 1.63 * math.sqrt(1 / contacts + 1 / (DRAWS * probability))
    )
    assert distributions["distance_between_variants"] == pytest.approx(distributions["distance_in_contact"][3], abs=0.1)
    assert distributions["captured_variance"] == pytest.approx(1.0)


def in_contact_directly(variables, count=400_000):
    """Variables of a direct sample of surfaces given contact: three in ten of normal draws."""
    u = np.random.default_rng(21).standard_normal((count, len(variables)))
    return u[MEAN + SCATTER * u @ RESPONSE > 0]


def test_variants_given_contact_are_those_of_a_direct_sample_given_contact(distributions, designs, variables):
    """Eq. (8) is exact here, so it is the cut normal; eq. (9) is what its fit by hand gives at the direct sample.

    The solved surfaces err by 1.63 / sqrt(n), one in a hundred, the evenly drawn ones by no more.
    """
    xi, ratio = designs["latin_hypercube"], MEAN / SCATTER
    pressure = trial_pressure(xi, variables[0])
    indices = multi_indices(4, 2)
    basis = hermite_basis((xi @ variables[0].T)[pressure > 0], indices)
    coefficients = np.linalg.lstsq(basis, np.log(pressure[pressure > 0]), rcond=None)[0]
    direct = np.exp(hermite_basis(in_contact_directly(variables[0]), indices) @ coefficients)
    exact = (norm.cdf((distributions["pressure"] - MEAN) / SCATTER) - norm.cdf(-ratio)) / norm.cdf(ratio)
    surfaces = int(distributions["given_surfaces"])
    assert surfaces == pytest.approx(MONTE_CARLO * norm.cdf(ratio), abs=4 * math.sqrt(MONTE_CARLO * 0.25))
    for row, truth in enumerate((exact, cumulative_given_contact(direct, distributions["pressure"]))):
        np.testing.assert_allclose(distributions["given_cumulative"][row], truth, atol=1.63 / math.sqrt(surfaces))
        np.testing.assert_allclose(
            distributions["judged_cumulative"][row], truth, atol=1.63 / math.sqrt(DRAWS * norm.cdf(ratio))
        )
    assert np.all(distributions["judged_distance"] < distributions["judged_chance"])
    np.testing.assert_array_equal(distributions["given_positive_share"], 1.0)
    true = kolmogorov_distance(direct, np.maximum(MEAN + SCATTER * in_contact_directly(variables[0]) @ RESPONSE, 0))
    assert distributions["given_distance_low"][1] <= true <= distributions["given_distance_high"][1]
    assert (
        distributions["given_distance"][0] < distributions["given_distance_high"][0] < 0.1
    )  # of a design with 100 in contact
    assert distributions["given_between_low"] <= true <= distributions["given_between_high"]
    assert np.sum(distributions["first_variable"] * np.diff(distributions["first_variable_edge"])) == pytest.approx(1.0)


def test_variants_given_contact_of_refused_fits_are_nan_and_one_design_has_the_scatter_of_its_refits():
    """Of two designs Student's interval, of one the 95 % quantile of how far its refits lie. Else NaN."""
    rng = np.random.default_rng([11, 0])
    pressure = rng.exponential(1.0, 20_000) * (rng.random(20_000) < 0.2)
    solved = Reference(pressure, 20_000, np.quantile(pressure[pressure > 0], np.linspace(0.001, 0.999, 200)))
    sampled = Sampled(solved, [solved.pressure])
    stored = given_contact({}, {}, sampled, np.ones(4))
    for name in ("given_distance", "given_cumulative", "judged_distance", "given_between"):
        assert np.isnan(stored[name].values).all()
    assert stored["given_surfaces"].values == 4
    assert sampled.tail_from == pytest.approx(max(1e-3, 5 / np.count_nonzero(solved.pressure)))
    one = Members(np.ones((4, 7)), designs=1).row(np.array([0.5, 0.4, 0.6, 0.7]), np.array([0, 0.1, 0.1, 0.1]), 0.05)
    assert one == pytest.approx((0.5, 0.35, 0.65))
    two = Members(np.ones((2, 7)), designs=2).row(np.array([0.5, 0.7]), np.zeros(2), 0.0)
    assert two == pytest.approx((0.6, 0.0, 0.6 + 12.7062 * 0.1), rel=1e-4)  # t(0.975, 1)


def test_variants_drawn_over_all_surfaces_are_farther_than_given_contact(distributions):
    """Eq. (9) has no end at zero: drawn over all surfaces it is in contact everywhere."""
    assert distributions["fit_positive_share"][1] == 1.0
    assert distributions["distance_in_contact"][3] > 2 * distributions["given_distance"][1]


def test_draws_bear_less_by_what_cells_at_edges_bear_too_much(expanded, distributions):
    """Of the training nodes all bear AT_EDGES too much, so the expansion is in contact with Phi((m - AT_EDGES) / s).

    What is drawn lies within four standard errors of 800 training nodes, the ratio within its interval. A scene of
    whole nodes says the same of the error, and keeps it.
    """
    corrected, cells = expanded("corrected"), norm.cdf(MEAN / SCATTER)
    points = norm.cdf((MEAN - AT_EDGES) / SCATTER)
    assert distributions["contact_probability"][4] == pytest.approx(cells, abs=2 / math.sqrt(DRAWS))
    assert corrected["contact_probability"][4] == pytest.approx(points, abs=4 * math.sqrt(points / 800))
    mean = (MEAN - AT_EDGES) * points + SCATTER * norm.pdf((MEAN - AT_EDGES) / SCATTER)
    assert corrected["mean_pressure"][4] == pytest.approx(mean, rel=0.02)
    for one in (distributions, corrected):
        assert one["contact_correction_low"] < points / cells < one["contact_correction_high"]
        assert one["contact_correction_high"] - one["contact_correction_low"] < 0.2 * points / cells
        assert one["distance_of_correction"] == distributions["distance_of_correction"] > 0
    for row in (0, 1):
        assert corrected["contact_probability"][row] == distributions["contact_probability"][row]


def test_a_correction_maps_quantiles_to_quantiles():
    """Cells p to points f(p) = max(p - 1, 0): at samples exactly, between them linearly, monotone, and no change of
    what is out of contact. Half of the contacts vanish, on two of four surfaces."""
    cells = np.array([[0.5, 0.0], [0.0, 0.8], [3.0, 0.0], [7.0, 0.0]])
    edges = EdgeCorrection(cells, np.maximum(cells - 1, 0), np.arange(4))
    drawn = np.array([0.0, 0.3, 0.8, 1.9, 3.0, 5.0, 7.0, 9.0])
    distributions = edges.apply(drawn)
    np.testing.assert_allclose(distributions, [0, 0, 0, 1, 2, 4, 6, 8], atol=1e-15)
    assert edges.contact()[0] == 0.5
    np.testing.assert_allclose(edges.contact()[2] - 0.5, 1.959964 * math.sqrt(4 * 0.25) / 4)
    np.testing.assert_array_equal(EdgeCorrection(cells, cells, np.arange(4)).apply(drawn), drawn)
    np.testing.assert_array_equal(edges.without(2).cells, cells[[0, 1, 3]])
    np.testing.assert_allclose(edges.without(2).apply(drawn[3]), 6 * 1.1 / 6.2)  # between 0.8 and 7


def test_the_scatter_of_a_correction_enters_that_of_its_expansion():
    """An expansion without scatter of its own: uniform draws, to all groups alike.

    Of 2000 solves 0.2 lose their contact. Both this share and the quantile of cells at it have the variance 0.2 0.8 /
    2000, so the probability has the root of twice that for standard error, known to 16 % (twenty groups).
    """
    rng = np.random.default_rng(12)
    cells = rng.random((2000, 1))
    points = np.where(rng.random((2000, 1)) < 0.2, 0.0, cells)

    class Uniform:
        def draw(self, generator, count, *, left_out):
            return np.tile((np.arange(count) + 0.5) / count, (21, 1))

    curves, error = moved_local(Uniform(), np.array([0.5]), [1], EdgeCorrection(cells, points, np.arange(2000) % 20))
    assert error == pytest.approx(math.sqrt(2 * 0.2 * 0.8 / 2000), rel=0.4)
    assert curves.std() > 0
