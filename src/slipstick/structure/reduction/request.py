"""What a reduction is asked for: directions, loads, accuracy and damping, and what is wrong with the request."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import (
    LARGEST,
    Gathering,
    enumerated,
    in_radians,
    number,
    number_or_numbers,
    numbers,
    path,
    shown,
    text,
    truth,
    whole,
    wrong,
)
from slipstick.faults import names as name_list
from slipstick.solve.linear.modes import StageListener
from slipstick.structure.checks import DAMPING_ELSEWHERE, entry_faults, named_shapes, number_faults, real, within_range
from slipstick.typing import Array, Matrix


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


@dataclass(frozen=True, kw_only=True)
class Accuracy:
    """How many modes: a fixed number, or as many as keep the receptance's relative error up to ``highest`` (rad/s).

    With neither, as many as keep its estimate up to ten times the first natural frequency and up to ``reach`` (rad/s),
    and 128 at most.
    """

    modes: int | None = None
    relative: float = 1e-7
    highest: float | None = None
    reach: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Request:
    """What a reduction is asked for, checked: directions (n, n_keep) sparse by columns, loads (n, n_loads), names."""

    directions: Matrix
    kept: tuple[str, ...]
    dofs: tuple[str, ...] | None
    loads: Array
    load_names: tuple[str, ...]
    want: Accuracy
    frequency_range: tuple[float, float] | None
    damping: Damping
    force: bool
    solver: str | None
    cache: str | Path | None
    listener: StageListener | None
    residuals: str = "auto"


RESIDUALS = ("auto", "written", "solved")
"""How what the modes leave out is applied."""


def checked_request(
    n: int,
    *,
    keep: Any,
    dofs: Any = None,
    names: Any = None,
    load_shapes: Any = None,
    modes: Any = None,
    accuracy: Any = 1e-7,
    frequency_range: Any = None,
    loss_factor: Any = 0.0,
    damping_ratio: Any = 0.0,
    rayleigh: Any = (0.0, 0.0),
    force: Any = False,
    solver: Any = None,
    cache: Any = None,
    listener: Any = None,
    residuals: Any = "auto",
    reach: float = 0.0,
) -> Request:
    """The request for matrices of n rows; raises InputError with every fault. Arguments are those of ``reduce``."""
    faults = Gathering()
    either = "a number, or one for each mode"
    damping = {
        "loss_factor": faults.take(non_negative, "loss_factor", loss_factor),
        "damping_ratio": faults.take(number_or_numbers, "damping_ratio", damping_ratio, either),
        "rayleigh": faults.take(_pair, "rayleigh", rayleigh, "two numbers >= 0, in 1/s and s"),
    }
    expected = "two angular frequencies >= 0 (rad/s), not both 0"
    ends = None if frequency_range is None else faults.take(_range, frequency_range, expected)
    modes = None if modes is None else faults.take(whole, "modes", modes, 1, n)
    accuracy = faults.take(relative_error, "accuracy", accuracy)
    dofs = None if dofs is None else faults.take(name_list, "dofs", dofs, "the name of each dof, in order")
    names = None if names is None else faults.take(name_list, "names", names, "a name for each direction")
    shapes = named_shapes(load_shapes, faults.faults)
    kept = faults.take(_kept_directions, n, keep, dofs, names)
    loads = faults.take(_shape_columns, n, shapes)
    faults.take(truth, "force", force)
    faults.take(tools, solver, cache, listener)
    faults.take(residuals_kind, residuals)
    faults.end()
    assert kept is not None
    assert loads is not None
    assert accuracy is not None
    return Request(
        directions=kept[0],
        kept=kept[1],
        dofs=dofs,
        loads=loads,
        load_names=tuple(shapes),
        want=Accuracy(modes=modes, relative=accuracy, highest=None if ends is None else max(ends), reach=reach),
        frequency_range=ends,
        damping=Damping(**cast(Any, damping)),
        force=force,
        solver=solver,
        cache=cache,
        listener=listener,
        residuals=residuals,
    )


def residuals_kind(residuals: Any) -> str:
    """One of ``RESIDUALS``."""
    if not isinstance(residuals, str) or residuals not in RESIDUALS:
        raise wrong("residuals", residuals, '"auto", "written" or "solved"')
    return residuals


def non_negative(name: str, value: Any) -> float | Array:
    """One number >= 0, or one for each mode."""
    values: float | Array = number_or_numbers(name, value, "a number >= 0, or one for each mode")
    if np.any(np.asarray(values) < 0.0):
        raise wrong(name, value, "a number >= 0, or one for each mode")
    return values


def _range(ends: Any, expected: str) -> tuple[float, float]:
    """Two frequencies, rad/s, numbers or texts."""
    name = "frequency_range"
    values = [in_radians(name, end) for end in ends] if isinstance(ends, list | tuple) else ends
    return _pair(name, values, expected, some=True)


def _pair(name: str, value: Any, expected: str, some: bool = False) -> tuple[float, float]:
    """Two numbers >= 0, one of them (``some``) above."""
    ends = numbers(name, value, expected)
    if ends.shape != (2,) or ends.min() < 0.0 or (some and ends.max() == 0.0):
        raise wrong(name, value, expected)
    return float(ends[0]), float(ends[1])


def relative_error(name: str, value: Any) -> float:
    """A number between 0 and 1."""
    expected = "a relative error between 0 and 1, such as 1e-7"
    share = number(name, value, expected)
    if not 0.0 < share < 1.0:
        raise wrong(name, value, expected)
    return share


def tools(solver: Any, cache: Any, listener: Any) -> None:
    """Raise InputError unless these are of their kinds, or None."""
    if solver is not None:
        text("solver", solver, "the name of a solver, or None")
    if cache is not None:
        path("cache", cache, "a folder, or None")
    if listener is not None and not callable(listener):
        raise wrong("listener", listener, "a function of the progress, or None")


def real_matrices(K: Matrix, M: Matrix) -> tuple[Any, Any]:
    """Stiffness and mass stored by rows; raises InputError where they are complex or no matrices of numbers."""
    faults = []
    for name, A in (("the stiffness matrix", K), ("the mass matrix", M)):
        wrong_numbers = number_faults(name, A, DAMPING_ELSEWHERE)
        faults += wrong_numbers
        if not wrong_numbers and np.ndim(A) != 2:
            faults.append(Fault(name, found=f"shape {np.shape(A)}", expected="a square matrix"))
    if faults:
        raise InputError(faults)
    return as_csr(K), as_csr(M)


def as_csr(A: Matrix) -> Any:
    """Any matrix of real numbers, sparse or dense, stored by rows."""
    return real(A).tocsr() if sparse.issparse(A) else sparse.csr_array(real(A))


def _kept_directions(
    n: int, keep: Any, dofs: Sequence[str] | None, names: Sequence[str] | None
) -> tuple[Any, tuple[str, ...]]:
    """Directions (n, n_keep) sparse by columns, and their names."""
    if sparse.issparse(keep) or (isinstance(keep, np.ndarray) and keep.dtype.kind not in "UO"):
        return _given_directions(n, keep, tuple(names or ()))
    kept = name_list("keep", keep, "names of dofs, or a matrix of directions (numpy or scipy.sparse)")
    if dofs is None:
        unnamed = "names are given, but the dofs of the matrices have none"
        raise InputError(Fault("keep", unnamed, remedy="give dofs or a matrix of directions"))
    position = {name: index for index, name in enumerate(dofs)}
    unknown = [name for name in kept if name not in position]
    faults = [
        Fault("keep", f"there is no dof {shown(name)}", remedy=f"there are {enumerated(dofs)}") for name in unknown[:20]
    ]
    if not kept or len(set(kept)) != len(kept):
        faults.append(Fault("keep", found=shown(list(kept)), expected="the names of one dof or more, each once"))
    if len(dofs) != n:
        sizes = f"{len(dofs)} names for matrices of {n} rows"
        faults.append(Fault("dofs", sizes, remedy="give the map of these matrices"))
    if faults:
        raise InputError(faults)
    rows = [position[name] for name in kept]
    return sparse.csc_array((np.ones(len(rows)), (rows, range(len(rows)))), shape=(n, len(rows))), kept


def _given_directions(n: int, keep: Any, names: tuple[str, ...]) -> tuple[Any, tuple[str, ...]]:
    """The same of a matrix of directions."""
    faults = number_faults("keep", keep)
    if not faults and keep.ndim != 2:
        faults = [Fault("keep", found=f"shape {keep.shape}", expected=f"({n}, number of directions), or names of dofs")]
    if faults:
        raise InputError(faults)
    matrix = sparse.csc_array(real(keep))
    if matrix.shape[0] != n:
        height = f"has {matrix.shape[0]} rows, the matrices have {n}"
        faults.append(Fault("keep", height, remedy="give one row for each dof"))
    if len(names) != matrix.shape[1] or len(set(names)) != len(names):
        needed = f"{matrix.shape[1]} directions need as many different names"
        faults.append(Fault("names", needed, found=str(len(set(names)))))
    faults += entry_faults("keep", matrix.data)
    if faults:
        raise InputError(faults)
    return matrix, names


def _shape_columns(n: int, shapes: Mapping[str, ArrayLike]) -> Array:
    """Load vectors as columns (n, n_loads)."""
    faults: list[Fault] = []
    columns = [np.zeros((n, 0))]
    for name, vector in shapes.items():
        where = ("load shape", name)
        if wrong := number_faults(where, vector):
            faults += wrong
            continue
        column = real(vector).reshape(-1)
        columns.append(column)
        if column.shape != (n,):
            sizes = f"has {column.size} entries, the matrices {n}"
            faults.append(Fault(where, sizes, remedy="give one for each dof"))
        elif not within_range(column) or not column.any():
            faults.append(Fault(where, f"is zero, not finite or above {LARGEST:g}", remedy="give forces"))
    if faults:
        raise InputError(faults)
    return np.column_stack(columns)
