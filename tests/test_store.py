import json
import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from roughslip import store
from roughslip.errors import StoreError

KEY = store.Key({"seed": 3, "strip": {"cell_m": 1e-6}}, "abc")


def example():
    return {
        "pressure": store.Variable(("sample", "x"), np.arange(6.0).reshape(2, 3), "Pa", "contact pressure"),
        "label": store.Variable(("sample",), np.array(["a", "bc"]), "1", "name of the sample"),
    }


def test_what_is_written_is_read_back_with_what_made_it(tmp_path):
    store.write(tmp_path / "a.nc", example(), KEY, {"first": 4})
    result = store.read(tmp_path / "a.nc")
    np.testing.assert_array_equal(result["pressure"], np.arange(6.0).reshape(2, 3))
    assert list(result["label"]) == ["a", "bc"]
    assert json.loads(result.attributes["configuration"]) == KEY.configuration
    assert (result.attributes["code_hash"], result.attributes["seed"], int(result.attributes["first"])) == (
        "abc",
        "3",
        4,
    )
    assert set(json.loads(result.attributes["versions"])) == {"python", *store.PACKAGES}


def test_same_content_same_bytes(tmp_path):
    for name in "ab":
        store.write(tmp_path / f"{name}.nc", example(), KEY)
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_a_truncated_file_is_named_with_the_command_that_rebuilds_it(tmp_path, share):
    path = tmp_path / "a.nc"
    store.write(path, example(), KEY)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(StoreError, match=r"a\.nc: .*rebuild it with: rm -f .*a\.nc && snakemake"):
        store.read(path)


def test_a_file_that_declares_more_than_it_holds_is_refused_before_it_fills_the_memory(tmp_path):
    """Six kilobytes that claim eight terabytes."""
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("x", 10**12)
        file.createVariable("pressure", "f8", ("x",), zlib=True).setncatts({"units": "Pa", "long_name": "p"})
    with pytest.raises(StoreError, match=r"declares more than it holds\); rebuild it with: rm -f .*a\.nc && snakemake"):
        store.read(path)


def test_an_altered_value_is_noticed(tmp_path):
    path = tmp_path / "a.nc"
    store.write(path, example(), KEY)
    content = path.read_bytes()
    place = content.index(np.arange(6.0).tobytes())
    path.write_bytes(content[: place + 6] + bytes([content[place + 6] ^ 1]) + content[place + 7 :])
    with pytest.raises(StoreError, match="checksum"):
        store.read(path)


@pytest.mark.parametrize("what", ["first", "model", "configuration", "code_hash", "units", "long_name"])
def test_an_altered_attribute_is_noticed(tmp_path, what):
    """Stages read some of them back, such as the model of a scan; none may change unnoticed."""
    path = tmp_path / "a.nc"
    store.write(path, example(), KEY, {"first": 4, "model": '{"marginal": null}'})
    store.read(path)
    with netCDF4.Dataset(path, "a") as file:
        owner = file["pressure"] if what in ("units", "long_name") else file
        value = owner.getncattr(what)
        owner.setncattr(what, value.swapcase() if isinstance(value, str) else value + 1)
        assert owner.getncattr(what) != value
    with pytest.raises(StoreError, match="differ from its checksum; rebuild it with"):
        store.read(path)


@pytest.mark.parametrize("change", ["added", "removed"])
def test_an_attribute_more_or_less_is_noticed(tmp_path, change):
    path = tmp_path / "a.nc"
    store.write(path, example(), KEY, {"first": 4})
    with netCDF4.Dataset(path, "a") as file:
        if change == "added":
            file.setncattr("model", "{}")
        else:
            file.delncattr("first")
    with pytest.raises(StoreError, match="checksum"):
        store.read(path)


def test_missing_file_variable_and_key_are_named(tmp_path):
    with pytest.raises(StoreError, match=r"none\.nc: missing"):
        store.read(tmp_path / "none.nc")
    store.write(tmp_path / "a.nc", example(), KEY)
    with pytest.raises(StoreError, match="no variable 'gap'"):
        store.read(tmp_path / "a.nc")["gap"]
    (tmp_path / "key.json").write_text('{"code": 1')
    with pytest.raises(StoreError, match=r"key\.json"):
        store.read_key(tmp_path / "key.json")


def test_infinity_is_refused_and_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.nc"
    store.write(path, example(), KEY)
    before = path.read_bytes()
    bad = {"x": store.Variable(("n",), np.array([1.0, np.inf]), "1", "bad")}
    with pytest.raises(StoreError, match="infinity"):
        store.write(path, bad, KEY)

    def stop_half_way():
        with store.replacing(path) as temporary:
            temporary.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        stop_half_way()
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == ["a.nc"]


def test_batches_come_in_the_order_of_their_samples(tmp_path):
    for first in (100, 20, 3):
        store.write(
            tmp_path / f"{first}.nc", {"n": store.Variable(("s",), np.array([first]), "1", "n")}, KEY, {"first": first}
        )
    batches = store.read_all(sorted(tmp_path.glob("*.nc")))
    np.testing.assert_array_equal(store.join(batches, "n"), [3, 20, 100])


def test_arrays_of_one_dimension_have_one_length(tmp_path):
    more = {"x": store.Variable(("x",), np.arange(4.0), "m", "place")}
    with pytest.raises(ValueError, match="x: dimension x has 3 places, not 4"):
        store.write(tmp_path / "a.nc", example() | more, KEY)
    assert list(tmp_path.iterdir()) == []


def test_a_result_opens_as_a_dataset_with_its_units_and_what_made_it(tmp_path):
    store.write(tmp_path / "a.nc", example(), KEY, {"first": 4})
    dataset = store.read(tmp_path / "a.nc").dataset()
    assert float(dataset.pressure.mean("x").isel(sample=1)) == 4.0
    assert (dataset.pressure.units, dataset.attrs["first"]) == ("Pa", 4)


def test_an_array_may_have_the_name_of_a_dimension_that_it_does_not_have(tmp_path):
    """As quantiles at given probabilities in a file with arrays along quantiles; netCDF depends on the order."""
    arrays = {
        "quantile": store.Variable(("probability",), np.arange(3.0), "1", "quantile"),
        "table": store.Variable(("quantile",), np.arange(2.0), "1", "table"),
    }
    store.write(tmp_path / "a.nc", arrays, KEY)
    assert store.read(tmp_path / "a.nc")["quantile"].tolist() == [0.0, 1.0, 2.0]


def test_text_is_read_as_it_was_whatever_type_it_came_in(tmp_path):
    """Its checksum, too: an array that was cut out of another keeps the longer type."""
    words = np.array(["", "fälschlich", "ab"])
    for number, values in enumerate((words, words[:1], words[2:], words.astype(object), words[:0])):
        path = tmp_path / f"{number}.nc"
        store.write(path, {"word": store.Variable(("n",), values, "1", "word")}, KEY)
        assert store.read(path)["word"].tolist() == values.tolist()


def test_no_stage_waits_for_xarray_or_pandas():
    """They are half of what a stage takes to start; only who works on with a result imports them."""
    environment = {"PYTHONPATH": str(Path(store.__file__).parents[1])}
    ask = "import sys; import roughslip.store; print(*{'xarray', 'pandas'} & set(sys.modules))"
    assert (
        subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True, env=environment).stdout
        == "\n"
    )
