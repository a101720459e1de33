"""Linear references against closed forms and against dense solutions of the full matrices."""

import numpy as np
import pytest

import slipstick as ss
from slipstick.errors import InputError
from slipstick.verify.cases import oscillator

W = np.array([2.0, 6.0, 9.0, 14.0])


@pytest.mark.parametrize(("state", "k"), [("free", 40.0), ("stuck", 140.0)])
def test_oscillator(state, k):
    found = ss.linear_response(oscillator(velocity=10.0), omega=W, state=state).dataset["amplitude"][:, 0]
    np.testing.assert_allclose(found, 100.0 / np.abs(k - W**2 + 0.4j * W), rtol=1e-12)


def test_stuck_is_the_structure_with_springs_that_the_counter_surface_moves():
    K = np.array([[40.0, -5.0], [-5.0, 60.0]])
    C = 0.02 * K
    structure = ss.MatrixStructure(M=np.eye(2), C=C, K=K, dofs=["x", "y"])
    law = ss.FrictionContact(kt=30.0, mu=0.3, kn=50.0, gap=-0.1)
    rub = ss.RubbingMotion(cos={1: 0.4}, normal_cos={1: 0.02})
    pair = ss.ContactPair(name="tip", contact=law, tangential="x", normal="y", rubbing=rub)
    p = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=4.0)], harmonics=range(6))
    found = ss.linear_response(p, omega=W, state="stuck").dataset["displacement"].to_numpy()
    springs = np.diag([30.0, 50.0])
    for n, w in enumerate(W):
        push = np.array([-4.0j, 0.0]) - springs @ [0.4, 0.02]
        answer = np.linalg.solve(K + springs - w**2 * np.eye(2) + 1j * w * C, push)
        np.testing.assert_allclose(found[n, :, 1] - 1j * found[n, :, 2], answer, atol=1e-12)
        np.testing.assert_allclose(found[n, :, 0], np.linalg.solve(K + springs, [0.0, -50.0 * 0.1]), atol=1e-12)
        np.testing.assert_allclose(found[n, :, 3:], 0.0, atol=1e-14)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"omega": [1.0], "state": "slipping"}, 'expected "free" or "stuck"'),
        ({"omega": []}, "frequencies > 0"),
        ({"omega": [1.0, -2.0]}, "frequencies > 0"),
        ({"omega": [[1.0]]}, "frequencies > 0"),
    ],
)
def test_what_cannot_be_asked(options, said):
    with pytest.raises(InputError, match=said):
        ss.linear_response(oscillator(velocity=1.0), **options)
