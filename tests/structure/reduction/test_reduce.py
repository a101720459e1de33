from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from helpers.reductions import receptance_errors
from scipy import sparse
from scipy.sparse.linalg import spsolve

from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import FiniteElementModel, elastic_model
from slipstick.solve.linear.modes import EigenError, StageProgress
from slipstick.structure.modal import ModalStructure
from slipstick.structure.reduction import compute as reduction_compute
from slipstick.structure.reduction import store as reduction_store
from slipstick.structure.reduction.reduce import Reduction, reduce, reduce_model

STEEL = Material(young=2.08e11, poisson=0.3, density=8200.0)


@pytest.fixture(scope="module")
def beam() -> FiniteElementModel:
    """A square cantilever of 20-node bricks: double bending modes, 1 800 dofs."""
    return elastic_model(box((0.2, 0.02, 0.02), (20, 2, 2), "hex20"), STEEL, "x0")


@pytest.fixture(scope="module")
def tip(beam: FiniteElementModel) -> list[str]:
    """All dofs of five nodes on the upper side near the free end."""
    x, y, z = beam.mesh.nodes.T
    nodes = np.flatnonzero((z > 0.02 - 1e-9) & (y < 1e-9) & (x > 0.15))[:5]
    return [beam.dofs[index] for index in beam.indices(nodes).ravel()]


@pytest.fixture(scope="module")
def pressure(beam: FiniteElementModel) -> np.ndarray:
    load = np.zeros(beam.K.shape[0])
    load[2::3] = 1.0
    return load


@pytest.fixture(scope="module")
def reduction(beam: FiniteElementModel, tip: list[str], pressure: np.ndarray) -> Reduction:
    return reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, load_shapes={"pressure": pressure}, modes=128)


def direct(model: FiniteElementModel, columns: Any, omega: float, loss_factor: float = 0.0) -> np.ndarray:
    """``columns^T (K (1 + i eta) - omega^2 M)^-1 columns`` by SciPy's solver, not the package's."""
    Z = sparse.csc_array(model.K * (1.0 + 1j * loss_factor) - omega**2 * model.M)
    return np.asarray(columns.T @ spsolve(Z, columns))


def relative(found: np.ndarray, exact: np.ndarray) -> float:
    return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


def test_receptance_against_the_full_model_up_to_five_times_the_first_resonance(
    beam: FiniteElementModel, reduction: Reduction, pressure: np.ndarray
) -> None:
    s = reduction.structure
    columns = np.column_stack([reduction.directions.toarray(), pressure])
    n = len(s.dofs)
    frequencies = s.omega[0] * np.array([0.3, 0.9, 1.7, 3.0, 4.4, 5.0])
    values = s.project(np.eye(n), np.eye(n), ["pressure"]).at([1], frequencies)[0][:, 0]
    for omega, value in zip(frequencies, values, strict=True):
        exact = direct(beam, columns, omega)[:n]
        assert relative(value[:, :n], exact[:, :n]) < 1e-7
        assert relative(value[:, n:], exact[:, n:]) < 1e-7


def test_receptance_at_resonance_with_damping(beam: FiniteElementModel, tip: list[str]) -> None:
    s = reduce(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=128, loss_factor=1e-3)
    n = len(s.dofs)
    columns = np.zeros((len(beam.dofs), n))
    columns[[beam.dofs.index(name) for name in tip], range(n)] = 1.0
    value = s.project(np.eye(n), np.eye(n)).at([1], s.omega[0])[0][0]
    assert relative(value, direct(beam, columns, s.omega[0], 1e-3)) < 1e-6


def test_static_compliance_is_exact(beam: FiniteElementModel, reduction: Reduction, pressure: np.ndarray) -> None:
    s = reduction.structure
    columns = np.column_stack([reduction.directions.toarray(), pressure])
    static = s.project(np.eye(len(s.dofs)), np.eye(len(s.dofs)), ["pressure"]).static
    # conditioning of K is near 1e9
    assert relative(static, direct(beam, columns, 0.0).real[: len(s.dofs)]) < 1e-8


def test_modes_are_complete_double_ones_included(reduction: Reduction) -> None:
    s = reduction.structure
    assert reduction.complete is True
    np.testing.assert_allclose(s.omega[0], s.omega[1], rtol=1e-8)
    # Euler-Bernoulli, 1.8751^2 sqrt(E I / (rho A L^4)); shear and the fixed end change it by about a percent
    bending = 1.8751**2 * np.sqrt(STEEL.young * 0.02**2 / 12 / STEEL.density) / 0.2**2
    assert s.omega[0] == pytest.approx(bending, rel=0.02)
    assert reduction.residuals.max() < 1e-7


def test_error_falls_fast_with_the_last_mode_taken(beam: FiniteElementModel, tip: list[str]) -> None:
    """Left out is the sum of ``a_r^2 omega^4 / omega_r^6``: order 6 less 1 to 3, for modes as dense as omega^0..2."""
    omega = reduce(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=1).omega[0] * 4.0
    errors, firsts = [], []
    for modes in (8, 16, 32, 64):
        made = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=modes)
        errors.append(next(iter(receptance_errors(made, beam.K, beam.M, omega).values())))
        firsts.append(made.structure.omega[-1])
    order = -np.polyfit(np.log(firsts), np.log(errors), 1)[0]
    assert errors[-1] < 1e-9
    assert 3.0 < order < 5.0


def test_error_grows_with_the_fourth_power_of_frequency(beam: FiniteElementModel, tip: list[str]) -> None:
    """The first term left out is omega^4 times a constant: absolute error, order 4 in frequency."""
    made = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=6)
    s, columns = made.structure, made.directions.toarray()
    omegas = s.omega[0] * np.array([1.5, 3.0])
    found = s.project(np.eye(len(tip)), np.eye(len(tip))).at([1], omegas)[0][:, 0]
    errors = [np.linalg.norm(a - direct(beam, columns, w)) for a, w in zip(found, omegas, strict=True)]
    assert np.log2(errors[1] / errors[0]) == pytest.approx(4.0, abs=0.3)


def test_number_of_modes_follows_from_the_accuracy(
    beam: FiniteElementModel, tip: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    highest = 5.0 * 2600.0
    counts = []
    for accuracy in (1e-4, 1e-6, 1e-8):
        made = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, accuracy=accuracy, frequency_range=(0.0, highest))
        counts.append(made.structure.omega.size)
        assert made.error_estimate is not None
        assert made.error_estimate <= accuracy
        measured = receptance_errors(made, beam.K, beam.M, [0.35 * highest, highest])
        assert max(measured.values()) <= accuracy
        assert measured[highest] <= 1.001 * made.error_estimate + 1e-12
        assert made.complete is True
    assert counts[0] < counts[1] < counts[2] < 128
    monkeypatch.setattr(reduction_compute, "MOST_MODES", 40)
    least = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, accuracy=1e-2, frequency_range=(0.0, highest))
    monkeypatch.setattr(reduction_compute, "MOST_MODES", least.structure.omega.size)
    reached = 1.2 * least.error_estimate  # with all the modes allowed the accuracy itself is enough, not half of it
    made = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, accuracy=reached, frequency_range=(0.0, highest))
    assert made.structure.omega.size == least.structure.omega.size
    monkeypatch.setattr(reduction_compute, "MOST_MODES", 40)
    with pytest.raises(EigenError, match=r"40 modes leave"):
        reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, accuracy=1e-15, frequency_range=(0.0, highest))


def test_patches_are_kept_as_directions(beam: FiniteElementModel, reduction: Reduction, tip: list[str]) -> None:
    weights = np.array([[0.5, 0.25, 0.25]]).T
    pick = sparse.csc_array(reduction.directions)[:, [2, 5, 8]]
    patch = reduce(beam.K, beam.M, keep=sparse.csc_array(pick @ weights), names=["patch"], modes=128)
    names = [tip[2], tip[5], tip[8]]
    rows = np.zeros((len(tip), 1))
    rows[[tip.index(name) for name in names], 0] = weights[:, 0]
    frequencies = np.array([500.0, 4000.0])
    one = patch.project([[1.0]], [[1.0]]).at([1], frequencies)[0]
    other = reduction.structure.project(rows, rows).at([1], frequencies)[0]
    np.testing.assert_allclose(one, other, rtol=1e-9)
    assert patch.dofs == ("patch",)


def test_rayleigh_damping_becomes_ratios_of_the_modes(beam: FiniteElementModel, tip: list[str]) -> None:
    s = reduce(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=8, rayleigh=(3.0, 2e-7), damping_ratio=0.01)
    np.testing.assert_allclose(s.damping_ratio, 0.01 + 1.5 / s.omega + 1e-7 * s.omega)


def test_a_stored_reduction_is_reused_and_recognised_by_content(
    beam: FiniteElementModel, tip: list[str], pressure: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def make(K: Any = beam.K, **options: Any) -> Reduction:
        wishes: dict[str, Any] = {"modes": 8, "load_shapes": {"pressure": pressure}, "cache": tmp_path / "store"}
        return reduce_model(K, beam.M, dofs=beam.dofs, keep=tip, **(wishes | options))

    first = make()
    again = make(loss_factor=0.002)
    assert not first.reused
    assert again.reused
    assert again.solver == first.solver
    assert again.complete == first.complete
    np.testing.assert_array_equal(first.structure.omega, again.structure.omega)
    np.testing.assert_array_equal(first.structure.static_compliance, again.structure.static_compliance)
    np.testing.assert_array_equal(again.structure.loss_factor, np.full(8, 0.002))
    assert not make(modes=9).reused
    assert not make(load_shapes={"pressure": 2.0 * pressure}).reused
    changed = beam.K.copy()
    changed.data[changed.indices == 7] *= 1.0
    assert make(K=changed).reused
    changed.data[0] *= 1.0 + 1e-15
    assert not make(K=changed).reused
    files = sorted((tmp_path / "store").iterdir())
    assert all(path.suffix == ".npz" for path in files)
    for path in files:
        path.write_bytes(path.read_bytes()[:100])  # a copy cut off
    assert not make().reused
    assert make().reused


def test_what_other_code_stored_is_made_again(
    beam: FiniteElementModel, tip: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The key holds the text of the code: a change of one byte in a room is another key."""
    made = [reduce_model(beam.K, beam.M, keep=tip, dofs=beam.dofs, modes=4, cache=tmp_path).reused for _ in range(2)]
    monkeypatch.setattr(reduction_store, "code_digest", lambda *rooms: "other")
    made.append(reduce_model(beam.K, beam.M, keep=tip, dofs=beam.dofs, modes=4, cache=tmp_path).reused)
    assert made == [False, True, False]
    room = tmp_path / "room" / "inner"
    room.mkdir(parents=True)
    (room / "a.py").write_text("x = 1\n")
    before = reduction_store.folders_digest([tmp_path / "room"])
    assert reduction_store.folders_digest([tmp_path / "room"]) == before
    (room / "a.py").write_text("x = 2\n")
    assert reduction_store.folders_digest([tmp_path / "room"]) != before


def test_a_stored_file_of_something_else_is_made_again(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    assert reduction_store.read(path) is None
    path.write_bytes(b"not an archive")
    assert reduction_store.read(path) is None
    np.savez(path, evil=np.array([{"code": 1}], dtype=object))
    assert reduction_store.read(path) is None


def test_a_folder_that_cannot_be_written_is_told(beam: FiniteElementModel, tip: list[str], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match=r"file: cannot be written \(found a file"):
        reduce(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=4, cache=tmp_path / "file")


def test_progress_names_the_stages(beam: FiniteElementModel, tip: list[str]) -> None:
    events: list[StageProgress] = []
    made = reduce_model(beam.K, beam.M, dofs=beam.dofs, keep=tip, modes=8, listener=events.append)
    assert {"factorisation", "static solutions", "modes", "counting modes"} <= {event.stage for event in events}
    assert set(made.seconds) == {"factorisation", "static solutions", "modes"}
    assert min(made.seconds.values()) > 0.0


def small() -> tuple[sparse.csr_array, sparse.csr_array]:
    n = 30
    K = sparse.diags_array([-np.ones(n - 1), 2.0 * np.ones(n), -np.ones(n - 1)], offsets=[-1, 0, 1], format="csr")
    return K, sparse.eye_array(n, format="csr")


NAMES = [f"u{k}" for k in range(30)]


def edited(A: sparse.csr_array, entries: dict[tuple[int, int], float]) -> sparse.csr_array:
    changed = A.tolil()
    for place, value in entries.items():
        changed[place] = value
    return sparse.csr_array(changed)


def free_ends(K: sparse.csr_array) -> sparse.csr_array:
    return edited(K, {(0, 0): 1.0, (29, 29): 1.0})


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda K, M: (K[:20, :20], M), r"stiffness \(20, 20\) and mass \(30, 30\) differ in size"),
        (lambda K, M: (K[:, :20], M), r"the stiffness matrix has shape \(30, 20\); give a square one"),
        (
            lambda K, M: (edited(K, {(4, 5): -1.1}), M),
            r"the stiffness matrix is not symmetric, first in the row of dof 'u4'",
        ),
        (lambda K, M: (sparse.triu(K).tocsr(), M), r"if one half is stored, mirror it"),
        (lambda K, M: (K, edited(M, {(4, 5): 0.2})), r"the mass matrix is not symmetric"),
        (lambda K, M: (edited(K, {(3, 3): np.nan}), M), r"the stiffness matrix holds a value that is not finite.*'u3'"),
        (lambda K, M: (K * (1 + 0.1j), M), r"the stiffness matrix is complex"),
        (lambda K, M: (K, edited(M, {(9, 9): -0.1})), r"dof 'u9' has negative mass -0.1"),
        (lambda K, M: (K, edited(M, {(9, 8): 1.4, (8, 9): 1.4})), r"the mass matrix is indefinite"),
        (lambda K, M: (K, 0.0 * M), r"the mass matrix is zero"),
        (lambda K, M: (free_ends(K), M), r"singular: some motion meets no resistance.*constrain the structure"),
        (lambda K, M: (K - 0.1 * M, M), r"has 3 negative eigenvalues, so the structure is unstable"),
    ],
)
def test_bad_matrices_get_one_clear_sentence(change: Callable[..., Any], sentence: str) -> None:
    K, M = change(*small())
    with pytest.raises(InputError, match=sentence) as error:
        reduce(K, M, dofs=NAMES[: K.shape[0]], keep=["u3"], modes=3)
    assert len(error.value.sentences) == 1


def test_a_mechanism_is_located() -> None:
    K, M = small()
    loose = edited(K, {(12, 11): 0.0, (11, 12): 0.0, (12, 12): 1.0, (11, 11): 1.0, (12, 13): -1.0, (13, 12): -1.0})
    loose = edited(
        loose, {(13, 14): 0.0, (14, 13): 0.0, (13, 13): 1.0, (14, 14): 1.0}
    )  # 12 and 13 hold only each other
    with pytest.raises(InputError, match=r"it moves most at dofs .*'u1[23]'"):
        reduce(loose, M, dofs=NAMES, keep=["u3"], modes=3, solver="superlu")
    with pytest.raises(InputError, match=r"a mechanism or a rigid-body motion"):
        reduce(loose, M, dofs=NAMES, keep=["u3"], modes=3)


def test_all_faults_of_a_request_come_at_once() -> None:
    K, M = small()
    with pytest.raises(InputError) as error:
        reduce(
            K,
            M,
            dofs=NAMES,
            keep=["u3", "tip"],
            modes=31,
            accuracy=2.0,
            frequency_range=(0.0, np.inf),
            loss_factor=-0.1,
            load_shapes={"p": np.ones(29), "q": np.zeros(30)},
        )
    text = str(error.value)
    assert len(error.value.sentences) == 7
    for part in (
        "loss_factor: found -0.1",
        "modes: found 31; expected a whole number from 1 to 30",
        "accuracy: found 2.0",
        "frequency_range",
        "'tip'",
        "load shape 'p' has 29",
        "'q' is zero",
    ):
        assert part in text


def test_directions_and_names_must_fit() -> None:
    K, M = small()
    with raises_fault("keep", says="dofs of the matrices have none"):
        reduce(K, M, keep=["u3"])
    with raises_fault("dofs", says="29 names for matrices of 30 rows"):
        reduce(K, M, dofs=NAMES[:29], keep=["u3"])
    with pytest.raises(
        InputError, match=r"keep has 29 rows.*\nnames: found 1; 2 directions need as many different names"
    ):
        reduce(K, M, keep=np.zeros((29, 2)), names=["a", "a"])
    with pytest.raises(InputError, match="dof name 'u0' appears more than once"):
        reduce(K, M, dofs=["u0", *NAMES[:29]], keep=["u3"])


def test_names_may_come_as_an_array_or_alone() -> None:
    K, M = small()
    assert reduce(K, M, dofs=np.array(NAMES), keep=np.array(["u3", "u4"]), modes=2).dofs == ("u3", "u4")
    assert reduce(K, M, dofs=NAMES, keep="u3", modes=2).dofs == ("u3",)


def test_all_modes_and_dense_matrices_work_too() -> None:
    K, M = small()
    s = reduce(K.toarray(), M.toarray(), dofs=NAMES, keep=NAMES)
    assert isinstance(s, ModalStructure)
    assert s.omega.size == 30
    exact = np.linalg.inv(K.toarray() - 0.04 * np.eye(30))
    np.testing.assert_allclose(s.project(np.eye(30), np.eye(30)).at([1], 0.2)[0][0], exact, atol=1e-10)


def test_estimate_at_a_natural_frequency_is_refused() -> None:
    K, M = small()
    made = reduce_model(K, M, dofs=NAMES, keep=["u3"], modes=3)
    exact = 2.0 * np.sin(np.pi / 62)
    with pytest.raises(InputError, match="is a natural frequency to working accuracy"):
        receptance_errors(made, K, M, [exact])


def test_without_a_number_or_a_range_the_accuracy_says_how_many(
    beam: FiniteElementModel, tip: list[str], pressure: np.ndarray, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Right to 1e-7 against the full model up to ten times the first resonance, and farther on request."""
    given = {"dofs": beam.dofs, "keep": tip, "load_shapes": {"pressure": pressure}}
    made = reduce_model(beam.K, beam.M, **given)
    first = made.structure.omega[0]
    assert 16 < made.structure.omega.size < 128
    assert made.complete is True
    assert max(receptance_errors(made, beam.K, beam.M, first * np.array([0.4, 2.0, 4.5, 9.0, 10.0])).values()) < 1e-7
    farther = reduce_model(beam.K, beam.M, **given, reach=14.0 * first)
    assert farther.structure.omega.size > made.structure.omega.size
    assert max(receptance_errors(farther, beam.K, beam.M, first * np.array([11.0, 13.9])).values()) < 1e-7
    monkeypatch.setattr(reduction_compute, "MOST_BY_DEFAULT", 20)
    assert reduce_model(beam.K, beam.M, **given).structure.omega.size == 20


def test_a_small_structure_keeps_all_its_modes() -> None:
    K = np.diag([2.0, 2.0, 1.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    assert reduce(1e4 * K, np.eye(3), keep=["b"], dofs=["a", "b", "c"]).omega.size == 3
