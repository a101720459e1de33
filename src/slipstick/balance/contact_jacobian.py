"""The matrix-free Jacobian ``I + A dF/dX`` of many contacts, and its preconditioner.

The forces of an element depend on its own motion only, so ``dF/dX`` has a block for each element, and ``A`` consists of
a few modes and residuals. The preconditioner is ``P = D + U W``. ``D = I + A_own dF/dX`` of the single elements has
blocks. ``U W`` holds, exactly, the modes that couple the elements most: ``U`` is their motion at the ports, ``W`` their
excitation by it. P is inverted by Woodbury's formula.

Where contacts are stiff, as clamped ones are, those that stick are first replaced by springs K on the structure (see
``StuckStructure``): ``J = (I + A K) (I + A_K E)`` with ``E = dF/dX - K``. E is zero at contacts that stick or are open
all through the period, so the second factor is solved for the others alone: D and U W stand for it, with ``A_K`` for A
and E for dF/dX. The first factor is inverted as a whole.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache, cached_property
from itertools import pairwise
from math import log10
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor
from scipy.linalg.lapack import dgetrs

from slipstick.balance.compliance import FactoredCompliance, coefficients
from slipstick.balance.stuck_structure import SHARE, STICKING
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.solve.linear.jacobian import Jacobian
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance
    from slipstick.balance.layout import Tangents
    from slipstick.balance.stuck_structure import Attached, SpringCompliance, StuckStructure
    from slipstick.state.contact_state import Carried

# Preconditioner.
MAX_EXACT = 264
"""Coefficients of modes that are held exactly: 24 modes with the harmonics 0 to 5."""
_MIN_GAIN = 0.03
"""Gain of a mode through all contacts below which it is left out: it hardly moves an eigenvalue from 1."""
_COST = 10.0
"""Cost of making a preconditioner in products (measured at 300 and 1000 contacts: 11)."""
_SPARED, _FEW = 1.25, 8
"""Ratio and number of elements that springs of a neighbouring Jacobian may leave more than springs of its own would."""
_ZERO = 1e-10
"""Difference of the tangent of an element to its springs, over the stiffness of stuck contacts, that is zero."""
_CHUNK = 256
"""Elements whose forces by all modes are computed together: bounds the memory."""


@cache
def _blocks() -> ModuleType:
    """The compiled products, loaded with the first Jacobian: reading and checking a case needs none."""
    from slipstick.balance.kernel import blocks

    return blocks


class Blocks:
    """Elements by their port numbers (n, p), -1 where there is none, and products with blocks (n, p L, p L) of them.

    Numbers at the ports are (n_ports + 1, L), the last row zero.
    """

    def __init__(self, rows: NDArray[np.intp], L: int) -> None:
        self.rows, self.shape = rows, (*rows.shape, L)

    def stiffness(self, blocks: Array) -> Array:
        """Largest entry of blocks (n, p L, p L) at each port, (n, p)."""
        return np.asarray(np.abs(blocks).max(axis=2).reshape(self.shape).max(axis=2))

    def multiply(self, blocks: Array, X: Array, out: Array, *, transposed: bool = False) -> None:
        """Write blocks (n, p L, p L) times ``X`` to the rows of the elements; the last row of ``out`` means nothing."""
        _blocks().blocks_times(blocks, self.rows, X, out, transposed)


class Elements(Blocks):
    """The elements of one batch with ``dF/dX`` (n, p L, p L).

    Those that move together are one here: their forces add up.
    """

    def __init__(self, balance: Balance, k: int, tangents: Mapping[tuple[int, int], Array]) -> None:
        batch, L = balance.batches[k], balance.L
        n, p = batch.count, len(batch.ports)
        self._each, self._group = batch.rows.T, np.arange(n)
        rows = self._each
        if batch.shared:
            rows, group = np.unique(self._each, axis=0, return_inverse=True)
            self._group = group.ravel()
        super().__init__(rows, L)
        tangent = np.zeros((n, p, L, p, L))
        for (i, j), part in tangents.items():
            tangent[:, i, :, j, :] = part * self._here(i, j)
        self.tangent = self._together(tangent.reshape(n, p * L, p * L))
        self.local = self.tangent  # by the element's own motion, contact states included
        self.fed_back: tuple[Array, Array, Array] | None = None

    def _here(self, *ports: int) -> Array:
        return np.asarray(np.all(self._each[:, list(ports)] >= 0, axis=1), dtype=float)[:, None, None]

    def _together(self, each: Array) -> Array:
        """Numbers of the elements, (n, ...), added up where these move together."""
        if len(self.rows) == len(each):
            return each
        out = np.zeros((len(self.rows), *each.shape[1:]))
        np.add.at(out, self._group, each)
        return out

    def feed_back(self, carried: Carried) -> None:
        """Add the effect of a state: powers by motion (n, p L), gain (n, n), forces by the state (n, p L)."""
        n, (_, p, L) = len(self._each), self.shape
        power, force = np.zeros((n, p, L)), np.zeros((n, p, L))
        for j, part in carried.power.by_motion.items():
            power[:, j] = part * self._here(j)[:, 0]
        for i, part in carried.force_by_value.items():
            force[:, i] = part * self._here(i)[:, 0]
        rows, columns, gain = power.reshape(n, -1), force.reshape(n, -1), carried.gain
        self.fed_back = rows, gain, columns
        own = np.diag(gain)[:, None, None] * columns[:, :, None] * rows[:, None, :]
        self.local = self.tangent + self._together(own)

    def beyond(self, springs: Array) -> Array:
        """``dF/dX`` by the element's own motion less springs at the ports (n_ports,), (n, p L, p L)."""
        _, p, L = self.shape
        out = self.local.copy()
        out[:, np.arange(p * L), np.arange(p * L)] -= np.repeat(self._along(springs), L, axis=1)
        return out

    def _along(self, springs: Array) -> Array:
        """Springs at the ports (n_ports,) by element, (n, p)."""
        return np.asarray(np.append(springs, 0.0)[self.rows])

    def differ(self, beyond: Array, stuck: Array) -> NDArray[np.bool_]:
        """Which elements (n,) have blocks (n, p L, p L) that are not zero, beside a stiffness (n_ports,)."""
        return np.asarray(np.abs(beyond).max(axis=(1, 2)) > _ZERO * self._along(stuck).max(axis=1))

    def shares(self, stuck: Array, out: Array) -> int:
        """Write shares of springs (n_ports,) to numbers (n_ports + 1,); the number of elements that are no springs.

        All where an element sticks through the period, none where it is open or mostly slips, else a part.
        """
        own, slipping = self._along(stuck), self.differ(self.local, stuck)
        held = ~self.differ(self.beyond(stuck), stuck)
        mean = np.einsum("nkk->nk", self.local).reshape(self.shape).mean(axis=2)
        out[self.rows] = np.where(held[:, None], 1.0, np.where(mean >= STICKING * own, SHARE, 0.0))
        return int(np.count_nonzero(slipping & ~held))

    def forces(self, X: Array, out: Array, *, transposed: bool = False, sizes: bool = False) -> None:
        """Write ``dF/dX X``, or with the transpose, or with the sizes of all entries, likewise."""
        self.multiply(np.abs(self.tangent) if sizes else self.tangent, X, out, transposed=transposed)
        if self.fed_back is not None:
            rows, gain, columns = map(np.abs, self.fed_back) if sizes else self.fed_back
            if transposed:
                rows, gain, columns = columns, gain.T, rows
            q = X[self._each].reshape(len(self._each), -1)
            fed = (gain @ np.einsum("nk,nk->n", rows, q))[:, None] * columns
            out[self.rows] += self._together(fed).reshape(self.shape)


class Preconditioner:
    """The preconditioner of one Jacobian; raises numpy's LinAlgError where it is singular.

    ``P^-1 = D^-1 (1 - U C^-1 W D^-1)`` with ``C = 1 + W D^-1 U``.

    Parameters
    ----------
    elements, tangents
        Batches and what stands for their ``dF/dX``.
    compliance
        Between the ports of these.
    attached
        The structure with springs at which these are; None where contacts are soft.
    ports
        Numbers of the ports among all.

    Attributes
    ----------
    by_digit
        Most products per digit of a solution with the Jacobian that it was made for.
    """

    def __init__(
        self,
        elements: Sequence[Blocks],
        tangents: Sequence[Array],
        compliance: FactoredCompliance,
        attached: Attached | None = None,
        ports: NDArray[np.intp] | None = None,
    ) -> None:
        self._elements, self.by_digit = elements, 0.0
        self.attached, self.ports = attached, ports
        sign = 1 if attached is None else attached.sign
        exact = _exact_modes(elements, tangents, compliance)
        self._set_modes(exact, compliance)
        self._inverse, self._forces = list[Array](), list[Array]()
        C = np.zeros((self._size, self._size))
        for batch, tangent in zip(elements, tangents, strict=True):
            D = _own_blocks(compliance.local(batch.rows, exact), tangent)
            sign *= int(np.prod(np.linalg.slogdet(D)[0]))
            inverse = np.asarray(np.linalg.inv(D), dtype=float)
            self._inverse.append(inverse)
            self._forces.append(tangent @ inverse)
            self._add_modal_forces(batch, self._forces[-1], C)
        C = self._weighted(C)
        C.reshape(-1)[:: len(C) + 1] += 1.0
        self._lu = lu_factor(C, check_finite=False)
        swaps = np.count_nonzero(self._lu[1] != np.arange(len(C)))
        negative = np.count_nonzero(self._lu[0].diagonal() < 0.0)
        self.sign: int = 0 if np.any(self._lu[0].diagonal() == 0.0) else (-sign if (swaps + negative) % 2 else sign)

    def record(self, by_digit: float) -> None:
        """Record the products per digit of a solution with the Jacobian that it was made for."""
        self.by_digit = max(self.by_digit, by_digit)

    def _set_modes(self, exact: NDArray[np.bool_], compliance: FactoredCompliance) -> None:
        """Order by order: the cosines of its modes, then their sines; harmonic 0 has one coefficient."""
        f, n = compliance.factors, compliance.n_rows
        order, modes = np.nonzero(exact)
        self._left, self._right = np.ascontiguousarray(f.left[:, modes]), np.ascontiguousarray(f.right[:n, modes])
        self._weight = f.weight[order, modes].conj()
        self._first = np.searchsorted(order, np.arange(len(exact) + 1))
        counts, static = np.diff(self._first), int(self._first[1])
        self._size = 2 * len(modes) - static
        self._cosine = np.arange(static, len(modes)) + self._first[order[static:]] - static
        self._sine = self._cosine + counts[order[static:]]

    def _coefficients(self) -> Iterator[tuple[int, slice, slice]]:
        """Each coefficient of the motion, the places of its modes among all of ``C``, and among the shapes."""
        static = self._first[1]
        for order, (begin, end) in enumerate(pairwise(self._first)):
            at, shapes = 2 * begin - static if order else 0, slice(begin, end)
            for coefficient in (2 * order - 1, 2 * order) if order else (0,):
                yield coefficient, slice(at, at + end - begin), shapes
                at += end - begin

    def _add_modal_forces(self, elements: Blocks, forces: Array, out: Array) -> None:
        """Add the modal forces (q, q) by the motion of the modes, from forces (n, p L, p L) of the elements."""
        n, p, L = elements.shape
        for first in range(0, n, _CHUNK):
            rows, part = elements.rows[first : first + _CHUNK], forces[first : first + _CHUNK]
            m, here = len(rows), (rows >= 0)[:, :, None]
            left, right = self._left[rows] * here, (self._right[rows] * here).reshape(m * p, -1)
            columns, answered = part.reshape(m, p * L, p, L), np.empty((m, p * L, self._size))
            for coefficient, at, shapes in self._coefficients():
                answered[:, :, at] = columns[:, :, :, coefficient] @ left[:, :, shapes]
            by_coefficient = answered.reshape(m, p, L, -1)
            for coefficient, at, shapes in self._coefficients():
                out[at] += right[:, shapes].T @ by_coefficient[:, :, coefficient].reshape(m * p, -1)

    def _weighted(self, f: Array, *, transposed: bool = False) -> Array:
        """Motion of the modes by modal forces (q, ...), or with the transpose."""
        out, static = np.empty_like(f), self._first[1]
        weight = self._weight.reshape(-1, *(1,) * (f.ndim - 1))
        out[:static] = weight[:static].real * f[:static]
        dynamic = weight[static:].conj() if transposed else weight[static:]
        z = dynamic * (f[self._cosine] + 1j * f[self._sine])
        out[self._cosine], out[self._sine] = z.real, z.imag
        return out

    def _solve_modes(self, f: Array, trans: int) -> Array:
        if not f.size:
            return f
        x: Array = dgetrs(*self._lu, f, trans=trans)[0]
        return x

    def solve(self, X: Array) -> Array:
        """``P^-1 X`` for values (n_ports + 1, L) of all ports, the last row zero, and of no meaning in the result."""
        out, forces, f = np.zeros_like(X), np.zeros_like(X), np.empty(self._size)
        for elements, blocks in zip(self._elements, self._forces, strict=True):
            elements.multiply(blocks, X, forces)
        _blocks().onto_modes(self._right, self._first, forces, f)
        rest = X.copy()
        _blocks().subtract_along_modes(self._left, self._first, self._solve_modes(self._weighted(f), 0), rest)
        for elements, inverse in zip(self._elements, self._inverse, strict=True):
            elements.multiply(inverse, rest, out)
        return out

    def solve_transposed(self, X: Array) -> Array:
        """``P^-T X``, likewise."""
        out, pulled, f = np.zeros_like(X), np.zeros_like(X), np.empty(self._size)
        for elements, inverse in zip(self._elements, self._inverse, strict=True):
            elements.multiply(inverse, X, out, transposed=True)
        _blocks().onto_modes(self._left, self._first, out, f)
        g, forces = self._weighted(self._solve_modes(f, 1), transposed=True), np.zeros_like(X)
        _blocks().subtract_along_modes(self._right, self._first, g, forces)
        for elements, blocks in zip(self._elements, self._forces, strict=True):
            elements.multiply(blocks, forces, pulled, transposed=True)
        return np.asarray(out + pulled)


class Departing:
    """The elements that are no springs of a structure with springs, by the ports that they have.

    With ``E = dF/dX - K``, zero at all others, and these ports a: ``I + A_K E`` is ``I + A_aa E`` for them alone, and
    the motion of the others follows from ``A_ia E``.

    Parameters
    ----------
    elements
        All batches.
    attached
        The structure with springs.
    stuck
        Stiffness (n_ports,) of contacts that stick.
    also
        Ports whose elements count among these in any case.

    Attributes
    ----------
    ports
        Numbers (m,) of the ports.
    count
        Number of elements.
    batches, tangents
        By the numbers of ``ports``, with ``E`` of each.
    """

    def __init__(
        self, elements: Sequence[Elements], attached: Attached, stuck: Array, also: NDArray[np.intp] | None = None
    ) -> None:
        n, self.L = len(stuck), elements[0].shape[2]
        marked, self.tangents, rows = np.zeros(n + 1, dtype=bool), list[Array](), list[NDArray[np.intp]]()
        if also is not None:
            marked[also] = True
        for batch in elements:
            beyond = batch.beyond(attached.springs)
            own = batch.differ(beyond, stuck) | marked[batch.rows].any(axis=1)
            if own.any():
                marked[batch.rows[own]] = True
                marked[-1] = False
                self.tangents.append(beyond[own])
                rows.append(batch.rows[own])
        self.ports, self.count = np.flatnonzero(marked), sum(map(len, rows))
        number = np.full(n + 1, -1)
        number[self.ports] = np.arange(len(self.ports))
        self.batches = [Blocks(number[own], self.L) for own in rows]

    def forces(self, X: Array, *, transposed: bool = False) -> Array:
        """``E X`` (m, L) for motion (m, L), or with the transpose."""
        given, out = np.vstack([X, np.zeros((1, self.L))]), np.zeros((len(X) + 1, self.L))
        for batch, tangent in zip(self.batches, self.tangents, strict=True):
            batch.multiply(tangent, given, out, transposed=transposed)
        return out[:-1]


def _exact_modes(
    elements: Sequence[Blocks], tangents: Sequence[Array], compliance: FactoredCompliance
) -> NDArray[np.bool_]:
    """Modes of each order that couple the ports most, (n + 1, n_modes)."""
    f, n = compliance.factors, compliance.n_rows
    stiffness = np.zeros(n + 1)
    for batch, tangent in zip(elements, tangents, strict=True):
        stiffness[batch.rows] = batch.stiffness(tangent)
    through = np.einsum("rm,rm,r->m", np.abs(f.left), np.abs(f.right[:n]), stiffness[:-1])
    gain = np.abs(f.weight) * through
    likeliest = np.argsort(-gain, axis=None, kind="stable")
    places = np.where(likeliest >= gain.shape[1], 2, 1)  # harmonic 0 has no sine
    chosen = likeliest[(np.cumsum(places) <= MAX_EXACT) & (gain.ravel()[likeliest] > _MIN_GAIN)]
    exact = np.zeros(gain.shape, dtype=bool)
    exact.reshape(-1)[chosen] = True
    return exact


def _own_blocks(local: ComplexArray, tangent: Array) -> Array:
    """``I + A_own dF/dX`` (n, p L, p L) of single elements."""
    n, p, _, orders = local.shape
    L = 2 * orders - 1
    F = tangent.reshape(n, p, L, p * L)
    out = np.empty((n, p, L, p * L))
    out[:, :, 0] = local[..., 0].real @ F[:, :, 0]
    z = (F[:, :, 1::2] + 1j * F[:, :, 2::2]).transpose(0, 2, 1, 3)
    moved = (local[..., 1:].transpose(0, 3, 1, 2) @ z).transpose(0, 2, 1, 3)
    out[:, :, 1::2], out[:, :, 2::2] = moved.real, moved.imag
    whole = out.reshape(n, p * L, p * L)
    whole[:, np.arange(p * L), np.arange(p * L)] += 1.0
    return whole


class ContactJacobian(IterativeJacobian):
    """``I + A dF/dX`` for a structure known by its modes.

    Parameters
    ----------
    tangents
        ``dF/dX`` by batch and port.
    """

    has_nearby = True
    _wasted: float | None = None
    """Extra products because the preconditioner was made for another Jacobian; None: it is its own."""
    _offered: Preconditioner | None = None
    """That of a neighbouring Jacobian."""
    _departing: Departing | None = None
    """With stiff contacts those that are no springs."""
    _with_springs: SpringCompliance
    """``A_K`` from and to their ports."""

    def __init__(
        self, balance: Balance, tangents: Tangents, compliance: FactoredCompliance, states: Sequence[Carried] = ()
    ) -> None:
        self._n_ports, self._L, self._compliance = balance.n_ports, balance.L, compliance
        self._stuck = balance.stuck(compliance.factors)
        if self._stuck is not None and not self._stuck.has_residual:
            self.has_nearby = False
        self._elements = [Elements(balance, k, tangent) for k, tangent in enumerate(tangents)]
        for carried in states:
            if not carried.state.slow:
                self._elements[carried.batch].feed_back(carried)
                self.has_nearby = self._stuck is None

    @property
    def size(self) -> int:
        """N."""
        return self._n_ports * self._L

    def _forces(self, x: Array, *, transposed: bool = False) -> Array:
        """``dF/dX x`` on all ports, (n_ports, L), or with the transpose."""
        return self._forces_and_none(x, transposed)[:-1]

    def _forces_and_none(self, x: Array, transposed: bool = False) -> Array:
        """The same with a row of zeros at the end."""
        X, out = self._rows(x), self._rows(None)
        for elements in self._elements:
            elements.forces(X, out, transposed=transposed)
        out[-1] = 0.0
        return out

    def _rows(self, x: Array | None) -> Array:
        """Values of all ports with a row of zeros at the end, (n_ports + 1, L)."""
        out = np.zeros((self._n_ports + 1, self._L))
        if x is not None:
            out[:-1] = x.reshape(self._n_ports, self._L)
        return out

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        if x.ndim == 2 and transposed:
            return np.column_stack([self.multiply(column, transposed=True) for column in x.T])
        if x.ndim == 2:
            return x + self._compliance.answers([_complex(self._forces(column), self._L) for column in x.T])
        if transposed:
            onto = self._compliance.transposed(_complex(x, self._L))[: self._n_ports]
            return x + self._forces(coefficients(onto).reshape(-1, self._L), transposed=True).ravel()
        return x + self._compliance.answer(_complex(self._forces(x), self._L))

    def nearby(self, x: Array) -> Array:
        """``J @ x`` without the coupling of elements by residuals, which decays fast with distance; for soft ones."""
        F, out = self._forces_and_none(x), self._rows(x)
        out[:-1] += coefficients(self._compliance.by_modes(_complex(F[:-1], self._L))).reshape(-1, self._L)
        for elements, residual in zip(self._elements, self._own_residuals, strict=True):
            _blocks().add_own(residual, elements.rows, F, out)
        return out[:-1].ravel()

    @cached_property
    def _own_residuals(self) -> list[ComplexArray]:
        """Compliance of the residuals of each element to itself, (n, p, p, n + 1)."""
        return [self._compliance.local_residual(elements.rows) for elements in self._elements]

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more: both coefficients of a harmonic get the sum of their sizes."""
        X, sizes = self._rows(np.abs(x)), self._rows(None)
        for elements in self._elements:
            elements.forces(X, sizes, sizes=True)
        G = _complex(sizes[:-1], self._L).real + _complex(sizes[:-1], self._L).imag
        by_order = self._compliance.bound_by_order(G)
        return np.abs(x) + np.hstack([by_order[:, :1], np.repeat(by_order[:, 1:], 2, axis=1)]).ravel()

    @cached_property
    def departing(self) -> NDArray[np.intp] | None:
        """See ``IterativeJacobian``: with stiff contacts the unknowns of those that are no springs."""
        if self._preconditioner is None or self._departing is None:
            return None
        return (self._departing.ports[:, None] * self._L + np.arange(self._L)).ravel()

    def departure(self, x: Array) -> Array:
        """``P_a^-1 (I + A_aa E) x - x`` for their motion."""
        return self._solved(x + coefficients(self._with_springs.own(self._forces_of(x)))) - x

    def spread(self, d: Array, *, alone: bool = False) -> Array:
        """Others move by what the forces of these change."""
        if alone or self._with_springs.every:
            return d
        out = -coefficients(self._with_springs.answer_to_own(self._forces_of(d)))
        out[self.departing] = d
        return out

    def spread_transposed(self, x: Array) -> Array:
        """The transpose."""
        assert self._departing is not None
        if self._with_springs.every:
            return x
        others = x.copy()
        others[self.departing] = 0.0
        pulled = self._with_springs.answer(_complex(others, self._L), transposed=True)[self._departing.ports]
        back = self._departing.forces(coefficients(pulled).reshape(-1, self._L), transposed=True)
        return np.asarray(x[self.departing] - back.ravel())

    def _forces_of(self, x: Array) -> ComplexArray:
        """``E x`` (m, n + 1) of the motion of the departing elements."""
        assert self._departing is not None
        return _complex(self._departing.forces(x.reshape(-1, self._L)), self._L)

    def _solved(self, x: Array, *, transposed: bool = False) -> Array:
        """``P_a^-1 x`` for the departing elements: that of elements which it does not have is one."""
        made = self._preconditioner
        assert made is not None
        assert made.ports is not None
        assert self._departing is not None
        solve, X = made.solve_transposed if transposed else made.solve, np.zeros((x.size // self._L + 1, self._L))
        X[:-1] = x.reshape(-1, self._L)
        if len(made.ports) == len(self._departing.ports):
            return solve(X)[:-1].ravel()
        places = np.append(np.searchsorted(self._departing.ports, made.ports), len(X) - 1)
        X[places] = solve(X[places])
        return X[:-1].ravel()

    def take_over(self, other: Jacobian) -> None:
        """Use the preconditioner of a neighbouring Jacobian."""
        super().take_over(other)
        if isinstance(other, ContactJacobian) and other.__dict__.get("_preconditioner") is not None:
            for name in ("_preconditioner", "departing"):
                self.__dict__.pop(name, None)
            self._offered, self._wasted = other._preconditioner, other._wasted or 0.0

    def took(self, products: int, tolerance: float) -> bool:
        """Make its own preconditioner once one taken over has cost as many extra products as making it."""
        if self._preconditioner is None:
            return False
        digits = -log10(tolerance)
        if self._wasted is None:
            self._preconditioner.record(products / digits)
            return False
        self._wasted += products - self._preconditioner.by_digit * digits
        if self._wasted <= _COST:
            return False
        for name in ("_preconditioner", "departing"):
            self.__dict__.pop(name, None)
        self._wasted = None
        return True

    @cached_property
    def _preconditioner(self) -> Preconditioner | None:
        """The preconditioner; None where it is singular."""
        try:
            if self._stuck is not None:
                return self._beside_springs(self._stuck)
            if self._wasted is not None:
                return self._offered
            return Preconditioner(self._elements, [batch.local for batch in self._elements], self._compliance)
        except np.linalg.LinAlgError:
            return None

    def _beside_springs(self, stuck: StuckStructure) -> Preconditioner:
        """That of the elements that are no springs; springs taken over are kept as long as they spare most of these."""
        factors, offered, shares = self._compliance.factors, self._offered, np.zeros(self._n_ports + 1)
        needed = sum(batch.shares(stuck.stuck, shares) for batch in self._elements)
        attached = departing = None
        if offered is not None and offered.attached is not None:
            attached = offered.attached
            departing = Departing(
                self._elements, attached, stuck.stuck, None if self._wasted is None else offered.ports
            )
        if departing is None or attached is None or departing.count > _SPARED * needed + _FEW:
            attached, self._wasted = stuck.at(shares[:-1]), None
            departing = Departing(self._elements, attached, stuck.stuck)
        self._departing = departing
        self._with_springs = stuck.compliance(attached, factors, departing.ports, near=not self.has_nearby)
        if offered is not None and self._wasted is not None:
            return offered
        near = attached.near(factors, departing.ports)
        return Preconditioner(departing.batches, departing.tangents, near, attached, departing.ports)

    @property
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P; 0 where it is singular."""
        return 0 if self._preconditioner is None else self._preconditioner.sign

    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` (N,), or with the transpose."""
        if self._preconditioner is None:
            return np.full(x.shape, np.nan)
        if self._departing is None:
            whole = self._preconditioner.solve_transposed if transposed else self._preconditioner.solve
            return whole(self._rows(x))[:-1].ravel()
        if transposed:
            out = x.copy()
            out[self.departing] = self._solved(self.spread_transposed(x), transposed=True)
            return coefficients(self._with_springs.released_transposed(_complex(out, self._L)))

        def solve(X: ComplexArray) -> ComplexArray:
            return _complex(self._solved(coefficients(X)), self._L)

        def forces(X: ComplexArray) -> ComplexArray:
            return self._forces_of(coefficients(X))

        return coefficients(self._with_springs.eliminated(_complex(x, self._L), solve, forces))

    def __repr__(self) -> str:
        return f"ContactJacobian({self.size})"


def _complex(X: Array, L: int) -> ComplexArray:
    """Coefficients (rows, L), or flat, as complex numbers (rows, n + 1)."""
    coefficients = X.reshape(-1, L)
    out = np.zeros((len(coefficients), L + 1))
    out[:, 0], out[:, 2:] = coefficients[:, 0], coefficients[:, 1:]
    return out.view(complex)
