"""Names for the arrays of this package."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from scipy.sparse import sparray, spmatrix

    from slipstick.trig.harmonics import Harmonics

    class DrawnAxes(Axes):
        """Axes in a figure of their own, which has ``savefig``."""

        @property
        def figure(self) -> Figure:  # noqa: D102
            ...

else:
    DrawnAxes = Any  # matplotlib is loaded where something is drawn

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

Sparse: TypeAlias = "sparray | spmatrix"
"""A sparse array of scipy, which has no types of its own."""

Matrix: TypeAlias = "Array | Sparse"
"""A dense or a sparse matrix."""


class Tabular(Protocol):
    """What numpy makes an array of, such as an ``xarray.DataArray`` or a ``pandas.Series``."""

    def __array__(self) -> NDArray[Any]:
        """The array."""
        ...


Real: TypeAlias = "float | np.floating[Any] | np.integer[Any]"
"""One number that a user gives; Python's whole numbers are floats to a type checker."""

RealArray: TypeAlias = "NDArray[np.floating[Any]] | NDArray[np.integer[Any]] | Tabular"
"""Numbers in an array."""

Numbers: TypeAlias = "float | Array"
"""What becomes of them where one number or one for each element, (n,), is kept."""

Reals: TypeAlias = "Real | RealArray | Sequence[Real | RealArray | Sequence[Real | RealArray]]"
"""Real numbers that a user gives: one, or lists and arrays of them; docstrings give shapes. Texts are none."""


class SparseLike(Protocol):
    """A sparse array or matrix of scipy, told by what it can do."""

    def tocsc(self) -> Any:
        """By columns."""
        ...


Temperature: TypeAlias = "Reals | Mapping[str, float] | str"
"""A temperature everywhere, or by node set or surface ("all" is the rest), or of each node of a mesh (n_nodes,); or the
name of a load step of the file that gives it."""

MatrixLike: TypeAlias = "Reals | SparseLike"
"""A matrix that a user gives: rows of numbers, an array, a sparse array."""

Frequency: TypeAlias = "Real | str"
"""A frequency that a user gives: rad/s, or a text such as "15 Hz", "3000 rpm"."""

FrequencyRange: TypeAlias = "tuple[Frequency, Frequency]"
"""First and last frequency."""

FrequencyList: TypeAlias = "Frequency | Iterable[Frequency] | NDArray[np.floating[Any]]"
"""One frequency, or several."""

Orders: TypeAlias = "Iterable[int] | int | str | Harmonics"
"""Harmonics that a user gives: orders, a count, or a text such as "0..10"."""

Points: TypeAlias = "int | Sequence[int] | NDArray[np.integer[Any]] | None"
"""Numbers of points, one or several, or None for all that there are."""

Names: TypeAlias = "str | Sequence[str] | None"
"""One name, several, or None for all that there are."""
