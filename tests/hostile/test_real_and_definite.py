"""Complex, unsymmetric, indefinite and energy-feeding arrays: refused on every road, dense and sparse alike."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy.sparse import coo_array, csc_array, csr_matrix, diags_array

import slipstick as ss
from slipstick.errors import InputError
from slipstick.importers.import_model import read_model
from slipstick.importers.plain.matrix_file import read_matrix
from slipstick.structure import matrices
from slipstick.structure.matrix_checks import smallest_pivot
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.npz import read_arrays

DENSE_AND_SPARSE = pytest.mark.parametrize("store", [np.asarray, csr_matrix, coo_array], ids=["dense", "csr", "coo"])
CHAIN = np.array([[3.0, -1.0, 0.0], [-1.0, 3.0, -1.0], [0.0, -1.0, 3.0]])
GOOD = {"M": np.eye(3), "K": CHAIN, "C": 0.1 * CHAIN}


def structure(store: Callable[..., Any] = np.asarray, **change: Any) -> ss.MatrixStructure:
    return ss.MatrixStructure(**{k: store(v) for k, v in (GOOD | change).items()}, dofs=list("abc"))


def modal(**change: Any) -> ModalStructure:
    given = {"omega": [1.0, 2.0], "mode_shapes": np.eye(2), "static_compliance": 1.5 * np.eye(2), "dofs": ["a", "b"]}
    return ModalStructure.from_arrays(given | change)


@pytest.fixture
def always_sparse(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 0)


@DENSE_AND_SPARSE
@pytest.mark.parametrize("name", "MCK")
def test_complex_matrices_are_refused(name: str, store: Callable[..., Any]) -> None:
    words = rf"{name} is complex \(imaginary parts up to 0.*beside.*\): expected|loss_factor"
    with pytest.raises(InputError, match=words):
        structure(store, **{name: GOOD[name] * (1 + 0.05j)})
    taken = structure(store, **{name: GOOD[name].astype(complex)})
    np.testing.assert_array_equal(taken.natural_frequencies, structure(store).natural_frequencies)


@pytest.mark.parametrize("name", ["stiffness", "mass"])
@pytest.mark.parametrize("store", [np.asarray, csr_matrix])
def test_reduce_refuses_complex_matrices(name: str, store: Callable[..., Any]) -> None:
    factors = {"stiffness": (1 + 0.05j, 1.0), "mass": (1.0, 1 + 0.05j)}[name]
    with pytest.raises(InputError, match=rf"the {name} matrix is complex .*give hysteretic damping as loss_factor"):
        ss.reduce(store(CHAIN * factors[0]), store(np.eye(3) * factors[1]), dofs=list("abc"), keep=["a"], modes=3)
    taken = ss.reduce(store(CHAIN.astype(complex)), store(np.eye(3)), dofs=list("abc"), keep=["a"], modes=3)
    assert taken.omega.size == 3


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ({"load_shapes": {"p": np.array([1.0, 1j, 0.0])}}, "load shape 'p' is complex"),
        ({"keep": np.array([[1j], [0.0], [0.0]]), "names": ["a"]}, "keep is complex"),
        ({"loss_factor": 0.1j}, "loss_factor: found 0.1j"),
        ({"loss_factor": -0.1}, "loss_factor: found -0.1"),
        ({"damping_ratio": [0.1, np.nan, 0.0]}, "damping_ratio"),
        ({"rayleigh": (-1.0, 0.1)}, "rayleigh"),
    ],
)
def test_reduce_refuses_other_complex_or_negative_values(option: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        ss.reduce(CHAIN, np.eye(3), **{"dofs": list("abc"), "keep": ["a"], "modes": 3} | option)


@pytest.mark.parametrize("name", ["K", "M", "C"])
def test_complex_matrices_in_files(tmp_path: Path, name: str) -> None:
    """One matrix in a file, dense or sparse, and a bundle that is imported."""
    from scipy.sparse import save_npz

    bad = GOOD[name] * (1 + 0.1j)
    np.savez(tmp_path / "dense.npz", bad)
    save_npz(tmp_path / "sparse.npz", csc_array(bad))
    for file in ("dense.npz", "sparse.npz"):
        with pytest.raises(InputError, match=f"{file}.* is complex .*loss_factor"):
            read_matrix(tmp_path / file)
    rows = {"dof_nodes": np.array([1, 2, 3]), "dof_components": np.array(["x"] * 3)}
    np.savez(tmp_path / "bundle.npz", **GOOD | {name: bad}, **rows)
    with pytest.raises(InputError, match=f"bundle.npz: {name} is complex .*loss_factor"):
        read_model(tmp_path / "bundle.npz")
    np.savez(tmp_path / "bundle.npz", **GOOD | {name: GOOD[name].astype(complex)}, **rows)
    np.testing.assert_array_equal(read_model(tmp_path / "bundle.npz").K.toarray(), CHAIN)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"omega": np.sqrt(np.array([-1.0 + 0j, 4.0]))}, "omega.* is complex .*negative squared frequency"),
        ({"omega": [-1.0, 2.0]}, "omega: the smallest entry is -1"),
        ({"mode_shapes": np.eye(2) * (1 + 1j)}, "mode_shapes.* is complex .*real modes of the undamped structure"),
        ({"static_compliance": 1.5 * np.eye(2) * (1 + 1e-3j)}, "static_compliance.* is complex"),
        ({"static_compliance": 1.5 * np.eye(2) + 1.5 * np.eye(2)[::-1]}, "static_compliance.*negative eigenvalue"),
        ({"static_compliance": 1.5 * np.eye(2) + np.triu(np.ones((2, 2)), 1)}, "static_compliance: not symmetric"),
        ({"second_residual": -np.eye(2)}, "second_residual.*negative eigenvalue"),
        ({"second_residual": np.eye(2) + 3.0 * np.eye(2)[::-1]}, "second_residual.*negative eigenvalue"),
        ({"loss_factor": [0.01, -0.01]}, "loss_factor: the smallest entry is -0.01"),
        ({"damping_ratio": [0.01, 0.01j]}, "damping_ratio.* is complex"),
    ],
)
def test_modal_arrays(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    """The same words for arrays, for a file read in Python and for a file that a case names."""
    from slipstick.case.case import Case

    with pytest.raises(InputError, match=words):
        modal(**change)
    arrays = {"omega": [1.0, 2.0], "mode_shapes": np.eye(2), "static_compliance": 1.5 * np.eye(2)} | change
    np.savez(tmp_path / "m.npz", **arrays)
    with pytest.raises(InputError, match=words):
        ModalStructure.load(tmp_path / "m.npz", dofs=["a", "b"])
    text = (
        'format = 1\nharmonics = "0..3"\n[structure]\nkind = "modal"\nfile = "m.npz"\ndofs = ["a", "b"]\n'
        '[[contact]]\nname = "c"\ntangential = "a"\nkt = 1.0\nmu = 0.3\nnormal_load = 1.0\n'
        "[response]\nfrom = 0.1\nto = 0.2\n"
    )
    with pytest.raises(InputError, match=words):
        Case.from_text(text, tmp_path / "case.toml")


def test_complex_load_shapes() -> None:
    shape = LoadShape(participation=[1.0, 1j], static_response=[1.0, 1.0])
    with raises_fault("load shape", "p", "participation", expected="real numbers"):
        ModalStructure(omega=[1.0, 2.0], mode_shapes=np.eye(2), dofs=["a", "b"], load_shapes={"p": shape})
    with raises_fault("load shape", "p", expected="real numbers"):
        ss.MatrixStructure(M=np.eye(3), K=CHAIN, dofs=list("abc"), load_shapes={"p": [1j, 0.0, 0.0]})


def test_a_damping_given_takes_the_place_of_the_arrays_own() -> None:
    arrays = {"omega": [1.0, 2.0], "mode_shapes": np.eye(2), "loss_factor": [0.1, 0.2], "dofs": ["a", "b"]}
    assert ModalStructure.from_arrays(arrays).loss_factor.tolist() == [0.1, 0.2]
    assert ModalStructure.from_arrays(arrays, loss_factor=0.3).loss_factor.tolist() == [0.3, 0.3]


SWAP = np.array([[0.0, 1.0], [1.0, 0.0]])
NEGATIVE = [
    -np.eye(3),
    np.diag([1.0, 0.0, -1e-9]),
    np.diag([1.0, 1.0, 1.0]) - 0.9 * CHAIN / 3,
    np.pad(SWAP, (0, 1)),
    np.array([[1.0, 1.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]]),
    1e-3 * CHAIN - 2e-3 * np.eye(3),
]
PASSIVE = [
    np.zeros((3, 3)),
    np.diag([0.0, 0.0, 2.0]),
    np.outer([1.0, -1.0, 0.0], [1.0, -1.0, 0.0]),
    np.outer([0.1, 0.2, -0.3], [0.1, 0.2, -0.3]),
    np.ones((3, 3)),
    1e-3 * CHAIN,
    CHAIN - 1e-17 * np.eye(3),
]


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("C", NEGATIVE)
def test_negative_damping_is_known(C: np.ndarray, sparse: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    if np.linalg.eigvalsh(C)[0] > 0:
        C = -C
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 0 if sparse else 1500)
    assert structure(csc_array if sparse else np.asarray, C=C).energy_fed


@pytest.mark.parametrize("sparse", [False, True])
@pytest.mark.parametrize("C", PASSIVE)
def test_passive_damping_is_taken(C: np.ndarray, sparse: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Singular ones too: dashpots between two dofs, and dofs without any."""
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 0 if sparse else 1500)
    assert structure(csc_array if sparse else np.asarray, C=C).energy_fed == ""


@pytest.mark.parametrize("sparse", [False, True])
def test_negative_damping_of_a_rotation(sparse: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Units do not hide it: a rotation whose numbers are 1e12 times smaller."""
    monkeypatch.setattr(matrices, "DENSE_LIMIT", 0 if sparse else 1500)
    units = np.array([1.0, 1.0, 1e-6])
    scaled = {name: np.diag(units) @ A @ np.diag(units) for name, A in GOOD.items()}
    store = csc_array if sparse else np.asarray
    assert structure(store, **scaled).energy_fed == ""
    assert structure(store, **scaled | {"C": scaled["C"] - np.diag([0.0, 0.0, 0.5]) * units**2}).energy_fed


def test_large_damping_of_a_chain(always_sparse: None) -> None:
    n = 3000
    K = diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1], format="csr")
    M, dofs = diags_array(np.ones(n), format="csr"), [str(i) for i in range(n)]
    assert ss.MatrixStructure(M=M, K=K, C=0.1 * K, dofs=dofs).energy_fed == ""
    assert ss.MatrixStructure(M=M, K=K, C=0.1 * K - 1e-4 * M, dofs=dofs).energy_fed  # of the lowest modes alone


def test_pivots_show_the_sign_whatever_their_order() -> None:
    """Round numbers make pivots of exactly zero, which must not hide a negative eigenvalue."""
    rng = np.random.default_rng(0)
    for _ in range(300):
        n = int(rng.integers(2, 7))
        A = rng.integers(-1, 2, (n, n)).astype(float)
        A = A + A.T
        np.fill_diagonal(A, rng.integers(1, 4, n))
        lowest = np.linalg.eigvalsh(A)[0]
        if abs(lowest) > 1e-9:
            assert (smallest_pivot(csc_array(A)) > 0.0) == (lowest > 0.0)


@pytest.mark.parametrize("name", "MK")
def test_an_indefinite_matrix_of_round_numbers(name: str, always_sparse: None) -> None:
    A = np.array([[1.0, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.0], [0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 1.0, 1.0]])
    given = {"M": np.eye(4), "K": np.eye(4)} | {name: A}
    with pytest.raises(InputError, match=f"{name}: .*not positive definite"):
        ss.MatrixStructure(**{k: csc_array(v) for k, v in given.items()}, dofs=list("abcd"))


@pytest.mark.parametrize("solver", ["superlu", None])
def test_reduce_refuses_indefinite_stiffness_with_every_solver(solver: str | None) -> None:
    """A negative eigenvalue far from zero is not among the lowest modes."""
    n = 30
    K = np.diag(np.r_[np.linspace(1.0, 2.0, n - 1), -1e6])
    K[0, 1] = K[1, 0] = 0.1
    with pytest.raises(InputError, match="negative eigenvalues"):
        ss.reduce(K, np.eye(n), dofs=[f"u{k}" for k in range(n)], keep=["u3"], modes=3, solver=solver)


@DENSE_AND_SPARSE
@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", "MCK")
def test_values_that_are_not_finite(name: str, bad: float, store: Callable[..., Any]) -> None:
    matrix = GOOD[name].copy()
    matrix[0, 0] = bad
    with pytest.raises(InputError, match=f"{name}: some entries are not finite"):
        structure(store, **{name: matrix})


def test_an_array_of_complex_zeros_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", a=np.ones(2, dtype=complex), b=np.array([1.0, 1j]))
    assert read_arrays(tmp_path / "a.npz", {"a": 1})["a"].dtype == float
    with raises_fault("a.npz: 'b'", expected="real numbers"):
        read_arrays(tmp_path / "a.npz", {"b": 1})
