"""Results are read as they were written, and a broken write leaves the earlier file."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from bayes_placement.io import netcdf


def tree(number=1.5):
    draws = (("chain", "draw"), np.array([[number, np.nan, -np.inf]]), {"units": "m"})
    posterior = xr.Dataset({"sensor.s1.position": draws}, coords={"chain": [0], "draw": [0, 1, 2]})
    observed = xr.Dataset(
        {"measured": (("sensor", "frequency"), np.array([[1.0, 2.0]]))},
        coords={"sensor": ["s1+x"], "frequency": ("frequency", [5.0, 7.5], {"units": "Hz"})},
    )
    result = xr.DataTree.from_dict({"/posterior": posterior, "/observed_data": observed})
    result.attrs = {
        "engine": "SMC",
        "particles": 2000,
        "seconds": 1.25,
        "warnings": [],
        "experiment": "two lines\nand a unit [(m/s²)/N]",
        "seed": [0, 7],
    }
    return result


def test_a_tree_comes_back_with_values_names_units_and_attributes(tmp_path):
    path = netcdf.write(tree(), tmp_path / "new folder" / "result.nc")
    back = netcdf.read(path)
    assert path == tmp_path / "new folder" / "result.nc"
    assert list(back.children) == list(tree().children)
    for group, expected in tree().children.items():
        assert back[group].to_dataset().identical(expected.to_dataset())
    assert list(back.attrs) == list(tree().attrs)
    for name, value in tree().attrs.items():
        np.testing.assert_array_equal(back.attrs[name], value)


@pytest.mark.parametrize("warnings", [[], ["It is wet."], ["It is wet.", "It is\ncold."]])
def test_warnings_come_back_as_a_list_of_sentences(warnings, tmp_path):
    result = tree()
    result.attrs["warnings"] = warnings
    assert netcdf.read(netcdf.write(result, tmp_path / "result.nc")).attrs["warnings"] == warnings


def test_what_was_read_no_longer_needs_the_file(tmp_path):
    back = netcdf.read(netcdf.write(tree(), tmp_path / "result.nc"))
    (tmp_path / "result.nc").unlink()
    assert back["posterior"]["sensor.s1.position"][0, 0] == 1.5


def test_a_file_is_replaced_by_a_newer_one(tmp_path):
    netcdf.write(tree(), tmp_path / "result.nc")
    netcdf.write(tree(2.5), tmp_path / "result.nc")
    assert netcdf.read(tmp_path / "result.nc")["posterior"]["sensor.s1.position"][0, 0] == 2.5


def test_a_reader_of_the_old_file_is_not_disturbed_by_a_newer_one(tmp_path):
    path = netcdf.write(tree(), tmp_path / "result.nc")
    before = path.read_bytes()
    with path.open("rb") as reader:
        netcdf.write(tree(2.5), path)
        assert reader.read() == before
    assert path.read_bytes() != before


def test_a_write_that_breaks_off_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    netcdf.write(tree(), tmp_path / "result.nc")

    def full_disk(self, content):
        with self.open("wb") as file:
            file.write(b"half a fi")
        raise OSError("No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full_disk)
    with pytest.raises(OSError, match="No space left"):
        netcdf.write(tree(2.5), tmp_path / "result.nc")
    assert netcdf.read(tmp_path / "result.nc")["posterior"]["sensor.s1.position"][0, 0] == 1.5
    assert [path.name for path in tmp_path.iterdir()] == ["result.nc"]


def test_a_missing_file_is_named_with_the_way_to_write_one(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"no file .*result\.nc.*io\.netcdf\.write"):
        netcdf.read(tmp_path / "result.nc")


def test_a_damaged_file_is_refused(tmp_path):
    path = netcdf.write(tree(), tmp_path / "result.nc")
    all_bytes = path.read_bytes()
    for content in (b"no netCDF at all", all_bytes[: len(all_bytes) // 2]):
        path.write_bytes(content)
        with pytest.raises(ValueError, match=r"result\.nc cannot be read as netCDF.*complete file"):
            netcdf.read(path)


def test_a_single_changed_byte_is_told(tmp_path):
    path = netcdf.write(tree(), tmp_path / "result.nc")
    content = path.read_bytes()
    for place in range(0, len(content), len(content) // 40):
        damaged = bytearray(content)
        damaged[place] ^= 1
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match=r"result\.nc .*(changed since|does not end with)"):
            netcdf.read(path)


def test_a_changed_attribute_is_told(tmp_path):
    path = netcdf.write(tree(), tmp_path / "result.nc")
    with h5py.File(path, "r+") as file:
        file.attrs["engine"] = "another"
    with pytest.raises(ValueError, match=r"result\.nc cannot be read .*(changed|does not end)"):
        netcdf.read(path)


def test_hdf5_files_of_others_are_not_opened(tmp_path):
    path = tmp_path / "result.nc"
    tree().to_netcdf(path, engine="h5netcdf")
    with pytest.raises(ValueError, match=r"does not end with the checksum .*open_datatree\(path\)"):
        netcdf.read(path)


def test_other_readers_of_netcdf_read_our_results(tmp_path):
    path = netcdf.write(tree(), tmp_path / "result.nc")
    with xr.open_datatree(path, engine="h5netcdf") as other:
        assert other["posterior"]["sensor.s1.position"][0, 0] == 1.5
