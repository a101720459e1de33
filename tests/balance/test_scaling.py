"""Sizes of a problem follow its units; linear motions solve the linear problems they name."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.scaling import linear_motions, scales


def oscillator(*, length=1.0, force=1.0, gap=-800.0, p=100.0, v=10.0):
    """Stiffness is force over length."""
    k = force / length
    structure = ss.MatrixStructure(M=[[k]], C=[[0.4 * k]], K=[[40.0 * k]], dofs=["x"])
    contact = ss.FrictionContact(kt=100.0 * k, mu=0.3, kn=k, gap=gap * length)
    pair = ss.ContactPair(name="damper", contact=contact, tangential="x", rubbing=ss.RubbingMotion(velocity=v * length))
    return ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=p * force)], harmonics=range(4))


@pytest.mark.parametrize(("length", "force"), [(1e-3, 1.0), (1.0, 1e6), (25.4, 4.448)])
def test_sizes_follow_the_units(length, force):
    one, other = oscillator(), oscillator(length=length, force=force)
    a, b = (scales(Balance(p), p.inputs, 5.0) for p in (one, other))
    assert b.displacement == pytest.approx(length * a.displacement, rel=1e-12)
    assert b.velocity == pytest.approx(length * a.velocity, rel=1e-12)


@pytest.mark.filterwarnings("ignore::slipstick.errors.SlipstickWarning")
def test_without_anything_that_moves_one_is_one():
    problem = oscillator(p=0.0, v=0.0, gap=1.0)
    assert scales(Balance(problem), problem.inputs, 5.0).displacement == 1.0


def test_linear_motions_are_those_of_springs():
    """Free: k - w^2 m + i w c; stuck: kt besides; sliding at constant load: a mean force mu N besides."""
    problem, w = oscillator(), 5.0
    balance = Balance(problem)
    found = linear_motions(balance, problem.inputs, balance.compliance(w), w)
    assert set(found) == {"sliding", "stuck", "free"}
    for name, k, mean in (("free", 40.0, 0.0), ("stuck", 140.0, 0.0), ("sliding", 40.0, -240.0 / 40.0)):
        x = found[name]
        answer = 100.0 / (k - w**2 + 0.4j * w)  # to sin
        assert x[0] == pytest.approx(mean, abs=1e-12)
        assert x[1] == pytest.approx(answer.imag, rel=1e-12)
        assert x[2] == pytest.approx(answer.real, rel=1e-12)
        np.testing.assert_allclose(x[3:], 0.0, atol=1e-14)
