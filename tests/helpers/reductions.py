"""How far reductions are from their full models."""

from __future__ import annotations

import numpy as np

from slipstick.structure.reduction.reduce import Reduction, receptance_error
from slipstick.typing import Matrix, Reals


def receptance_errors(reduction: Reduction, K: Matrix, M: Matrix, frequencies: Reals) -> dict[float, float]:
    """``receptance_error`` by frequency (rad/s)."""
    structure, directions = reduction.structure, reduction.directions
    return {
        omega: receptance_error(structure, directions, K, M, omega)
        for omega in np.atleast_1d(np.asarray(frequencies, dtype=float)).tolist()
    }
