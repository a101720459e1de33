"""What readers hand over, and the checks that make a model of it."""

import numpy as np
import pytest
from helpers.imported import STEEL, raw, spd
from scipy.sparse import csr_array

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.deck import Deck
from slipstick.importers.matrix_model import build_model, full_symmetric, support_notes
from slipstick.importers.mesh_model import assemble_mesh


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
    with pytest.raises(InputError, match=r"K is not symmetric: entry \((4, 2|2, 4)\)"):
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
        (lambda K, M: Deck(matrices={"K": csr_array(K), "M": csr_array(M)}), "no map from rows to nodes"),
        (lambda K, M: Deck(matrices={"K": csr_array(K)}, rows=raw(K, M).rows), "no mass matrix M"),
        (lambda K, M: raw(K, -M), "M has negative diagonal entries at n10x, n10y"),
        (lambda K, M: raw(K * np.nan, M), "not finite"),
        (lambda K, M: raw(K, M, held=[(n, c) for n in (10, 11, 12) for c in range(3)]), "no degree of freedom is left"),
        (
            lambda K, M: raw(K, M, rows=np.stack([np.arange(5), np.zeros(5, dtype=int)], axis=1)),
            "9 rows, the dof map has 5 entries",
        ),
        (
            lambda K, M: raw(K, M, rows=np.tile([1, 0], (9, 1))),
            "names node 1, direction 1, more than once",
        ),
    ],
)
def test_each_fault_is_one_sentence(change, sentence):
    with pytest.raises(InputError) as caught:
        build_model(change(spd(9), spd(9, 1)), source="job")
    assert len(caught.value.sentences) == 1
    assert sentence in caught.value.sentences[0]


def test_mass_without_stiffness_is_a_mechanism_and_names_the_nodes():
    K, M = spd(9), spd(9, 1)
    K[5], K[:, 5], K[6], K[:, 6] = 0, 0, 0, 0
    with pytest.raises(InputError, match=r"singular, 2 dofs have mass but no stiffness \(a mechanism\): n11z, n12x"):
        build_model(raw(K, M), source="job")


@pytest.mark.parametrize(("fixed", "free"), [([], 6), (["x0"], 0)])
def test_parts_that_float_are_found(fixed, free):
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    model = assemble_mesh(Deck(mesh=mesh), source="box", material=STEEL, fixed=fixed)
    notes = support_notes(model)
    assert len(notes) == (free > 0)
    assert not free or f"({free} rigid body motions)" in notes[0]


def test_a_hinge_is_found_as_one_motion():
    """Two nodes held in all directions leave the rotation about their line."""
    mesh = box((2.0, 1.0, 1.0), (2, 1, 1), "hex20")
    model = assemble_mesh(Deck(mesh=mesh), source="box", material=STEEL)
    corner = np.flatnonzero((mesh.nodes[:, :2] == 0.0).all(axis=1))
    assert "(1 rigid body motions)" in support_notes(model.fix(mesh.labels[corner]))[0]
