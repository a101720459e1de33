"""Linear constraints between degrees of freedom, eliminated: ``u = T q``, ``K -> T' K T``.

An equation is ``sum_i c_i u_i = 0``. Equations are taken one after the other; in each, what earlier ones have made
dependent is replaced, and one dof that is left becomes dependent. So chains of any length come out, T is sparse, and
for each motion q all equations hold exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from scipy.sparse import coo_array, csr_array

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import one
from slipstick.typing import Array, IntArray, Matrix

_NEGLIGIBLE = 1e-12
"""Coefficient, over the largest of its equation, that is rounding of a cancellation."""


class Dependent(Enum):
    """Which dof of an equation becomes dependent."""

    FIRST = "the first one; a dof that is dependent twice, or on itself, is refused"
    ANY = "whichever is left"
    YIELDING = "the first one; where that is constrained or dependent already, the equation does not apply"


@dataclass(frozen=True, kw_only=True)
class Equation:
    """``sum coefficients[i] u[dofs[i]] = 0``; ``where`` names its origin in messages."""

    dofs: tuple[int, ...]
    coefficients: tuple[float, ...]
    where: str | Where = "an equation"
    dependent: Dependent = Dependent.FIRST


@dataclass(frozen=True, kw_only=True)
class Elimination:
    """The motions that a set of equations leaves.

    Attributes
    ----------
    T
        Sparse (n, n_q): all dofs from the independent ones.
    independent
        Which dofs are q, ascending, (n_q,).
    dependent
        The others that may move, ascending; rows of T.
    zero
        Dofs that are held, or that the equations leave no motion, ascending.
    idle
        Number of equations that were redundant, or did not apply because their dof was dependent, by origin.
    """

    T: csr_array
    independent: IntArray
    dependent: IntArray
    zero: IntArray
    idle: Mapping[str | Where, int] = field(default_factory=dict)

    def reduce(self, matrix: Matrix) -> csr_array:
        """``T' A T``, exactly symmetric for a symmetric A."""
        reduced = csr_array(self.T.T @ csr_array(matrix) @ self.T)
        return csr_array((reduced + reduced.T) * 0.5)

    def forces(self, columns: Matrix) -> Matrix:
        """``T' f``: loads or directions (n, ...) on q."""
        return self.T.T @ columns

    def motion(self, q: Array) -> Array:
        """``T q``: motion of all dofs (n, ...)."""
        return np.asarray(self.T @ q)


def eliminate(
    size: int, equations: Iterable[Equation], held: Iterable[int] = (), *, name: Callable[[int], str] = "dof {}".format
) -> Elimination:
    """Resolve equations between ``size`` dofs, of which some are held at zero.

    Raises
    ------
    InputError
        For dofs out of range, coefficients that are not finite, a dof that is made dependent twice or depends on
        itself: with the origin of the equation.

    Examples
    --------
    Dof 0 follows the mean of 1 and 2, dof 3 moves twice as far as dof 0:

    >>> mean = Equation(dofs=(0, 1, 2), coefficients=(1.0, -0.5, -0.5))
    >>> lever = Equation(dofs=(3, 0), coefficients=(1.0, -2.0))
    >>> eliminate(4, [lever, mean]).T.toarray().tolist()
    [[0.5, 0.5], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    """
    zero = {int(dof) for dof in held}
    checked = [one("equations", equation, Equation, "an Equation") for equation in equations]
    faults = [fault for equation in checked for fault in _faults(equation, size)]
    faults += [Fault("held", f"there is no dof {dof}") for dof in zero if not 0 <= dof < size]
    if faults:
        raise InputError(faults)
    order = (Dependent.FIRST, Dependent.ANY, Dependent.YIELDING)
    resolver = _Resolver(zero, name)
    for equation in sorted(checked, key=lambda e: order.index(e.dependent)):
        resolver.take(equation)
    if resolver.faults:
        raise InputError(resolver.faults)
    return _elimination(size, resolver)


def _faults(equation: Equation, size: int) -> list[Fault]:
    if len(equation.dofs) != len(equation.coefficients) or not equation.dofs:
        counts = f"{len(equation.dofs)} dofs and {len(equation.coefficients)} coefficients"
        return [Fault(equation.where, found=counts, expected="as many of each, at least one")]
    wrong = [dof for dof in equation.dofs if not 0 <= dof < size]
    faults = [Fault(equation.where, f"there is no dof {dof}; it is one of 0 to {size - 1}") for dof in wrong[:1]]
    if not all(np.isfinite(equation.coefficients)):
        faults.append(Fault(equation.where, "a coefficient is not finite"))
    return faults


_Row = dict[int, float]


class _Resolver:
    """Dependent dofs as combinations of others, which later equations may make dependent too."""

    def __init__(self, zero: set[int], name: Callable[[int], str]) -> None:
        self.zero = zero
        self.name = name
        self.rows: dict[int, _Row] = {}
        self.stated: dict[int, str | Where] = {}
        self.idle: dict[str | Where, int] = {}
        self.faults: list[Fault] = []

    def take(self, equation: Equation) -> None:
        row: _Row = {}
        for dof, value in zip(equation.dofs, equation.coefficients, strict=True):
            row[dof] = row.get(dof, 0.0) + value
        first = equation.dofs[0]
        taken = first in self.zero or first in self.rows
        left = self.resolved(row)
        if not left or (taken and equation.dependent is Dependent.YIELDING):
            self.idle[equation.where] = self.idle.get(equation.where, 0) + 1
        elif equation.dependent is Dependent.ANY or first in self.zero:
            self.settle(max(left, key=lambda dof: abs(left[dof])), left, equation)
        elif not taken and first in left and np.isclose(left[first], row[first], rtol=1e-9, atol=0.0):
            self.settle(first, left, equation)
        elif equation.dependent is Dependent.YIELDING:
            self.idle[equation.where] = self.idle.get(equation.where, 0) + 1
        else:
            self.faults.append(self.fault(equation, taken))

    def fault(self, equation: Equation, taken: bool) -> Fault:
        name = self.name(equation.dofs[0])
        if taken:
            what = f"makes {name} dependent, which {self.stated[equation.dofs[0]]} has done otherwise"
        else:
            others = sorted({str(self.stated[dof]) for dof in equation.dofs[1:] if dof in self.rows})
            if not sum(
                v for dof, v in zip(equation.dofs, equation.coefficients, strict=True) if dof == equation.dofs[0]
            ):
                return Fault(
                    equation.where, f"makes {name} dependent with the coefficient 0", remedy="put another first"
                )
            what = f"makes {name} depend on itself, through {', '.join(others) or 'its own terms'}"
        return Fault(equation.where, what, remedy="write equations whose first dofs differ and form no ring")

    def settle(self, dof: int, left: _Row, equation: Equation) -> None:
        """``dof`` as a combination of the others."""
        pivot = left.pop(dof)
        self.stated[dof] = equation.where
        if left:
            self.rows[dof] = {other: -value / pivot for other, value in left.items()}
        else:
            self.zero.add(dof)

    def resolved(self, row: _Row) -> _Row:
        """The combination in dofs that are neither held nor dependent."""
        scale = max(abs(value) for value in row.values())
        row = {dof: value for dof, value in row.items() if value}
        while dependent := [dof for dof in row if dof in self.rows]:
            row = dict(row)
            for dof in dependent:
                value = row.pop(dof)
                for other, factor in self.rows[dof].items():
                    row[other] = row.get(other, 0.0) + value * factor
        return {dof: v for dof, v in row.items() if dof not in self.zero and abs(v) > _NEGLIGIBLE * scale}


def _elimination(size: int, resolver: _Resolver) -> Elimination:
    # the last ones depend on none before them: in that order each row is resolved once
    for dof in reversed(list(resolver.rows)):
        resolver.rows[dof] = resolver.resolved(resolver.rows[dof])
    zero = np.array(sorted(resolver.zero), dtype=np.int64)
    free = np.ones(size, dtype=bool)
    free[zero] = False
    free[list(resolver.rows)] = False
    independent = np.flatnonzero(free)
    place = np.cumsum(free) - 1
    entries = [(dof, other, value) for dof, row in resolver.rows.items() for other, value in row.items()]
    rows, columns, values = np.array(entries, dtype=float).reshape(-1, 3).T
    i = np.concatenate([independent, rows.astype(np.int64)])
    j = np.concatenate([place[independent], place[columns.astype(np.int64)]])
    T = csr_array(
        coo_array((np.concatenate([np.ones(len(independent)), values]), (i, j)), shape=(size, len(independent)))
    )
    dependent = np.array(sorted(resolver.rows), dtype=np.int64)
    return Elimination(T=T, independent=independent, dependent=dependent, zero=zero, idle=resolver.idle)
