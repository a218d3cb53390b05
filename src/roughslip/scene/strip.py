"""Section `strip` of a scene."""

from __future__ import annotations

from roughslip.scene.fields import Section, integer, many, number, section


@section
class Strip(Section):
    """Long strip on whose sliding windows the friction coefficient is evaluated."""

    length_m: float = number(
        "Length of the strip along the belt on which windows lie, at least four windows", "m", above=0, at_most=1
    )
    margin_m: float = number(
        "Length solved beyond either end and not used, because the ends of a contact carry more pressure",
        "m",
        at_least=0,
        at_most=1,
    )
    width_m: float = number("Width of strip and windows across the belt", "m", above=0, at_most=1)
    cell_m: float = number(
        "Edge of the square cells; length, margin, width, window and spacing are whole multiples of it", "m", above=0
    )
    window_m: float = number("Length of a window along the belt", "m", above=0)
    window_spacing_m: float = number(
        "Distance between the starts of neighbouring windows, the step of the lags of the autocorrelation",
        "m",
        above=0,
    )
    penetration_percentiles: tuple[float, ...] = many(
        "Penetrations of figure 3, strictly increasing; 50 sets the shear strength",
        number("A penetration, as square.penetration_percentile", "%", above=0, below=100),
        most=99,
    )
    samples: int = integer(
        "Strips that are solved; a bootstrap over strips needs at least 8", at_least=8, at_most=100_000
    )
    training_samples: int = integer(
        "Number of the first solved strips that also train the expansion", at_least=1, at_most=100_000
    )
    expansion_spacing_m: float | None = number(
        "Distance of the columns at which the expansion is evaluated, for smooth heights a third of the correlation "
        "length; strip.cell_m where not given",
        "m",
        above=0,
        at_most=1,
        default=None,
    )
    expansion_samples: int = integer(
        "Strips that the expansion is evaluated on, the solved ones among them", at_least=8, at_most=1_000_000
    )
