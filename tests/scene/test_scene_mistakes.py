"""A mistake in a scene file has its line."""

import pytest

from tests.scene.shipped import FIGURES, FRACTAL, KINDS, KNOWN, SCAN, STATISTICS, TABLE, lines_of

# What follows `extends: paper` in a scene file, and the line that reports it, without the name of the file.
MISTAKES = {
    # the schema
    "strip: {cell_m: 0}": "strip.cell_m: 0 is not allowed; a number > 0 [m]",
    "material: {poisson_ratio: 0.6}": "material.poisson_ratio: 0.6 is not allowed; a number > -1 and <= 0.5",
    "square: {nodes: 1025}": "square.nodes: 1025 is not allowed; a whole number >= 2 and <= 1024",
    "square: {nodes: 10.0}": "square.nodes: 10.0 is not allowed; a whole number >= 2 and <= 1024",
    "square: {penetration_percentile: 100}": "square.penetration_percentile: 100 is not allowed; "
    "a number > 0 and < 100 [%]",
    "square: {latin_hypercube_samples: 3999}": "square.latin_hypercube_samples: 3999 is not allowed; "
    "a whole number >= 4000 and <= 1000000",
    "oscillator: {mass_kg: true}": "oscillator.mass_kg: true is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg:}": "oscillator.mass_kg: no value is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: 1.0e+999}": "oscillator.mass_kg: inf is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: 2 kg}": "oscillator.mass_kg: '2 kg' is text, not a number; a number > 0 and <= 1000000 [kg]",
    "oscillator: {stochastic_static_limit: yes}": "oscillator.stochastic_static_limit: 'yes' is not allowed; "
    "true or false",
    "roughness: {covariance: gauss}": "roughness.covariance: 'gauss' is not allowed; did you mean gaussian? "
    f"one of {KINDS}",
    "strip: {penetration_percentiles: [0, 50]}": "strip.penetration_percentiles[0]: 0 is not allowed; "
    "a number > 0 and < 100 [%]",
    "ensemble: {damping_ratios: []}": "ensemble.damping_ratios: [] is not allowed; "
    "a list of 1 to 200, of a number >= 0 and <= 10",
    "targets: [figure2, figure4]": f"targets[1]: 'figure4' is not allowed; did you mean figure5? one of {FIGURES}",
    "targets: [figure2, figure2]": "targets: ['figure2', 'figure2'] is not allowed; "
    f"a list of at least 1, each once, of one of {FIGURES}",
    "numerics: 1.0e-8": "numerics: 1e-08 is not allowed; a group of the keys contact_tolerance, oscillator_tolerance",
    r'description: "two\nlines"': r"description: 'two\nlines' is not allowed; text on one line, 1 to 200 characters",
    "oscillator: {law: coulomb, static_friction: 0.2}\nfriction: {mean_at_median: 0.3}": "oscillator.static_friction: "
    "0.2 is not allowed; at least friction.mean_at_median = 0.3, or stick holds less than slip",
    "oscillator: {law: table}": "oscillator.friction_table: missing; oscillator.law = table needs it",
    f"oscillator: {{friction_table: {TABLE}}}": "oscillator.friction_table: a group of keys is not allowed "
    "together with oscillator.law = stribeck; only table takes it",
    f"oscillator: {{law: table, friction_table: {TABLE.replace('0.3]', '0.3, 0.2]')}}}": "oscillator.friction_table."
    "values: 3 values are not allowed; one for each of the 2 speeds",
    f"oscillator: {{law: table, friction_table: {TABLE.replace('[0, 1]', '[1, 1]')}}}": "oscillator.friction_table."
    "speeds_m_per_s: [1, 1] is not allowed; strictly increasing speeds from 0 on",
    f"oscillator: {{law: table, static_friction: 0.35, friction_table: {TABLE}}}": "oscillator.static_friction: 0.35 "
    "is not allowed; at least the first of oscillator.friction_table.values = 0.4, or stick holds less than slip",
    "oscillator: {friction_follows: time}": "oscillator.correlation_time_s: missing; oscillator.friction_follows = "
    "time needs it",
    "oscillator: {correlation_time_s: 2.0e-4}": "oscillator.correlation_time_s: 0.0002 is not allowed together with "
    "oscillator.friction_follows = slip; only time takes it",
    "oscillator: {excitation_force_n: 1}\nensemble: {count_by_period: true}": "ensemble.count_by_period: true is not "
    "allowed; false where oscillator.excitation_force_n is not 0, because no cycle repeats the last there",
    # keys
    "strip: {cel_m: 1.0e-6}": "strip.cel_m: unknown key; did you mean cell_m? allowed: "
    "length_m, margin_m, width_m, cell_m, window_m, window_spacing_m, penetration_percentiles, samples, "
    "training_samples, expansion_spacing_m, expansion_samples",
    "numerics: {normal_force_n: 1}": "numerics.normal_force_n: unknown key; did you mean oscillator.normal_force_n? "
    "allowed: contact_tolerance, oscillator_tolerance",
    "numerics: {xyz: 1}": "numerics.xyz: unknown key; allowed: contact_tolerance, oscillator_tolerance",
    r'numerics: {"x\ny": 1}': r"numerics.'x\ny': unknown key; allowed: contact_tolerance, oscillator_tolerance",
    "targets: [figure5]\nfriction: {statistics: {mean: 0.3, standard_deviation: 0.05, beta_a: 2, beta_b: 5}}": (
        "friction.statistics.correlation_length_m: missing; a number > 0 and <= 1 [m]"
    ),
    # YAML
    "material: {young_modulus_pa: 1e9}": "material.young_modulus_pa: '1e9' is text, not a number; "
    "write 1.0e+9, a number >= 1000 and <= 1e+13 [Pa]",
    "roughness: {rms_height_m: 5E-8}": "roughness.rms_height_m: '5E-8' is text, not a number; "
    "write 5.0e-8, a number > 0 and <= 0.01 [m]",
    "square: {monte_carlo_samples: 4e5}": "square.monte_carlo_samples: '4e5' is text, not a number; "
    "write 400000, a whole number >= 100 and <= 100000000",
    "seed: 010": "seed: '010' is text, not a number; a whole number >= 0 and <= 4294967295",
    "seed: 1:30": "seed: '1:30' is text, not a number; a whole number >= 0 and <= 4294967295",
    "seed: 1\nseed: 2": "seed: 2 in line 3 repeats the key; give it once",
    "seed: &base 1": "seed: &base is not allowed; write the value out (no anchor, alias or tag)",
    "seed: !!python/name:os.system 1": "seed: tag:yaml.org,2002:python/name:os.system is not allowed; "
    "write the value out (no anchor, alias or tag)",
    "seed: *base": "seed: *base is not allowed; write the value out (no anchor, alias or tag)",
    "strip: {penetration_percentiles: [*base, 50]}": "strip.penetration_percentiles[0]: *base is not allowed; "
    "write the value out (no anchor, alias or tag)",
    "&base seed: 1": "the key in line 2 is not allowed; a key is a plain word",
    # across keys
    "square: {modes: 101, nodes: 10}": "square.modes: 101 is not allowed; at most square.nodes^2 = 10^2",
    "square: {modes: 20000, nodes: 200}": "square.modes: 20000 is not allowed; modes times nodes^2 at most 100000000 "
    "(0.8 GB of memory), here with 200 nodes",
    "square: {latin_hypercube_samples: 300000, modes: 400, nodes: 20}": "square.latin_hypercube_samples: 300000 is "
    "not allowed; samples times square.modes = 400 at most 100000000 (0.8 GB of memory)",
    "square: {modes: 6}\nexpansion: {variables: 7}": "expansion.variables: 7 is not allowed; at most square.modes = 6, "
    "of which best takes 8 or more",
    "expansion: {variables: best, degree: 4, samples: 60000}": "expansion.samples: 60000 is not allowed; "
    "samples times terms, C(best + 4, 4), at most 100000000 (0.8 GB of memory)",
    "expansion: {variables: 8, degree: 3, samples: 165}": "expansion.samples: 165 is not allowed; "
    "more than the terms of the expansion, C(8 + 3, 3)",
    "strip: {length_m: 2.401e-3, cell_m: 2.5e-6}": "strip.length_m: 0.002401 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {window_spacing_m: 1.6e-5, cell_m: 2.5e-6}": "strip.window_spacing_m: 1.6e-05 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {window_spacing_m: 6.25e-4, window_m: 6.0e-4}": "strip.window_spacing_m: 0.000625 is not allowed; "
    "at most half of strip.window_m = 0.0006 [m], for lags within the window",
    "strip: {width_m: 5.0e-6, cell_m: 2.5e-6}": "strip.width_m: 5e-06 is not allowed; "
    "at least 3 times strip.cell_m = 2.5e-06 [m], for slope and curvature across the strip",
    "strip: {training_samples: 1, cell_m: 2.5e-6}": "strip.training_samples: 1 is not allowed; "
    "at least 2, and enough that every 8th column gives more samples than C(8 + 3, 3)",
    "strip: {length_m: 2.3e-3, window_m: 6.0e-4}": "strip.length_m: 0.0023 is not allowed; "
    "at least four times strip.window_m = 0.0006 [m], for lags of three windows",
    "strip: {length_m: 2.4e-3}\nroughness: {correlation_length_m: 3.1e-4}": "strip.length_m: 0.0024 is not allowed; "
    "at least eight times roughness.correlation_length_m = 0.00031 [m]",
    "strip: {length_m: 2.4e-3, margin_m: 0, width_m: 2.5e-5, cell_m: 1.0e-7}": "strip.cell_m: 1e-07 is not allowed; "
    "at most 4000000 cells on the strip of 0.0024 + 2 x 0 by 2.5e-05 m",
    "strip: {penetration_percentiles: [10, 50, 50]}": "strip.penetration_percentiles: [10, 50, 50] is not allowed; "
    "strictly increasing percentiles",
    "strip: {penetration_percentiles: [10, 90]}": "strip.penetration_percentiles: [10, 90] is not allowed; "
    "50 among them: friction.mean_at_median sets the shear strength there",
    "oscillator: {penetration_percentile: 3}": "oscillator.penetration_percentile: 3 is not allowed; between the first "
    "and last of strip.penetration_percentiles, 5 and 95",
    "extends: given\noscillator: {penetration_percentile: 30}": "oscillator.penetration_percentile: 30 is not allowed "
    "together with friction.statistics; give one",
    "oscillator: {penetration_percentile: 30}\nensemble: {marginal: empirical}": "oscillator.penetration_percentile: "
    "30 is not allowed together with ensemble.marginal = empirical; 50, where quantiles of the windows are kept",
    "oscillator: {windows_in_parallel: 4}\nensemble: {marginal: empirical}": "oscillator.windows_in_parallel: 4 is not "
    "allowed together with ensemble.marginal = empirical; 1, or beta or paper for the marginal",
    "targets: [figure_field]\nmaterial: {hardness_pa: 1.0e+9}": "targets: ['figure_field'] is not allowed; "
    "figure_field ranks the pressures of a node, and those at material.hardness_pa are equal: leave it out",
    "targets: [figure2]\nmaterial: {hardness_pa: 1.0e+9}\nexpansion: {target: censored}": "expansion.target: "
    "'censored' is not allowed; trial_pressure, squared_pressure or best where the surface yields, at "
    "material.hardness_pa = 1000000000.0 [Pa]",
    "expansion: {target: censored}": "expansion.target: 'censored' is not allowed; "
    "trial_pressure, squared_pressure or best: along the strip no regression is censored",
    "strip: {expansion_spacing_m: 3.75e-6}": "strip.expansion_spacing_m: 3.75e-06 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {expansion_spacing_m: 1.0e-5}": "strip.window_spacing_m: 1.5e-05 is not allowed; "
    "a whole multiple of strip.expansion_spacing_m = 1e-05 [m]",
    "strip: {samples: 12, training_samples: 13}": "strip.training_samples: 13 is not allowed; "
    "at most strip.samples = 12",
    "strip: {samples: 12, training_samples: 4, expansion_samples: 11}": "strip.expansion_samples: 11 is not allowed; "
    "at least twice strip.samples = 12",
    "oscillator: {excitation_force_n: 1, excitation_frequency_rad_per_s: 0}": "oscillator."
    "excitation_frequency_rad_per_s: 0 is not allowed; a number > 0 [rad/s] "
    "where oscillator.excitation_force_n is not 0",
    "oscillator: {static_friction: 0.2}\nfriction: {mean_at_median: 0.3}": "oscillator.static_friction: 0.2 is not "
    "allowed; at least friction.mean_at_median = 0.3, or eq. (13) turns negative at high speed",
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS}}}\noscillator: {{static_friction: 0.2}}": (
        "oscillator.static_friction: 0.2 is not allowed; at least friction.statistics.mean = 0.3, "
        "or eq. (13) turns negative at high speed"
    ),
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS.replace('e-4', 'e-10')}}}": "friction.statistics."
    "correlation_length_m: 2.5e-10 is not allowed; long enough for at most 100000000 nodes (0.8 GB of memory) "
    "over the belt's way in a run, or ensemble.process: recursion",
    "ensemble: {discarded_periods: 100, duration_periods: 100}": "ensemble.discarded_periods: 100 is not allowed; "
    "less than ensemble.duration_periods = 100",
    "ensemble: {drawn_realisations: 17, realisations: 16}": "ensemble.drawn_realisations: 17 is not allowed; "
    "at most ensemble.realisations = 16",
    "ensemble: {damping_ratios: [0.2, 0.1]}": "ensemble.damping_ratios: [0.2, 0.1] is not allowed; "
    "strictly increasing damping ratios",
    # the two ways to truncate the square
    "square: {modes: 20, variance_share: 0.9}": "square.variance_share: 0.9 is not allowed together with square.modes; "
    "give one",
    "square: {modes: 0, variance_share: 0.9}": "square.modes: 0 is not allowed; a whole number >= 1 and <= 262144",
    # the two forms of the samples of the expansion
    "expansion: {samples: automatic, cdf_error: 0.01}": "expansion.samples: 'automatic' is not allowed; "
    "a whole number >= 10 and <= 1000000, or auto",
    "ensemble: {nodes_per_correlation_length: auto}": "ensemble.count_error: missing; "
    "ensemble.nodes_per_correlation_length = auto needs it",
    "ensemble: {count_error: 0.01}": "ensemble.count_error: 0.01 is not allowed together with "
    "ensemble.nodes_per_correlation_length = 4; only auto takes it",
    "targets: [figure5]\nensemble: {marginal: empirical}\n"
    f"friction: {{statistics: {STATISTICS}}}": "ensemble.marginal: 'empirical' is not allowed; beta or paper where "
    "friction.statistics replaces the windows",
    "expansion: {samples: auto}": "expansion.cdf_error: missing; expansion.samples = auto needs it",
    "expansion: {cdf_error: 0.01}": "expansion.cdf_error: 0.01 is not allowed together with expansion.samples = 1000; "
    "only auto takes it",
    "expansion: {samples: auto, cdf_error: 0.01, design: latin_hypercube}": "expansion.design: 'latin_hypercube' is "
    "not allowed; sobol or monte_carlo with expansion.samples = auto, to be extended",
    "expansion: {samples: auto, cdf_error: 0.005, draws: 399999}": "expansion.draws: 399999 is not allowed; "
    "at least 10 / expansion.cdf_error^2, or the draws alone err by as much as 0.005",
    "expansion: {samples: auto, cdf_error: 0.01, degree: 7}\nstrip: {training_samples: 100}\n"
    "square: {latin_hypercube_samples: 8000}": "expansion.samples: 'auto' is not allowed; a lower "
    "expansion.degree, because more samples than C(8 + 7, 7), at 16 nodes each, give tables above 100000000 "
    "(0.8 GB of memory)",
    # the two forms of friction
    "friction: {}\nextends: given\ntargets: [figure3]": "friction.mean_at_median: missing; needed for figure3, "
    "for which friction.statistics is no substitute",
    "extends: given\nfriction: {mean_at_median: 0.3}\ntargets: [figure3]": "friction.least_contact_fraction: missing; "
    "goes with friction.mean_at_median",
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS}, mean_at_median: 0.3}}": (
        "friction.mean_at_median: 0.3 is not allowed together with friction.statistics; give one"
    ),
    # the three forms of roughness
    "roughness: {covariance: matern}": "roughness.smoothness: missing; roughness.covariance = matern needs it",
    "roughness: {smoothness: 1.0}": "roughness.smoothness: 1.0 is not allowed; "
    "roughness.covariance = gaussian has none",
    "roughness: {lay_rad: 0.5}": "roughness.correlation_length_across_m: missing; goes with roughness.lay_rad",
    "roughness: {marginal: {family: beta, shapes: [2.1]}}": "roughness.marginal.shapes: [2.1] is not allowed; "
    "[a, b] of beta, each 0.02 to 10000",
    "roughness: {marginal: {family: lognormal, shapes: [1.6]}}": "roughness.marginal.shapes: [1.6] is not allowed; "
    "[s] of lognormal, each 0.02 to 1.5",
    f"targets: [figure3]\nroughness: {{fractal: {FRACTAL}, hurst: 0.8}}": (
        "roughness.hurst: 0.8 is not allowed together with roughness.fractal; give one"
    ),
    f"roughness: {{fractal: {FRACTAL}}}": "targets: ['figure2', 'figure3', 'figure5'] is not allowed; figure2 and "
    "figure_field expand the pressure in Gaussian variables, and roughness.fractal has a phase a wave",
    f"targets: [figure3]\nroughness: {{fractal: {FRACTAL[:-1]}, shortest_wavelength_m: 5.0e-6}}}}": (
        "roughness.fractal.shortest_wavelength_m: 5e-06 is not allowed; more than two cells, strip.cell_m = 2.5e-06 [m]"
    ),
    "roughness: {scan: {form: plane, covariance: best, marginal: gaussian}}": "roughness.scan.file: missing; "
    "give the file of a scan, or grinding to have one made",
    f"roughness: {{scan: {SCAN[:-1]}, spacing_x_m: 1.0e-6}}}}": "roughness.scan.spacing_y_m: missing; "
    "goes with roughness.scan.spacing_x_m",
    f"roughness: {{scan: {SCAN[:-1]}, correct_correlation: true}}}}": "roughness.scan.correct_correlation: true is not "
    "allowed; a gaussian marginal changes no correlation",
    f"roughness: {{scan: {SCAN}, rms_height_m: 1.0e-7}}": "roughness.rms_height_m: 1e-07 is not allowed together with "
    "roughness.scan; give one",
    "targets: [figure_field]\nexpansion: {samples: 101, degree: 1}": "expansion.samples: 101 is not allowed; without "
    "a 10th of them still more than the 101 terms of figure_field, square.modes and a constant",
    "targets: [figure3]\nextends: fractal\nstrip: {expansion_spacing_m: 5.0e-6}": "strip.expansion_spacing_m: 5e-06 "
    "is not allowed; strip.cell_m = 2.5e-06 [m], or less than half of roughness.fractal.shortest_wavelength_m",
    "targets: [figure_field]\nexpansion: {samples: 1000}\nsquare: {nodes: 301, modes: 20}": "expansion.samples: 1000 "
    "is not allowed; samples times the 90601 nodes of the square at most 90000000 (1.5 GB of memory) for figure_field",
    "map: {belt_velocities_m_per_s: [2, 1]}": "map.belt_velocities_m_per_s: [2, 1] is not allowed; strictly increasing",
    "targets: [figure_map]\noscillator: {excitation_force_n: 1}": "targets: ['figure_map'] is not allowed; figure_map "
    "draws limits of the free oscillator, and oscillator.excitation_force_n is not 0",
    "targets: [figure_scan]": "roughness.scan: missing; needed for figure_scan",
    # overlays
    "extends: 3": f"extends: 3 is not allowed; scenes: {KNOWN}",
    "extends: papr": f"extends: 'papr' is not allowed; did you mean paper? scenes: {KNOWN}",
    "extends: mine": "extends: 'mine' is not allowed; overlays run in a circle: mine -> mine",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_has_its_line(mine, text):
    text_with_base = text if "extends:" in text else f"extends: paper\n{text}"
    assert lines_of(mine, text_with_base) == [f"scenes/mine.yaml: {MISTAKES[text]}"]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("", "empty; a scene file holds keys and values"),
        ("# nothing\n", "empty; a scene file holds keys and values"),
        ("- 1\n- 2\n", "[1, 2] is not allowed; a scene file holds keys and values"),
        ("text\n", "'text' is not allowed; a scene file holds keys and values"),
        (b"seed: 1  # \xb5m\n", "not UTF-8 text; byte 11 is 0xb5"),
        (
            b"a: \x00\n",
            "not valid YAML: unacceptable character #x0000: special characters are not allowed in "
            '"<unicode string>", position 3',
        ),
        ("a: 'b\n", "line 2, column 1: not valid YAML: found unexpected end of stream"),
        ("a:\n\tb: 1\n", "line 2, column 1: not valid YAML: found character '\\t' that cannot start any token"),
        ("a: 1\n---\na: 1\n", "line 2, column 1: not valid YAML: but found another document"),
        ('a: "\\Uffffffff"\n', "not valid YAML: "),
        ("a: " + "[" * 5000, "line 1, column 15: not valid YAML: nested deeper than 12"),
        ("# " + "x" * 100_000, "larger than 100000 bytes, which no scene needs"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_file_that_is_no_scene(mine, content, line):
    (found,) = lines_of(mine, content)
    assert found.startswith(f"scenes/mine.yaml: {line}")
    assert "\n" not in found
