"""Prescribed normal motion of the opposing surface: run-out and lobed casings, against time integration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.faults import raises_fault

import slipstick as ss


def rubbed(*, normal: bool, harmonics=range(31), **motion) -> ss.Problem:
    """Two dofs, a contact that rubs along x; along y it can give way, or not."""
    K = np.array([[40.0, -5.0], [-5.0, 60.0]])
    structure = ss.MatrixStructure(M=np.eye(2), C=0.02 * K, K=K, dofs=["x", "y"])
    pair = ss.ContactPair(
        name="tip", contact=ss.FrictionContact(kt=30.0, mu=0.3, kn=50.0, gap=0.1), tangential="x",
        normal="y" if normal else None, rubbing=ss.RubbingMotion(velocity=3.0, **motion),
    )  # fmt: skip
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=4.0)], harmonics=harmonics)


LOBES = {"normal_cos": {0: 0.05, 2: 0.4}, "normal_sin": {1: 0.1}}


@pytest.mark.parametrize("normal", [True, False])
def test_balance_agrees_with_time_integration(normal: bool) -> None:
    """A two-lobed casing that opens and closes the contact twice a period."""
    branch = ss.forced_response(rubbed(normal=normal, **LOBES), omega=(2.0, 12.0))
    assert branch.outcome.ok
    separated = branch.dataset.separation_fraction.values
    assert separated.min() < 0.9
    assert separated.max() > 0.1
    for point in np.linspace(3, len(branch) - 1, 7).astype(int):
        check = branch.check_in_time(int(point))
        assert check.converged
        assert check.relative_difference < 2e-4


def test_a_constant_approach_closes_the_gap() -> None:
    """``normal_cos = {0: d}`` is a gap smaller by d, exactly."""
    near = rubbed(normal=True, normal_cos={0: 0.3})
    closed = rubbed(normal=True).with_parameter("tip.gap", 0.1 - 0.3)
    a, b = (ss.forced_response(p, omega=(2.0, 12.0)).dataset for p in (near, closed))
    assert a.displacement.values == pytest.approx(b.displacement.values, abs=1e-12)


def test_the_normal_motion_is_added_to_the_relative_one() -> None:
    """``F(X, Y; normal motion N) = F(X, Y + N)``."""
    h, rng = ss.Harmonics(range(5)), np.random.default_rng(0)
    X, Y = rng.normal(size=(2, h.size))
    contact = ss.FrictionContact(kt=3.0, mu=0.4, kn=2.0, gap=-0.3)
    rub = ss.RubbingMotion(velocity=2.0, cos={1: 0.5}, **LOBES)
    N = np.zeros(h.size)
    N[0], N[h.index(2, "c")], N[h.index(1, "s")] = 0.05, 0.4, 0.1
    a = ss.contact_forces(contact, h, X, Y, omega=3.0, rubbing=rub)
    b = ss.contact_forces(contact, h, X, Y + N, omega=3.0, rubbing=replace(rub, normal_cos={}, normal_sin={}))
    assert np.array_equal(a.Fx, b.Fx)
    assert np.array_equal(a.Fy, b.Fy)
    assert not np.allclose(a.Fx, ss.contact_forces(contact, h, X, Y, omega=3.0).Fx)


def test_components_are_followed() -> None:
    """The lobes grow from nothing until the blade rubs."""
    branch = ss.parameter_response(rubbed(normal=True, normal_cos={2: 0.0}), "tip.normal_cos2", (0.0, 0.5), omega=4.0)
    assert branch.outcome.ok
    data = branch.dataset
    assert data.normal_motion.sel(contact="tip", coefficient="c2").values == pytest.approx(data.parameter.values)
    assert data.separation_fraction.values[0, 0] == 1.0
    assert data.separation_fraction.values[-1, 0] < 0.9
    assert data.parameter.attrs["units"] == "length"
    again = ss.forced_response(rubbed(normal=True, normal_cos={2: 0.5}), omega=(4.0, 4.5))
    assert data.displacement.values[-1] == pytest.approx(again.dataset.displacement.values[0], abs=1e-8)


def test_orders_must_be_kept() -> None:
    with raises_fault("contact", "tip", "rubbing", "normal_cos", says="harmonic 7 is not among the harmonics kept"):
        rubbed(normal=True, harmonics=range(5), normal_cos={7: 0.1})
