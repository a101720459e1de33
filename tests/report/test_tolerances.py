from __future__ import annotations

import numpy as np
from helpers.figures import branch
from helpers.reports import decoded

from slipstick.analysis.sensitivity.tolerances import amplitude_band
from slipstick.report.content import bands_of, content_of, what_matters

SHARES = {"c0.mu": 0.2, "load": 0.05}


def test_bands_are_those_of_the_results():
    own, kept = branch(), np.array([0, 2])
    found = bands_of(own, kept, SHARES)
    expected = amplitude_band(own, "x2", SHARES)
    assert np.allclose(decoded(found["high"]).reshape(-1, 2)[:, 1], expected.high, rtol=1e-5)
    assert np.allclose(decoded(found["low"]).reshape(-1, 2)[:, 1], expected.low, rtol=1e-5)
    assert found["said"] == "c0.mu \N{PLUS-MINUS SIGN}20 %, load \N{PLUS-MINUS SIGN}5 %"


def test_what_matters_is_a_row_for_each_dof():
    ((head, text),) = what_matters(branch(), np.array([0]), SHARES)
    assert head == "largest amplitude of x0 with tolerances"
    assert text.count("%") == 2


def test_a_page_without_tolerances_has_none():
    assert "bands" not in content_of(branch(), "a", contacts=1, dofs=1)
    assert "bands" in content_of(branch(), "a", contacts=1, dofs=1, tolerances=SHARES)
