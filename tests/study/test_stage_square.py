"""The stages of the square against closed forms: modes, contact at the centre for every design, distributions."""

import math

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import kstest, norm, uniform, zscore

from roughslip.chaos import centre_distribution
from roughslip.chaos.centre_distribution import in_contact, share_up_to
from roughslip.chaos.hermite import even_terms, multi_indices, terms_at
from roughslip.chaos.variables import latin_hypercube
from roughslip.contact.influence import Influence
from roughslip.errors import IllPosedError
from roughslip.scene.types import scene_of
from roughslip.study.from_scene import expansion, geometry, surface_model
from roughslip.surface.modes import karhunen_loeve
from tests.study.conftest import CONTACT, MODULUS, SQ, changed

SCENE = changed(
    CONTACT,
    roughness={"correlation_length_m": 3e-5, "correlation_length_across_m": 1e-5},
    square={"latin_hypercube_samples": 40},
    expansion={"samples": 40},
    numerics={"contact_area": "nodes"},
)
CELL = 1e-5
MONTE_CARLO, LATIN_HYPERCUBE, EXPANSION_DESIGN = 1, 2, 3  # streams of random numbers


def design_of(*stream: int, samples: int, modes: int = 36) -> np.ndarray:
    """The variables of the modes that belong to a stream."""
    if stream[0] == MONTE_CARLO:
        seeds = ([7, MONTE_CARLO, number] for number in range(samples))
        return np.array([np.random.default_rng(seed).standard_normal(modes) for seed in seeds])
    return latin_hypercube(np.random.default_rng([7, *stream]), samples, modes)


def test_all_modes_together_are_the_covariance(run):
    """sum_k modes_k(r) modes_k(r') = Sq^2 exp(-(x/lx)^2 - (y/ly)^2), as no mode is left out. Of 101 modes on 64 nodes
    the shares in the mean, at the centre and at the corner are those of the study, and of the modes."""
    modes = run("karhunen_loeve", SCENE)["modes"]
    squares = (CELL * np.subtract.outer(np.arange(6), np.arange(6))) ** 2
    expected = SQ**2 * np.einsum("ik,jl->ijkl", np.exp(-squares / 3e-5**2), np.exp(-squares / 1e-5**2))
    np.testing.assert_allclose(np.einsum("mij,mkl->ijkl", modes, modes), expected, rtol=0, atol=1e-12 * SQ**2)
    assert np.all(np.diff(np.sum(modes**2, axis=(1, 2))) <= 1e-12 * 36 * SQ**2)
    square, roughness = {"edge_m": 1.0, "nodes": 64, "modes": 101}, {"correlation_length_m": 0.1035}
    some = run("karhunen_loeve", changed(CONTACT, square=square, roughness=roughness))
    shares = [float(some[f"captured_{where}"]) for where in ("variance", "at_centre", "at_corner")]
    variance = np.sum(some["modes"] ** 2, axis=0) / SQ**2
    np.testing.assert_allclose(shares, [variance.mean(), variance[32, 32], variance[0, 0]], rtol=1e-12)
    np.testing.assert_allclose(shares, [0.950, 0.957, 0.718], atol=0.002)


# The four central nodes of 6 x 6, the centre first; each is lifted alone by a mode of its own, and nothing else is.
CENTRAL = [(3, 3), (3, 2), (2, 3), (2, 2)]
PLANE = SQ * float(ndtri(0.8))  # 20 % of the heights lie above
DIAGONAL = 4 * CELL * math.log(1 + math.sqrt(2)) / math.pi / MODULUS  # of a square under its own load
DESIGNS = {
    "monte_carlo": design_of(MONTE_CARLO, samples=40),
    "latin_hypercube": design_of(LATIN_HYPERCUBE, samples=40),
    "expansion": design_of(EXPANSION_DESIGN, samples=40),
}


@pytest.mark.parametrize("design", DESIGNS)
def test_a_node_alone_in_contact_bears_what_its_cell_bears(run, stored, design):
    """p = interference / B_00, and others are pressed away from the plane, which is above. Samples 5 to 40 of a design.

    Of Latin hypercubes the centre alone is kept. Cells that yield bear H; their gap is below zero by what they gave.
    """
    modes = np.zeros((36, 6, 6))
    for mode, place in enumerate(CENTRAL):
        modes[(mode, *place)] = SQ
    arguments = {"surface": stored("modes.nc", modes=(("mode", "x", "y"), modes)), "design": design}
    arguments |= {"constants": {"PENETRATION": 20.0}, "first": 5, "last": 40}
    heights = SQ * DESIGNS[design][5:, :4]
    result = run("contact_square", SCENE, design, **arguments)
    assert (result.attributes["first"], result.attributes["design"]) == (5, design)
    kept = result["pressure"].shape[1]
    assert kept == (1 if design == "latin_hypercube" else 4)
    alone = np.count_nonzero(heights > PLANE, axis=1) <= 1
    assert np.count_nonzero(heights[alone] > PLANE) >= 8  # 4 0.2 0.8^3 of 35 are 14
    bears = np.maximum(heights - PLANE, 0.0)[alone, :kept] / DIAGONAL
    np.testing.assert_allclose(result["pressure"][alone], bears, rtol=1e-9)
    hardness = 0.2 * SQ / DIAGONAL
    soft = run("contact_square", changed(SCENE, material={"hardness_pa": hardness}), "soft", **arguments)
    np.testing.assert_allclose(soft["pressure"][alone], np.minimum(bears, hardness), rtol=1e-9)
    if design == "expansion":
        lonely = bears > 0
        np.testing.assert_allclose(result["gap"][alone][lonely], 0.0, atol=1e-9 * SQ)
        gave = np.minimum(hardness - bears[lonely], 0.0) * DIAGONAL
        np.testing.assert_allclose(soft["gap"][alone][lonely], gave, atol=1e-9 * SQ)
        bare = np.count_nonzero(lonely, axis=1) == 0
        np.testing.assert_allclose(result["gap"][alone][bare], PLANE - heights[alone][bare], rtol=1e-12)
        assert np.all((result["gap"][alone] + heights[alone])[~lonely & ~bare[:, None]] > PLANE)


@pytest.mark.parametrize(("contact_area", "like"), [("corrected", "point_pressure"), ("nodes", "pressure")])
def test_pressures_of_samples_lack_the_mesh_error_where_the_scene_corrects_areas(run, monkeypatch, contact_area, like):
    """As of training samples at the same variables, which have both; where several differ."""
    scene = changed(SCENE, numerics={"contact_area": contact_area})
    arguments = {"surface": run("karhunen_loeve", scene).path, "first": 0, "last": 40}
    trained = run("contact_square", scene, "trained", design="expansion", **arguments)
    same = "latin_hypercubes", lambda *_: iter([DESIGNS["expansion"]])
    sampled = run("contact_square", scene, "sampled", dict([same]), design="latin_hypercube", **arguments)
    np.testing.assert_allclose(sampled["pressure"], trained[like][:, :1], rtol=1e-8)
    assert np.count_nonzero(trained["point_pressure"][:, 0] != trained["pressure"][:, 0]) >= 5


MODES, SAMPLES, DRAWS, SURFACES = 16, 8000, 20_000, 1500
LINEAR = changed(
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
HYPERCUBES = [design_of(LATIN_HYPERCUBE, *more, samples=4000, modes=MODES) for more in ((), (1,))]
TRAINING = design_of(EXPANSION_DESIGN, samples=200, modes=MODES)


def trial_pressure(xi: np.ndarray, variables: np.ndarray) -> np.ndarray:
    return MEAN + SCATTER * xi @ variables.T @ RESPONSE


@pytest.fixture(scope="module")
def modes(run):
    return run("karhunen_loeve", LINEAR, "linear-modes")


@pytest.fixture(scope="module")
def variables(modes):
    """(4, 4, MODES) at the four central nodes, which are all that train on so coarse a mesh."""
    model, grid = surface_model.gaussian_model(scene_of(LINEAR)), geometry.square_grid(scene_of(LINEAR))
    return expansion.directions(model, grid, modes["modes"], geometry.training_nodes(model.lengths_m, grid), 4)[0]


@pytest.fixture(scope="module")
def expanded(run, stored, modes, variables):
    """expanded(**constants) is what chaos_square makes of a trial pressure that is linear in the variables. Monte Carlo
    lies in two batches, named in another order than numbered, with four equal nodes; of hypercubes the centre counts.
    """
    stiffness = 1 / Influence(geometry.square_grid(scene_of(LINEAR)), MODULUS).diagonal
    drawn = design_of(MONTE_CARLO, samples=SURFACES, modes=MODES)

    def batch(name: str, method: str, first: int, trial: np.ndarray):
        fields = {"pressure": np.maximum(trial, 0), "gap": np.maximum(-trial, 0) / stiffness}
        fields |= {"point_pressure": np.maximum(trial - AT_EDGES, 0)}
        arrays = {key: (("sample", "node"), values) for key, values in fields.items()}
        return stored(name, {"first": first, "design": method}, **arrays)

    centre = np.tile(trial_pressure(drawn, variables[0])[:, None], 4)
    of_designs = np.tile(trial_pressure(np.concatenate(HYPERCUBES), variables[0])[:, None], 4) * [1, -1, -1, -1]
    batches = [
        batch("b.nc", "monte_carlo", 0, centre[:1000]),
        batch("a.nc", "monte_carlo", 1000, centre[1000:]),
        batch("l.nc", "latin_hypercube", 0, of_designs),
        batch("e.nc", "expansion", 0, np.column_stack([trial_pressure(TRAINING, one) for one in variables])),
    ]

    def expand(contact_area="nodes", **constants):
        with pytest.MonkeyPatch.context() as patch:  # intervals have tests of their own
            patch.setattr(centre_distribution, "REPLICATES", 20)
            patch.setattr(centre_distribution, "BLOCKS", 1)
            scene, few = changed(LINEAR, numerics={"contact_area": contact_area}), {"FUNCTIONALS": 4, "DRAWS": DRAWS}
            return run("chaos_square", scene, "square", few | constants, surface=modes.path, contact=batches)

    return expand


@pytest.fixture(scope="module")
def distributions(expanded):
    return expanded()


def test_expansions_that_are_exact_have_no_error(distributions, modes, variables):
    """Eq. (8) and ours; eq. (9) is of another shape. Ours has the even terms at all training nodes."""
    assert list(distributions["method"]) == ["monte_carlo", "latin_hypercube", "equation_8", "equation_9", "roughslip"]
    assert np.all(distributions["fit_leave_one_out"][[0, 2]] < 1e-20)
    assert distributions["fit_leave_one_out"][1] > 1e-6
    touches = trial_pressure(np.concatenate(HYPERCUBES), variables[0]) > 0
    np.testing.assert_array_equal(distributions["fit_samples"], [*[np.sum(touches[:4000])] * 2, 800])
    height = modes["modes"][:, 2, 2]
    np.testing.assert_allclose(variables[0, 0], height / np.linalg.norm(height), atol=1e-12)
    rows = np.concatenate([TRAINING @ one.T for one in variables])
    signs = np.array([[0, 0], [1, 0], [0, 1], [0, 0]])  # height, slopes, curvature: mirrored along x, along y
    basis = terms_at(rows, even_terms(multi_indices(4, 2), signs))
    assert basis.shape == (800, 8)  # 1, h, c, h^2, h c, c^2, and the squares of the slopes
    condition = np.linalg.cond(basis / np.linalg.norm(basis, axis=0))
    assert distributions["fit_condition_number"][2] == pytest.approx(condition)


def test_distributions_are_those_of_a_cut_normal(distributions, expanded, variables):
    """P(p <= x | p > 0) by the normal law, within four standard errors of the draws; K/K_t is that of the designs.

    Draws bear less by what cells at edges bear too much: all training nodes by AT_EDGES."""
    exact = (norm.cdf((distributions["pressure"] - MEAN) / SCATTER) - 1 + PROBABILITY) / PROBABILITY
    for row, count in ((0, SURFACES), (1, SAMPLES), (2, 20_000), (4, DRAWS)):
        tolerance = 2 / math.sqrt(count * PROBABILITY)
        np.testing.assert_allclose(distributions["cumulative"][row], exact, atol=tolerance)
        share, low, high = (distributions[f"contact_probability{end}"][row] for end in ("", "_low", "_high"))
        assert share == pytest.approx(PROBABILITY, abs=2 / math.sqrt(count))
        assert low <= share <= high
    touches = trial_pressure(np.concatenate(HYPERCUBES), variables[0]) > 0
    np.testing.assert_allclose(distributions["contact_probability"][1:4], np.mean(touches), atol=1e-12)
    assert distributions["distance"][0] == 0.0
    drawn = np.concatenate([*[design_of(MONTE_CARLO, samples=SURFACES, modes=MODES)] * 4, *HYPERCUBES])
    z = zscore(in_contact(trial_pressure(drawn, variables[0])))
    for name, model in (("normal", norm()), ("uniform", uniform(-math.sqrt(3), math.sqrt(12)))):
        assert distributions[f"distance_to_{name}"] == pytest.approx(kstest(z, model.cdf).statistic, rel=1e-9)
    limit = 1.63 * math.sqrt(1 / (SURFACES * PROBABILITY) + 1 / (DRAWS * PROBABILITY))
    assert np.all(distributions["distance_in_contact"][[2, 4]] < limit)
    assert distributions["distance_between_variants"] == pytest.approx(distributions["distance_in_contact"][3], abs=0.1)
    corrected, points = expanded("corrected"), norm.cdf((MEAN - AT_EDGES) / SCATTER)
    assert corrected["contact_probability"][4] == pytest.approx(points, abs=4 * math.sqrt(points / 800))
    np.testing.assert_array_equal(corrected["contact_probability"][:2], distributions["contact_probability"][:2])


def test_equations_given_contact_are_those_of_a_direct_sample_given_contact(distributions, variables):
    """Eq. (8) is exact here, so it is the cut normal; eq. (9) is what its fit by hand gives at the direct sample.

    The solved surfaces err by 1.63 / sqrt(n), one in a hundred. Over all surfaces eq. (9), which has no end at zero, is
    in contact everywhere.
    """
    pressure = trial_pressure(HYPERCUBES[0], variables[0])
    basis = terms_at((HYPERCUBES[0] @ variables[0].T)[pressure > 0], multi_indices(4, 2))
    coefficients = np.linalg.lstsq(basis, np.log(pressure[pressure > 0]), rcond=None)[0]
    u = np.random.default_rng(21).standard_normal((400_000, 4))
    direct = np.exp(terms_at(u[MEAN + SCATTER * u @ RESPONSE > 0], multi_indices(4, 2)) @ coefficients)
    levels = distributions["pressure"]
    exact = (norm.cdf((levels - MEAN) / SCATTER) - 1 + PROBABILITY) / PROBABILITY
    known = design_of(MONTE_CARLO, samples=SURFACES, modes=MODES) @ variables[0].T
    known = known[MEAN + SCATTER * known @ RESPONSE > 0]
    assert distributions["given_surfaces"] == len(known)
    for row, truth in enumerate((exact, share_up_to(in_contact(direct), levels))):
        np.testing.assert_allclose(distributions["given_cumulative"][row], truth, atol=1.63 / math.sqrt(len(known)))
    true = np.max(np.abs(share_up_to(in_contact(direct), levels) - exact))
    assert distributions["given_distance_low"][1] - 0.01 <= true <= distributions["given_distance_high"][1] + 0.01
    assert distributions["given_between_low"] <= true + 0.01
    assert distributions["given_distance"][0] < distributions["given_distance_high"][0] < 0.1
    assert distributions["distance_in_contact"][3] > 2 * distributions["given_distance"][1]


def test_an_equation_that_is_refused_is_stored_as_nan(run, expanded):
    def refuse(*arguments, **options):
        raise IllPosedError("design 2 of 2: no sample is in contact")

    result = expanded(fit_equation=refuse)
    assert len([line for line in run.warnings if "design 2 of 2" in line and "stored as NaN" in line]) == 2
    for name in ("given_distance", "given_cumulative", "given_between", "distance_between_variants"):
        assert np.isnan(result[name]).all()
    assert np.isnan(result["cumulative"][2:4]).all()
    assert np.all(result["contact_probability"][2:4] == result["contact_probability"][1])


@pytest.mark.parametrize(
    ("nx", "ny", "lengths", "central", "training"),
    [
        (10, 10, (2.9, 2.9), [(5, 5), (5, 4), (4, 5), (4, 4)], None),  # half of 2.9 cells is one cell
        (6, 6, (6.0, 6.0), [(3, 3), (3, 2), (2, 3), (2, 2)], None),  # half of 6 is 3, which on 6 nodes is the border
        (10, 9, (2.9, 2.9), [(5, 4), (4, 4)], None),
        (8, 9, (4.0, 4.0), [(4, 4), (3, 4)], {(i, j) for i in (1, 3, 4, 6) for j in (2, 4, 6)}),  # next to the border
        (32, 31, (6.0, 12.0), [(16, 15), (15, 15)], {(i, j) for i in (12, 15, 16, 19) for j in (9, 15, 21)}),
    ],
)
def test_training_nodes_lie_half_a_length_from_the_central_ones(nx, ny, lengths, central, training):
    """Each with its mirror images, the centre first; the central ones alone where the mesh does not resolve it."""
    grid = geometry.Grid(nx, ny, 1.0, 1.0)
    middle, nodes = geometry.central_nodes(lengths, grid), geometry.training_nodes(lengths, grid)
    assert list(zip(middle.x.tolist(), middle.y.tolist(), strict=True)) == central
    assert (nodes.x[0], nodes.y[0]) == central[0] == grid.centre
    assert set(zip(nodes.x.tolist(), nodes.y.tolist(), strict=True)) == (training or set(central))
    out = ((nodes.x - (nx - 1) / 2) / lengths[0]) ** 2 + ((nodes.y - (ny - 1) / 2) / lengths[1]) ** 2
    np.testing.assert_allclose(nodes.distance2, out - out[0], atol=1e-12)
    assert np.all(np.diff(nodes.distance2) >= 0)


@pytest.mark.parametrize(("lay", "symmetries"), [(0.0, 2), (0.6, 1)])
def test_variables_are_local_functionals_with_the_signs_of_surfaces_turned_with_their_nodes(lay, symmetries):
    """Mirrored along x and along y; where the lay is aslant, turned by half a turn. A turned surface of the modes is
    one of the modes again, as their covariance stays the same."""
    roughness = {"rms_height_m": 1.0, "correlation_length_m": 6.0, "correlation_length_across_m": 9.0, "lay_rad": lay}
    scene = scene_of(changed(CONTACT, roughness=roughness, square={"edge_m": 24.0, "nodes": 24, "modes": 30}))
    surface, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
    modes = karhunen_loeve(surface.covariance, grid, 30).modes
    places = geometry.training_nodes(surface.lengths_m, grid)
    even, odd = expansion.directions(surface, grid, modes, places, 8)
    np.testing.assert_allclose(even @ even.transpose(0, 2, 1), np.tile(np.eye(8), (len(places.x), 1, 1)), atol=1e-9)
    assert odd.shape == (8, symmetries)
    at = {node: number for number, node in enumerate(zip(places.x.tolist(), places.y.tolist(), strict=True))}
    flat = modes.reshape(30, -1).T
    for flip, signs in zip([(0,), (1,)] if symmetries == 2 else [(0, 1)], odd.T, strict=True):
        turn, left, *_ = np.linalg.lstsq(flat, np.flip(modes, [1 + axis for axis in flip]).reshape(30, -1).T)
        assert np.all(left < 1e-20)
        for (x, y), number in at.items():
            image = at[23 - x if 0 in flip else x, 23 - y if 1 in flip else y]
            np.testing.assert_allclose(even[image] @ turn, even[number] * (-1.0) ** signs[:, None], atol=1e-7)
    with pytest.raises(IllPosedError, match="6 variables of the expansion depend"):
        expansion.directions(surface, grid, modes[:5], places, 6)
