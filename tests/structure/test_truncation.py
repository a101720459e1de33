"""What modes left out do: the estimate bounds the true error of a chain below its last mode, in any units."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import eigh

from slipstick.fem.box import box
from slipstick.fem.materials import Material
from slipstick.fem.model import elastic_model
from slipstick.structure.reduction.reduce import reduce_model
from slipstick.structure.truncation import (
    CANCELLED,
    REFUSED,
    UNREACHED,
    WARNED_REDUCTION,
    ReceptanceSize,
    Truncation,
    WorstError,
    band,
    band_error,
)

N = 12
K = 100.0 * (2.0 * np.eye(N) - np.eye(N, k=1) - np.eye(N, k=-1))
M = np.diag(np.linspace(1.0, 2.0, N))
VALUES, SHAPES = eigh(K, M)
KEPT = [2, 5, 9]


def truncation(modes, second=True, unit=1.0):
    a = SHAPES[KEPT] * unit
    static = (a / VALUES) @ a.T
    left = a[:, modes:]
    residual = (left / VALUES[modes:] ** 2) @ left.T if second else None
    return Truncation(
        omega=np.sqrt(VALUES[:modes]), mode_shapes=a[:, :modes], static_compliance=static, second_residual=residual
    )


def true_error(modes, w, second):
    a = SHAPES[KEPT]
    scale = 1.0 / np.sqrt(np.diag((a / VALUES) @ a.T))
    a = a * scale[:, None]
    exact = (a / (VALUES - w**2)) @ a.T
    left = a[:, modes:]
    short = (a[:, :modes] / (VALUES[:modes] - w**2)) @ a[:, :modes].T + (left / VALUES[modes:]) @ left.T
    if second:
        short = short + w**2 * (left / VALUES[modes:] ** 2) @ left.T
    return np.linalg.norm(exact - short) / np.linalg.norm(short)


@pytest.mark.parametrize("modes", [2, 4, 8])
@pytest.mark.parametrize("second", [True, False])
def test_the_estimate_bounds_the_error_below_the_last_mode(modes, second):
    found, last = truncation(modes, second), np.sqrt(VALUES[modes - 1])
    for share in (0.1, 0.5, 0.8):
        w = share * last
        true = true_error(modes, w, second)
        assert 0.99 * true <= float(found.error(w)) < 100.0 * true


def test_units_do_not_matter_and_all_modes_leave_nothing_out():
    w = np.linspace(0.5, 10.0, 7)
    np.testing.assert_allclose(truncation(4).error(w), truncation(4, unit=1e3).error(w), rtol=1e-10)
    assert truncation(N).error(w).max() < 1e-12
    assert truncation(N).valid_to == np.inf


def test_valid_to_is_where_the_estimate_reaches_one_percent():
    found = truncation(3)
    w = found.valid_to
    assert float(found.error(0.99 * w)) <= REFUSED < float(found.error(1.02 * w))


def test_a_worst_error_says_what_to_do():
    bad = WorstError(value=0.2, relative=0.2, omega=5.0, last_mode=4.0, reach=5.0)
    assert bad.refused
    assert "force = true" in bad.sentence(7)
    assert "all 7 below" in bad.sentence(7)
    fair = WorstError(
        value=10 * WARNED_REDUCTION, relative=10 * WARNED_REDUCTION, omega=5.0, last_mode=9.0, reach=5.0, kind="bound"
    )
    assert not fair.refused
    assert "may be wrong by up to" in fair.sentence()
    assert fair.needed >= 1.05 * 9.0


def test_a_load_that_modes_left_out_answer_enters_the_estimate():
    """The load drives dofs that are not kept against each other: its response is worse than that between those kept."""
    modes, load = 3, np.zeros(N)
    load[[4, 6]] = 1.0, -1.0
    a, p = SHAPES[KEPT], SHAPES.T @ load
    parts = {"omega": np.sqrt(VALUES[:modes]), "mode_shapes": a[:, :modes], "static_compliance": (a / VALUES) @ a.T}
    parts["second_residual"] = (a[:, modes:] / VALUES[modes:] ** 2) @ a[:, modes:].T
    static, second = (a / VALUES) @ p, (a[:, modes:] / VALUES[modes:] ** 2) @ p[modes:]
    known = {
        "participation": p[None, :modes],
        "load_response": static[:, None],
        "second_load_response": second[:, None],
    }
    w = 0.3 * np.sqrt(VALUES[modes - 1])
    with_load, without = Truncation(**parts, **known), Truncation(**parts)
    exact = (a / (VALUES - w**2)) @ p
    short = (a[:, :modes] / (VALUES[:modes] - w**2)) @ p[:modes]
    short = short + static - (a[:, :modes] / VALUES[:modes]) @ p[:modes] + w**2 * second
    true = np.linalg.norm(exact - short) / np.linalg.norm(exact)
    assert float(without.error(w)) < 0.5 * true < true <= float(with_load.error(w)) < 50.0 * true
    assert float(with_load.error(w, w * (1.0 + 1e-12))) == pytest.approx(float(without.error(w)), rel=1e-9)
    del known["second_load_response"]
    assert float(Truncation(**parts, **known).error(w)) > float(with_load.error(w))


OMEGA = np.array([1.0, 2.0, 4.0])
FEW_MODES = np.array([[1.0, 0.5, 0.3], [0.4, -1.0, 0.2]])
RESIDUAL = np.array([[0.02, 0.01], [0.01, 0.03]])


def size(participation, load_residual):
    return ReceptanceSize(OMEGA, FEW_MODES, RESIDUAL, np.asarray(participation), np.asarray(load_residual))


def test_norms_of_the_sum_over_modes():
    p, residual = np.array([[1.0, 2.0, -1.0]]), np.array([[0.1], [-0.2]])
    found = size(p, residual).at([0.0, 0.7, 3.0])
    for w, row in zip([0.0, 0.7, 3.0], found, strict=True):
        c = 1.0 / (OMEGA**2 - w**2)
        whole = (FEW_MODES * c) @ np.column_stack([FEW_MODES.T, p.T]) + np.column_stack([RESIDUAL, residual])
        np.testing.assert_allclose(row, [np.linalg.norm(whole[:, :2]), np.linalg.norm(whole[:, 2])], rtol=1e-12)


def test_between_resonances_it_counts_as_a_tenth_of_what_cancels():
    one = ReceptanceSize(OMEGA[:2], np.ones((1, 2)), np.zeros((1, 1)), np.zeros((0, 2)), np.zeros((1, 0)))
    w = np.sqrt(2.5)  # 1 / (1 - w^2) + 1 / (4 - w^2) = 0
    assert one.at(w)[0] == pytest.approx(CANCELLED * 2.0 / 1.5)


def test_a_load_that_reaches_nothing_counts_as_what_it_might():
    found = size([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], np.zeros((2, 2)))
    assert found.at(0.5)[1] == 0.0
    shapes = np.array([[0.0, 1.0]])
    symmetric = ReceptanceSize(OMEGA[:2], shapes, np.zeros((1, 1)), np.array([[1.0, 0.0]]), np.zeros((1, 1)))
    assert symmetric.at(0.0)[1] == pytest.approx(UNREACHED * np.sqrt(0.25 * 1.0))


def test_a_band_is_looked_at_between_its_resonances():
    omega = np.array([1.0, 1.001, 5.0])
    grid = band(omega, 0.0, 3.0)
    assert (grid[0], grid[-1]) == (0.0, 3.0)
    assert np.count_nonzero((grid > 1.0) & (grid < 1.001)) >= 8
    assert np.all(np.diff(band(omega, 2.0, 2.0)) > 0.0)


STEEL = Material(young=2e11, poisson=0.3, density=8000.0)
CASES = {
    # seed, size, divisions, directions kept, accuracy, mode below the top, top over that mode
    "many": (13, (0.25, 0.06, 0.03), (4, 2, 2), 24, 1e-3, 9, 1.03),
    "few": (3, (0.20, 0.03, 0.02), (5, 1, 1), 2, 1e-4, 6, 1.20),
    "one": (6, (0.20, 0.05, 0.03), (4, 1, 1), 1, 1e-4, 8, 1.03),
    "low": (5, (0.15, 0.06, 0.02), (4, 2, 1), 9, 1e-5, 1, 1.25),
    "dense": (8, (0.12, 0.08, 0.04), (3, 2, 1), 24, 1e-3, 11, 1.03),
}


def case(seed, size, divisions, n_keep, accuracy, mode, share):
    """Full model with a uniform load and a point load; worst error over accuracy of each (directions, loads)."""
    rng = np.random.default_rng(seed)
    model = elastic_model(box(size, divisions, "hex20"), STEEL, "x0")
    n = model.K.shape[0]
    values, shapes = eigh(model.K.toarray(), model.M.toarray())
    keep = list(rng.choice(model.dofs, n_keep, replace=False))
    uniform, point = np.zeros(n), np.zeros(n)
    uniform[1::3], point[int(rng.integers(n))] = 1.0, 1.0
    top = np.sqrt(values[mode]) * share
    made = reduce_model(
        model.K, model.M, dofs=model.dofs, keep=keep, load_shapes={"uniform": uniform, "point": point},
        accuracy=accuracy, frequency_range=(0.0, top),
    )  # fmt: skip
    grid = np.linspace(0.0, top, 702)[1:]
    natural = np.sqrt(values)
    grid = grid[np.abs(grid[:, None] / natural - 1.0).min(axis=1) > 2e-3]  # there rounding of frequencies shows
    a = shapes[[model.dofs.index(name) for name in keep]]
    p = np.column_stack([shapes.T @ uniform, shapes.T @ point])
    c = 1.0 / (values - grid[:, None] ** 2)
    exact = np.concatenate(
        [np.einsum("ir,gr,jr->gij", a, c, a, optimize=True), np.einsum("ir,gr,rk->gik", a, c, p, optimize=True)], axis=2
    )
    eye = np.eye(n_keep)
    found = made.structure.project(eye, eye, ["uniform", "point"]).at([1], grid)[0][:, 0]
    whole = np.abs(c)[:, None] * np.abs(np.vstack([np.ones_like(values), p.T]))
    between = [np.linalg.norm((a * w) @ a.T) for w in whole[:, 0]]
    worst = []
    for column in (slice(0, n_keep), slice(n_keep, n_keep + 1), slice(n_keep + 1, None)):
        k = max(column.start - n_keep + 1, 0)
        error = np.linalg.norm((found - exact)[:, :, column], axis=(1, 2))
        size = np.linalg.norm(exact[:, :, column], axis=(1, 2))
        if k:
            apart = np.sqrt(np.einsum("gr,rs,gs->g", whole[:, k], np.abs(a.T @ a), whole[:, k], optimize=True))
            reach = UNREACHED * np.sqrt(between * (np.abs(c) @ p[:, k - 1] ** 2))
            size = np.maximum(size, reach)
        else:
            apart = np.array(between)
        worst.append(float(np.max(error / np.maximum(size, CANCELLED * apart)) / accuracy))
    return worst, made


@pytest.mark.filterwarnings("ignore:the receptance of the reduced")  # an accuracy above 1e-4 is warned of
@pytest.mark.parametrize("name", CASES)
def test_the_accuracy_holds_everywhere_in_the_band_loads_included(name):
    worst, made = case(*CASES[name])
    assert max(worst) <= 1.0, worst
    assert made.error_estimate / CASES[name][4] >= 0.9 * max(worst)


def test_what_cancels_at_the_top_is_still_bounded_below_it():
    """Two modes left out move one dof; a load drives them so that its error at the top is zero, and not below it."""
    omega, left, top, n_keep = np.array([1.0, 3.0]), np.array([4.0, 6.0]), 2.0, 1
    t = top**4 / (left**2 - top**2)
    kept, p = np.array([[1.0, 0.5]]), np.array([t[1], -t[0]])
    shapes, loads = np.array([[1.0, 1.0]]) * left**2, p * left**2
    both = np.vstack([shapes, loads]) / left**2
    missing = (both * t) @ both.T
    assert missing[0, 1] == pytest.approx(0.0, abs=1e-12)
    residual, load_residual = (shapes / left**2) @ shapes.T, (shapes / left**2) @ loads[:, None]
    size = ReceptanceSize(omega, kept, residual, np.array([[1.0, 1.0]]), load_residual)
    second = both @ both.T
    found = band_error(size, omega, n_keep, top=top, missing=missing, second=second)
    w = band(omega, 0.0, top)
    true = np.abs((both[0] * both[1]) @ (w**4 / (left[:, None] ** 2 - w**2)))
    assert found >= np.max(true / size.at(w)[:, 1]) > 0.0


def test_modes_that_end_below_the_top_say_nothing():
    size = ReceptanceSize(np.array([1.0]), np.ones((1, 1)), np.ones((1, 1)), np.zeros((0, 1)), np.zeros((1, 0)))
    assert band_error(size, np.array([1.0]), 1, top=2.0, missing=np.ones((1, 1)), second=np.ones((1, 1))) == np.inf
