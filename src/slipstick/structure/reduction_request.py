"""What a reduction is asked for: directions, loads, accuracy and damping, and what is wrong with the request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from slipstick.errors import InputError
from slipstick.structure.checks import DAMPING_ELSEWHERE, number_faults, real

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Damping:
    """Damping of the reduced structure.

    ``loss_factor`` (hysteretic) and ``damping_ratio`` (viscous) are one number or one for each mode; ``rayleigh`` is
    (alpha, beta) of ``C = alpha M + beta K``, in 1/s and s.
    """

    loss_factor: float | Array = 0.0
    damping_ratio: float | Array = 0.0
    rayleigh: tuple[float, float] = (0.0, 0.0)

    def ratios(self, omega: Array) -> float | Array:
        """Viscous damping ratio of each mode: ``zeta + alpha / (2 omega) + beta omega / 2``."""
        alpha, beta = self.rayleigh
        if alpha == beta == 0.0:
            return self.damping_ratio
        return np.asarray(self.damping_ratio + 0.5 * alpha / omega + 0.5 * beta * omega)

    def problems(self) -> list[str]:
        """One sentence for each negative or non-finite value."""
        values = {"loss_factor": self.loss_factor, "damping_ratio": self.damping_ratio, "rayleigh": self.rayleigh}
        return [
            f"{name} = {value} must be finite and not negative"
            for name, value in values.items()
            if not (np.isfinite(value).all() and np.min(value) >= 0.0)
        ]


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How many modes: a fixed number, or as many as keep the receptance's relative error up to ``highest`` (rad/s)."""

    modes: int | None = None
    relative: float = 1e-7
    highest: float | None = None


def number_or_array(value: float | ArrayLike) -> float | Array:
    """A float or a float array."""
    array = real(value)
    return array if array.ndim else float(array)


def require_real(K: Any, M: Any, **values: Any) -> None:
    """Raises InputError where matrices or other values (by name) are complex or not numbers."""
    faults = number_faults("the stiffness matrix", K, DAMPING_ELSEWHERE)
    faults += number_faults("the mass matrix", M, DAMPING_ELSEWHERE)
    for name, value in values.items():
        faults += number_faults(name, value)
    if faults:
        raise InputError(faults)


def as_csr(A: Any) -> Any:
    """Any matrix of real numbers, sparse or dense, stored by rows."""
    return real(A).tocsr() if sparse.issparse(A) else sparse.csr_array(real(A))


def request_problems(K: Any, want: Accuracy, frequency_range: tuple[float, float] | None) -> list[str]:
    """One sentence for each wish that cannot be fulfilled."""
    problems = []
    if want.modes is not None and not 1 <= want.modes <= K.shape[0]:
        problems.append(f"modes = {want.modes} is not to be had from {K.shape[0]} dofs; ask for 1 to {K.shape[0]}")
    if not 0.0 < want.relative < 1.0:
        problems.append(f"accuracy = {want.relative} is no relative error; give one such as 1e-7")
    if frequency_range is not None:
        ends = np.asarray(frequency_range, dtype=float)
        if ends.shape != (2,) or not np.isfinite(ends).all() or ends.min() < 0.0 or ends.max() == 0.0:
            problems.append(f"frequency_range = {frequency_range} must be two angular frequencies >= 0 (rad/s)")
    return problems


def kept_directions(
    n: int, keep: Any, dofs: Sequence[str] | None, names: Sequence[str] | None
) -> tuple[Any, tuple[str, ...], list[str]]:
    """Directions (n, n_keep) sparse by columns, their names, and what is wrong with them."""
    if sparse.issparse(keep) or (isinstance(keep, np.ndarray) and keep.dtype.kind not in "UO"):
        faults = number_faults("keep", keep)
        if faults:
            return None, (), faults
        matrix = sparse.csc_array(real(keep))
        kept = tuple(names or ())
        if matrix.shape[0] != n:
            faults.append(f"keep has {matrix.shape[0]} rows, the matrices have {n}; give one row for each dof")
        if len(kept) != matrix.shape[1] or len(set(kept)) != len(kept):
            faults.append(f"{matrix.shape[1]} directions need as many different names; {len(set(kept))} were given")
        if not np.isfinite(matrix.data).all():
            faults.append("keep holds a value that is not finite")
        return matrix, kept, faults
    kept = (keep,) if isinstance(keep, str) else tuple(keep)
    if dofs is None:
        return (
            None,
            kept,
            ["keep gives names, but the dofs of the matrices have none; give dofs or a matrix of directions"],
        )
    position = {name: index for index, name in enumerate(dofs)}
    unknown = [name for name in kept if name not in position]
    faults = [f"dof '{name}' to keep is not in the model; its names look like {_examples(dofs)}" for name in unknown]
    if not kept or len(set(kept)) != len(kept):
        faults.append("keep must name at least one dof, each once")
    if faults or len(dofs) != n:
        return None, kept, faults or [f"{len(dofs)} dof names for matrices of {n} rows; give the map of these matrices"]
    rows = [position[name] for name in kept]
    return sparse.csc_array((np.ones(len(rows)), (rows, range(len(rows)))), shape=(n, len(rows))), kept, []


def _examples(dofs: Sequence[str]) -> str:
    return ", ".join(f"'{name}'" for name in list(dofs)[:3])


def load_columns(n: int, shapes: Mapping[str, ArrayLike]) -> tuple[Array, list[str]]:
    """Load vectors as columns (n, n_loads), and what is wrong with them."""
    faults: list[str] = []
    columns: list[Array] = []
    for name, vector in shapes.items():
        wrong = number_faults(f"load shape '{name}'", vector)
        if wrong:
            faults += wrong
            continue
        column = real(vector).reshape(-1)
        columns.append(column)
        if column.shape != (n,):
            faults.append(f"load shape '{name}' has {column.size} entries, the matrices {n}; give one for each dof")
        elif not np.isfinite(column).all() or not column.any():
            faults.append(f"load shape '{name}' is zero or not finite; give forces")
    if faults or not columns:
        return np.zeros((n, 0)), faults
    return np.column_stack(columns), faults
