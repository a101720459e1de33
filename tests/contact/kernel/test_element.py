"""One element: its forces are the coefficients of the force in time; compiled and interpreted it is the same."""

import numpy as np
import pytest
from helpers.elements import SEEDS, H, element, evaluated, given, marched, motion, tuples

from slipstick.contact.forces import element_forces


@pytest.mark.parametrize("seed", SEEDS)
def test_compiled_and_interpreted_it_is_the_same(seed):
    inputs = given(seed)
    out, _, _ = evaluated(inputs)
    names = ("v", "kt", "mu", "kn", "gap")
    f = element_forces(
        H, inputs.X[None], inputs.Y[None], **{n: inputs.parameters[i : i + 1] for i, n in enumerate(names)}
    )
    vectors = (f.Fx, f.Fy, f.dFx_dv, f.dFx_dmu, f.dFx_dkt, f.dFx_dkn, f.dFy_dkn)
    np.testing.assert_allclose(out.vectors, np.concatenate(vectors), atol=1e-12)
    np.testing.assert_allclose(out.matrices, np.concatenate([f.dFx_dX, f.dFx_dY, f.dFy_dY]), atol=1e-12)
    assert out.scalars[tuples.S_WORK] == pytest.approx(f.work[0], abs=1e-12)


@pytest.mark.parametrize("seed", SEEDS)
def test_forces_are_the_coefficients_of_the_force_in_time(seed):
    inputs = given(seed)
    out, k, total = evaluated(inputs)
    if total == 1 and k.intervals.code[0, 0] == tuples.STICK:
        pytest.skip("stuck all period: the march stops anywhere within the residual traction")
    t, friction = marched(inputs)
    normal = inputs.parameters[tuples.P_KN] * np.maximum(motion(inputs, t)[1], 0.0)
    weights = np.full(t.size, t[1] / np.pi)
    weights[[0, -1]] *= 0.5
    for row, force in ((tuples.V_FX, friction), (tuples.V_FY, normal)):
        np.testing.assert_allclose(out.vectors[row], (weights * force) @ H.H_plus(t), atol=2e-3)
    velocity = inputs.parameters[tuples.P_V] + H.H_minus(t) @ H.derivative(inputs.X)
    assert out.scalars[tuples.S_WORK] == pytest.approx(float((weights * friction) @ velocity) / 2, abs=3e-3)


def test_weights_of_states_are_one_for_what_a_state_does():
    found = {state: element.weights(state) for state in range(4)}
    assert found[tuples.SEPARATION] == (0.0, 0.0, 0.0)
    assert found[tuples.STICK] == (1.0, 0.0, 1.0)
    assert found[tuples.SLIP_PLUS] == (0.0, 1.0, 1.0)
    assert found[tuples.SLIP_MINUS] == (0.0, -1.0, 1.0)
