"""The structure with springs in the place of stuck contacts, against inverses, and what it spares."""

from __future__ import annotations

import functools
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from helpers.joint import clamped_by_points

import slipstick as ss
from slipstick.balance import stuck_structure as module
from slipstick.balance.balance import Balance
from slipstick.balance.contact_jacobian import ContactJacobian
from slipstick.balance.evaluation import FrequencySystem
from slipstick.balance.scaling import motions_at
from slipstick.balance.stuck_structure import StuckStructure, stuck_structure
from slipstick.solve.linear.block_bordered import BlockBordered
from slipstick.solve.linear.dense import DenseJacobian
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.solve.newton import newton_at
from slipstick.structure.receptance import Factors
from slipstick.structure.residuals import WrittenResiduals

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")  # half of the surfaces do not meet

ORDERS, OMEGA = np.array([0.0, 1.0, 3.0]), 2.3


def factors(n=7, modes=4, *, residual=1.0, growing=0.0, loss=0.0, residual_loss=0.0):
    rng = np.random.default_rng(1)
    shapes, squares = rng.standard_normal((n, modes)), rng.uniform(1.0, 30.0, modes) ** 2
    root, second = rng.standard_normal((2, n, n))
    moving = (ORDERS > 0.0) + 0j
    share = np.array([1.0 / (1.0 + 1j * residual_loss * moving), (ORDERS * OMEGA) ** 2])
    weight = 1.0 / (squares * (1.0 + 1j * loss * (ORDERS[:, None] > 0)) - (ORDERS[:, None] * OMEGA) ** 2)
    parts = [residual * root @ root.T / n, growing * second @ second.T / n]
    return Factors(
        left=shapes, right=shapes, weight=weight, slope=0.0 * weight,
        parts=WrittenResiduals(parts, symmetric=True), part_weight=share, part_slope=0.0 * share,
    )  # fmt: skip


def written(factors, k):
    modes = (factors.left * factors.weight[k]) @ factors.right.T
    return modes + sum(w[k] * R for R, w in zip(factors.parts.matrices, factors.part_weight, strict=True))


SHARES = [[], [2], [0, 3, 5], range(7)]


@pytest.mark.parametrize("softer", [0.0, 0.3])
@pytest.mark.parametrize("slipping", SHARES)
@pytest.mark.parametrize("residual", [0.0, 1.0])
def test_modes_with_springs_are_near_the_inverse(residual, slipping, softer):
    free, stuck, share = factors(residual=residual), np.linspace(50.0, 500.0, 7), np.ones(7)
    share[list(slipping)] = softer
    attached = StuckStructure(free, stuck, residual * factors().parts.matrices[0]).at(share)
    np.testing.assert_array_equal(attached.springs, share * stuck)
    found = attached.near(free, np.arange(7)).factors
    for k in range(len(ORDERS)):
        A = written(free, k)
        expected = np.linalg.solve(np.eye(7) + A * attached.springs, A)
        np.testing.assert_allclose(written(found, k), expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    assert attached.sign == np.sign(np.linalg.det(np.eye(7) + written(free, 0).real * attached.springs))


@pytest.mark.parametrize("slipping", SHARES)
@pytest.mark.parametrize("loss, error", [(0.0, 1e-9), (1e-3, 1e-5)])
def test_the_compliance_with_springs_is_that_of_the_inverse(slipping, loss, error):
    """With modal damping and a residual that grows; the loss of the residual to its first order."""
    free = factors(growing=0.02, loss=0.1, residual_loss=loss)
    stuck, share, some = np.linspace(50.0, 500.0, 7), np.ones(7), np.array([0, 2, 3, 5])
    share[list(slipping)] = 0.3
    structure = StuckStructure(free, stuck, free.parts.matrices[0])
    attached = structure.at(share)
    found, K = structure.compliance(attached, free, some), np.diag(attached.springs)
    rng = np.random.default_rng(4)
    F = rng.standard_normal((7, len(ORDERS))) + 1j * rng.standard_normal((7, len(ORDERS))) * (ORDERS > 0.0)
    only = np.zeros_like(F)
    only[some] = F[some]
    A_K = [np.linalg.solve(np.eye(7) + written(free, k) @ K, written(free, k)) for k in range(len(ORDERS))]

    def by_order(matrices, x):
        return np.column_stack([M @ column for M, column in zip(matrices, x.T, strict=True)])

    def near(one, other):
        np.testing.assert_allclose(one, other, rtol=0, atol=error * np.abs(other).max())

    conjugates = [A.conj() for A in A_K]
    near(found.answer(F), by_order(conjugates, F))
    near(found.answer(F, transposed=True), by_order([A.T for A in A_K], F))
    near(found.answer_to_own(F[some]), by_order(conjugates, only))
    near(found.own(F[some]), by_order(conjugates, only)[some])
    near(found.released_transposed(F), F - K @ by_order([A.T for A in A_K], F))
    freed, seen = F - by_order(conjugates, K @ F), []
    whole = found.eliminated(F, lambda X: seen.append(X) or 2.0 * X, lambda X: only[some])
    near(seen[0], freed[some])
    expected = freed - by_order(conjugates, only)
    expected[some] = 2.0 * freed[some]
    near(whole, expected)
    every = structure.compliance(attached, free, np.arange(7))
    near(every.eliminated(F, lambda X: X, lambda X: F), freed)


def test_soft_contacts_do_without():
    problem = clamped_by_points(8)
    balance = Balance(problem, backend="iterative")
    free = balance.compliance(1e4).factors
    assert stuck_structure(balance, free) is not None
    soft = ss.PlanarFrictionContact(kt=1.0, kn=1.0, mu=0.3, gap=0.0)
    pairs = [replace(pair, contact=soft) for pair in problem.contacts]
    assert stuck_structure(Balance(replace(problem, contacts=pairs), backend="iterative"), free) is None


def test_a_clamped_joint_takes_the_steps_of_a_dense_jacobian():
    """Corrections are as good one by one: measured by residuals alone, the line search gave up at the second."""
    problem, omega, found = clamped_by_points(12), 9e3, []
    for backend in ("dense", "iterative"):
        balance = Balance(problem, backend=backend)
        x = next(iter(motions_at(balance, problem.inputs, omega).values()))
        system = FrequencySystem(balance, problem.inputs)
        found.append(newton_at(system, x, omega, scale=float(np.linalg.norm(x))))
    exact, own = found
    assert exact.converged
    assert own.converged
    assert (own.iterations, own.evaluations) == (exact.iterations, exact.evaluations)
    np.testing.assert_allclose(own.corrections[:-2], exact.corrections[:-2], rtol=1e-2)
    np.testing.assert_allclose(own.x, exact.x, rtol=0, atol=1e-8 * np.abs(exact.x).max())


@functools.cache
def joint():
    """A clamped joint after its preload, shaken, and its motion: of 24 contacts some slip, some are open."""
    still = clamped_by_points(24)
    shaken = [replace(load, sin=200.0) if load.harmonic == 1 else load for load in still.loads]
    problem, omega = replace(still, loads=shaken).preloaded(ss.preload(still)), 9e3
    balance = Balance(problem, backend="dense")
    x = next(iter(motions_at(balance, problem.inputs, omega).values()))
    system = FrequencySystem(balance, problem.inputs)
    found = newton_at(system, x, omega, scale=float(np.linalg.norm(x)))
    assert found.converged
    return problem, found.x, omega


def at(x, omega, border="none"):
    """Dense and iterative Jacobians at a motion of the joint."""
    problem = joint()[0]
    systems = (FrequencySystem(Balance(problem, backend=kind), problem.inputs) for kind in ("dense", "iterative"))
    both = [system.evaluate(x, omega).jacobian for system in systems]
    rng, n = np.random.default_rng(5), both[0].size
    columns, rows = 1e-6 * rng.standard_normal((n, 2)), rng.standard_normal((2, n + 2))
    if border == "one":
        return [J.bordered(columns[:, 0], rows[0, :-1]) for J in both]
    if border == "two":
        sizes, inner = rng.uniform(0.5, 2.0, n), both[0].matrix
        scaled = np.vstack([np.column_stack([inner * sizes / sizes[:, None], columns]), rows])
        return [DenseJacobian(scaled), BlockBordered(both[1], sizes, columns, rows)]
    return both


BORDERS = ["none", "one", "two"]


@pytest.mark.parametrize("border", BORDERS)
def test_systems_are_solved_for_contacts_that_slip(border):
    """The others are springs, or nothing: two products of J at most, with all digits, and the sign."""
    dense, own = at(*joint()[1:], border)
    inner = getattr(own, "_inner", own)
    (contacts,), stuck = inner._elements, inner._stuck.stuck
    held, closed = ~contacts.differ(contacts.beyond(stuck), stuck), contacts.differ(contacts.local, stuck)
    slipping = np.count_nonzero(closed & ~held)
    assert min(np.count_nonzero(held), np.count_nonzero(~closed), slipping) > 0
    assert own.departing.size == 3 * slipping * 5
    b = dense.multiply(np.random.default_rng(6).standard_normal(dense.size))
    expected = dense.solve(b)
    for solve, error in ((own.solve, 1e-7), (own.solve_correction, 1e-5)):
        before, found = own.products, solve(b)
        assert own.products - before <= 2
        assert np.linalg.norm(found - expected) <= error * np.linalg.norm(expected)
    before = own.products
    assert own.sign() == dense.sign()
    assert own.products - before == 1
    found = own.solve(b, transposed=True)
    np.testing.assert_allclose(found, dense.solve(b, transposed=True), rtol=0, atol=1e-6 * np.abs(found).max())


@pytest.mark.parametrize("border", BORDERS)
def test_the_preconditioner_departs_from_the_jacobian_by_these_contacts_alone(border, monkeypatch):
    """``P^-1 J = I + B D``, exact where nothing of the residual that grows is left out; each transpose is one."""
    monkeypatch.setattr(module, "_RANK", 100)
    _, own = at(*joint()[1:], border)
    rng = np.random.default_rng(7)
    x, y = rng.standard_normal((2, own.size))
    d = own.departure(x[own.departing])
    found, expected = x + own.spread(d), own.precondition(own.multiply(x))
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())
    np.testing.assert_allclose(own.spread(d, alone=True), own.spread(d)[own.departing], rtol=1e-9)
    assert own.spread(d) @ y == pytest.approx(d @ own.spread_transposed(y), rel=1e-8)
    assert own.precondition(x) @ y == pytest.approx(x @ own.precondition(y, transposed=True), rel=1e-8)


def test_a_preconditioner_of_a_neighbour_serves_where_other_contacts_slip():
    """Springs are kept; contacts that were springs, or nothing, count among those that slip."""
    _, x, omega = joint()
    more = x.reshape(-1, 5).copy()
    more[:, 1:] *= 1.5
    (_, first), (dense, own) = at(x, omega), at(more.ravel(), 1.01 * omega)
    first.solve(x)
    own.take_over(first)
    b = dense.multiply(np.random.default_rng(9).standard_normal(x.size))
    assert own._preconditioner is first._preconditioner
    assert own.departing.size > first.departing.size
    expected, found = dense.solve(b), own.solve(b)
    assert own.products <= 2
    assert np.linalg.norm(found - expected) <= 1e-6 * np.linalg.norm(expected)
    assert own.sign() == dense.sign()


def test_curves_of_a_clamped_joint_are_those_of_dense_jacobians(monkeypatch):
    """With two products of the Jacobian for each of its solutions and signs, at most, in the mean."""
    problem, span, counts = joint()[0], (8.8e3, 9.2e3), Counter()

    def count(kind, name):
        once = getattr(kind, name)
        monkeypatch.setattr(kind, name, lambda *of, **how: counts.update([name]) or once(*of, **how))

    for kind, name in (
        (ContactJacobian, "multiply"), (IterativeJacobian, "solve"), (IterativeJacobian, "solve_correction"),
        (IterativeJacobian, "sign"),
    ):  # fmt: skip
        count(kind, name)
    found = [
        ss.forced_response(problem, omega=span, at=[8.9e3, 9.1e3], options={"jacobian": kind}).dataset
        for kind in ("dense", "iterative")
    ]
    exact, own = (data.isel(point=data.kind.values == "requested") for data in found)
    assert own.omega.size == exact.omega.size == 2
    for name in ("displacement", "normal_force", "friction_force"):
        one, other = own[name].values, exact[name].values
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-8 * np.abs(other).max(), err_msg=name)
    assert np.any(own.slip_fraction.values > 0.0)
    assert 0 < counts.pop("multiply") <= 2 * counts.total()


def row_of_springs(n=60, reach=12.0):
    """Stiff springs in a row that only push or pull, on a residual that couples neighbours closely."""
    rng = np.random.default_rng(0)
    omega, shapes, place = np.linspace(2.0, 60.0, 5), rng.standard_normal((n, 5)), np.arange(n)
    residual = np.exp(-np.abs(place[:, None] - place) / reach)
    structure = ss.ModalStructure(
        omega=omega, mode_shapes=shapes, static_compliance=(shapes / omega**2) @ shapes.T + residual,
        damping_ratio=0.01, dofs=[f"d{i}" for i in range(n)],
    )  # fmt: skip
    pairs = [ss.bolt(name=f"c{i}", elongation={f"d{i}": 1.0}, stiffness=1e3) for i in range(n)]
    return ss.Problem(structure, contacts=pairs, loads=ss.Load(dof="d1", cos=3.0), harmonics=[0, 1, 3])


def test_contacts_that_are_springs_need_no_iteration():
    """Pressed through the period, or open: P is J."""
    problem, x = row_of_springs(), np.zeros((60, 5))
    x[:, 0] = np.where(np.arange(60) % 4, -1.0, 1.0)
    dense, own = (
        FrequencySystem(Balance(problem, backend=kind), problem.inputs).evaluate(x.ravel(), 7.3).jacobian
        for kind in ("dense", "iterative")
    )
    b = dense.multiply(np.random.default_rng(8).standard_normal(x.size))
    found, expected = own.solve(b), dense.solve(b)
    assert own.departing.size == 0
    assert own.products == 1
    assert np.linalg.norm(found - expected) <= 1e-8 * np.linalg.norm(expected)
    assert own.sign() == dense.sign()


def test_products_are_spared(monkeypatch):
    """Half of them at least where a quarter of the contacts is open, or all but a quarter; with more digits."""
    problem, omega = row_of_springs(), 7.3
    x = 0.02 * np.random.default_rng(3).standard_normal((60, 5))
    x[:, 0] += np.where(np.arange(60) % 4, -1.0, 1.0)
    x = x.ravel()
    products, found = [], []
    for least in (np.inf, module.STIFF_FROM):
        monkeypatch.setattr(module, "STIFF_FROM", least)
        at = FrequencySystem(Balance(problem, backend="iterative"), problem.inputs).evaluate(x, omega)
        at.jacobian.has_nearby = False
        found.append(at.jacobian.solve(at.residual))
        products.append(at.jacobian.products)
    system = FrequencySystem(Balance(problem, backend="dense"), problem.inputs)
    exact = system.evaluate(x, omega).jacobian.solve(at.residual)
    for one, error in zip(found, (1e-3, 1e-6), strict=True):
        assert np.linalg.norm(one - exact) <= error * np.linalg.norm(exact)
    assert 2 * products[1] <= products[0], products
