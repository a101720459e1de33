"""Friction in two directions in time where the structure answers forces at once: a static residual.

A residual is what stiff modes leave behind: motion with them tends to the one with it as the square of their
frequencies. Along a line the contact is that of one direction, which is solved for elsewhere. What the multipliers are
held against is the period map, differenced, and a balance in many harmonics.
"""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.typing import Array

pytestmark = pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")

OMEGA = np.array([5.0, 7.0, 9.0])
SHAPES = np.array([[1.0, 0.2, 0.1], [-0.3, 1.0, 0.2], [0.1, -0.2, 1.0]])
RESIDUAL = 0.02 * np.array([[1.0, 0.3, 0.25], [0.3, 0.8, -0.2], [0.25, -0.2, 1.2]])
STRAIGHT = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]])
"""What of matrices leaves y out of the motion of x and z."""


def structure(
    stiff: float | None = None, shapes: Array = SHAPES, residual: Array = RESIDUAL, damping: float = 0.03
) -> ss.ModalStructure:
    """Three modes with a residual, or with three stiff modes in its place."""
    if stiff is None:
        static = shapes @ np.diag(1.0 / OMEGA**2) @ shapes.T + residual
        return ss.ModalStructure(
            omega=OMEGA, mode_shapes=shapes, dofs=list("xyz"), damping_ratio=damping, static_compliance=static
        )
    return ss.ModalStructure(
        omega=[*OMEGA, *[stiff] * 3], mode_shapes=np.hstack([shapes, stiff * np.linalg.cholesky(residual)]),
        dofs=list("xyz"), damping_ratio=[damping] * 3 + [18.0 / stiff] * 3,
    )  # fmt: skip


def problem(
    body: ss.ModalStructure, *, law: type = ss.PlanarFrictionContact, gap: float = -1.5,
    v: tuple[float, float] = (0.0, 0.0), load: float = 40.0, across: float = 24.0, orders: int = 10,
) -> ss.Problem:  # fmt: skip
    """A contact on x, y and z, or on x and z alone."""
    planar = law is ss.PlanarFrictionContact
    contact = law(kt=30.0, mu=0.4, kn=20.0, gap=gap)
    pair = ss.ContactPair(
        name="foot", contact=contact, tangential=("x", "y") if planar else "x", normal="z",
        rubbing=ss.RubbingMotion(velocity=v if planar else v[0]),
    )  # fmt: skip
    loads = [ss.Load(dof="x", sin=load), ss.Load(dof="y", cos=across), ss.Load(dof="z", cos=20.0)]
    return ss.Problem(body, contacts=pair, loads=loads, harmonics=range(orders + 1))


@pytest.mark.parametrize(("gap", "v"), [(-0.3, (1.0, 2.0)), pytest.param(-1.5, (0.0, 0.0), marks=pytest.mark.verify)])
def test_it_is_what_stiff_modes_tend_to(gap: float, v: tuple[float, float]) -> None:
    exact = ss.transient(problem(structure(), gap=gap, v=v), 6.0)
    assert exact.converged
    off = []
    for stiff in (120.0, 240.0):
        near = ss.transient(problem(structure(stiff), gap=gap, v=v), 6.0, tolerance=1e-8)
        off.append([np.abs(getattr(near, of) - getattr(exact, of)).max() for of in ("amplitude", "mean", "power")])
    ratio = np.array(off[0]) / off[1]
    assert np.all((ratio > 3.3) & (ratio < 5.0)), ratio  # the square of two
    assert np.all(np.array(off[1]) < [0.002, 2e-4, 0.05]), off


def straight(law: type, gap: float, v: float) -> ss.Problem:
    body = structure(shapes=SHAPES * STRAIGHT, residual=RESIDUAL * STRAIGHT)
    return problem(body, law=law, gap=gap, v=(v, 0.0), across=0.0)


@pytest.mark.parametrize(
    ("gap", "v"), [(-0.3, 2.0), *(pytest.param(*at, marks=pytest.mark.verify) for at in ((-1.5, 0.0), (-1.5, 2.0)))]
)
def test_along_a_line_it_is_the_contact_of_one_direction(gap: float, v: float) -> None:
    one, two = (ss.transient(straight(law, gap, v), 6.0) for law in (ss.FrictionContact, ss.PlanarFrictionContact))
    np.testing.assert_allclose(two.coefficients, one.coefficients, atol=1e-9)
    np.testing.assert_allclose(two.power, one.power, rtol=1e-9)
    shares = one.fractions.copy()
    shares[:, 2:] = shares[:, 2:].sum(), 0.0
    np.testing.assert_allclose(two.fractions, shares, atol=1e-6)
