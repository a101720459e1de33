from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.analysis.modes.nonlinear_modes import mode_values


def test_values_of_a_mode():
    """One mode of mass-normalised shape: a load of phasor p peaks where |p| = xi w |q| (phase resonance)."""
    detail = SimpleNamespace(amplitude=2.0, omega=5.0, xi=0.4, modal=np.array([0.0, 4.0j]))
    found = mode_values([detail], np.array([3.0, 8.0]))
    assert found["modal_amplitude"] == pytest.approx([2.0])
    assert found["modal_damping"] == pytest.approx([0.04])
    assert found["load_factor"] == pytest.approx([0.4 * 5.0 * 4.0 / 8.0])
    assert np.isnan(mode_values([detail], np.array([3.0, 0.0]))["load_factor"][0])
