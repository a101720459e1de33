"""netCDF-4 files: what is written is read, and no more than the file holds."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from helpers.results import opened

from slipstick.errors import InputError
from slipstick.io import hdf5
from slipstick.io.loading import load_dataset
from slipstick.io.netcdf import Further, Group, StoredVariable, write_netcdf
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


FULL = """
import errno, resource, sys
from pathlib import Path
import numpy as np
from slipstick.io.netcdf import Further, Group, StoredVariable, write_netcdf

path, values = Path(sys.argv[1]), np.random.default_rng(1).random((40, 3000))
names = StoredVariable(dims=("dof",), values=np.array([f"dof {i}" for i in range(3000)]))
whole = {"x": StoredVariable(dims=("point", "dof"), values=values, attributes={"units": "m"}), "dof": names}
first = {"x": StoredVariable(dims=("point", "dof"), values=values[:10]), "dof": names}
first["point"] = StoredVariable(dims=("point",), values=np.arange(10))

def blocks():
    for at in range(10, 40, 10):
        yield {"x": values[at : at + 10], "point": np.arange(at, at + 10)}

def written(in_blocks):
    root = Group(variables=first if in_blocks else whole, attributes={"case": "format = 1" * 9000})
    write_netcdf(path, root, {"problem": Group(variables={"K": StoredVariable(dims=("a", "b"), values=values)})},
                 Further(30, blocks()) if in_blocks else Further())

none, tried = resource.getrlimit(resource.RLIMIT_FSIZE), 0
for in_blocks in (False, True):
    written(in_blocks)
    size = path.stat().st_size
    for limit in [0, 7, 100, 3000, *range(20_000, size, size // 12), size - 25, size - 1]:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, none[1]))
        try:
            written(in_blocks)
        except OSError as error:
            assert error.errno == errno.EFBIG, error
            tried += 1
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, none)
    written(in_blocks)
print(tried)
"""


@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_a_disk_that_fills_up_at_any_place_ends_the_writing_not_the_process(tmp_path: Path) -> None:
    """As whole arrays and block by block; HDF5 itself would end the process, perhaps only at its very end."""
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(tmp_path / "r.nc")], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert int(done.stdout) > 30
    assert opened(tmp_path / "r.nc")["x"].shape == (40, 3000)


def test_points_written_in_blocks_are_those_written_at_once(tmp_path: Path) -> None:
    """Where HDF5 keeps a piece in memory (y) and where each block is one (x), and with texts."""
    x, y = np.random.default_rng(1).random((50, 4000)), np.arange(50.0)
    kind = np.array(["start", *["regular"] * 48, "end"])
    every = {"point": np.arange(50), "x": x, "y": y, "kind": kind}

    def group(points: slice) -> Group:
        dims = {name: ("point", "dof")[: value.ndim] for name, value in every.items()}
        return Group(variables={
            name: StoredVariable(dims=dims[name], values=value[points], attributes={"units": "m"})
            for name, value in every.items()
        })  # fmt: skip

    write_netcdf(tmp_path / "whole.nc", group(slice(50)))
    blocks = ({name: value[at : at + 12] for name, value in every.items()} for at in range(12, 50, 12))
    write_netcdf(tmp_path / "blocks.nc", group(slice(12)), further=Further(38, blocks))
    xarray.testing.assert_identical(opened(tmp_path / "blocks.nc"), opened(tmp_path / "whole.nc"))
    xarray.testing.assert_identical(load_dataset(tmp_path / "blocks.nc"), load_dataset(tmp_path / "whole.nc"))
    assert opened(tmp_path / "blocks.nc").encoding["unlimited_dims"] == {"point"}
    with h5py.File(tmp_path / "blocks.nc", "r") as file:
        assert (file["x"].chunks, file["y"].chunks) == ((12, 4000), (50,))
        assert file["x"].fletcher32


def test_large_arrays_are_stored_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hdf5, "_LARGEST_CHUNK", 4000)
    K = np.random.default_rng(1).random((61, 100))
    write_netcdf(tmp_path / "r.nc", Group(variables={"K": StoredVariable(dims=("a", "b"), values=K)}))
    with h5py.File(tmp_path / "r.nc", "r") as file:
        assert file["K"].chunks == (5, 100)
    assert np.array_equal(load_dataset(tmp_path / "r.nc")["K"].to_numpy(), K)


def test_an_interrupt_waits_until_the_file_is_closed(tmp_path: Path) -> None:
    """In the midst of HDF5 it would leave a broken library behind."""

    class Interrupts(dict[str, object]):
        def items(self) -> Any:
            signal.raise_signal(signal.SIGINT)
            return super().items()

    write = {"x": StoredVariable(dims=("point",), values=np.arange(3.0), attributes=Interrupts(units="m"))}
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            write_netcdf(tmp_path / "r.nc", Group(variables=write))
    finally:
        signal.signal(signal.SIGINT, before)
    assert opened(tmp_path / "r.nc")["x"].values.tolist() == [0.0, 1.0, 2.0]
