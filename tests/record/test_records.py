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
from roughslip.record.slips import Rig, sliding

TIME = np.arange(200) * 0.01
RECORDS = Path(__file__).parents[2] / "config" / "records"
RIG = Rig(2.0, 800.0, 8.0)
LOAD, DT = 20.0, 1.0 / 400.0


def write(folder, header, *columns):
    path = folder / "trace.csv"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def test_units_become_si(tmp_path):
    head = "Time [ms],speed [rpm],force [mN],load [N],position [um]"
    path = write(tmp_path, head, 1e3 * TIME, *np.full((4, 200), [[60.0], [3000.0], [10.0], [5.0]]))
    (trace,) = read_records([path], 0.5)
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
        (HEAD, [*ROWS, *ROWS[:9]], ["column time: record 2, where time falls, has 9 rows; at least 100"]),
        (HEAD, [row.replace("0.3", "-0.3") for row in ROWS], ["column friction: friction is -0.3 on average"]),
        (HEAD, [row.replace("0.5", "0.0") for row in ROWS], ["column speed: zero in each row"]),
        (HEAD, [*ROWS, "2.00,-0.5,0.3"], ["column speed: of both signs"]),
        (HEAD.replace("friction [1]", "friction [N]"), ROWS, ["column friction: unit 'N' is not allowed"]),
        (
            "zeit [s],speed [rpm],speed [m/s],force [lb]",
            [f"{row},1" for row in ROWS],
            [
                *("column 'zeit': not known", "column speed: rpm needs the radius of", "column 'speed': given twice"),
                *("column force: unit 'lb' is not allowed", "column time: missing", "column friction: missing"),
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


def mu(speed):
    return 0.25 / (1.0 + 20.0 * speed) + 0.2


def trace(belt, seconds=4.0, inner=10, noise=0.0):
    """A pin on a rig over a belt of constant speed, by small steps, from rest if slow: the force in its support."""
    x, velocity, forces = 0.0 if belt < 0.1 else LOAD * mu(belt) / RIG.stiffness_n_per_m, 0.0, []
    for t in range(int(seconds / DT) * inner):
        held = RIG.stiffness_n_per_m * x + RIG.damping_n_s_per_m * velocity
        if t % inner == 0:
            forces.append(held)
        velocity += DT / inner / RIG.mass_kg * (LOAD * mu(max(belt - velocity, 0.0)) - held)
        velocity = min(velocity, belt)
        x += DT / inner * velocity
    forces = np.array(forces) + noise * np.random.default_rng(1).standard_normal(len(forces))
    ones = np.ones(forces.size)
    return Trace(np.arange(forces.size) * DT, belt * ones, forces / LOAD, LOAD * ones, None)


def test_slips_show_the_curve_that_stick_slip_hides():
    """The error of the balance is that of a derivative over five samples of a slip: below 0.01."""
    found = sliding([trace(0.05)], RIG)
    samples = found.samples
    assert 0.3 < np.mean(found.stick[0]) < 0.9
    assert samples.speed.max() > 0.08  # nearly twice the belt's
    assert np.sqrt(np.mean((samples.friction - mu(samples.speed)) ** 2)) < 0.01
    assert found.notes == ()
    assert found.from_slips


def test_without_the_rig_slips_are_left_out_and_a_note_says_so():
    slow, fast = trace(0.03, noise=0.01), trace(0.5, noise=0.01)
    one = Trace(
        np.arange(slow.time.size + fast.time.size) * DT,
        *(np.concatenate([getattr(part, name) for part in (slow, fast)]) for name in ("speed", "friction", "load")),
        None,
    )
    found = sliding([one])
    assert found.samples.speed.min() > 0.4
    assert "50% of the record is stick-slip and not used" in found.notes[0]


def test_noise_is_no_stick_slip():
    steady = np.random.default_rng(4).normal(0.3, 0.01, 8000)
    found = sliding([Trace(np.arange(8000) * DT, np.full(8000, 0.1), steady, None, None)])
    assert not found.stick[0].any()
    assert found.samples.friction.size == 4000  # means of two
    assert found.samples.slipped[-1] == pytest.approx(8000 * DT * 0.1, rel=1e-3)


def test_a_specimen_that_never_slides_has_no_friction():
    n = 1000
    place = np.arange(n) * DT * 0.1
    with pytest.raises(IllPosedError, match="no sample of the record is in steady sliding"):
        sliding([Trace(np.arange(n) * DT, np.full(n, 0.1), np.full(n, 0.3), None, place)])


@pytest.mark.slow
def test_the_shipped_record_is_what_its_script_makes_and_holds_its_truth():
    """A third of it is stick. Curve, standard deviation 0.015 and length 5 mm lie within four standard errors."""
    made = runpy.run_path(str(RECORDS / "tribometer.py"))
    (shipped,) = read_records([RECORDS / "tribometer.csv"])
    again = made["record"]()
    assert shipped.friction == pytest.approx(again[:, 2] / again[:, 3], abs=1e-4)  # of three digits of a newton
    assert shipped.speed == pytest.approx(again[:, 1], abs=1e-5)
    samples = sliding([shipped], Rig(made["MASS"], made["STIFFNESS"], made["DAMPING"])).samples
    found = fit_record(samples, 2.0 * np.pi * made["RADIUS"], from_slips=True)
    low, high = found.curve.interval()
    away = np.abs(found.curve.friction - made["mu"](found.curve.speeds_m_per_s)) / (high - low)
    assert np.max(away) < 1.0
    errors = np.sqrt(np.diag(found.additive.log_covariance))
    values = np.array([found.additive.standard_deviation, found.additive.correlation_length_m])
    assert np.all(np.abs(np.log(values / [made["DEVIATION"], made["LENGTH"]])) < 4.0 * errors)
    assert found.kind != "multiplicative"
