"""Order of the harmonic truncation against the exact periodic motion: 3 (kinks of the friction force)."""

import numpy as np
import pytest

from slipstick.verify.cases import EXACT_OSCILLATOR
from slipstick.verify.oscillator_checks import truncation_error


@pytest.mark.parametrize(("velocity", "omega"), sorted(EXACT_OSCILLATOR))
def test_error_falls_with_third_order(velocity, omega):
    highest = np.array([7, 10, 14, 20, 28, 40])
    errors = truncation_error(velocity, omega, highest)
    order = -np.polyfit(np.log(highest), np.log(errors), 1)[0]
    assert order == pytest.approx(3.0, abs=0.4)
    assert 5e-5 < errors[1] < 6e-4
    assert errors[-1] < 7e-6
