"""The linear limits of a case: their largest amplitudes do not depend on how fast the machine is."""

from __future__ import annotations

import numpy as np
import pytest

import slipstick as ss
from slipstick.analysis.curve import linear
from slipstick.balance.balance import Balance


@pytest.mark.parametrize("seconds", [1e-9, 2.0])
@pytest.mark.parametrize("zeta", [0.001, 0.05])
def test_the_largest_amplitudes_are_those_of_the_closed_form(
    seconds: float, zeta: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(linear, "_SECONDS", seconds)
    k, kt, F = 40.0, 100.0, 2.0
    structure = ss.MatrixStructure(M=[[1.0]], C=[[2 * zeta * np.sqrt(k)]], K=[[k]], dofs=["x"])
    pair = ss.ContactPair(name="damper", contact=ss.FrictionContact(kt=kt, mu=0.3, normal_load=800.0), tangential="x")
    problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=F)], harmonics=range(6))
    found = dict(linear.linear_references(Balance(problem), (2.0, 15.0)))
    for label, stiffness in {"without contact": k, "stuck": k + kt}.items():
        own = zeta * np.sqrt(k / stiffness)
        data = found[label].dataset
        assert float(data.amplitude.max()) == pytest.approx(F / (2 * stiffness * own * np.sqrt(1 - own**2)), rel=1e-4)
        top = float(data.omega[int(data.amplitude.sel(dof="x").argmax("point"))])
        assert top == pytest.approx(np.sqrt(stiffness * (1 - 2 * own**2)), rel=1e-4)
        assert np.all(np.diff(data.omega) > 0)
