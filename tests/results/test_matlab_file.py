"""MATLAB files of every version: the numbers that were written, by the names they have in MATLAB; and what is none."""

from __future__ import annotations

import tracemalloc
import zlib
from contextlib import suppress
from pathlib import Path
from struct import pack

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from slipstick.errors import InputError
from slipstick.results import matlab_file
from slipstick.results.matlab_file import matlab_arrays
from slipstick.results.measured_columns import in_units, read_columns
from slipstick.units import Units

F = np.array([1.0, 2.0, 4.0])
H = np.arange(12.0).reshape(3, 2, 2) * (1.0 - 0.5j)
X = np.array([[10.0, 20.0], [11.0, 21.0], [12.0, 22.0]])


def older(path: Path, **options: object) -> Path:
    note = np.array(["a", 1.0], dtype=object)
    held = {"f": F, "rig": {"H": H, "x": X, "about": "run 7"}, "note": note, "title": "rig", "on": np.array([1, 0, 1])}
    savemat(path, held, **options)
    return path


def newer(path: Path) -> Path:
    """As MATLAB lays it out: reversed dimensions, structs as groups, complex numbers as pairs, texts as numbers."""
    pairs = np.empty(H.T.shape, dtype=[("real", "<f8"), ("imag", "<f8")])
    pairs["real"], pairs["imag"] = H.T.real, H.T.imag
    with h5py.File(path, "w", userblock_size=512) as file:
        file["f"] = F[None, :]
        file["on"] = np.array([[1, 0, 1]], dtype=np.uint8)
        file["rig/x"] = X.T
        file["rig/H"] = pairs
        file["title"] = np.array([[114, 105, 103]], dtype=np.uint16)
        file["title"].attrs["MATLAB_class"] = np.bytes_("char")
        file["nothing"] = np.zeros(2, dtype=np.uint64)
        file["nothing"].attrs["MATLAB_empty"] = 1
        file["#refs#/a"] = np.ones(5)
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/x")
        file["round"] = h5py.SoftLink("/rig")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + pack("<H", 0x200) + b"IM")
    return path


@pytest.mark.parametrize(
    "write", [older, lambda path: older(path, do_compression=True), newer], ids=["5", "7 compressed", "7.3"]
)
def test_the_same_columns_in_every_version(tmp_path: Path, write) -> None:
    found = matlab_arrays(write(tmp_path / "rig.mat"))
    assert sorted(found) == ["f", "on", "rig.H", "rig.x"]
    np.testing.assert_array_equal(found["f"], F)
    np.testing.assert_array_equal(found["rig.H"], H)
    np.testing.assert_array_equal(found["rig.x"], X)
    np.testing.assert_array_equal(found["on"], [1, 0, 1])


def test_types_of_numbers(tmp_path: Path) -> None:
    """All that SciPy writes, also the other order of bytes."""
    held = {f"v{k}": np.arange(1, 4).astype(k) for k in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")}
    held |= {"c8": (H[:, 0, 0]).astype("c8"), "one": np.array([7.0]), "row": F[None, :], "none": np.zeros((0, 3))}
    savemat(tmp_path / "a.mat", held)
    found = matlab_arrays(tmp_path / "a.mat")
    assert set(found) == set(held) - {"none"}
    for name, values in found.items():
        np.testing.assert_array_equal(values, np.ravel(held[name]))
    big = b"MATLAB 5.0 MAT-file".ljust(124) + pack(">H", 0x100) + b"MI"
    body = (
        pack(">IIII", 6, 8, 6, 0)
        + pack(">IIii", 5, 8, 2, 1)
        + pack(">HH", 1, 1)
        + b"x\0\0\0"
        + pack(">IIdd", 9, 16, 3, 5)
    )
    (tmp_path / "b.mat").write_bytes(big + pack(">II", 14, len(body)) + body)
    np.testing.assert_array_equal(matlab_arrays(tmp_path / "b.mat")["x"], [3.0, 5.0])


def test_version_4_is_named(tmp_path: Path) -> None:
    savemat(tmp_path / "rig.mat", {"f": F, "H": np.ones((5, 5))}, format="4")
    refused(tmp_path / "rig.mat", "save it with -v7")


def test_columns_with_units(tmp_path: Path) -> None:
    """A unit stands behind a name, as the file has none; what is not chosen may have any length."""
    file = older(tmp_path / "rig.mat")
    found = read_columns(file, {"frequency": "f [kHz]", "x": "rig.x(:, 2) [um]", "tip/root": "rig.H(:,2,1)"})
    values = in_units(file, found, Units(length="mm", force="N"))
    np.testing.assert_allclose(values["frequency"], 1e3 * F, rtol=1e-14)
    np.testing.assert_allclose(values["x"], 1e-3 * X[:, 1], rtol=1e-14)
    np.testing.assert_array_equal(values["tip/root"], H[:, 1, 0])
    wide = read_columns(file, {"a": "rig.x(3, :)", "b": "rig.x(:,2)"} | {"b": "rig.H(1,:,2) [um]"}).values
    np.testing.assert_array_equal(wide["a"], X[2])
    np.testing.assert_array_equal(wide["b"], H[0, :, 1])
    for wrong in (
        "rig.x(:,3)",
        "rig.x(:,0)",
        "rig.x(:,:)",
        "rig.x(1,2)",
        "rig.x(:)",
        "rig.x",
        "rig.x(:,1,1)",
        "f(:,,)",
    ):
        with pytest.raises(InputError, match="there is no column"):
            read_columns(file, {"x": wrong})
    with pytest.raises(InputError, match=r"holds a matrix, rig\.H \(3 x 2 x 2\); expected vectors"):
        read_columns(file)
    savemat(tmp_path / "b.mat", {"f": F, "long": np.arange(9.0)})
    with pytest.raises(InputError, match="columns of different lengths: 3 of f, 9 of long; choose"):
        read_columns(tmp_path / "b.mat")
    with pytest.raises(InputError, match=r"no column 'ff' in rig\.mat; the columns are f, rig\.H \(3 x 2 x 2\)"):
        read_columns(file, {"omega": "ff"})
    (tmp_path / "c.csv").write_text("omega,x [um]\n1,2\n")
    with pytest.raises(InputError, match=r"x is given in mm; expected um, as c\.csv says"):
        read_columns(tmp_path / "c.csv", {"x": "x [mm]"})


def refused(path: Path, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        matlab_arrays(path)
    (sentence,) = caught.value.sentences
    assert str(path) in sentence
    assert "\n" not in sentence


def test_files_that_are_none(tmp_path: Path) -> None:
    good = older(tmp_path / "good.mat", do_compression=True).read_bytes()
    for name, data in {
        "empty": b"", "text": b"omega,x\n1,2\n" * 20, "short": good[:200], "head": good[:128], "netcdf": b"CDF\1" * 99,
        "hdf5": b"\x89HDF\r\n\x1a\n" + b"\0" * 600, "pickle": b"\x80\x04\x95" + b"a" * 200,
    }.items():  # fmt: skip
        (tmp_path / name).write_bytes(data)
        refused(tmp_path / name, "cannot be read as a MATLAB file|holds no arrays of numbers")
    refused(tmp_path / "none", "cannot be read as a MATLAB file")
    savemat(tmp_path / "texts.mat", {"a": "text", "b": np.array([{"c": 1}], dtype=object)})
    refused(tmp_path / "texts.mat", "holds no arrays of numbers")


def test_sizes_are_checked_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small compressed file that grows, and a sparse one that claims what it does not hold, are not unpacked."""
    many = zlib.compress(bytes(30_000_000), 9)
    bomb = tmp_path / "bomb.mat"
    bomb.write_bytes(b"MATLAB 5.0 MAT-file".ljust(124) + pack("<H", 0x100) + b"IM" + pack("<II", 15, len(many)) + many)
    monkeypatch.setattr(matlab_file, "_MOST_BYTES", 1_000_000)
    tracemalloc.start()
    refused(bomb, "more than two gigabytes")
    assert tracemalloc.get_traced_memory()[1] < 4_000_000  # of 30 MB
    tracemalloc.stop()
    with h5py.File(tmp_path / "huge.mat", "w", userblock_size=512) as file:
        file.create_dataset("x", shape=(10**9,), dtype=float, chunks=(10**6,))
    refused(tmp_path / "huge.mat", "more than two gigabytes")
    monkeypatch.setattr(matlab_file, "_MOST_ARRAYS", 2)
    refused(older(tmp_path / "wide.mat"), "more than 2 arrays")


def outcome(path: Path, data: bytes) -> None:
    """Columns, or an InputError; anything else is raised."""
    path.write_bytes(data)
    with suppress(InputError):
        matlab_arrays(path)


def test_damaged_files_never_end_in_a_traceback(tmp_path: Path) -> None:
    """Wrong bytes anywhere, also as types that a file claims."""
    data, rng = older(tmp_path / "rig.mat").read_bytes(), np.random.default_rng(0)
    for _ in range(300):
        spoilt = bytearray(data)
        for at in rng.integers(0, len(data), 3):
            spoilt[at] = rng.integers(256)
        outcome(tmp_path / "spoilt.mat", bytes(spoilt))


@pytest.mark.parametrize("write", [older, newer], ids=["5", "7.3"])
def test_files_that_end_early(tmp_path: Path, write) -> None:
    data = write(tmp_path / "rig.mat").read_bytes()
    for size in np.linspace(0, len(data), 60).astype(int):
        outcome(tmp_path / "short.mat", data[:size])
