"""Files .full: the one a reader's package ships, cut and spoilt."""

import contextlib

import numpy as np
import pytest
from helpers.ansys import BEAM
from scipy.sparse.linalg import eigsh

from slipstick.errors import InputError
from slipstick.importers.import_model import read_mesh, read_model
from slipstick.importers.roles import ImportOptions


def test_full_holds_the_modes_that_ansys_computed(shipped):
    """Ansys' own modes (file.rst, free beam) fulfil K x = w^2 M x with the matrices of file.full (clamped beam) in each
    row that does not touch the clamped nodes: matrices, order and map are right, and w is Ansys' to 1e-6."""
    from ansys.mapdl.reader import read_binary

    model = read_model(shipped / "file.full")
    mesh = read_mesh(shipped / "HexBeam.cdb").mesh
    elements = mesh.labels[mesh.blocks["hex20r"]]
    touching = np.unique(elements[np.isin(elements, model.constrained[:, 0]).any(axis=1)])
    inner = ~np.isin(model.dof_nodes, touching)
    result = read_binary(str(shipped / "file.rst"))
    for mode, printed in enumerate(result.time_values):
        nodes, shape = result.nodal_solution(mode)
        x = shape[np.searchsorted(nodes, model.dof_nodes), model.dof_components]
        force, momentum = (model.K @ x)[inner], (model.M @ x)[inner]
        squared = momentum @ force / (momentum @ momentum)
        assert np.sqrt(squared) / (2 * np.pi) == pytest.approx(printed, rel=1e-6)
        assert np.linalg.norm(force - squared * momentum) < 1e-5 * np.linalg.norm(force)


def test_full_is_what_the_reader_kept_by_others_finds(shipped):
    from ansys.mapdl.reader.full import FullFile

    from slipstick.importers.matrix_model import full_symmetric

    reference, stiffness, mass = FullFile(str(shipped / "file.full")).load_km(sort=True)
    model = read_model(shipped / "file.full")
    names = {f"n{node}{'xyz'[axis]}": row for row, (node, axis) in enumerate(reference.tolist())}
    rows = [names[dof] for dof in model.dofs]
    for ours, theirs in ((model.K, stiffness), (model.M, mass)):
        assert abs(full_symmetric(theirs, "theirs")[rows][:, rows] - ours).max() == 0.0


def test_full_lists_what_is_held(shipped):
    model = read_model(shipped / "file.full")
    assert model.n_dofs == 900
    assert sorted(set(model.constrained[:, 0].tolist())) == list(range(1, 22))
    assert len(model.constrained) == 63
    first = np.sqrt(eigsh(model.K, 1, model.M, sigma=0.0)[0][0]) / (2 * np.pi)
    assert first == pytest.approx(1283.2003692, rel=1e-8)  # by dense LAPACK on the same matrices


def test_full_takes_positions_and_components_from_the_archive(shipped):
    """The archive is in N and m, the matrices in lbf and inch: only with the material of the matrices they fit."""
    files = [shipped / "file.full", shipped / "HexBeam.cdb"]
    with pytest.raises(InputError, match="in the same units"):
        read_model(files)
    model = read_model(files, ImportOptions(material=BEAM))
    assert model.warnings == ()
    assert len(model.node_ids) == 321
    assert "NCOMP2" in model.node_sets
    held = np.unique(model.constrained[:, 0])
    np.testing.assert_array_equal(model.positions(held)[:, 2], 0.0)


@pytest.mark.parametrize("words", [3, 50, 300, 2000, 100_000, 131_000, 140_000])
def test_full_cut_anywhere_is_refused_without_ending_the_process(shipped, tmp_path, words):
    path = tmp_path / "cut.full"
    np.fromfile(shipped / "file.full", dtype="<i4")[:words].tofile(path)
    with pytest.raises(InputError, match="damaged or truncated"):
        read_model(path)


@pytest.mark.parametrize("at", [103, 105, 206, 212, 536, 538, 540, 131_000])
def test_full_with_a_wild_number_is_refused_or_read(shipped, tmp_path, at):
    words = np.fromfile(shipped / "file.full", dtype="<i4")
    words[at] = 2_000_000_000
    path = tmp_path / "wild.full"
    words.tofile(path)
    with contextlib.suppress(InputError):
        assert read_model(path).n_dofs == 900


def test_a_whole_file_that_is_laid_out_otherwise_is_not_called_damaged(shipped, tmp_path):
    """Records of another kind, as compression leaves them: the release is told, and the way round."""
    words = np.fromfile(shipped / "file.full", dtype="<i4")
    words[104] = 0  # flags of the header of the file
    words[11] = int.from_bytes(b"20.1", "big")
    path = tmp_path / "newer.full"
    words.tofile(path)
    with pytest.raises(InputError, match=r"newer\.full: is a whole \.full file of Ansys 20\.1, .* in one \.npz"):
        read_model(path)
    words[:140_000].tofile(path)
    with pytest.raises(InputError, match="damaged or truncated"):
        read_model(path)
