"""Text files of records: columns and units, several records in one file, and all mistakes, a line each."""

import numpy as np
import pytest

from roughslip import InputError
from roughslip.record.reading import read_records

TIME = np.arange(200) * 0.01


def write(folder, header, *columns):
    path = folder / "trace.csv"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def test_units_become_si(tmp_path):
    path = write(
        tmp_path,
        "Time [ms],speed [rpm],force [mN],load [N],position [um]",
        1e3 * TIME,
        np.full(200, 60.0),
        np.full(200, 3000.0),
        np.full(200, 10.0),
        np.full(200, 5.0),
    )
    (trace,) = read_records([path], 0.5)
    assert trace.time == pytest.approx(TIME)
    assert trace.speed == pytest.approx(np.pi)  # one turn a second on 0.5 m
    assert trace.friction == pytest.approx(0.3)
    assert trace.load == pytest.approx(10.0)
    assert trace.position == pytest.approx(5e-6)
    assert trace.interval == pytest.approx(0.01)


def test_a_time_that_falls_begins_a_new_record(tmp_path):
    path = write(tmp_path, "time [s],speed [m/s],friction [1]", np.tile(TIME, 2), np.ones(400), np.full(400, 0.3))
    assert [trace.time.size for trace in read_records([path])] == [200, 200]


def test_semicolons_with_decimal_commas(tmp_path):
    path = tmp_path / "trace.csv"
    rows = [f"{time:.2f};0,5;0,3".replace(".", ",") for time in TIME]
    path.write_text("\n".join(["time [s];speed [m/s];friction [1]", *rows]))
    (trace,) = read_records([path])
    assert (trace.time[1], trace.speed[0], trace.friction[0]) == (0.01, 0.5, 0.3)


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
    path = tmp_path / "trace.csv"
    path.write_bytes("\r\n".join([*head.split("\n"), *(row.format(time) for time in TIME)]).encode())
    (trace,) = read_records([path])
    assert trace.time == pytest.approx(TIME)
    assert np.abs(trace.speed) == pytest.approx(0.5)
    assert trace.friction == pytest.approx(0.3)


def test_several_files_are_read_together_and_each_mistake_names_its_file(tmp_path):
    good = write(tmp_path, "time [s],speed [m/s],friction [1]", TIME, np.ones(200), np.full(200, 0.3))
    assert len(read_records([good, good])) == 2
    bad = tmp_path / "bad.csv"
    bad.write_text(good.read_text().replace("friction [1]", "friction [N]"))
    with pytest.raises(InputError) as error:
        read_records([good, bad, tmp_path / "absent.csv"])
    assert [line.split(":")[0] for line in error.value.lines] == [str(bad), str(tmp_path / "absent.csv")]


@pytest.mark.parametrize(
    ("speed", "friction", "line"),
    [
        (0.5, -0.3, "column friction: friction is -0.3 on average; above 0 and below 10 are read"),
        (0.5, 15.0, "column friction: friction is 15 on average"),
        (0.0, 0.3, "column speed: zero in each row"),
        (np.linspace(-1.0, 1.0, 200), 0.3, "column speed: of both signs"),
    ],
)
def test_what_is_no_sliding_in_one_direction_is_refused(tmp_path, speed, friction, line):
    ones = np.ones(200)
    path = write(tmp_path, "time [s],speed [m/s],friction [1]", TIME, speed * ones, friction * ones)
    with pytest.raises(InputError, match=line):
        read_records([path])


def test_every_mistake_of_a_header_is_a_line(tmp_path):
    path = write(tmp_path, "zeit [s],speed [rpm],speed [m/s],force [lb]", *[TIME] * 4)
    with pytest.raises(InputError) as error:
        read_records([path])
    assert [line.removeprefix(f"{path}: ") for line in error.value.lines] == [
        "column 'zeit': not known; allowed are time, position, speed, friction, force, load, each as `name [unit]` in "
        "the first line",
        "column speed: rpm needs the radius of the track; scene key: friction.record.radius_m",
        "column 'speed': given twice; allowed are time, position, speed, friction, force, load, each as `name [unit]` "
        "in the first line",
        "column force: unit 'lb' is not allowed; N, mN, kN",
        "column time: missing; give time [s]",
        "column friction: missing; give friction [1], or force [N] and load [N]",
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (lambda rows: rows[::-1], "column time: falls in 199 of 200 rows; sort the rows by time"),
        (
            lambda rows: [row.replace(".", ",") for row in rows],
            "6 values for 3 columns; decimal commas take semicolons",
        ),
        (lambda rows: rows[:50], "50 rows of numbers; 100 to 5000000 are read"),
        (lambda rows: [*rows, "1,2"], "line 202: 2 values for 3 columns"),
        (lambda rows: [*rows, "2.0,0.5,x"], "line 202, column friction: 'x' is no finite number"),
        (
            lambda rows: [*rows, "9.0,0.5,0.3"],
            "column time: steps from 0.01 to 7.01 s in record 1, first at 1.99 s; even steps are read",
        ),
        (lambda rows: [*rows, *rows[:9]], "column time: record 2, where time falls, has 9 rows; at least 100"),
    ],
)
def test_a_mistake_in_the_rows_is_named(tmp_path, change, line):
    path = tmp_path / "trace.csv"
    rows = [f"{time:.2f},0.5,0.3" for time in TIME]
    path.write_text("\n".join(["time [s],speed [m/s],friction [1]", *change(rows)]))
    with pytest.raises(InputError, match=r"trace\.csv: ") as error:
        read_records([path])
    assert line in error.value.lines[0]


def test_what_is_no_text_is_named(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_records([tmp_path / "absent.csv"])
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(InputError, match="not UTF-8"):
        read_records([tmp_path / "bytes.csv"])
