"""The imported model and the checks that make one."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.imported import ImportedModel
from slipstick.fem.materials import Material
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.importers.raw_model import DofMap, Nodes, RawModel, build_model, full_symmetric, support_notes

STEEL = Material(young=2e11, poisson=0.3, density=7800.0)


def spd(n: int, seed: int = 0) -> np.ndarray:
    a = np.random.default_rng(seed).normal(size=(n, n))
    a[np.abs(a) < 0.7] = 0.0
    return a @ a.T + n * np.eye(n)


def raw(K, M, held=(), nodes=None, **matrices) -> RawModel:
    n = np.shape(K)[0]
    rows = np.arange(n)
    held = np.array(held, dtype=np.int64).reshape(-1, 2)
    return RawModel(
        matrices={"K": csr_array(K), "M": csr_array(M), **{k: csr_array(v) for k, v in matrices.items()}},
        dof_map=DofMap(nodes=10 + rows // 3, components=rows % 3) if nodes is None else nodes,
        nodes=Nodes(held=held),
    )


@pytest.fixture(scope="module")
def cantilever() -> ImportedModel:
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    return assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=["x0"], quadratic=True)


@pytest.mark.parametrize("stored", ["full", "upper", "lower", "mixed"])
def test_every_way_of_storing_a_symmetric_matrix_gives_the_same(stored):
    matrix = spd(7)
    mixed = np.where(np.add.outer(np.arange(7), np.arange(7)) % 2 == 0, np.tril(matrix), np.triu(matrix))
    mixed[np.diag_indices(7)] = np.diag(matrix)
    forms = {"full": matrix, "upper": np.triu(matrix), "lower": np.tril(matrix), "mixed": mixed}
    np.testing.assert_array_equal(full_symmetric(forms[stored], "K").toarray(), matrix)


def test_an_asymmetric_matrix_is_refused_with_the_worst_entry():
    matrix = spd(5)
    matrix[3, 1] = matrix[1, 3] + 7.0
    with pytest.raises(InputError, match=r"K is not symmetric: entry \((4, 2|2, 4)\).*export a symmetric model"):
        full_symmetric(matrix, "K")


def test_held_and_empty_rows_are_taken_out_and_listed():
    K, M = spd(9), spd(9, 1)
    K[4], K[:, 4], M[4], M[:, 4] = 0, 0, 0, 0
    model = build_model(raw(K, M, held=[(10, 0), (12, 2)]), source="job")
    kept = [1, 2, 3, 5, 6, 7]
    np.testing.assert_array_equal(model.K.toarray(), K[np.ix_(kept, kept)])
    np.testing.assert_array_equal(model.M.toarray(), M[np.ix_(kept, kept)])
    assert model.dofs == ("n10y", "n10z", "n11x", "n11z", "n12x", "n12y")
    assert model.constrained.tolist() == [[10, 0], [12, 2]]
    assert "n11y" in model.notes[0]
    with pytest.raises(InputError, match="'n10x' is constrained"):
        model.index("n10x")
    with pytest.raises(InputError, match="names are n<node><direction>"):
        model.index("tip")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda K, M: raw(K, M[:6, :6]), "different size (K is 9 x 9, M is 6 x 6)"),
        (lambda K, M: RawModel(matrices={"K": csr_array(K), "M": csr_array(M)}), "no map from rows to nodes"),
        (lambda K, M: RawModel(matrices={"K": csr_array(K)}, dof_map=raw(K, M).dof_map), "no mass matrix M"),
        (lambda K, M: raw(K, -M), "M has negative diagonal entries at n10x, n10y"),
        (lambda K, M: raw(K * np.nan, M), "not finite"),
        (lambda K, M: raw(K, M, held=[(n, c) for n in (10, 11, 12) for c in range(3)]), "no degree of freedom is left"),
        (
            lambda K, M: raw(K, M, nodes=DofMap(nodes=np.arange(5), components=np.zeros(5, dtype=int))),
            "9 rows, the dof map has 5 entries",
        ),
        (
            lambda K, M: raw(K, M, nodes=DofMap(nodes=np.ones(9, dtype=int), components=np.zeros(9, dtype=int))),
            "names node 1, direction 1, more than once",
        ),
    ],
)
def test_each_fault_is_one_sentence(change, sentence):
    with pytest.raises(InputError) as caught:
        build_model(change(spd(9), spd(9, 1)), source="job")
    assert len(caught.value.problems) == 1
    assert sentence in caught.value.problems[0]


def test_mass_without_stiffness_is_a_mechanism_and_names_the_nodes():
    K, M = spd(9), spd(9, 1)
    K[5], K[:, 5], K[6], K[:, 6] = 0, 0, 0, 0
    with pytest.raises(InputError, match=r"singular, 2 dofs have mass but no stiffness \(a mechanism\): n11z, n12x"):
        build_model(raw(K, M), source="job")


@pytest.mark.parametrize(("fixed", "free"), [([], 6), (["x0"], 0)])
def test_parts_that_float_are_found(fixed, free):
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    model = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, fixed=fixed)
    notes = support_notes(model)
    assert len(notes) == (free > 0)
    assert not free or f"({free} rigid body motions)" in notes[0]


def test_a_hinge_is_found_as_one_motion():
    """Two nodes held in all directions leave the rotation about their line."""
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    model = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL)
    corner = np.flatnonzero((mesh.nodes[:, :2] == 0.0).all(axis=1))
    assert "(1 rigid body motions)" in support_notes(model.fix(mesh.labels[corner]))[0]


def test_fixing_later_equals_fixing_at_once(cantilever):
    mesh = box((4.0, 1.0, 1.0), (4, 1, 1), "hex8")
    free = assemble_mesh(MeshModel(mesh=mesh), source="box", material=STEEL, quadratic=True)
    later = free.fix("x0")
    assert later.dofs == cantilever.dofs
    assert abs(later.K - cantilever.K).max() == 0.0
    with pytest.raises(InputError, match="fixed: there is no node set 'root' in the model; known are x0, x1"):
        free.fix("root")
    partly = free.fix("x0", "x")
    assert partly.n_dofs == free.n_dofs - len(free.nodes_of("x0"))


def test_cantilever_bends_as_a_beam(cantilever):
    """First bending frequency of a slender beam, 1.875^2 sqrt(E I / (rho A L^4)); shear and section take some off."""
    from scipy.linalg import eigh

    first = np.sqrt(eigh(cantilever.K.toarray(), cantilever.M.toarray(), eigvals_only=True)[0])
    beam = 1.8751**2 * np.sqrt(2e11 / 12 / (7800.0 * 4.0**4))
    assert 0.93 < first / beam < 1.0


def test_positions_by_label(cantilever):
    nodes = cantilever.nodes_of("x1")
    np.testing.assert_array_equal(cantilever.positions(nodes)[:, 0], 4.0)
    with pytest.raises(InputError, match="position of node 99999 is not known"):
        cantilever.positions(np.array([99999]))
