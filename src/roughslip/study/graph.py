"""The graph of the study: every stage and figure, in the order in which numbers flow. No science, no import of numpy.

A row says which keys of a scene a stage reads, whose results it takes, what it makes, and when it runs. Slices of the
scene, names of results, rules, commands and the plan of a run follow from the rows. A new stage is a row and the module
with its work; a new figure is a row and its drawing. All figures of a scene are drawn by one job.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from string import Formatter
from typing import Any

EVERY_SCENE = "every scene"  # as the target of a stage


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage of the study, or one figure: what it reads, takes and makes, and when it runs.

    name, module : of the stage, and of the module of roughslip.study with its work, if that has another name; of a
        figure that draws more than stored numbers, the module that computes these
    draws : of a figure, the module of roughslip.figures that draws it
    reads : scene keys, separated by spaces, or sections for all their keys; with a question mark those that a scene may
        leave out with their sections
    own : the same, of which it speaks where the scene itself, or a base of the user, gives them
    takes : files by the name under which the work asks for them: stages whose results they are, or a scene key that
        holds paths; with a question mark where only some scenes have them
    collects : the same, of files that are taken if they exist; they never cause a run
    makes : the result, below the folder of the scene; {first}-{last} are the numbers of the samples of a batch
    also : further files that it makes, by name
    batches : how its samples are split into jobs: by the name of a design, the scene key of its number of samples; the
        jobs of the scene are shared out by these numbers
    target : the target of a scene that needs this stage, or EVERY_SCENE; other stages run for those that take of them
    comes_with : stages that this one accompanies, where its condition holds
    runs_if : condition on the scene for a stage that is not always needed: "key" (given), "not key", or several of them
        with " and " between
    caption : of a figure
    memory_mb : [MB] that a job asks for: a fifth above the peaks in costs.json; far larger scenes take more
    """

    name: str
    module: str = ""
    draws: str = ""
    reads: str = ""
    own: str = ""
    takes: Mapping[str, str] = field(default_factory=dict)
    collects: Mapping[str, str] = field(default_factory=dict)
    makes: str = ""
    also: Mapping[str, str] = field(default_factory=dict)
    batches: Mapping[str, str] = field(default_factory=dict)
    target: str = ""
    comes_with: str = ""
    runs_if: str = ""
    caption: str = ""
    memory_mb: int = 420

    @property
    def keys(self) -> list[str]:
        """Scene keys that it reads: its slice."""
        return [key.rstrip("?") for key in f"{self.reads} {self.own}".split()]

    @property
    def modules(self) -> str:
        """The modules whose import closure is its code, separated by spaces."""
        own = self.module or ("" if self.draws else self.name)
        rooms = (("study", own), ("figures", self.draws))
        return " ".join(f"roughslip.{room}.{name}" for room, words in rooms for name in words.split())

    @property
    def user_files(self) -> dict[str, str]:
        """The scene keys of files of the user that it takes, by name."""
        return {name: key for name, key in self.takes.items() if "." in key}

    @property
    def makers(self) -> dict[str, bool]:
        """Stages that make what it takes, and whether nothing else can."""
        found = {}
        for name, words in self.takes.items():
            for word in () if name in self.user_files else words.split():
                found[word.rstrip("?")] = word == words and not word.endswith("?")
        return found

    @property
    def placeholders(self) -> list[str]:
        """What stands in braces in the name of its result; its command takes each as an option."""
        return [name for _, name, _, _ in Formatter().parse(self.makes) if name]

    @property
    def results(self) -> dict[str, str]:
        """Every file that it makes, by name; `output` is the result. Of a figure: numbers, and two forms of it."""
        if self.caption:
            return {file: file for file in (f"{self.name}.{kind}" for kind in ("nc", "png", "svg"))} | dict(self.also)
        return {"output": self.makes} | dict(self.also)

    def job_name(self, **values: object) -> str:
        """The name of a job, for its record of cost and its log: its stage, and the design and range of its samples.

        values : of the placeholders in the name of the result; without them they stay as they are
        """
        name = "-".join((self.name, *(f"{{{part}}}" for part in self.placeholders)))
        return name.format(**values) if values else name


def figure(name: str, of: str, caption: str, draws: str = "", target: str = "", **others: Any) -> Stage:
    """Return the row of a figure of one stage. Target and drawing module have its name by default."""
    return Stage(name=name, takes={of: of}, caption=caption, draws=draws or name, target=target or name, **others)


FRICTION = "friction? record?"  # whose friction the machine has, unless the scene gives it
MACHINE = "seed oscillator ensemble.marginal? friction.mean? friction.statistics? friction.scatter?"
SURFACE = "seed material roughness"
STRIP = f"{SURFACE} strip.window_m strip.width_m strip.cell_m strip.penetration_percentiles"
SQUARE = "square.edge_m square.nodes"

_ROWS = (
    Stage(
        name="scan",
        reads="targets roughness.scan roughness.correct_correlation? strip.window_m? strip.width_m? strip.cell_m? "
        "strip.expansion_spacing_m?",
        takes={"scan": "roughness.scan.file"},
        makes="surface/scan.nc",
        runs_if="roughness.scan",
        memory_mb=1000,
    ),
    Stage(
        name="record",
        reads="seed friction.record friction.scatter? oscillator.windows_in_parallel?",
        own="oscillator.normal_force_n material roughness strip.window_m strip.width_m",
        takes={"record": "friction.record.file"},
        makes="friction/record.nc",
        runs_if="friction.record",
        memory_mb=700,
    ),
    Stage(
        name="karhunen_loeve",
        reads=f"roughness {SQUARE} square.modes",
        takes={"scan": "scan?"},
        makes="surface/modes.nc",
    ),
    Stage(
        name="contact_square",
        reads=f"{SURFACE} {SQUARE} square.latin_hypercube_samples expansion.samples "
        "numerics.contact_tolerance numerics.contact_area",
        takes={"surface": "karhunen_loeve", "scan": "scan?"},
        makes="contact/square-{design}-{first}-{last}.nc",
        batches={
            "monte_carlo": "square.monte_carlo_samples",
            "latin_hypercube": "square.latin_hypercube_samples",
            "expansion": "expansion.samples",
        },
    ),
    Stage(
        name="chaos_square",
        reads=f"{SURFACE} {SQUARE} square.latin_hypercube_samples numerics.contact_area expansion",
        takes={"surface": "karhunen_loeve", "contact": "contact_square", "scan": "scan?"},
        makes="chaos/square.nc",
        memory_mb=620,
    ),
    Stage(
        name="contact",
        reads=f"{STRIP} strip.samples strip.window_spacing_m strip.training_samples "
        "numerics.contact_area numerics.contact_tolerance load.nominal_pressure_pa?",
        takes={"scan": "scan?"},
        makes="contact/blocks-{first}-{last}.nc",
        batches={"": "strip.samples"},
        memory_mb=900,
    ),
    Stage(
        name="expansion_strip",
        reads=f"{STRIP} numerics.contact_area strip.window_spacing_m strip.samples strip.training_samples "
        "strip.expansion_samples expansion.degree expansion.target strip.expansion_spacing_m?",
        takes={"contact": "contact", "scan": "scan?"},
        makes="friction/expansion.nc",
        runs_if="not load",
        memory_mb=460,
    ),
    Stage(
        name="friction",
        reads=f"{STRIP} strip.window_spacing_m strip.samples strip.expansion_samples strip.expansion_spacing_m? "
        "friction.mean load? oscillator.normal_force_n? oscillator.windows_in_parallel?",
        takes={"blocks": "contact expansion_strip", "scan": "scan?"},
        makes="friction/statistics.nc",
        also={"summary": "summary.csv"},
        runs_if="not friction.statistics and not friction.record",
        memory_mb=700,
    ),
    Stage(
        name="cycles",
        reads="seed oscillator ensemble friction.mean? friction.statistics? friction.scatter?",
        takes={"friction": FRICTION},
        makes="oscillator/statistics.nc",
        memory_mb=620,
    ),
    Stage(
        name="answer",
        reads=f"{MACHINE} answer.realisations? answer.duration_periods? answer.can_change?",
        takes={"friction": FRICTION},
        makes="answer.json",
        target="answer",
        comes_with="cycles stick_slip_map",
        memory_mb=620,
    ),
    Stage(
        name="budget",
        reads=f"{MACHINE} standard_uncertainties? load? material? roughness? strip.window_m? strip.width_m?",
        takes={"answer": "answer", "friction": FRICTION, "scan": "scan?"},
        makes="oscillator/budget.nc",
        also={"text": "budget.json"},
        memory_mb=620,
    ),
    Stage(
        name="stick_slip_map",
        reads=f"{MACHINE} map",
        takes={"friction": FRICTION},
        makes="oscillator/map.nc",
        memory_mb=620,
    ),
    figure(
        name="friction_against_load",
        of="friction",
        draws="figure3",
        reads="description load",
        caption="Friction against load: real area of contact, mean and coefficient of variation of the "
        "friction coefficient of the pad, and windows without contact, over two decades of nominal "
        "pressure. The shear strength is that which gives the pad its mean under the load of the "
        "scene, marked. Bands are 95 % intervals.",
    ),
    figure(
        name="figure2",
        of="chaos_square",
        caption="Figure 2. Pressure at the centre of the square, given contact: (a) as in the paper, (b) at "
        "low probabilities, and (c) the probability of contact. Both expansions (PC) are fitted to "
        "one Latin hypercube design (LHS) and evaluated at solved surfaces in contact that no fit has "
        "seen, with bands over all designs.",
    ),
    figure(
        name="figure3",
        of="friction",
        caption="Figure 3. Friction coefficient of the test surface against penetration: as in the paper (a) "
        "mean and (b) standard deviation, and (c) their ratio. Combined: solved contact with the "
        "expansion as control variate, and the curve through it is the mean friction coefficient that "
        "the oscillator takes.",
    ),
    figure(
        name="figure3_law",
        of="friction",
        draws="figure3",
        target="figure3",
        caption="The distribution of the friction coefficient: its autocorrelation next to that of white "
        "pressure in the same windows, exponential lengths, and the marginal at median penetration. "
        "Below: the marginal where the paper's Beta lies nearest, skewness and excess kurtosis.",
    ),
    figure(
        name="figure5",
        of="cycles",
        caption="Figure 5. As in the paper (a) the limit cycle, (b) the point where the mass sticks again, "
        "and (c) the cycles lost to the scatter against damping; (d) the cycles themselves. The "
        "paper's dimensionless numbers are ours in metres.",
    ),
    figure(
        name="figure_budget",
        of="budget",
        draws="stick_slip",
        caption="What is worth measuring: the part of each source, and of the scatter of friction itself, in the "
        "variance of stick-slip or not. Then Sobol' indices of the limits of the cycle. Wide bars are total, narrow "
        "ones first indices, lines 95 % intervals.",
    ),
    Stage(
        name="figure_chain",
        module="figure_chain",
        draws="figure5",
        reads="description seed material roughness oscillator ensemble strip.cell_m "
        "numerics.contact_tolerance friction.mean? friction.statistics? friction.scatter? load? "
        "numerics.contact_area? strip.window_m? strip.width_m? strip.window_spacing_m? strip.samples?",
        takes={"cycles": "cycles", "friction": FRICTION, "scan": "scan?"},
        target="figure_chain",
        comes_with="figure5",
        runs_if="not friction.statistics and not friction.record",
        caption="The chain in one picture: a piece of the rough surface and the contact pressure on it, then friction "
        "along four paths, and the limit cycle of several runs with such friction.",
    ),
    figure(
        name="figure_map",
        of="stick_slip_map",
        draws="stick_slip",
        caption="Where stick-slip occurs: its probability over two parameters, with dots at the points that "
        "were run. Lines without scatter, where one axis is damping: the cycle exists left of the "
        "solid one, steady sliding is unstable left of the dashed one. In the hatched area, without scatter too, the "
        "mass vibrates and does not stick.",
    ),
    figure(
        name="figure_record",
        of="record",
        comes_with="record",
        caption="A measured friction record: over time, over sliding speed with the mean curve and its 95 % "
        "band, residuals, and their autocovariance with the fit. "
        "Below: synthetic records of the fitted process, on the scale of the measured one.",
    ),
    figure(
        name="figure_scan",
        of="scan",
        comes_with="scan",
        caption="A scan and the model fitted to it: map of the scan, autocorrelation over lags, with a line where it "
        "falls to 1/e, and density of heights. Below: autocorrelation along both axes, radially averaged power "
        "spectrum, numbers. Bands are 95 % intervals of the scan.",
    ),
    Stage(name="figures", reads="description"),
    Stage(
        name="page",
        reads="description targets origins",
        collects={"square": "chaos_square", "friction": "friction", "oscillator": "cycles"},
        makes="report.html",
        also={"claims": "claims.json", "costs": "costs.json"},
        target=EVERY_SCENE,
    ),
    Stage(name="joint_page", module="page", makes="report.html"),
    Stage(name="verify", makes="verify.txt"),
)
STAGES = {stage.name: stage for stage in _ROWS}


def targets() -> tuple[str, ...]:
    """Return all that a scene may ask for."""
    return tuple(sorted({stage.target for stage in STAGES.values()} - {"", EVERY_SCENE}))


def drawing(figures: Iterable[str]) -> Stage:
    """Return the stage that draws these figures in one job: what they read, take and make together."""
    rows, whole = [STAGES[name] for name in figures], STAGES["figures"]
    return replace(
        whole,
        module=" ".join(dict.fromkeys([whole.name, *filter(None, (row.module for row in rows))])),
        draws=" ".join(dict.fromkeys(row.draws for row in rows)),
        reads=" ".join(dict.fromkeys(key for row in (whole, *rows) for key in row.reads.split())),
        takes={name: words for row in rows for name, words in row.takes.items()},
        also={name: file for row in rows for name, file in row.results.items()},
    )
