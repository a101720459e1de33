"""The dense Jacobian is what its parts say, column by column."""

import numpy as np
import pytest
from helpers.problems import random_problem

from slipstick.balance.balance import Balance
from slipstick.balance.jacobian_backends import BACKENDS

BALANCE = Balance(random_problem(0))
RNG = np.random.default_rng(0)


@pytest.mark.parametrize("sprung", [False, True])
def test_the_jacobian_is_one_plus_the_compliance_times_the_tangents(sprung, monkeypatch):
    """With springs ``i k`` taken off the forces the compliance is the anchored one."""
    monkeypatch.setattr(BALANCE, "springs", np.linspace(1.0, 3.0, BALANCE.n_ports) if sprung else None)
    compliance = BALANCE.compliance(6.0)
    count, L = BALANCE.n_contacts, BALANCE.L
    tangents = [{key: RNG.normal(size=(count, L, L)) for key in ((0, 0), (0, 1), (1, 1), (1, 0))}]
    found = BACKENDS["dense"].jacobian(BALANCE, tangents, compliance).matrix
    for _ in range(5):
        dx = RNG.normal(size=BALANCE.size)
        moved = BALANCE.layout.spread(dx)[0]
        forces = {}
        for (i, j), tangent in tangents[0].items():
            part = np.einsum("cij,cj->ci", tangent, moved[j])
            forces[i] = forces.get(i, 0.0) + part
        G = BALANCE.layout.excitation([forces])
        BALANCE.anchor(dx, G)
        answer = compliance.answer(G)
        np.testing.assert_allclose(found @ dx, dx + answer, atol=1e-12)
