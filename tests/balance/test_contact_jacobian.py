"""The Jacobian that is never written out against the one that is, for every mixture of contacts."""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance import contact_jacobian
from slipstick.balance.balance import Balance
from slipstick.balance.compliance import FactoredCompliance
from slipstick.balance.contact_jacobian import ContactJacobian
from slipstick.balance.evaluation import Balanced, detail
from slipstick.solve.linear.jacobian import Jacobian

OMEGA = 7.3


def structure(n, modes=9, *, loss=0.01, second=True, seed=0, rest=1.0):
    """Random modes with residuals that a larger model of the same kind would leave."""
    rng = np.random.default_rng(seed)
    omega, shapes = np.sort(rng.uniform(2.0, 60.0, modes)), rng.standard_normal((n, modes))
    root = rng.standard_normal((n, n))
    rest = rest * (root @ root.T) / n
    return ss.ModalStructure(
        omega=omega,
        mode_shapes=shapes,
        static_compliance=(shapes / omega**2) @ shapes.T + 1e-3 * rest,
        second_residual=1e-6 * rest if second else None,
        loss_factor=loss,
        damping_ratio=0.01,
        dofs=[f"d{i}" for i in range(n)],
    )


def grid(n, *, v=0.3):
    """n friction contacts with both ports."""
    law = ss.FrictionContact(kt=30.0, mu=0.4, kn=50.0, normal_load=1.0)
    return [
        ss.ContactPair(
            name=f"c{i}", contact=law, tangential=f"d{2 * i}", normal=f"d{2 * i + 1}",
            rubbing=ss.RubbingMotion(velocity=v),
        )
        for i in range(n)
    ]  # fmt: skip


def mixture():
    """Contacts with and without a normal port, a law sampled in time, a port along two dofs."""
    pairs = grid(3)
    pairs.append(
        ss.ContactPair(name="flat", contact=ss.FrictionContact(kt=20.0, mu=0.3, normal_load=2.0), tangential="d6")
    )
    cubic = ss.SampledLaw(force=lambda x, velocity, k: k * x**3, parameters={"k": 4.0}, ports=("x",))
    pairs.append(ss.ContactPair(name="spring", contact=cubic, ports={"x": {"d7": 0.6, "d8": 0.8}}))
    return pairs


def heated(n):
    """Contacts whose friction falls with their heat, each heated by all."""
    pairs = grid(n, v=2.0)
    curve = ss.FrictionCurve(temperature=[20.0, 400.0], mu=[0.5, 0.2])
    R = 3.0 * np.eye(n) + 0.5
    thermal = ss.ThermalModel(curve=curve, background=20.0, resistance=R)
    return pairs, thermal


CASES = {
    "two ports": lambda: (grid(4), None),
    "mixture": lambda: (mixture(), None),
    "heated": lambda: heated(4),
}


@pytest.fixture(params=CASES)
def both(request):
    pairs, thermal = CASES[request.param]()
    return jacobians(pairs, thermal)


def jacobians(pairs, thermal=None, **options):
    problem = ss.Problem(
        structure(9, **options), contacts=pairs, loads=[ss.Load(dof="d1", harmonic=1, cos=3.0)],
        harmonics=ss.Harmonics([0, 1, 2, 5]), thermal=thermal,
    )  # fmt: skip
    balance = Balance(problem)
    x = np.random.default_rng(2).standard_normal(balance.size) * 0.1
    found = detail(balance, x, OMEGA, problem.inputs)
    dense = Balanced(balance, x, found, balance.compliance(OMEGA)).jacobian
    compliance = FactoredCompliance(balance.receptance.factors(balance.orders, OMEGA))
    return dense, ContactJacobian(balance, [r.by_motion for r in found.responses], compliance, found.states)


def test_is_a_jacobian(both):
    assert isinstance(both[1], Jacobian)


@pytest.mark.parametrize("transposed", [False, True])
def test_products_and_solutions(both, transposed):
    dense, own = both
    for v in (np.random.default_rng(3).standard_normal((own.size, 2)), np.eye(own.size)[5]):
        expected = dense.multiply(v, transposed=transposed)
        np.testing.assert_allclose(own.multiply(v, transposed=transposed), expected, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            own.solve(v, transposed=transposed), dense.solve(v, transposed=transposed), rtol=0, atol=1e-6
        )


@pytest.mark.parametrize(
    ("pairs", "thermal", "rest"),
    [(grid(4), None, np.kron(np.eye(5), np.ones((2, 2)))[:9, :9]), (mixture(), None, 0.0), (*heated(4), 0.0)],
)
def test_what_is_near_is_all_of_it_where_residuals_stay_within_the_elements(pairs, thermal, rest):
    dense, own = jacobians(pairs, thermal, rest=rest)
    for v in np.random.default_rng(11).standard_normal((2, own.size)):
        np.testing.assert_allclose(own.nearby(v), dense.multiply(v), rtol=0, atol=1e-12)
    own.solve(v)
    assert own.products <= 2
    assert own.sign() == dense.sign()


def test_what_stands_for_it_transposed_is_its_transpose(both):
    """A wrong one would still be solved with, only slower."""
    _, own = both
    x, y = np.random.default_rng(7).standard_normal((2, own.size))
    pulled = own.precondition(y, transposed=True)
    assert own.precondition(x) @ y == pytest.approx(x @ pulled, rel=1e-9, abs=1e-9 * np.abs(x) @ np.abs(pulled))


@pytest.mark.parametrize("pairs", [grid(4), mixture()])
def test_what_stands_for_it_is_all_of_it_where_every_mode_is_held(pairs, monkeypatch):
    """Nothing but modes carries from one contact to another: one product, and the sign of the determinant, exactly."""
    monkeypatch.setattr(contact_jacobian, "_MIN_GAIN", 0.0)
    dense, own = jacobians(pairs, rest=0.0, second=False)
    for v in np.random.default_rng(8).standard_normal((3, own.size)):
        np.testing.assert_allclose(own.precondition(dense.multiply(v)), v, rtol=0, atol=1e-8)
        np.testing.assert_allclose(
            own.precondition(dense.multiply(v, transposed=True), transposed=True), v, rtol=0, atol=1e-8
        )
    assert own.preconditioner_sign == dense.sign()
    own.solve(v)
    assert own.products <= 2


def test_modes_that_are_left_out_cost_products_and_no_digits(monkeypatch):
    """Of more coefficients than are held exactly, those that carry most are chosen, harmonic 0 counted once."""
    products = []
    monkeypatch.setattr(ContactJacobian, "has_nearby", False)
    for most in (0, 20, 264):
        monkeypatch.setattr(contact_jacobian, "MAX_EXACT", most)
        dense, own = jacobians(grid(4))
        v = np.random.default_rng(9).standard_normal(own.size)
        np.testing.assert_allclose(own.solve(v), dense.solve(v), rtol=0, atol=1e-6)
        assert own._preconditioner._size <= most
        products.append(own.products)
    assert products[0] > products[1] > products[2]


def test_determinants_keep_their_sign(both):
    dense, own = both
    rng = np.random.default_rng(4)
    column, row = rng.standard_normal(own.size), rng.standard_normal(own.size + 1)
    for border in (row, -row):
        assert own.bordered(column, border).sign() == dense.bordered(column, border).sign()
    assert own.sign() == dense.sign()


def test_the_bound_is_one_and_not_far(both):
    dense, own = both
    v = np.random.default_rng(5).standard_normal(own.size)
    ratio = own.bound(v) / dense.bound(v)
    assert ratio.min() >= 1.0 - 1e-12
    assert ratio.max() < 50.0


def at(x, pairs, omega=OMEGA):
    """Dense and own Jacobian at a motion."""
    problem = ss.Problem(
        structure(2 * len(pairs)), contacts=pairs, loads=[ss.Load(dof="d1", harmonic=1, cos=3.0)],
        harmonics=ss.Harmonics([0, 1, 2, 5]),
    )  # fmt: skip
    balance = Balance(problem)
    found = detail(balance, np.resize(x, balance.size), omega, problem.inputs)
    dense = Balanced(balance, np.resize(x, balance.size), found, balance.compliance(omega)).jacobian
    compliance = FactoredCompliance(balance.receptance.factors(balance.orders, omega))
    return dense, ContactJacobian(balance, [r.by_motion for r in found.responses], compliance)


@pytest.mark.parametrize("border", [False, True])
@pytest.mark.parametrize(("far", "solutions", "own_ones"), [(1e-4, 1, 0), (1e-4, 6, 1), (3.0, 6, 1)])
def test_what_stands_for_another_serves_until_its_own_is_worth_it(far, solutions, own_ones, border, monkeypatch):
    """Digits and sign stay."""
    made = []
    first = contact_jacobian.Preconditioner.__init__
    monkeypatch.setattr(
        contact_jacobian.Preconditioner, "__init__", lambda self, *of: made.append(self) or first(self, *of)
    )
    rng = np.random.default_rng(12)
    x, y = 0.1 * rng.standard_normal((2, 500))
    (_, one), (dense, own) = at(x, grid(4)), at(x + far * y, grid(4), OMEGA * (1.0 + 0.1 * far))
    if border:
        column, row = rng.standard_normal(own.size), rng.standard_normal(own.size + 1)
        one, dense, own = (J.bordered(column, row) for J in (one, dense, own))
    v = rng.standard_normal(own.size)
    one.solve(v)
    own.take_over(one)
    assert len(made) == 1
    for _ in range(solutions):
        np.testing.assert_allclose(own.solve(v), dense.solve(v), rtol=0, atol=1e-6 * np.abs(dense.solve(v)).max())
    assert own.sign() == dense.sign()
    assert len(made) == 1 + own_ones
    third = at(x, grid(4))[1]
    third.take_over(dense)
    third.solve(v[: third.size])
    assert len(made) == 2 + own_ones


@pytest.mark.parametrize("options", [{"loss": 0.0}, {"second": False}, {"loss": np.linspace(0.0, 0.02, 9)}])
def test_every_kind_of_damping_and_residual(options):
    dense, own = jacobians(grid(4), **options)
    v = np.random.default_rng(6).standard_normal(own.size)
    np.testing.assert_allclose(own.multiply(v), dense.multiply(v), rtol=0, atol=1e-12)


def test_products_do_not_grow_with_the_number_of_contacts():
    products = []
    for n in (4, 40):
        pairs = grid(n)
        problem = ss.Problem(
            structure(2 * n, modes=20), contacts=pairs, loads=[ss.Load(dof="d1", harmonic=1, cos=3.0)],
            harmonics=ss.Harmonics(range(4)),
        )  # fmt: skip
        balance = Balance(problem)
        x = np.random.default_rng(2).standard_normal(balance.size) * 0.1
        found = detail(balance, x, OMEGA, problem.inputs)
        compliance = FactoredCompliance(balance.receptance.factors(balance.orders, OMEGA))
        own = ContactJacobian(balance, [r.by_motion for r in found.responses], compliance)
        own.solve(x)
        products.append(own.products)
    assert products[1] <= 2 * products[0]
