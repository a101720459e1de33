"""Block Lanczos: the basis stays orthonormal and its relation holds, through restarts and dead directions."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import eigsh

from slipstick.errors import InputError
from slipstick.solve.linear import lanczos
from slipstick.solve.linear.factorisation import SingularMatrixError, available_solvers
from slipstick.solve.linear.lanczos import BlockLanczos, KrylovBasis, modes
from slipstick.solve.linear.modes import EigenError, EigenOptions, StageProgress, backward_errors

N = 60
K = np.diag(np.full(N, 2.0)) - np.eye(N, k=1) - np.eye(N, k=-1)
M = np.diag(np.linspace(1.0, 3.0, N))


def iteration(block=4, mass=M, start=None):
    return KrylovBasis(lambda B: np.linalg.solve(K, B), csr_array(mass), block, start)


def assert_relation(it):
    """``K^-1 M V = V H + Q coupling E^T`` and ``V^T M V = 1``."""
    V = it.V[:, : it.m]
    np.testing.assert_allclose(V.T @ M @ V, np.eye(it.m), atol=1e-11)
    right = V @ it.H
    right[:, it.m - it.coupling.shape[1] :] += it.Q @ it.coupling
    np.testing.assert_allclose(np.linalg.solve(K, M @ V), right, atol=1e-9)


def test_relation_and_ritz_values():
    it = iteration()
    for _ in range(8):
        it.make_room(40, 12)
        it.step()
        assert_relation(it)
    theta, _, residual = it.ritz()
    exact = 1.0 / eigh(K, M, eigvals_only=True)
    good = residual < 1e-8
    assert good.sum() >= 3
    np.testing.assert_allclose(theta[good], exact[: good.sum()], rtol=1e-10)


def test_a_restart_keeps_the_relation():
    it = iteration()
    for _ in range(12):
        it.make_room(20, 8)
        it.step()
    assert it.m <= 24
    theta, Y, residual = it.ritz()
    V = it.V[:, : it.m]
    shapes = V @ Y[:, :3]
    found = np.linalg.norm(np.linalg.solve(K, M @ shapes) - shapes * theta[:3], axis=0) / theta[:3]
    assert found.max() < 10 * max(residual[:3].max(), 1e-9)


def test_a_search_leaves_the_basis_as_it_was():
    it = iteration()
    for _ in range(6):
        it.make_room(40, 12)
        it.step()
    before = it.ritz()
    exact = 1.0 / eigh(K, M, eigvals_only=True)
    found = np.count_nonzero(before[0] > 0.5 * (exact[2] + exact[3]))
    assert found == 3
    assert not it.lacks(0.5 * (exact[2] + exact[3]), 10, 4)
    assert it.lacks(0.5 * (exact[30] + exact[31]), 10, 4)
    assert_relation(it)
    for ours, its in zip(before, it.ritz(), strict=True):
        np.testing.assert_array_equal(ours, its)


def test_directions_that_vanish_become_random_ones():
    """A start of equal columns has rank one; the block is full all the same."""
    it = iteration(start=np.ones((N, 4)))
    np.testing.assert_allclose(it.Q.T @ M @ it.Q, np.eye(4), atol=1e-10)


def test_an_indefinite_mass_is_said():
    with pytest.raises(InputError, match="the mass matrix is indefinite"):
        iteration(mass=np.diag(np.linspace(-3.0, 1.0, N)))


def test_a_restart_of_a_large_basis_goes_piece_by_piece():
    """20 000 rows in more than one piece: the basis stays orthonormal and keeps the best Ritz vectors."""
    n = 20_000
    stiffness, mass = np.arange(1.0, n + 1.0), np.linspace(1.0, 2.0, n)
    it = KrylovBasis(lambda B: B / stiffness[:, None], diags_array(mass).tocsr(), 4)
    for _ in range(8):
        it.make_room(16, 8)
        it.step()
    V = it.V[:, : it.m]
    np.testing.assert_allclose(V.T @ (mass[:, None] * V), np.eye(it.m), atol=1e-10)
    theta, Y, _ = it.ritz()
    np.testing.assert_allclose(theta[:2], np.sort(mass / stiffness)[::-1][:2], rtol=1e-6)
    first = V @ Y[:, 0]
    assert abs(first[0]) * np.sqrt(mass[0]) == pytest.approx(1.0, rel=1e-6)


def chain(n: int) -> sparse.csr_array:
    """Unit springs, both ends fixed."""
    return sparse.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1], format="csr")


def lattice(shape: tuple[int, int, int]) -> tuple[sparse.csr_array, np.ndarray]:
    """Lattice of unit springs with fixed sides, and all its eigenvalues: sums of 4 sin^2 (closed form)."""
    nx, ny, nz = shape
    eye = [sparse.eye_array(n, format="csr") for n in shape]
    A = (
        sparse.kron(sparse.kron(chain(nx), eye[1]), eye[2])
        + sparse.kron(sparse.kron(eye[0], chain(ny)), eye[2])
        + sparse.kron(sparse.kron(eye[0], eye[1]), chain(nz))
    )
    one = [4.0 * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) ** 2 for n in shape]
    exact = (one[0][:, None, None] + one[1][None, :, None] + one[2][None, None, :]).ravel()
    return sparse.csr_array(A), np.sort(exact)


@pytest.fixture(params=["counted", "searched"])
def _way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """How it is made sure that no mode is missing: small factors are made once more, large ones not."""
    monkeypatch.setattr(lanczos, "_COUNT_MEMORY", np.inf if request.param == "counted" else 0.0)


@pytest.mark.usefixtures("_way")
def test_lattice_with_manifold_eigenvalues_is_found_whole() -> None:
    K, exact = lattice((12, 12, 12))  # up to six equal ones
    mass = 2.5
    found = modes(K, mass * sparse.eye_array(K.shape[0], format="csr"), 100)
    np.testing.assert_allclose(found.eigenvalues, exact[:100] / mass, rtol=1e-10)
    assert found.complete is True
    assert found.residuals.max() < 1e-7
    np.testing.assert_allclose(mass * found.shapes.T @ found.shapes, np.eye(100), atol=1e-12)


@pytest.mark.parametrize("solver", available_solvers())
def test_consistent_mass_against_arpack(solver: str) -> None:
    K, _ = lattice((20, 9, 5))
    n = K.shape[0]
    random = np.random.default_rng(3)
    M = sparse.csr_array(sparse.diags_array(random.uniform(1.0, 5.0, n)) - 0.1 * K)
    reference = np.sort(eigsh(K, 30, M, sigma=0.0)[0])
    found = modes(K, M, 30, solver=solver)
    np.testing.assert_allclose(found.eigenvalues, reference, rtol=1e-9)
    assert found.solver == solver
    assert found.complete is True
    np.testing.assert_allclose(found.shapes.T @ (M @ found.shapes), np.eye(30), atol=1e-11)
    # the eigenvalue error is the square of the subspace residual, so the equation holds to about the latter
    assert backward_errors(K, M, found.eigenvalues, found.shapes).max() < 1e-7


def test_restarts_find_the_same_modes_in_less_memory() -> None:
    K, exact = lattice((15, 14, 13))
    options = EigenOptions(block=4, subspace=80)
    found = modes(K, sparse.eye_array(K.shape[0], format="csr"), 40, options=options)
    np.testing.assert_allclose(found.eigenvalues, exact[:40], rtol=1e-9)
    assert found.complete is True


def test_a_basis_too_small_to_converge_is_refused() -> None:
    K, _ = lattice((15, 14, 13))
    with pytest.raises(EigenError, match="of 60 modes converged after 0 restarts with a basis of 7"):
        modes(K, sparse.eye_array(K.shape[0], format="csr"), 60, options=EigenOptions(block=4, subspace=70, restarts=0))


@pytest.mark.usefixtures("_way")
def test_modes_hidden_from_the_start_are_found() -> None:
    """A start that does not touch one of two separate parts cannot see its modes: a count or a search tells."""
    one, exact_one = lattice((9, 8, 7))
    two, exact_two = lattice((7, 6, 5))
    K = sparse.block_diag([one, two], format="csr")
    M = sparse.eye_array(K.shape[0], format="csr")
    exact = np.sort(np.concatenate([exact_one, exact_two]))[:12]
    start = np.zeros((K.shape[0], 16))
    start[: one.shape[0]] = np.random.default_rng(5).standard_normal((one.shape[0], 16))
    stages: list[str] = []
    uncounted = BlockLanczos(K, M, start=start).modes(12, count=False)
    assert uncounted.complete is None
    np.testing.assert_allclose(uncounted.eigenvalues, exact_one[:12], rtol=1e-9)
    found = modes(K, M, 12, start=start, listener=lambda event: stages.append(event.stage))
    np.testing.assert_allclose(found.eigenvalues, exact, rtol=1e-9)
    assert found.complete is True
    assert "modes were missing, searching on" in stages


@pytest.mark.usefixtures("_way")
def test_eigenvalues_repeated_more_often_than_the_block_has_columns() -> None:
    one = chain(30)
    K = sparse.csr_array(sparse.kron(sparse.eye_array(40), one))
    exact = np.sort(np.tile(4.0 * np.sin(np.pi * np.arange(1, 31) / 62) ** 2, 40))[:100]
    found = modes(K, sparse.eye_array(1200, format="csr"), 100)
    np.testing.assert_allclose(found.eigenvalues, exact, rtol=1e-10)
    assert found.complete is True
    found = modes(K, sparse.eye_array(1200, format="csr"), 30)
    np.testing.assert_allclose(found.eigenvalues, exact[:30], rtol=1e-10)


def test_penalty_springs_do_no_harm() -> None:
    K = (chain(200) + sparse.csr_array(([1e14], ([99], [99])), shape=(200, 200))).tocsr()
    parts = [4.0 * np.sin(np.pi * np.arange(1, n + 1) / (2 * (n + 1))) ** 2 for n in (99, 100)]
    found = modes(K, sparse.eye_array(200, format="csr"), 20)
    np.testing.assert_allclose(found.eigenvalues, np.sort(np.concatenate(parts))[:20], rtol=1e-9)
    assert found.complete is True


def test_modes_beyond_double_precision_are_not_given_out() -> None:
    K = sparse.diags_array(np.concatenate([[1e-6, 1.0], np.full(100, 1e12)]), format="csr")
    with pytest.raises(EigenError, match=r"does not satisfy its equation.*check units"):
        modes(K, sparse.eye_array(102, format="csr"), 3)


@pytest.mark.usefixtures("_way")
def test_all_modes_of_a_small_structure() -> None:
    K, exact = lattice((3, 3, 3))
    M = sparse.eye_array(27, format="csr")
    for count in (1, 26, 27):
        found = modes(K, M, count)
        np.testing.assert_allclose(found.eigenvalues, exact[:count], rtol=1e-10)
        assert found.complete is True
    assert modes(chain(1), sparse.eye_array(1), 1).omega[0] == pytest.approx(np.sqrt(2.0))


def free_chain(n: int) -> sparse.csr_array:
    K = chain(n).tolil()
    K[0, 0] = K[n - 1, n - 1] = 1.0
    return sparse.csr_array(K)


def test_a_free_body_needs_a_negative_shift() -> None:
    K, M = free_chain(60), sparse.eye_array(60, format="csr")
    with pytest.raises(SingularMatrixError, match="negative shift such as -"):
        modes(K, M, 5)
    found = modes(K, M, 5, shift=-1e-3)
    exact = 4.0 * np.sin(np.pi * np.arange(5) / 120) ** 2
    np.testing.assert_allclose(found.eigenvalues, exact, atol=1e-12)
    assert found.omega[0] < 1e-6
    with pytest.raises(SingularMatrixError, match="the shift is an eigenvalue"):
        modes(sparse.diags_array([1.0, 2.0, 3.0]), sparse.eye_array(3), 1, shift=1.0)


def test_modes_are_found_and_counted_with_one_ordering(monkeypatch: pytest.MonkeyPatch) -> None:
    rslab = pytest.importorskip("rslab")
    analyze, patterns = rslab.analyze, []
    monkeypatch.setattr(rslab, "analyze", lambda A, *given, **own: patterns.append(A.nnz) or analyze(A, *given, **own))
    K, exact = lattice((9, 8, 7))
    found = modes(K, sparse.eye_array(K.shape[0], format="csr"), 8, solver="rslab")
    assert found.complete
    np.testing.assert_allclose(found.eigenvalues, exact[:8], rtol=1e-10)
    assert patterns == [K.nnz]


def test_work_done_is_kept_when_more_modes_are_asked() -> None:
    K, exact = lattice((9, 8, 7))
    iteration = BlockLanczos(K, sparse.eye_array(K.shape[0], format="csr"))
    few = iteration.modes(8, count=False)
    used = iteration.basis.m
    again = iteration.modes(8)
    assert iteration.basis.m == used
    more = iteration.modes(40)
    np.testing.assert_allclose(few.eigenvalues, exact[:8], rtol=1e-10)
    np.testing.assert_allclose(again.eigenvalues, exact[:8], rtol=1e-10)
    np.testing.assert_allclose(more.eigenvalues, exact[:40], rtol=1e-10)


def test_results_repeat_to_the_bit_and_signs_are_fixed() -> None:
    K, _ = lattice((9, 8, 7))
    M = sparse.eye_array(K.shape[0], format="csr")
    first, second = modes(K, M, 12), modes(K, M, 12)
    np.testing.assert_array_equal(first.shapes, second.shapes)
    largest = np.abs(first.shapes).max(axis=0)
    assert (first.shapes.max(axis=0) >= (1.0 - 1e-6) * largest).all()


def test_progress_counts_up_to_the_modes_wanted() -> None:
    K, _ = lattice((9, 8, 7))
    events: list[StageProgress] = []
    modes(K, sparse.eye_array(K.shape[0], format="csr"), 20, listener=events.append)
    counted = [event.done for event in events if event.stage == "modes"]
    assert counted[0] == 0
    assert counted[-1] == 20


def test_massless_dofs_and_negative_mass() -> None:
    K, _ = lattice((6, 5, 4))
    mass = np.ones(120)
    mass[::3] = 0.0
    M = sparse.csr_array(sparse.diags_array(mass))
    heavy = np.flatnonzero(mass)
    dense = K.toarray()
    light = np.flatnonzero(mass == 0.0)
    condensed = dense[np.ix_(heavy, heavy)] - dense[np.ix_(heavy, light)] @ np.linalg.solve(
        dense[np.ix_(light, light)], dense[np.ix_(light, heavy)]
    )
    found = modes(K, M, 10)
    np.testing.assert_allclose(found.eigenvalues, np.linalg.eigvalsh(condensed)[:10], rtol=1e-9)
    with pytest.raises(InputError, match="indefinite"):
        modes(K, -M, 3)


def test_a_shift_above_eigenvalues_is_refused() -> None:
    K, M = chain(40), sparse.eye_array(40, format="csr")
    with pytest.raises(InputError, match=r"4 eigenvalues lie below the shift 0.1"):
        modes(K, M, 3, shift=0.1)
    assert 4.0 * np.sin(4 * np.pi / 82) ** 2 < 0.1 < 4.0 * np.sin(5 * np.pi / 82) ** 2


def test_an_impossible_number_is_refused() -> None:
    with pytest.raises(InputError, match="n_modes = 28 is not to be had from 27 dofs"):
        modes(lattice((3, 3, 3))[0], sparse.eye_array(27), 28)


def test_participations_are_those_of_the_modes() -> None:
    """Without forming the modes; their signs do not matter."""
    n = 60
    K = chain(n)
    M = sparse.csr_array(sparse.diags_array(np.linspace(1.0, 2.0, n)))
    B = sparse.csc_array(sparse.random_array((n, 3), density=0.2, rng=np.random.default_rng(3)))
    iteration = BlockLanczos(K, M)
    omega, amplitudes = iteration.participations(8, B)
    found = iteration.modes(8)
    np.testing.assert_allclose(omega, found.omega, rtol=1e-12)
    np.testing.assert_allclose(np.abs(amplitudes), np.abs(B.T @ found.shapes), rtol=1e-9, atol=1e-12)
