"""netCDF-4 files: what is written is read, and no more than the file holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from helpers.results import opened

from slipstick.errors import InputError
from slipstick.io.loading import load_dataset
from slipstick.io.netcdf import Group, write_netcdf
from slipstick.io.store import save_dataset


def test_texts_bare_dimensions_and_numbers_survive(tmp_path: Path) -> None:
    data = xarray.Dataset(
        {
            "kind": ("point", np.array(["start", "end"])),
            "x": (("point", "dof"), np.arange(4.0).reshape(2, 2), {"units": "m"}),
            "n": ((), 3),
            "change": ("event", np.zeros(0)),
        },
        coords={"dof": ["a", "ä"]},
        attrs={"seconds": 1.5, "points": 7, "title": "Größe", "none": None, "good": True},
    )
    save_dataset(data, tmp_path / "r.nc")
    for read in (load_dataset(tmp_path / "r.nc"), opened(tmp_path / "r.nc")):
        assert read["kind"].values.tolist() == ["start", "end"]
        assert read["x"].dims == ("point", "dof")
        assert read["x"].values.tolist() == [[0.0, 1.0], [2.0, 3.0]]
        assert read["dof"].values.tolist() == ["a", "ä"]
        assert int(read["n"]) == 3
        assert read["change"].shape == (0,)
        assert read.attrs == {"seconds": 1.5, "points": 7, "title": "Größe", "good": 1}


def test_attributes_of_other_writers_are_plain_numbers_where_they_are_one(tmp_path: Path) -> None:
    """netCDF-C writes a number as an array of one."""
    import h5py

    save_dataset(xarray.Dataset({"x": ("point", [1.0, 2.0])}), tmp_path / "r.nc")
    with h5py.File(tmp_path / "r.nc", "a") as file:
        file.attrs["one"] = np.array([3])
        file.attrs["two"] = np.array([1.5, 2.5])
    read = load_dataset(tmp_path / "r.nc").attrs
    assert read["one"] == 3
    assert isinstance(read["one"], int)
    assert read["two"].tolist() == [1.5, 2.5]


def test_a_claimed_size_is_refused(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "r.nc", "w") as file:
        file.create_dataset("x", (10**7, 10**7), dtype="f8", chunks=(100, 100))
    with pytest.raises(InputError, match="claims 100000000000000 entries, more than the file holds"):
        load_dataset(tmp_path / "r.nc")


def test_a_failed_write_holds_no_buffer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A view of the image, alive in the traceback, would make a fault of its collection (from Python 3.13 on)."""
    written: list[object] = []

    def full(path: Path, data: object) -> int:
        written.append(data)
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        write_netcdf(tmp_path / "r.nc", Group(variables={}))
    assert [type(data) for data in written] == [bytes]
