"""Names for the arrays of this package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.sparse import sparray

Array = NDArray[np.float64]
"""Real numbers; docstrings give shapes."""

ComplexArray = NDArray[np.complex128]
"""Complex numbers."""

IntArray = NDArray[np.int64]
"""Labels, indices, counts."""

BoolArray = NDArray[np.bool_]
"""Marks."""

AnyArray = NDArray[Any]
"""Numbers of any kind, marks or texts."""

Sparse: TypeAlias = "sparray"
"""A sparse array of scipy, which has no types of its own."""

Matrix: TypeAlias = "Array | Sparse"
"""A dense or a sparse matrix."""

Names: TypeAlias = "str | Sequence[str] | None"
"""One name, several, or None for all that there are."""
