"""Names for the arrays of this package."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Real numbers; docstrings give shapes."""

ComplexArray = NDArray[np.complex128]
"""Complex numbers."""
