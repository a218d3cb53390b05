"""Results on disk: read as they were written, or refused in one line."""

import json
from random import Random

import netCDF4
import numpy as np
import pytest
import xarray

from roughslip import store
from roughslip.errors import StoreError

KEY = store.Key({"seed": 3, "strip": {"cell_m": 1e-6}}, "abc")


def example():
    return {
        "pressure": store.Variable(("sample", "x"), np.arange(6.0).reshape(2, 3), "Pa", "contact pressure"),
        "label": store.Variable(("sample",), np.array(["a", "bc"]), "1", "name of the sample"),
    }


def test_what_is_written_is_read_back_with_what_made_it_and_has_the_same_bytes_again(tmp_path):
    store.write(tmp_path / "a.nc", example(), KEY, {"first": 4})
    result = store.read(tmp_path / "a.nc")
    np.testing.assert_array_equal(result["pressure"], np.arange(6.0).reshape(2, 3))
    assert list(result["label"]) == ["a", "bc"]
    assert json.loads(result.attributes["configuration"]) == KEY.configuration
    assert [str(result.attributes[name]) for name in ("code_hash", "seed", "first")] == ["abc", "3", "4"]
    assert set(json.loads(result.attributes["versions"])) == {"python", *store.PACKAGES}
    dataset = result.dataset()
    assert float(dataset.pressure.mean("x").isel(sample=1)) == 4.0
    assert (dataset.pressure.units, dataset.attrs["first"]) == ("Pa", 4)
    store.write(tmp_path / "b.nc", example(), KEY, {"first": 4})
    assert (tmp_path / "a.nc").read_bytes() == (tmp_path / "b.nc").read_bytes()
    with netCDF4.Dataset(tmp_path / "b.nc", "a") as file:
        file.setncattr("first", 5)
    with pytest.raises(StoreError, match=r"rebuild it with: rm -f .*b\.nc && snakemake"):
        store.read(tmp_path / "b.nc")


def test_xarray_selects_by_coordinates(tmp_path):
    """Of a dimension whose coordinates have another name; one that is named like its dimension stays."""
    cycles = store.Variable(("damping", "lag"), np.arange(6.0).reshape(3, 2), "1", "cycles")
    damping = store.Variable(("damping",), np.array([0.05, 0.1, 0.3]), "1", "damping ratio D")
    lag = store.Variable(("lag",), np.array([0.0, 2e-5]), "m", "lag")
    store.write(tmp_path / "a.nc", {"cycles": cycles, "damping_ratio": damping, "lag": lag}, KEY)
    with xarray.open_dataset(tmp_path / "a.nc") as dataset:
        one = dataset.sel(damping=0.1)
        assert (float(one.cycles.sel(lag=2e-5)), float(one.damping_ratio), dataset.damping.units) == (3.0, 0.1, "1")
    assert float(store.read(tmp_path / "a.nc").dataset().sel(damping=0.29, method="nearest").cycles[0]) == 4.0


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
        number = {"n": store.Variable(("s",), np.array([first]), "1", "n")}
        store.write(tmp_path / f"{first}.nc", number, KEY, {"first": first})
    np.testing.assert_array_equal(store.join(store.read_all(sorted(tmp_path.glob("*.nc"))), "n"), [3, 20, 100])


def test_a_damaged_result_is_never_taken_for_another(tmp_path):
    """Flipped bits, cut short, or with a piece overwritten; never with a traceback."""
    path, random = tmp_path / "a.nc", Random(1)
    store.write(path, example(), KEY, {"first": 0})
    content, was, refused = path.read_bytes(), store.read(path), []
    for number in range(100):
        damaged = bytearray(content)
        for _ in range(random.choice([1, 3, 30])):
            damaged[random.randrange(len(damaged))] ^= 1 << random.randrange(8)
        start = random.randrange(len(damaged))
        damaged[start:] = random.choice([damaged[start:], b"", random.randbytes(8) + damaged[start + 8 :]])
        path.write_bytes(damaged)
        try:
            result = store.read(path)
        except StoreError as error:
            refused.append(str(error))
        else:
            assert result.attributes == was.attributes, number
            assert result["pressure"].tobytes() == was["pressure"].tobytes(), number
            assert list(result["label"]) == ["a", "bc"], number
    assert len(refused) > 25  # the rest hit what the file does not use
    assert all("rebuild it with: rm -f" in line and "\n" not in line for line in refused)
