"""Text files of records, with all mistakes, a line each; and what of them is sliding.

Friction in slip follows from the balance of forces. What is left out where the rig is not known is said.
"""

import runpy
from pathlib import Path

import numpy as np
import pytest

from roughslip import IllPosedError, InputError
from roughslip.record.fit import fit_record
from roughslip.record.reading import Trace, read_records
from roughslip.record.slips import Rig, _deflection, sliding

TIME = np.arange(200) * 0.01
RECORDS = Path(__file__).parents[2] / "config" / "records"


def test_units_become_si(tmp_path):
    head = "Time [ms],speed [rpm],force [mN],load [N],displacement [um]"
    rows = np.column_stack([1e3 * TIME, np.tile([60.0, 3000.0, 10.0, 5.0], (200, 1))])
    np.savetxt(tmp_path / "trace.csv", rows, delimiter=",", header=head, comments="")
    (trace,) = read_records([tmp_path / "trace.csv"], 0.5)
    assert trace.time == pytest.approx(TIME)
    assert trace.speed == pytest.approx(np.pi)  # one turn a second on 0.5 m
    assert trace.friction == pytest.approx(0.3)
    assert trace.load == pytest.approx(10.0)
    assert trace.position == pytest.approx(5e-6)
    assert trace.interval == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("head", "row"),
    [
        ("# my rig\n# time [s] speed [m/s] friction [1]", "{:.2f} 0.5 0.3"),
        ("% load 20 N\n\ntime (s)\tspeed (mm/s)\tfriction (%)\t", "{:.2f}\t500,0\t30,0\t"),
        ('\ufeff"Time [ms]";"speed [m/min]";"friction"', "{:.2f}e3;30;0,3"),
        ("time [s],speed [m/s],friction [1]", "{:.2f},-0.5,-0.3"),
    ],
)
def test_headers_and_rows_as_programs_write_them(tmp_path, head, row):
    """Twice: a time that falls begins a new record."""
    path = tmp_path / "trace.csv"
    path.write_bytes("\r\n".join([*head.split("\n"), *(row.format(time) for time in (*TIME, *TIME))]).encode())
    traces = read_records([path])
    assert len(traces) == 2
    for trace in traces:
        assert trace.time == pytest.approx(TIME)
        assert np.abs(trace.speed) == pytest.approx(0.5)
        assert trace.friction == pytest.approx(0.3)


HEAD, ROWS = "time [s],speed [m/s],friction [1]", [f"{time:.2f},0.5,0.3" for time in TIME]


@pytest.mark.parametrize(
    ("head", "rows", "lines"),
    [
        (HEAD, ROWS[::-1], ["column time: falls in 199 of 200 rows; sort the rows by time"]),
        (HEAD, [row.replace(".", ",") for row in ROWS], ["line 2: 6 values for 3 columns; decimal commas take"]),
        (HEAD, [*ROWS, "1,2", "2.0,0.5,x"], ["line 202: 2 values for 3 columns"]),
        (HEAD, [*ROWS, "2.0,0.5,x"], ["line 202, column friction: 'x' is no finite number"]),
        (HEAD, [*ROWS, "9.0,0.5,0.3"], ["column time: steps from 0.01 to 7.01 s in record 1, first at 1.99 s"]),
        (HEAD, ROWS[:9] * 20, ["column time: 20 of 20 records, where it falls, have fewer than 20 rows"]),
        (
            HEAD,
            [*ROWS, *(row.replace("0.3", "-0.25") for row in ROWS)],
            ["column friction: of both signs, negative in 50%"],
        ),
        (HEAD, [row.replace("0.3", "-0.3") for row in ROWS], ["column friction: friction is -0.3 on average"]),
        (HEAD, [row.replace("0.5", "0.0") for row in ROWS], ["column speed: zero in each row"]),
        (HEAD, [*ROWS, "2.00,-0.5,0.3"], ["column speed: of both signs"]),
        (HEAD.replace("friction [1]", "friction [N]"), ROWS, ["column friction: unit 'N' is not allowed"]),
        (
            "zeit [s],speed [rpm],speed [m/s],force [lb]",
            [f"{row},1" for row in ROWS],
            [
                *("column speed: rpm needs the radius of", "column speed: given twice"),
                "column force: unit 'lb' is not allowed",
                "column time: missing; give time [s]; not known and not read: 'zeit'",
                "column friction: missing",
            ],
        ),
    ],
)
def test_each_mistake_is_a_line_that_names_its_file(tmp_path, head, rows, lines):
    """Next to those of other files."""
    good, bad, absent = (tmp_path / f"{name}.csv" for name in ("good", "bad", "absent"))
    good.write_text("\n".join([HEAD, *ROWS]))
    bad.write_text("\n".join([head, *rows]))
    with pytest.raises(InputError) as error:
        read_records([good, bad, absent])
    *found, last = error.value.lines
    assert last.startswith(f"{absent}:")
    for line, expected in zip(found[: len(lines)], lines, strict=True):
        assert line.startswith(f"{bad}: {expected}")


def test_what_is_not_read_is_said_in_a_line_each(tmp_path):
    """A preamble, units in their own line, columns of text, a path for position, and strokes that are too short."""
    path = tmp_path / "trace.csv"
    head = "Viewer 3.1\n2026-11-27; speed, 3 tracks\ntime;speed;friction;temp;position;state\ns;mm/s;-;degC;mm;"
    rows = [f"{time:.2f};500;0,3;21;{500 * time};ok, dry" for time in (*TIME[:99], *TIME[:99], *TIME[:5])]
    path.write_text("\n".join([head, *rows]))
    found = read_records([path])
    assert [(trace.time.size, trace.position, trace.speed[0]) for trace in found] == [(99, None, 0.5)] * 2
    assert [note.removeprefix(f"{path}: ") for note in found[0].notes] == [
        "the 2 lines before the header are not read",
        "columns not known and not read: 'temp', 'state'",
        "column time: 1 of 3 records, where it falls, have fewer than 20 rows and are not used",
        "column position is the path slid, and is not used",
    ]
    assert sliding(found).notes == found[0].notes


MADE = runpy.run_path(str(RECORDS / "tribometer.py"))
RIG = Rig(MADE["MASS"], MADE["STIFFNESS"], MADE["DAMPING"])


def test_slips_show_the_curve_that_stick_slip_hides():
    """At 50 mm/s. Friction scatters by 0.016, and a derivative over five samples of a slip errs."""
    time, speed, force, load = MADE["record"](4.0, speeds=(0.05, 0.05)).T
    found = sliding([Trace(time, speed, force / load, load, None)], RIG)
    assert 0.3 < np.mean(found.stick[0]) < 0.9
    assert found.samples.speed.max() > 0.08  # nearly twice the belt's
    assert np.sqrt(np.mean((found.samples.friction - MADE["mu"](found.samples.speed)) ** 2)) < 0.02
    assert (found.notes, found.from_slips) == ((), True)


def test_without_the_rig_slips_are_left_out_and_a_note_says_so():
    """Of the pin of the shipped record at 10 to 200 mm/s."""
    found = sliding(read_records([RECORDS / "tribometer.csv"]))
    assert found.samples.speed.min() > 0.03
    assert "of the record is not used: stick-slip up to 0.0" in found.notes[-1]


def test_a_specimen_that_never_slides_has_no_friction():
    time = 0.01 * np.arange(1000)
    with pytest.raises(IllPosedError, match="no sample of the record is in steady sliding"):
        sliding([Trace(time, np.full(1000, 0.1), np.full(1000, 0.3), None, 0.1 * time)])


@pytest.mark.slow
def test_the_shipped_record_is_what_its_script_makes_and_holds_its_truth():
    """A third of it is stick. Curve, standard deviation 0.015 and length 5 mm lie within four standard errors."""
    (shipped,) = read_records([RECORDS / "tribometer.csv"])
    again = MADE["record"]()
    assert shipped.friction == pytest.approx(again[:, 2] / again[:, 3], abs=1e-4)  # of three digits of a newton
    assert shipped.speed == pytest.approx(again[:, 1], abs=1e-5)
    samples = sliding([shipped], RIG).samples
    found = fit_record(samples, 2.0 * np.pi * MADE["RADIUS"], from_slips=True)
    low, high = found.curve.interval()
    away = np.abs(found.curve.friction - MADE["mu"](found.curve.speeds_m_per_s)) / (high - low)
    assert np.max(away) < 1.0
    errors = np.sqrt(np.diag(found.additive.log_covariance))
    values = np.array([found.additive.standard_deviation, found.additive.correlation_length_m])
    assert np.all(np.abs(np.log(values / [MADE["DEVIATION"], MADE["LENGTH"]])) < 4.0 * errors)
    assert found.kind != "multiplicative"


@pytest.mark.parametrize("begins", [0.0, 5.0])
def test_a_deflection_begins_in_balance(begins):
    """k x + d x' = F: a constant force holds x = F / k from the first sample; then a step takes d / k to follow."""
    time, rig = begins + 1e-3 * np.arange(200), Rig(1.0, 1e4, 100.0)  # d / k = 10 ms
    force = np.where(np.arange(200) < 100, 20.0, 30.0)
    place = _deflection(force, rig, time)
    assert np.allclose(place[:100], 20.0 / 1e4, rtol=1e-12)
    late = 1e-3 * np.arange(100)
    ramp = 10.0 * (1.0 - np.exp(-late / 1e-2) * (1.0 - np.exp(-0.1)) / 0.1)  # after a rise that lasts a sample
    assert np.allclose(1e4 * place[100:], 20.0 + ramp, rtol=1e-9)
