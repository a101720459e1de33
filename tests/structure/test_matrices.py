"""MatrixStructure against direct inversion, and what it refuses."""

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse import coo_array, csc_array, csr_matrix, diags_array

from slipstick.errors import InputError
from slipstick.structure import matrices
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.protocol import Structure
from slipstick.structure.receptance import Receptance

RNG = np.random.default_rng(4)
FREQUENCIES = np.array([0.3, 0.9, 1.7, 2.5, 6.0])


def chain(n=6):
    """Masses in a row, the first one held to ground."""
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    return np.diag(1.0 + 0.1 * np.arange(n)), K


def names(n):
    return [f"m{i}" for i in range(n)]


def damping(kind, M, K):
    general = RNG.standard_normal((len(M), 2))
    return {"none": None, "rayleigh": 0.02 * M + 0.03 * K, "general": 0.1 * general @ general.T}[kind]


def direct(M, C, K, loss, w, rows, columns):
    C = np.zeros_like(M) if C is None else C
    return rows.T @ np.linalg.inv(K * (1 + 1j * loss) - w * w * M + 1j * w * C) @ columns


@pytest.mark.parametrize("loss", [0.0, 0.05])
@pytest.mark.parametrize("kind", ["none", "rayleigh", "general"])
@pytest.mark.parametrize("store", [np.asarray, csr_matrix, coo_array])
def test_receptance_equals_the_inverse(kind, loss, store):
    M, K = chain()
    C = damping(kind, M, K)
    rows, columns = RNG.standard_normal((6, 3)), RNG.standard_normal((6, 2))
    structure = MatrixStructure(
        M=store(M), C=None if C is None else store(C), K=store(K), dofs=names(6), loss_factor=loss
    )
    seen = structure.project(rows, columns)
    value, slope = (each[:, 0] for each in seen.at([1], FREQUENCIES))
    assert isinstance(structure, Structure)
    assert isinstance(seen, Receptance)
    np.testing.assert_allclose(seen.static, rows.T @ np.linalg.solve(K, columns), atol=1e-13)
    h = 1e-5
    for w, a, da in zip(FREQUENCIES, value, slope, strict=True):
        np.testing.assert_allclose(a, direct(M, C, K, loss, w, rows, columns), rtol=1e-10, atol=1e-12)
        ahead, behind = (direct(M, C, K, loss, w + s, rows, columns) for s in (h, -h))
        # central difference: h^2/6 A''' and rounding 1e-16 |A| / h
        np.testing.assert_allclose(da, (ahead - behind) / (2 * h), rtol=1e-6, atol=1e-7 * abs(da).max())


def test_solved_and_summed_over_modes_agree():
    """The same structure with a damping that is just not diagonal in the modes takes the other way."""
    M, K = chain()
    C = 0.02 * M + 0.03 * K
    near = C.copy()
    near[0, 0] += 1e-9
    ways = [MatrixStructure(M=M, C=c, K=K, dofs=names(6)).project(np.eye(6), np.eye(6)) for c in (C, near)]
    assert type(ways[0]) is not type(ways[1])
    for a, b in zip(ways[0].at([1], FREQUENCIES), ways[1].at([1], FREQUENCIES), strict=True):
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-6 * abs(a).max())


def test_nearly_critical_damping_is_still_exact():
    """Two poles that meet have parallel complex modes: the expansion over the poles is not to be trusted there."""
    turn = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    M, K = np.eye(3), np.diag([4.0, 1.0, 9.0])
    for distance in (0.0, 1e-12, 1e-6, 1e-2):
        C = turn.T @ np.diag([4.0 * (1.0 + distance), 0.1, 0.2]) @ turn
        structure = MatrixStructure(M=M, C=C, K=K, dofs=names(3))
        value, _ = structure.project(np.eye(3), np.eye(3)).at([1], FREQUENCIES)
        for w, a in zip(FREQUENCIES, value[:, 0], strict=True):
            np.testing.assert_allclose(a, direct(M, C, K, 0.0, w, np.eye(3), np.eye(3)), rtol=1e-9, atol=1e-10)
    defective = MatrixStructure(M=[[1.0]], C=[[4.0]], K=[[4.0]], dofs=["x"])
    assert defective._poles is None


@pytest.mark.parametrize("loss", [0.0, 0.02])
def test_large_sparse_structure_is_solved_sparsely(monkeypatch, loss):
    M, K = chain(40)
    C = damping("general", M, K)
    dense = MatrixStructure(M=M, C=C, K=K, dofs=names(40), loss_factor=loss)
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 10)
    sparse = MatrixStructure(
        M=diags_array(np.diag(M)), C=csc_array(C), K=csc_array(K), dofs=names(40), loss_factor=loss
    )
    rows = np.eye(40)[:, [3, 39]]
    a, b = dense.project(rows, rows), sparse.project(rows, rows)
    assert not isinstance(sparse.K, np.ndarray)
    np.testing.assert_allclose(a.static, b.static, rtol=1e-11)
    for x, y in zip(a.at([1], FREQUENCIES), b.at([1], FREQUENCIES), strict=True):
        np.testing.assert_allclose(x, y, rtol=1e-9, atol=1e-10)
    np.testing.assert_allclose(sparse.natural_frequencies, dense.natural_frequencies[:20], rtol=1e-9)
    with raises_fault("time integration", says="too many"):
        sparse.time_equations(rows, rows)


def test_natural_frequencies_of_a_fixed_free_chain():
    n = 8
    K = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    K[-1, -1] = 1.0
    exact = 2 * np.sin((2 * np.arange(n) + 1) * np.pi / (2 * (2 * n + 1)))
    structure = MatrixStructure(M=np.eye(n), K=K, dofs=names(n))
    np.testing.assert_allclose(structure.natural_frequencies, exact, rtol=1e-12)


def test_time_equations_have_the_same_receptance():
    M, K = chain()
    C = damping("general", M, K)
    structure = MatrixStructure(M=M, C=C, K=K, dofs=names(6), load_shapes={"wind": np.arange(6.0)})
    rows, columns = RNG.standard_normal((6, 2)), RNG.standard_normal((6, 1))
    equations = structure.time_equations(rows, columns, ["wind"])
    value, _ = structure.project(rows, columns, ["wind"]).at([1], FREQUENCIES)
    for w, a in zip(FREQUENCIES, value[:, 0], strict=True):
        Z = equations.K - w * w * equations.M + 1j * w * equations.C
        np.testing.assert_allclose(
            equations.rows @ np.linalg.solve(Z, equations.columns) + equations.feedthrough, a, rtol=1e-10
        )


def test_hysteretic_damping_in_time_may_have_the_same_value_at_one_frequency():
    M, K = chain()
    structure = MatrixStructure(M=M, C=damping("general", M, K), K=K, dofs=names(6), loss_factor=0.03)
    equations = structure.time_equations(np.eye(6), np.eye(6), damping_at=0.7)
    Z = equations.K - 0.7**2 * equations.M + 0.7j * equations.C
    value, _ = structure.project(np.eye(6), np.eye(6)).at([1], 0.7)
    np.testing.assert_allclose(np.linalg.inv(Z), value[0], rtol=1e-10)


def test_hysteretic_damping_in_time_has_the_same_value_at_each_resonance():
    M, K = chain()
    structure = MatrixStructure(M=M, K=K, dofs=names(6), loss_factor=0.01)
    equations = structure.time_equations(np.eye(6), np.eye(6))
    squared, modes = np.linalg.eigh(np.diag(1 / np.sqrt(np.diag(M))) @ K @ np.diag(1 / np.sqrt(np.diag(M))))
    modes = np.diag(1 / np.sqrt(np.diag(M))) @ modes
    np.testing.assert_allclose(modes.T @ equations.C @ modes, np.diag(0.01 * np.sqrt(squared)), atol=1e-14)
    # forces in the shape of a mode at its own frequency: the hysteretic answer is the viscous one
    for r in range(6):
        w, force = np.sqrt(squared[r]), M @ modes[:, [r]]
        value, _ = structure.project(np.eye(6), force).at([1], w)
        Z = equations.K - w * w * equations.M + 1j * w * equations.C
        np.testing.assert_allclose(np.linalg.solve(Z, force), value[0], rtol=1e-9, atol=1e-9)


def test_load_shapes_are_further_columns():
    M, K = chain()
    shape = RNG.standard_normal(6)
    structure = MatrixStructure(M=M, K=K, dofs=names(6), load_shapes={"wind": shape})
    assert structure.load_shapes == ("wind",)
    seen = structure.project(np.eye(6), np.eye(6)[:, :1], ["wind"])
    assert seen.static.shape == (6, 2)
    np.testing.assert_allclose(seen.static[:, 1], np.linalg.solve(K, shape), rtol=1e-12)
    np.testing.assert_allclose(seen.at([1], 0.7)[0][0, :, 1], np.linalg.solve(K - 0.49 * M, shape), rtol=1e-10)
    with raises_fault("load shape", "rain", statement="is unknown"):
        structure.project(np.eye(6), np.eye(6), ["rain"])
    with raises_fault("rows", found="shape (5, 5)"):
        structure.project(np.eye(5), np.eye(6))


def test_empty_projection_and_no_frequencies():
    M, K = chain()
    seen = MatrixStructure(M=M, K=K, dofs=names(6)).project(np.eye(6)[:, :2], np.zeros((6, 0)))
    assert seen.static.shape == (2, 0)
    assert seen.at([1, 2], FREQUENCIES)[0].shape == (5, 2, 2, 0)
    seen = MatrixStructure(M=M, K=K, dofs=names(6)).project(np.eye(6), np.eye(6))
    assert seen.at(np.empty(0), 1.0)[0].shape == (0, 6, 6)


def test_disparate_units_are_not_mistaken_for_singular():
    """A rotation in rad beside a displacement in m: diagonal entries 14 decades apart."""
    units = np.array([1.0, 1e-7])
    M, K = chain(2)
    structure = MatrixStructure(M=M * np.outer(units, units), K=K * np.outer(units, units), dofs=names(2))
    plain = MatrixStructure(M=M, K=K, dofs=names(2))
    np.testing.assert_allclose(structure.natural_frequencies, plain.natural_frequencies, rtol=1e-6)


FREE = np.array([[1.0, -1.0], [-1.0, 1.0]])


@pytest.mark.parametrize("K", [FREE, np.diag([1.0, 0.0]), np.zeros((2, 2))])
def test_a_body_that_is_not_held(K, monkeypatch):
    """Its contacts may hold it; by itself, and with more dofs than dense matrices take, free_structure is named."""
    structure = MatrixStructure(M=np.eye(2), K=K, dofs=["a", "b"])
    assert not structure.held
    assert MatrixStructure(M=np.eye(2), K=2.0 * np.eye(2), dofs=["a", "b"]).held
    with pytest.raises(InputError, match=r"ss\.models\.free_structure"):
        structure.project(np.eye(2), np.eye(2))
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 1)
    with pytest.raises(InputError, match=r"stiffness matrix is singular.*ss\.models\.free_structure"):
        MatrixStructure(M=csc_array(np.eye(2)), K=csc_array(K), dofs=["a", "b"])


@pytest.mark.parametrize(
    "change, words",
    [
        (
            {
                "K": np.array([[0.0, 0.0, 0.0], [0.0, 1.0, 2.0], [0.0, 2.0, 1.0]]),
                "M": np.eye(3),
                "dofs": ["a", "b", "c"],
            },
            "K: the stiffness matrix is not positive definite",
        ),
        ({"K": np.diag([1.0, -1.0])}, "K: the stiffness matrix is not positive definite"),
        ({"M": np.diag([1.0, 0.0])}, "mass matrix is not positive definite"),
        ({"M": np.array([[1.0, 2.0], [2.0, 1.0]])}, "mass matrix is not positive definite"),
        ({"K": np.array([[2.0, -1.0], [0.0, 2.0]])}, "K: not symmetric"),
        ({"C": np.array([[2.0, -1.0], [0.0, 2.0]])}, "C: not symmetric"),
        ({"M": np.eye(3)}, "2 dofs are named"),
        ({"M": np.ones((2, 3))}, "expected a square matrix"),
        ({"M": np.ones(2)}, "expected a square matrix"),
        ({"K": np.diag([1.0, np.nan])}, "not finite"),
        ({"dofs": ["a", "a"]}, "more than once"),
        ({"dofs": ["a", ""]}, "non-empty"),
        ({"dofs": []}, "none given"),
        ({"M": [[1.0], [0.0, 1.0]]}, "M: not made of real numbers"),
        ({"loss_factor": -0.1}, "loss_factor"),
        ({"loss_factor": np.nan}, "loss_factor"),
        ({"load_shapes": {"wind": np.ones(3)}}, "'wind'"),
    ],
)
@pytest.mark.parametrize("sparse", [False, True])
def test_faults_are_said_in_a_sentence(change, words, sparse, monkeypatch):
    given = {"M": np.eye(2), "K": 2 * np.eye(2), "dofs": ["a", "b"]} | change
    if sparse and all(isinstance(given[k], np.ndarray) and given[k].ndim == 2 for k in "MK"):
        monkeypatch.setattr(matrices, "DENSE_LIMIT", 0)
        given |= {k: csc_array(given[k]) for k in "MKC" if k in given}
    with pytest.raises(InputError, match=words):
        MatrixStructure(**given)


def test_all_faults_at_once():
    with pytest.raises(InputError) as error:
        MatrixStructure(M=np.eye(3), K=np.diag([1.0, np.inf]), C=np.triu(FREE), dofs=["a", "a"], loss_factor=-1)
    assert len(error.value.sentences) == 5
