"""What to try where samples do not determine an expansion: the ends of error texts, with the scene keys."""

FEWER_TERMS = (
    "take more samples, fewer variables or a lower degree; scene keys: expansion.samples or strip.training_samples, "
    "expansion.degree"
)
MORE_CONTACT = (
    "take more samples or a deeper penetration; scene keys: expansion.samples or strip.training_samples, "
    "strip.penetration_percentiles"
)
OTHER_PENETRATION = (
    "its value is the result; for a scatter take another penetration; scene key: strip.penetration_percentiles"
)
MORE_SURFACES = "take more samples; scene key: expansion.samples"
FEWER_MODES = "take more samples or fewer modes; scene keys: expansion.samples, square.modes"
