"""Residuals applied by solutions against the same written out."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from helpers.faults import raises_fault
from scipy import sparse

import slipstick as ss
from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import FiniteElementModel, elastic_model
from slipstick.structure import residuals, solved_modes
from slipstick.structure.modal import ModalStructure
from slipstick.structure.reduction import compute as reduction_compute
from slipstick.structure.reduction.compute import cheaper_solved
from slipstick.structure.reduction.near_field import neighbours
from slipstick.structure.residuals import FullModel, load_compliance, own_compliance
from slipstick.structure.solved_modes import SolvedModes, SolvedModesReceptance

STEEL = Material(young=2.08e11, poisson=0.3, density=8200.0)
ORDERS, OMEGA = np.array([1.0, 2.0, 5.0]), 3300.0


@pytest.fixture(scope="module")
def model() -> FiniteElementModel:
    return elastic_model(box((0.2, 0.06, 0.01), (10, 5, 1), "hex20"), STEEL, "x0")


def reduced(model: FiniteElementModel, residuals: str, more: Any = None, **options: Any) -> ModalStructure:
    """Tangential and normal directions of the lower face, and two loads."""
    x, _, z = model.mesh.nodes.T
    rows = model.indices(np.flatnonzero((z < 1e-9) & (x > 0.09)))[:, [0, 2]].ravel()
    n = model.K.shape[0]
    keep = sparse.csc_array((np.ones(rows.size), (rows, np.arange(rows.size))), shape=(n, rows.size))
    loads = {"press": np.ones(n), "tip": np.eye(n)[-1], **(more or {})}
    names = [f"{i}{port}" for i in range(rows.size // 2) for port in "tn"]
    options = {"modes": 24, "loss_factor": 0.01, "damping_ratio": 0.003} | options
    return ss.reduce(model.K, model.M, keep=keep, names=names, load_shapes=loads, residuals=residuals, **options)


@pytest.fixture(scope="module")
def written(model: FiniteElementModel) -> ModalStructure:
    return reduced(model, "written")


@pytest.fixture(scope="module")
def solved(model: FiniteElementModel) -> SolvedModes:
    structure = reduced(model, "solved")
    assert isinstance(structure, SolvedModes)
    return structure


def ports(structure: ModalStructure) -> Any:
    return sparse.eye_array(len(structure.dofs), format="csc")


def both(written: ModalStructure, solved: SolvedModes, shapes: tuple[str, ...] = ("tip", "press")) -> tuple[Any, Any]:
    return tuple(s.project(ports(s), ports(s), shapes) for s in (written, solved))  # type: ignore[return-value]


def close(found: Any, expected: Any, rtol: float = 1e-9) -> None:
    np.testing.assert_allclose(found, expected, rtol=0, atol=rtol * float(np.abs(expected).max()))


@pytest.mark.parametrize(
    "change", [{}, {"loss_factor": 0.2}, {"damping": 3.0}, {"mode3.omega": 9000.0, "mode2.damping_ratio": 0.1}]
)
def test_products_are_those_of_written_matrices(written: Any, solved: Any, change: dict[str, float]) -> None:
    """Both ways, for values and slopes, also where parameters of the structure have changed."""
    A, B = (receptance.changed(**change) for receptance in both(written, solved))
    assert isinstance(B, SolvedModesReceptance)
    rng = np.random.default_rng(1)
    G = rng.standard_normal((*A.static.shape[1:], 4)) + 1j * rng.standard_normal((*A.static.shape[1:], 4))
    f, g = (one.factors(ORDERS, OMEGA) for one in (A, B))
    for weight in (f.part_weight, f.part_slope):
        close(g.parts.times(G, weight), f.parts.times(G, weight), 1e-5)
        close(
            g.parts.times_transposed(G[: len(f.left)], weight), f.parts.times_transposed(G[: len(f.left)], weight), 1e-5
        )
    close(B.static @ G.real, A.static @ G.real)
    close(B.static @ G[:, 0].real, A.static @ G[:, 0].real)
    forces = rng.standard_normal((2, len(G), 6))
    close(B.answer(ORDERS, np.array([OMEGA, 5e3]), forces), A.answer(ORDERS, np.array([OMEGA, 5e3]), forces))
    for one, other in zip(B.at(ORDERS, OMEGA), A.at(ORDERS, OMEGA), strict=True):
        close(one, other)
    close(B.conjugates(ORDERS, OMEGA)[0], A.conjugates(ORDERS, OMEGA)[0])
    close(B.by_parameter("loss_factor", ORDERS, OMEGA), A.by_parameter("loss_factor", ORDERS, OMEGA))


def test_a_changed_structure(written: ModalStructure, solved: SolvedModes) -> None:
    A, B = (s.changed(**{"mode1.omega": 800.0, "loss_factor": 0.05}) for s in (written, solved))
    close(B.static_compliance, A.static_compliance)
    close(B.second_residual, A.second_residual, 1e-5)
    for one, other in zip(*(s.modal_parts(ports(s), ports(s), ("press",)) for s in (B, A)), strict=True):
        close(one, other, 1e-5)


def test_zero_forces_and_harmonics_that_do_not_act(written: Any, solved: Any) -> None:
    """What does not act is not solved for: no forces, forces at rest alone, loads alone."""
    A, B = both(written, solved)
    f, g = (one.factors(ORDERS, OMEGA) for one in (A, B))
    G = np.zeros((A.static.shape[1], 4), dtype=complex)
    assert not g.parts.times(G, g.part_weight).any()
    G[3, 0], G[-1, 2] = 2.0, 1.0j
    close(g.parts.times(G, g.part_weight), f.parts.times(G, f.part_weight), 1e-6)


def test_columns_solved_in_parts(solved: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Some of them for one residual alone."""
    B, rng = solved.project(ports(solved), ports(solved)), np.random.default_rng(8)
    forces, second = rng.standard_normal((len(solved.dofs), 8)), np.arange(8) % 3 > 0
    whole = B._residuals.both(forces, second)
    monkeypatch.setattr(residuals, "SOLVED", 3)
    B._residuals._last = None
    close(B._residuals.both(forces, second), whole)
    assert not whole[1][:, ~second].any()


def test_loads_on_single_dofs(written: ModalStructure, solved: SolvedModes) -> None:
    """Columns beyond the rows that are no shapes: sizes are given of the rows alone, forces of all or of the rows."""
    A, B = (s.project(ports(s)[:, :-2], ports(s), ("tip",)) for s in (written, solved))
    f, g = (one.factors(ORDERS, OMEGA) for one in (A, B))
    rows, columns = A.static.shape
    rng = np.random.default_rng(7)
    for n in (rows, columns - 1, columns):
        G = rng.standard_normal((n, 4)) + 1j * rng.standard_normal((n, 4))
        close(g.parts.times(G, g.part_weight), f.parts.times(G, f.part_weight), 1e-6)
        assert g.parts.reach(np.abs(G), np.ones((2, 4))).shape == (rows, 4)
    close(load_compliance(B.static), load_compliance(A.static))
    close(own_compliance(B.static), own_compliance(A.static), 0.05)


def test_few_directions_are_written_out(written: ModalStructure, solved: SolvedModes) -> None:
    row = np.eye(len(solved.dofs))[:, [4]]
    for rows, columns in ((row, ports(solved)), (ports(solved), row), (row, row)):
        A, B = (s.project(rows, columns, ["tip"]) for s in (written, solved))
        assert not isinstance(B, SolvedModesReceptance)
        close(B.static, A.static)
        close(B.at(ORDERS, OMEGA)[0], A.at(ORDERS, OMEGA)[0])


@pytest.mark.parametrize("rows, columns", [(0, 3), (3, 0), (0, 0)])
def test_no_rows_or_no_columns(written: ModalStructure, solved: SolvedModes, rows: int, columns: int) -> None:
    """As the forces of loads on modes are asked for, where shapes come after the columns."""
    eye = np.eye(len(solved.dofs))
    parts = [s.modal_parts(eye[:, :rows], eye[:, :columns], ("tip", "press")) for s in (solved, written)]
    for one, other in zip(*parts, strict=True):
        assert np.shape(one) == np.shape(other)
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-5 * np.abs(other).max(initial=0.0))


def test_sizes(written: ModalStructure, solved: SolvedModes) -> None:
    """The near field and its mean share beyond: right in the middle, within a factor of four in the worst row.

    Also for forces here and there.
    """
    A, B = both(written, solved)
    f, g = (one.factors(ORDERS, OMEGA) for one in (A, B))
    rng = np.random.default_rng(5)
    n = A.static.shape[1]
    for sizes in (np.ones((n, 4)), rng.random((n, 4)) * (rng.random((n, 4)) < 0.2)):
        for weight in (np.eye(2)[0][:, None] * np.ones(4), np.eye(2)[1][:, None] * np.ones(4)):
            ratio = g.parts.reach(sizes, weight) / f.parts.reach(sizes, weight)
            assert 0.2 < ratio.min() < ratio.max() < 4.0
            assert 0.75 < np.median(ratio) < 1.4
    diagonal = np.diag(written.static_compliance)
    assert own_compliance(B.static) == pytest.approx(diagonal, rel=0.05)
    close(load_compliance(B.static), load_compliance(A.static))
    for mine, theirs in zip(*(s.own_compliance(ports(s)) for s in (solved, written)), strict=True):
        assert mine == pytest.approx(theirs, rel=0.2, abs=1e-3 * theirs.max())
    rows = np.arange(n - 2).reshape(-1, 2)
    mine, theirs = (one.parts.entries(rows[:, :, None], rows[:, None, :])[0] for one in (g, f))
    close(mine, theirs, 0.1)


def test_estimates_of_the_error(written: ModalStructure, solved: SolvedModes) -> None:
    frequencies = np.linspace(500.0, 60e3, 30)
    assert solved.reduction_error(frequencies) == pytest.approx(written.reduction_error(frequencies), rel=0.5)
    assert solved.valid_to == pytest.approx(written.valid_to, rel=0.1)
    assert solved.error_kind == "estimate"


@pytest.mark.verify
@pytest.mark.parametrize("options", [{"modes": None}, {"modes": None, "frequency_range": (0.0, 6e3), "accuracy": 1e-5}])
def test_as_many_modes_as_the_accuracy_asks_for(model: FiniteElementModel, options: dict[str, Any]) -> None:
    A, B = (reduced(model, kind, **options) for kind in ("written", "solved"))
    assert abs(A.omega.size - B.omega.size) <= 12
    eye = np.eye(len(A.dofs))[:, ::17]
    close(B.project(eye, eye, ["tip"]).at([1.0], 6e3)[0], A.project(eye, eye, ["tip"]).at([1.0], 6e3)[0], 1e-4)


def test_pickled_and_made_again(solved: SolvedModes) -> None:
    again = pickle.loads(pickle.dumps(solved))
    assert "factors" not in again.full.__dict__
    for other in (again, SolvedModes(**solved.arguments)):
        A, B = (s.project(ports(s), ports(s), ["tip"]) for s in (solved, other))
        x = np.linspace(-1.0, 1.0, A.static.shape[1])
        np.testing.assert_allclose(B.static @ x, A.static @ x, rtol=1e-12)
        np.testing.assert_array_equal(other.reduction_error([1e3, 9e3]), solved.reduction_error([1e3, 9e3]))


def test_the_full_model_of_its_triangles(solved: SolvedModes) -> None:
    """As it is read from a file: with the same factors, residuals are not wrong by the rounding of others."""
    full = FullModel(**solved.full.arguments)
    assert (solved.full.K.data == 0.0).any()
    assert full.solver == "rslab"
    again = SolvedModes(**{**solved.arguments, "full": full})
    np.testing.assert_array_equal(again.static_compliance, solved.static_compliance)
    np.testing.assert_array_equal(again.second_residual, solved.second_residual)


def shaken(structure: ModalStructure) -> ss.Problem:
    """On 66 contact ports, by a support that moves; outputs beside them are no contact ports."""
    law = ss.FrictionContact(kt=2e6, kn=2e6, mu=0.3, normal_load=0.05)
    pairs = [ss.ContactPair(name=f"c{i}", contact=law, tangential=f"{i}t", normal=f"{i}n") for i in range(33)]
    load = ss.Load(base="z", motion="displacement", cos=1e-5)
    return ss.Problem(structure, contacts=pairs, loads=load, harmonics=[0, 1, 3], outputs=["32n", "45n"])


@pytest.mark.filterwarnings("ignore::slipstick.SlipstickWarning")
def test_a_support_that_moves(model: FiniteElementModel) -> None:
    """All entries of its receptance are written out where they are asked for, as of that of forces."""
    rigid = np.zeros(model.K.shape[0])
    rigid[model.free % 3 == 2] = 1.0
    one, other = (shaken(reduced(model, kind, more={"base z": model.M @ rigid})) for kind in ("written", "solved"))
    for kind in ("dense", "iterative"):
        a, b = (
            ss.forced_response(
                p, omega=(2400.0, 2420.0), options={"jacobian": kind, "max_step": 0.5, "output_step": 0.2}
            )
            for p in (one, other)
        )
        assert (len(a), a.outcome) == (len(b), b.outcome)
        assert float(a.dataset["separation_fraction"].max()) > 0.1
        close(b.dataset["displacement"].values, a.dataset["displacement"].values, 1e-7)
    a, b = (ss.linear_response(p, omega=[2000.0, 3000.0], state="stuck") for p in (one, other))
    close(b.dataset["displacement"].values, a.dataset["displacement"].values)


def test_stored_reductions_are_found_again(model: FiniteElementModel, tmp_path: Any, monkeypatch: Any) -> None:
    first = reduced(model, "solved", cache=tmp_path)
    monkeypatch.setattr(reduction_compute, "near_residuals", None)
    again = reduced(model, "solved", cache=tmp_path)
    assert isinstance(again, SolvedModes)
    np.testing.assert_array_equal(again.near.entries.data, first.near.entries.data)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(again.near_second.entries.data, first.near_second.entries.data)  # type: ignore[attr-defined]
    assert not isinstance(reduced(model, "auto", cache=tmp_path), SolvedModes)


def test_what_would_fill_memory_is_refused(solved: SolvedModes, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solved_modes, "MOST_WRITTEN", 1000)
    receptance = solved.project(ports(solved), ports(solved))
    with raises_fault("structure"):
        receptance.at([1.0], 3e3)
    with raises_fault("structure"):
        solved.static_compliance  # noqa: B018


def test_another_word_for_the_kind() -> None:
    with raises_fault("residuals", found="'sparse'"):
        ss.reduce(np.eye(3), np.eye(3), keep=["a"], dofs=["a", "b", "c"], residuals="sparse")


def test_the_choice_goes_by_cost() -> None:
    """Few directions and large factors: matrices; many: solutions; what does not fit into memory: solutions."""
    assert not cheaper_solved(400, 10**6)
    assert not cheaper_solved(2000, 56 * 10**6)
    assert cheaper_solved(6000, 223 * 10**6)
    assert not cheaper_solved(3000, 10**10)
    assert cheaper_solved(20_000, 10**10)


def test_directions_far_from_each_other_are_not_near() -> None:
    """A chain of 200 springs, every tenth mass kept: two of one colour are never near the same one."""
    n = 200
    K = sparse.diags_array([np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], offsets=[-1, 0, 1])
    kept = np.arange(0, n, 10)
    B = sparse.csc_array((np.ones(kept.size), (kept, np.arange(kept.size))), shape=(n, kept.size))
    found = neighbours(sparse.csr_array(K), B)
    near, distance = found.near.toarray() > 0, np.abs(np.subtract.outer(np.arange(20), np.arange(20)))
    np.testing.assert_array_equal(near, distance <= 2)
    for row in near:
        assert len(set(found.colours[row])) == row.sum()


@pytest.mark.parametrize("place", [0, 200, 400])
def test_a_direction_spread_over_all_others_is_near_to_itself_alone(place: int) -> None:
    """A chain of 1200 springs, every third mass kept, and the sum of all: the others are neighbours as without it."""
    n = 1200
    K = sparse.csr_array(
        sparse.diags_array([np.full(n - 1, -1.0), np.full(n, 2.0), np.full(n - 1, -1.0)], offsets=[-1, 0, 1])
    )
    kept = sparse.csc_array((np.ones(400), (np.arange(0, n, 3), np.arange(400))), shape=(n, 400))
    without = neighbours(K, kept)
    face = sparse.csc_array(np.full((n, 1), 0.5))
    found = neighbours(K, sparse.hstack([kept[:, :place], face, kept[:, place:]], format="csc"))
    others = np.delete(np.arange(401), place)
    assert (found.near[others][:, others] != without.near).nnz == 0
    np.testing.assert_array_equal(found.near[[place]].indices, [place])
    np.testing.assert_array_equal(found.colours[others], without.colours)
    assert np.count_nonzero(found.colours == found.colours[place]) == 1


def test_what_the_modes_leave_out_of_a_spread_direction_is_exact() -> None:
    """A chain of 900 springs on springs to ground, every third mass kept, and the sum of all."""
    n = 900
    K = sparse.csr_array(
        sparse.diags_array([np.full(n - 1, -1.0), np.full(n, 2.1), np.full(n - 1, -1.0)], offsets=[-1, 0, 1])
    )
    kept = sparse.csc_array((np.ones(300), (np.arange(0, n, 3), np.arange(300))), shape=(n, 300))
    keep = sparse.hstack([kept, sparse.csc_array(np.ones((n, 1)))], format="csc")
    names = [f"p{i}" for i in range(301)]
    structure = ss.reduce(K, sparse.eye_array(n, format="csr"), keep=keep, names=names, modes=20, residuals="solved")
    assert isinstance(structure, SolvedModes)
    exact = structure.static_compliance[-1, -1] - np.sum((structure.mode_shapes[-1] / structure.omega) ** 2)
    np.testing.assert_allclose(structure.near.own[-1], exact, rtol=1e-9)
