"""The file of an imported model."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import ImportedModel
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io import model_file
from slipstick.io.model_file import load_model, save_model

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


@pytest.fixture(scope="module")
def cantilever() -> ImportedModel:
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    return assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=["x0"], quadratic=True)


def test_the_file_gives_back_everything(cantilever, tmp_path):
    path = save_model(cantilever, tmp_path / "model.h5")
    again = load_model(path)
    for name in ("K", "M"):
        assert abs(getattr(again, name) - getattr(cantilever, name)).max() == 0.0
    assert again.C is None
    assert again.dofs == cantilever.dofs
    assert (again.source, again.units, again.notes) == (cantilever.source, cantilever.units, cantilever.notes)
    assert again.materials == cantilever.materials
    np.testing.assert_array_equal(again.constrained, cantilever.constrained)
    for name, nodes in cantilever.node_sets.items():
        np.testing.assert_array_equal(again.nodes_of(name), nodes)
    assert again.mesh is not None
    np.testing.assert_array_equal(again.mesh.nodes, cantilever.mesh.nodes)
    np.testing.assert_array_equal(again.mesh.blocks["hex20"], cantilever.mesh.blocks["hex20"])
    np.testing.assert_array_equal(again.mesh.surface("x1").nodes, cantilever.mesh.surface("x1").nodes)
    assert list(tmp_path.iterdir()) == [path]


def test_damping_is_kept(cantilever, tmp_path):
    model = replace(cantilever, C=0.1 * cantilever.K)
    again = load_model(save_model(model, tmp_path / "c.h5"))
    assert abs(again.C - 0.1 * cantilever.K).max() == 0.0
    held = again.dof_nodes[:1]
    assert again.fix(held).C.shape == (again.n_dofs - 3,) * 2


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, OSError])
def test_a_file_that_is_there_stays_whole_until_the_new_one_is(cantilever, tmp_path, monkeypatch, error):
    """However writing ends: the old model as it was, and nothing beside it."""
    path = save_model(cantilever, tmp_path / "model.h5")
    before = path.read_bytes()

    def broken(file, model):
        file["K/data"] = np.ones(3)
        raise error("half way")

    monkeypatch.setattr(model_file, "_write", broken)
    with pytest.raises((error, InputError)):
        save_model(cantilever, path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def _claim(file):
    del file["K/data"]
    file.create_dataset("K/data", shape=(10**12,), dtype="f8", chunks=(1000,))


def _outside(file):
    del file["K/data"]
    file["K/data"] = h5py.ExternalLink("/etc/other.h5", "/x")


def _wrong_index(file):
    indices = file["K/indices"][()]
    indices[0] = 10**6
    file["K/indices"][...] = indices


@pytest.mark.parametrize(
    ("spoil", "sentence"),
    [
        (_claim, "claims 1000000000000 entries"),
        (_outside, "a link that leads elsewhere"),
        (_wrong_index, "damaged"),
        (lambda file: file.attrs.__setitem__("format", "other"), "not a slipstick model"),
        (lambda file: file.attrs.__setitem__("version", 99), "has format version 99"),
        (lambda file: file.__delitem__("M"), "damaged"),
        (lambda file: file.__delitem__("dof_nodes"), "dof_nodes"),
    ],
)
def test_a_spoilt_file_is_refused(cantilever, tmp_path, spoil, sentence):
    path = save_model(cantilever, tmp_path / "model.h5")
    with h5py.File(path, "a") as file:
        spoil(file)
    with pytest.raises(InputError, match=sentence):
        load_model(path)


def test_no_file_cut_file_wrong_folder(cantilever, tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_model(tmp_path / "none.h5")
    path = save_model(cantilever, tmp_path / "model.h5")
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(InputError, match="damaged or not a slipstick model"):
        load_model(path)
    with pytest.raises(InputError, match="cannot be written"):
        save_model(cantilever, tmp_path / "no" / "such" / "folder.h5")


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_one_value_that_is_not_finite_is_enough(cantilever, tmp_path, value):
    path = save_model(cantilever, tmp_path / "model.h5")
    with h5py.File(path, "r+") as file:
        data = file["K/data"][...]
        data[7] = value
        file["K/data"][...] = data
    with pytest.raises(InputError, match="K holds values that are not finite"):
        load_model(path)
