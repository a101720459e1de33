"""Options out of their range are named, all at once."""

import numpy as np
import pytest

from slipstick.errors import InputError
from slipstick.solve.newton import NewtonOptions


def test_all_at_once():
    with pytest.raises(InputError) as caught:
        NewtonOptions(tolerance=0.0, max_iterations=0, min_damping=2.0, non_monotone=-1, stagnation=1.0)
    assert len(caught.value.sentences) == 5
    with pytest.raises(InputError, match="tolerance"):
        NewtonOptions(tolerance=np.nan)
