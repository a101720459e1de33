from __future__ import annotations

import numpy as np
import pytest
from helpers.problems import difference

import slipstick as ss
from slipstick.structure.prescribed_mode import MODE, XI, PrescribedMode

ORDERS = np.array([1.0, 2.0, 3.0])


def setting() -> tuple[ss.ModalStructure, PrescribedMode]:
    rng = np.random.default_rng(1)
    shapes, omega = rng.standard_normal((3, 4)), np.array([3.0, 5.0, 9.0, 14.0])
    own = ss.ModalStructure(
        omega=omega, mode_shapes=shapes, static_compliance=(shapes / omega**2) @ shapes.T + 0.01 * np.eye(3),
        dofs=["a", "b", "c"], loss_factor=0.02, damping_ratio=[0.01, 0.02, 0.0, 0.03], second_residual=1e-4 * np.eye(3),
    )  # fmt: skip
    return own, PrescribedMode(own, 1, float(shapes[0, 1]))


def test_without_what_is_taken_it_is_the_structure_but_for_the_mode():
    own, held = setting()
    full, receptance = own.project(np.eye(3), np.eye(3)), held.project(np.eye(3), np.eye(3), [MODE])
    value, _ = receptance.at(ORDERS, 4.0)
    expected, _ = full.at(ORDERS, 4.0)
    D = 1.0 / (25.0 * (1.0 + 0.02j) - 16.0 + 4.0j * 2.0 * 0.02 * 5.0)
    phi = own.mode_shapes[:, 1]
    assert np.allclose(value[1:, :, :3], expected[1:], rtol=1e-12)
    assert np.allclose(value[0, :, :3], expected[0] - D * np.outer(phi, phi), rtol=1e-10)
    assert np.allclose(value[0, :, 3], phi / phi[0])
    assert not value[1:, :, 3].any()
    assert np.allclose(receptance.static, np.column_stack([full.static, np.zeros(3)]))


def test_derivatives_and_factors():
    _, held = setting()
    receptance = held.project(np.eye(3), np.eye(3), [MODE]).changed(xi=0.3)
    value, slope = receptance.at(ORDERS, 4.0)
    assert np.allclose(slope, difference(lambda w: receptance.at(ORDERS, w)[0], 4.0, 1e-3), rtol=1e-7, atol=1e-9)
    by_xi = difference(lambda xi: receptance.changed(xi=xi).at(ORDERS, 4.0)[0], 0.3, 1e-3)
    assert np.allclose(receptance.by_parameter(XI, ORDERS, 4.0), by_xi, rtol=1e-7, atol=1e-9)
    many, rates = receptance.at(ORDERS, np.array([4.0, 5.0]))
    assert np.allclose(many[0], value)
    assert np.allclose(rates[0], slope)
    for along in (None, {XI: 1.0}):
        f = receptance.factors(ORDERS, 4.0, along)
        parts = np.array(f.parts.matrices)
        whole = np.einsum("rj,kj,cj->krc", f.left, f.weight, f.right) + np.einsum("pk,prc->krc", f.part_weight, parts)
        assert np.allclose(whole, np.concatenate([receptance.static[None], value]), rtol=1e-10)
        rate = np.einsum("rj,kj,cj->krc", f.left, f.slope, f.right) + np.einsum("pk,prc->krc", f.part_slope, parts)
        assert np.allclose(rate[1:], slope if along is None else receptance.by_parameter(XI, ORDERS, 4.0), rtol=1e-10)


def test_it_is_a_structure_without_equations_in_time():
    _, held = setting()
    assert held.load_shapes == (MODE,)
    assert held.changed(xi=0.2).values == {XI: 0.2}
    with pytest.raises(ss.InputError, match="has no equations in time"):
        held.time_equations(np.eye(3), np.eye(3))


def test_modes_that_damping_couples():
    """Of uncoupled damping it is the same structure; else the equations of the modes, and central differences."""
    own, held = setting()
    shapes = own.mode_shapes
    plain = ss.ModalStructure(
        omega=own.omega, mode_shapes=own.mode_shapes, static_compliance=(shapes / own.omega**2) @ shapes.T,
        dofs=own.dofs, loss_factor=0.02, damping_ratio=own.damping_ratio,
    )  # fmt: skip
    viscous = np.diag(2.0 * own.damping_ratio * own.omega)
    alone, together = (
        PrescribedMode(plain, 1, held.scale, *more).project(np.eye(3), np.eye(3), [MODE]).changed(xi=0.3)
        for more in ((), (viscous,))
    )
    for first, other in zip(alone.at(ORDERS, 4.0), together.at(ORDERS, 4.0), strict=True):
        assert np.allclose(other, first, rtol=1e-10, atol=1e-13)
    assert np.allclose(together.by_parameter(XI, ORDERS, 4.0), alone.by_parameter(XI, ORDERS, 4.0), rtol=1e-10)
    assert np.allclose(together.static, alone.static)

    b = np.random.default_rng(4).standard_normal((4, 2))
    viscous = viscous + 0.1 * b @ b.T
    receptance = PrescribedMode(plain, 1, held.scale, viscous).project(np.eye(3), np.eye(3), [MODE]).changed(xi=0.3)
    value, slope = receptance.at(ORDERS, 4.0)
    assert np.allclose(slope, difference(lambda w: receptance.at(ORDERS, w)[0], 4.0, 1e-3), rtol=1e-7, atol=1e-9)
    by_xi = difference(lambda xi: receptance.changed(xi=xi).at(ORDERS, 4.0)[0], 0.3, 1e-3)
    assert np.allclose(receptance.by_parameter(XI, ORDERS, 4.0), by_xi, rtol=1e-7, atol=1e-9)
    stiffness = plain.omega**2 * (1.0 + 0.02j)
    Z = [np.diag(stiffness - w**2) + 1j * w * (viscous - 0.3 * np.eye(4)) for w in (4.0, 8.0)]
    assert np.allclose(value[1, :, :3], shapes @ np.linalg.inv(Z[1]) @ shapes.T, rtol=1e-10)
    force = np.array([0.0, 1.0, 0.0, 0.0])  # the mode held at 1 by a force on it
    q = np.linalg.solve(Z[0], force)
    assert np.allclose(value[0, :, 3], shapes @ (q / q[1]) / held.scale, rtol=1e-10)


@pytest.mark.parametrize("second", [False, True])
def test_coupled_modes_with_others_left_out(second: bool) -> None:
    """Three of five modes with residuals come close to the dense solution with all, as the next power of w says."""
    rng = np.random.default_rng(7)
    shapes, omega = rng.standard_normal((3, 5)), np.array([3.0, 5.0, 9.0, 200.0, 300.0])
    b = rng.standard_normal((3, 2))
    viscous = 0.1 * np.eye(3) + 0.1 * b @ b.T
    kept, out = shapes[:, :3], shapes[:, 3:]
    structure = ss.ModalStructure(
        omega=omega[:3], mode_shapes=kept, static_compliance=(shapes / omega**2) @ shapes.T, dofs=["a", "b", "c"],
        loss_factor=0.02, second_residual=(out / omega[3:] ** 4) @ out.T if second else None,
    )  # fmt: skip
    receptance = PrescribedMode(structure, 1, 1.0, viscous).project(np.eye(3), np.eye(3), [MODE])
    value, slope = receptance.at(ORDERS, 4.0)
    for order, found in zip(ORDERS, value, strict=True):
        w = 4.0 * order
        Z = np.diag(omega**2 * (1.0 + 0.02j) - w * w)
        Z[:3, :3] += 1j * w * viscous
        moving = [0, 2, 3, 4] if order == 1.0 else [0, 1, 2, 3, 4]
        exact = shapes[:, moving] @ np.linalg.solve(Z[np.ix_(moving, moving)], shapes[:, moving].T)
        power = 2 if second else 1
        rest = (out**2 / omega[3:] ** 2).sum() * (w / omega[3]) ** (2 * power)
        assert np.abs(found[:, :3] - exact).max() < 1.1 * rest
    assert np.allclose(slope, difference(lambda w: receptance.at(ORDERS, w)[0], 4.0, 1e-3), rtol=1e-7, atol=1e-10)
    by_xi = difference(lambda xi: receptance.changed(xi=xi).at(ORDERS, 4.0)[0], 0.0, 1e-3)
    assert np.allclose(receptance.by_parameter(XI, ORDERS, 4.0), by_xi, rtol=1e-7, atol=1e-10)
