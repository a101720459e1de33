"""HDF5 files made by a stranger: nothing is read from elsewhere, nothing larger than the file is believed."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io import hdf5
from slipstick.io.loading import load_dataset
from slipstick.io.model_file import load_model, save_model
from slipstick.io.netcdf import Group, StoredVariable, write_netcdf

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def results(folder: Path) -> Path:
    variables = {
        "omega": StoredVariable(dims=("point",), values=np.arange(3.0)),
        "dof": StoredVariable(dims=("dof",), values=np.array(["x", "y"])),
        "amplitude": StoredVariable(dims=("point", "dof"), values=np.ones((3, 2))),
    }
    write_netcdf(folder / "r.nc", Group(variables=variables, attributes={"case": "format = 1"}))
    assert load_dataset(folder / "r.nc").sizes == {"point": 3, "dof": 2}
    return folder / "r.nc"


def model(folder: Path) -> Path:
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    return save_model(assemble_mesh(MeshModel(mesh=mesh), source="s", material=STEEL), folder / "m.h5")


def replaced(name: str, make: Callable[[Any, Path], object]) -> Callable[[Any, Path], None]:
    def spoil(file: Any, folder: Path) -> None:
        del file[name]
        make(file, folder)

    return spoil


def secret(folder: Path) -> Path:
    with h5py.File(folder / "secret.h5", "w") as file:
        file["omega"] = np.arange(3.0)
        file["K/data"] = file["K/indices"] = file["K/indptr"] = np.zeros(3)
    return folder / "secret.h5"


def external_link(name: str) -> Callable[[Any, Path], None]:
    return replaced(name, lambda f, d: f.__setitem__(name, h5py.ExternalLink(str(secret(d)), name)))


def soft_link(name: str, to: str) -> Callable[[Any, Path], None]:
    return replaced(name, lambda f, _: f.__setitem__(name, h5py.SoftLink(to)))


def external_storage(file: Any, folder: Path) -> None:
    (folder / "raw").write_bytes(bytes(8 * 10**6))
    file.create_dataset("omega", (10**6,), "f8", external=[(str(folder / "raw"), 0, 8 * 10**6)])


def virtual(file: Any, folder: Path) -> None:
    layout = h5py.VirtualLayout((3,), "f8")
    layout[:] = h5py.VirtualSource(str(secret(folder)), "omega", shape=(3,))
    file.create_virtual_dataset("omega", layout)


def shared_text(file: Any, _: Path) -> None:
    """A label for each of many entries, all of them one long text: the references are copied, not the text."""
    long = file.create_dataset("long", (1,), h5py.string_dtype())
    long[0] = "x" * 100_000
    data = file.create_dataset("dof", (20_000,), h5py.string_dtype(), chunks=(20_000,))
    data[:] = ["x"] * 20_000
    file.flush()
    reference = long.id.read_direct_chunk((0,)) if long.chunks else None
    if reference is None:
        where = long.id.get_offset()
        with open(file.filename, "rb") as raw:
            raw.seek(where)
            reference = (0, raw.read(16))
    data.id.write_direct_chunk((0,), reference[1] * 20_000)
    del file["long"]


HOSTILE = {
    "external link": external_link("omega"),
    "soft link": soft_link("omega", "/amplitude"),
    "dangling link": soft_link("omega", "/none"),
    "external storage": replaced("omega", external_storage),
    "virtual": replaced("omega", virtual),
    "claims": replaced("omega", lambda f, _: f.create_dataset("omega", (10**12,), "f8", chunks=(1000,))),
    "filled": replaced("omega", lambda f, _: f.create_dataset("omega", (10**9,), "f8", chunks=(10**6,), fillvalue=1.0)),
    "shared text": replaced("dof", shared_text),
    "null": replaced("omega", lambda f, _: f.create_dataset("omega", data=h5py.Empty("f8"))),
    "compound": replaced("omega", lambda f, _: f.create_dataset("omega", data=np.zeros(3, [("a", "f8")]))),
    "list of texts": lambda f, _: f.attrs.__setitem__("case", ["x"] * 3000),
    "compound attribute": lambda f, _: f["omega"].attrs.__setitem__("DIMENSION_LIST", np.zeros(3)),
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_results(tmp_path: Path, kind: str) -> None:
    path = results(tmp_path)
    with h5py.File(path, "a") as file:
        HOSTILE[kind](file, tmp_path)
    with pytest.raises(InputError, match="not a results file"):
        load_dataset(path)


@pytest.mark.parametrize(
    "spoil",
    [
        external_link("K"),
        external_link("dof_nodes"),
        soft_link("K", "/M"),
        soft_link("mesh", "/K"),
        soft_link("node_sets", "/mesh/node_sets"),
        lambda f, d: external_link("K/data")(f, d),
        lambda f, _: f.attrs.__setitem__("notes", "[" * 50_000),
        lambda f, _: f.attrs.__setitem__("materials", "[]"),
        lambda f, _: f.attrs.__setitem__("version", h5py.Empty("i4")),
    ],
)
def test_models(tmp_path: Path, spoil: Callable[[Any, Path], None]) -> None:
    path = model(tmp_path)
    with h5py.File(path, "a") as file:
        spoil(file, tmp_path)
    with pytest.raises(InputError, match="damaged or not a slipstick model"):
        load_model(path)


@pytest.mark.parametrize("make, read", [(results, load_dataset), (model, load_model)])
def test_a_heap_of_texts_on_which_the_library_never_ends(
    tmp_path: Path, make: Callable[[Path], Path], read: Callable[[Path], object]
) -> None:
    """The free space that ends the heap claims to have no size."""
    path = make(tmp_path)
    data = bytearray(path.read_bytes())
    del data[data.rindex(b"sealed:\0") :]
    at = data.index(b"GCOL") + 16
    while int.from_bytes(data[at : at + 2], "little"):
        at += 16 + -(-int.from_bytes(data[at + 8 : at + 16], "little") // 8) * 8
    data[at + 8 : at + 16] = bytes(8)
    path.write_bytes(data)
    with pytest.raises(InputError, match="its heap of texts is damaged"):
        read(path)


@pytest.mark.parametrize("read", [load_dataset, load_model])
def test_devices_and_pipes(tmp_path: Path, read: Callable[[Path], object]) -> None:
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        with pytest.raises(InputError, match="there is no such file"):
            read(path)


@pytest.mark.parametrize("block", [1, 3, 10, 20, 100])
def test_texts_over_several_dimensions_are_read_in_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, block: int
) -> None:
    """One by one, by parts of rows, by rows and all at once: a study over a grid has texts over its parameters."""
    kept = np.array([[[f"case {i} {j} {k}" for k in range(5)] for j in range(2)] for i in range(7)])
    monkeypatch.setattr(hdf5, "_TEXT_BLOCK", 10000 * block)
    with h5py.File(tmp_path / "many.h5", "w") as file:
        data = file.create_dataset("texts", data=kept.astype(object), dtype=h5py.string_dtype())
        np.testing.assert_array_equal(hdf5.texts(data, 10000), kept)
