from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from slipstick.results.modes import mode_values


def test_values_of_a_mode():
    detail = SimpleNamespace(amplitude=2.0, omega=5.0, xi=0.4)
    found = mode_values([detail], scale=0.5, force=8.0)
    assert found["modal_damping"] == pytest.approx([0.04])
    assert found["load_factor"] == pytest.approx([0.4 * 5.0 * 2.0 / 0.25 / 8.0])
    assert np.isnan(mode_values([detail], scale=0.5, force=0.0)["load_factor"][0])
