"""Linear constraints between degrees of freedom, eliminated: ``u = T q``, ``K -> T' K T``.

An equation is ``sum_i c_i u_i = 0``. Equations are taken one after the other; in each, what earlier ones have made
dependent is replaced, and one dof that is left becomes dependent. So chains of any length come out, T is sparse, and
for each motion q all equations hold exactly. Equations whose first dof is taken wait: what they say of the dofs that
are left is solved by a factorisation with pivoting, for each set of them that have dofs in common.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components

from slipstick.errors import Fault, InputError, Where
from slipstick.faults import one
from slipstick.typing import Array, IntArray, Matrix

_NEGLIGIBLE = 1e-12
"""Coefficient, over the largest of its equation, that is rounding of a cancellation."""

_SAID_AGAIN = 1e-9
"""The same of all that an equation says when others are replaced in it: positions in files have some ten digits."""

_LARGEST = 50_000_000
"""Coefficients of equations that are solved together."""


class Dependent(Enum):
    """Which dof of an equation becomes dependent."""

    FIRST = "the first one; where that is constrained or dependent already, whichever pivoting chooses"
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
        For dofs out of range, coefficients that are not finite, and equations that leave a dof no motion although it
        is not held: with the origins of the equations.

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
    for kind in order:
        for equation in checked:
            if equation.dependent is kind:
                resolver.take(equation)
        resolver.take_waiting()
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

_NAMED = 5
"""Origins that a message names beside the first."""


def _row(equation: Equation) -> _Row:
    row: _Row = {}
    for dof, value in zip(equation.dofs, equation.coefficients, strict=True):
        row[dof] = row.get(dof, 0.0) + value
    return row


def _parts(rows: list[tuple[Equation, _Row]]) -> Iterator[list[tuple[Equation, _Row]]]:
    """Equations that have dofs in common, directly or through others."""
    dofs = [dof for _, row in rows for dof in row]
    if not dofs:
        return
    number = np.repeat(np.arange(len(rows)), [len(row) for _, row in rows])
    _, place = np.unique(dofs, return_inverse=True)
    size = len(rows) + place.max() + 1
    graph = coo_array((np.ones(len(dofs)), (number, len(rows) + place)), shape=(size, size))
    count, part = connected_components(graph, directed=False)
    parts: list[list[tuple[Equation, _Row]]] = [[] for _ in range(count)]
    for row, i in zip(rows, part[: len(rows)].tolist(), strict=True):
        parts[i].append(row)
    yield from filter(None, parts)


class _Resolver:
    """Dependent dofs as combinations of others, which later equations may make dependent too."""

    def __init__(self, zero: set[int], name: Callable[[int], str]) -> None:
        self.zero = zero
        self.name = name
        self.rows: dict[int, _Row] = {}
        self.stated: dict[int, list[Equation]] = {}
        self.waiting: list[Equation] = []
        self.idle: dict[str | Where, int] = {}
        self.faults: list[Fault] = []

    def take(self, equation: Equation) -> None:
        row = _row(equation)
        first = equation.dofs[0]
        taken = first in self.zero or first in self.rows
        left = self.resolved(row)
        if not left or (taken and equation.dependent is Dependent.YIELDING):
            self.rest(equation)
        elif equation.dependent is Dependent.ANY or first in self.zero:
            self.settle(max(left, key=lambda dof: abs(left[dof])), left, [equation])
        elif not taken and first in left and np.isclose(left[first], row[first], rtol=1e-9, atol=0.0):
            self.settle(first, left, [equation])
        elif equation.dependent is Dependent.YIELDING:
            self.rest(equation)
        elif not row[first]:
            what = f"makes {self.name(first)} dependent with the coefficient 0"
            self.faults.append(Fault(equation.where, what, remedy="put another first"))
        else:
            self.waiting.append(equation)

    def rest(self, equation: Equation) -> None:
        """An equation that says nothing new, or does not apply."""
        self.idle[equation.where] = self.idle.get(equation.where, 0) + 1

    def settle(self, dof: int, left: _Row, equations: list[Equation]) -> None:
        """``dof`` as a combination of the others."""
        pivot = left.pop(dof)
        self.stated[dof] = equations
        if left:
            self.rows[dof] = {other: -value / pivot for other, value in left.items()}
        else:
            self.zero.add(dof)

    def take_waiting(self) -> None:
        """Solve the equations whose first dof was taken, by parts that have dofs in common."""
        waiting = [(equation, self.news(equation)) for equation in self.waiting]
        self.waiting = []
        for equation, row in waiting:
            if not row:
                self.rest(equation)
        for part in _parts([(equation, row) for equation, row in waiting if row]):
            self.solve([equation for equation, _ in part], [row for _, row in part])

    def solve(self, equations: list[Equation], rows: list[_Row]) -> None:
        """Dependent dofs of equations between what is left, by QR with column pivoting."""
        from scipy.linalg import qr, solve_triangular

        dofs = sorted({dof for row in rows for dof in row})
        if len(rows) * len(dofs) > _LARGEST:
            what = f"and others are {len(rows)} equations between {len(dofs)} dofs that depend on others already"
            self.faults.append(Fault(equations[0].where, what, remedy="take out those that say the same"))
            return
        place = {dof: i for i, dof in enumerate(dofs)}
        matrix = np.zeros((len(rows), len(dofs)))
        for i, (equation, row) in enumerate(zip(equations, rows, strict=True)):
            scale = max(map(abs, equation.coefficients))
            for dof, value in row.items():
                matrix[i, place[dof]] = value / scale
        triangle, pivots = qr(matrix, mode="r", pivoting=True)
        rank = int(np.sum(np.abs(np.diag(triangle)) > _SAID_AGAIN))
        following = -solve_triangular(triangle[:rank, :rank], triangle[:rank, rank:])
        following[np.abs(following) <= _NEGLIGIBLE * np.abs(following).max(initial=0.0)] = 0.0
        for equation in equations[rank:]:
            self.rest(equation)  # one of those that say it; which one is a matter of order
        others = pivots[rank:].tolist()
        for pivot, values in zip(pivots[:rank].tolist(), following, strict=True):
            left = {dofs[i]: -float(value) for i, value in zip(others, values, strict=True) if value}
            if not left and not any(self.held(equation) for equation in equations):
                self.faults.append(self.stuck(dofs[pivot], equations))
                return
            self.settle(dofs[pivot], {dofs[pivot]: 1.0, **left}, equations)

    def held(self, equation: Equation) -> bool:
        """Whether a dof of an equation is zero, or follows one that is."""
        return any(dof in self.zero for one in self.behind([equation]) for dof in one.dofs)

    def behind(self, equations: list[Equation]) -> list[Equation]:
        """These equations and those that made their dofs dependent, in turn."""
        found = {id(equation): equation for equation in equations}
        new = [*equations]
        while new:
            dofs = {dof for equation in new for dof in equation.dofs}
            new = [e for dof in dofs for e in self.stated.get(dof, ()) if id(e) not in found]
            found |= {id(equation): equation for equation in new}
        return [*found.values()]

    def stuck(self, dof: int, equations: list[Equation]) -> Fault:
        """The fault of equations that hold a dof."""
        places = list(dict.fromkeys(str(equation.where) for equation in self.behind(equations)))
        more = f" and {len(places) - _NAMED - 1} more" if len(places) > _NAMED + 1 else ""
        others = ", ".join(places[1 : _NAMED + 1])
        what = f"leaves {self.name(dof)} no motion, although nothing holds it"
        what += f", together with {others}{more}" if others else ""
        return Fault(equations[0].where, what, remedy="take one of them out, or hold the dof by a support")

    def news(self, equation: Equation) -> _Row:
        """What an equation says of dofs that are neither held nor dependent; nothing where it is rounding."""
        row = self.resolved(_row(equation))
        largest = max(map(abs, row.values()), default=0.0)
        return row if largest > _SAID_AGAIN * max(map(abs, equation.coefficients)) else {}

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
