"""From points to variables: outputs that are ports and outputs that are not are one motion."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import FrequencySystem
from slipstick.results.record import Outputs, Point, Recorder

OMEGA = 3.0


def problem(outputs=("x", "y")):
    """The contact moves along x and along twice y: a port of y alone, with a cosine that is not 1."""
    K = np.array([[40.0, -5.0], [-5.0, 60.0]])
    structure = ss.MatrixStructure(M=np.eye(2), C=0.02 * K, K=K, dofs=["x", "y"])
    law = ss.FrictionContact(kt=30.0, mu=0.3, kn=50.0, gap=-0.1)
    rub = ss.RubbingMotion(velocity=3.0, cos={1: 0.2})
    pair = ss.ContactPair(name="tip", contact=law, tangential="x", normal={"y": 2.0}, rubbing=rub)
    return ss.Problem(
        structure, contacts=[pair], loads=[ss.Load(dof="x", sin=4.0)], harmonics=range(6), outputs=list(outputs)
    )


@pytest.fixture(scope="module")
def solved():
    """A solution by Newton on the residual itself."""
    p = problem()
    balance = Balance(p)
    system, x = FrequencySystem(balance, p.inputs), np.zeros(balance.size)
    for _ in range(30):
        value = system.evaluate(x, OMEGA)
        x = x - np.linalg.solve(value.jacobian.matrix, value.residual)
    return (
        p,
        balance,
        Point.at(value.detail, x=x, residual=1e-12, iterations=3, kind="start", parameter=OMEGA, peak_of=""),
    )


def test_motion_of_outputs_solves_the_equations_of_motion(solved):
    p, balance, point = solved
    found = Recorder(balance).record(point)
    q, h, s = found["displacement"], p.harmonics, p.structure
    F = np.stack([found["friction_force"][0], 2.0 * found["normal_force"][0]])
    load = np.zeros_like(q)
    load[0, h.index(1, "s")] = 4.0
    np.testing.assert_allclose(s.K @ q[:, 0], (load - F)[:, 0], atol=1e-11)
    for j, m in enumerate(h.orders[1:]):
        Z = s.K - (m * OMEGA) ** 2 * s.M + 1j * m * OMEGA * s.C
        hat = (load - F)[:, 2 * j + 1] - 1j * (load - F)[:, 2 * j + 2]
        np.testing.assert_allclose(Z @ (q[:, 2 * j + 1] - 1j * q[:, 2 * j + 2]), hat, atol=1e-10)


def test_ports_and_receptances_give_the_same_outputs(solved):
    p, balance, point = solved
    outputs = Outputs(balance, ["x", "y"])
    assert outputs.receptance is None
    far = ss.MatrixStructure(M=p.structure.M, C=p.structure.C, K=p.structure.K, dofs=["x", "y"])
    turned = ss.ContactPair(
        name="tip", contact=p.contacts[0].contact, tangential={"x": 1.0, "y": 1e-90}, normal={"y": 2.0, "x": 1e-90},
        rubbing=p.contacts[0].rubbing,
    )  # fmt: skip
    other = Balance(ss.Problem(far, contacts=[turned], loads=p.loads, harmonics=p.harmonics, outputs=["x", "y"]))
    by_forces = Recorder(other).record(point)["displacement"]
    np.testing.assert_allclose(by_forces, Recorder(balance).record(point)["displacement"], atol=1e-11)


def test_variables_are_those_of_the_layout(solved):
    _, balance, point = solved
    recorder = Recorder(balance)
    found = recorder.record(point)
    assert set(found) == set(recorder.layout.variables)
    for name, value in found.items():
        assert np.shape(value) == tuple(recorder.layout.shape(name))
    assert found["newton_iterations"] == 3
    np.testing.assert_allclose(found["contact_normal"][0], 2.0 * found["displacement"][1])
    assert recorder.values([])["omega"].shape == (0,)
