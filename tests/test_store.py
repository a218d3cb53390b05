import json

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
