"""A structure with springs in the place of its stuck contacts, for the preconditioner of stiff contacts.

With springs K along the ports the compliance ``A`` becomes ``A_K = (I + A K)^-1 A``: contacts that stick all through
the period are springs, and ask no more of an iteration. For ``A = R + U W U^T``, residual and modes, it is
``G + V S V^T`` with ``G = (I + R K)^-1 R``, ``V = U - G K U`` and ``S = (I + W U^T K V)^-1 W`` (M. A. Woodbury,
Princeton Statistical Research Group, Memorandum Report 42, 1950). The residual that grows with the frequency is of low
rank, as the lowest of the modes left out make most of it, and counts among the modes. A loss factor makes the residual
``(1 + e) R``, and with it ``G + e (G - G K G)`` and V alike, to the first power of e.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, lu_factor, lu_solve

from slipstick.balance.compliance import FactoredCompliance
from slipstick.structure.receptance import Factors
from slipstick.structure.residuals import WrittenResiduals, symmetric_product
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance

_Map = Callable[[ComplexArray], ComplexArray]

STIFF_FROM = 100.0
"""Stiffness of stuck contacts over that of the structure, from which they are attached to it: soft ones do without."""
MOST_PORTS = 4000
"""Ports up to which the residual is written out with the springs: a few times 128 MB, and some seconds once."""
SHARE = 1 / 3
"""Springs of contacts that slip, over their stiffness: iterations are fewest between a fifth and a half."""
STICKING = 0.4
"""Mean stiffness over a period, over that of a stuck contact, from which a contact that slips has its springs."""
_RANK, _MORE = 32, 8
"""Rank of a residual that grows with the frequency, and further columns with which it is found."""
_FEW = 0.7
"""Share of the ports up to which springs are few: products of their columns cost less than those of half of all."""
_SEED = 1
"""Of these columns: results repeat."""
_TOGETHER = 32
"""Columns of the residual that are written together."""
_SYMMETRIC = 1e-9
"""Largest difference of a residual to its transpose, over its size, that is rounding."""


class Attached:
    """A structure with springs along some of its ports.

    Parameters
    ----------
    free
        The factors without springs, at any frequency.
    springs
        Stiffness (n_ports,) >= 0.
    residual
        ``G``, (n_ports, n_ports).
    sign
        Sign of the determinant of ``I + R K``.
    growing
        Shapes (n_ports, r) of the residuals that grow with the frequency.

    Attributes
    ----------
    residual
        ``G``.
    held
        Ports that have springs.
    shapes
        ``V``, and its derivative by the loss, (n_ports, 2 m) for m modes and residuals that grow.
    sign
        Sign of the determinant of ``I + A K`` in harmonic 0; in all others together it is positive.
    """

    def __init__(self, free: Factors, springs: Array, residual: Array, sign: int, growing: Array) -> None:
        self.springs, self.residual, static = springs, residual, 1.0 / free.weight[0].real
        modes = np.hstack([free.left, growing])
        self.held, n = np.flatnonzero(springs), len(static)
        self._from_held = residual[self.held] if self.held.size <= _FEW * len(springs) else None
        held, moved = springs[:, None] * modes, self.moved(modes)
        by_loss = self.moved(moved) - moved
        self.shapes = np.hstack([modes - moved, by_loss])
        self._stiffness = held.T @ (modes - moved), held.T @ by_loss
        self._roots, self._vectors = eigh(np.diag(static) + self._stiffness[0][:n, :n], check_finite=False)
        self.sign: int = -sign if np.count_nonzero(self._roots < 0.0) % 2 else sign
        self._latest: tuple[NDArray[np.intp], tuple[Array, Array, Array]] | None = None

    def moved(self, X: Array) -> Array:
        """``G K X`` (n_ports, k)."""
        if self._from_held is None:
            return symmetric_product(self.residual, self.springs[:, None] * X)
        return np.asarray(self._from_held.T @ (self.springs[self.held, None] * X[self.held]))

    def modal(self, weight: ComplexArray, loss: ComplexArray) -> ComplexArray:
        """``S`` (n + 1, m, m) for weights ``W`` (n + 1, m) without springs and e (n + 1,)."""
        inner = weight[:, :, None] * (self._stiffness[0] + loss[:, None, None] * self._stiffness[1])
        inner[:, np.arange(weight.shape[1]), np.arange(weight.shape[1])] += 1.0
        return np.asarray(np.linalg.solve(inner, weight[:, :, None] * np.eye(weight.shape[1])))

    def between(self, ports: NDArray[np.intp]) -> tuple[Array, Array, Array]:
        """``G`` from all ports to some, ``G`` between these, and ``G - G K G`` between these."""
        if self._latest is None or not np.array_equal(self._latest[0], ports):
            every = len(ports) == len(self.springs)
            rows = self.residual if every else self.residual[ports]
            own = rows if every else np.ascontiguousarray(rows[:, ports])
            reached = rows[:, self.held]
            self._latest = ports, (rows, own, own - (reached * self.springs[self.held]) @ reached.T)
        return self._latest[1]

    def near(self, free: Factors, ports: NDArray[np.intp]) -> FactoredCompliance:
        """Near ``A_K`` between some ports: by modes of the static structure with springs, and ``G`` between them.

        ``free`` are the factors without springs at the same frequencies.
        """
        share, shapes = np.ones((1, len(free.weight)), dtype=complex), self._static_shapes[ports]
        weight, parts = self.static_modes(free)[1], WrittenResiduals([self.between(ports)[1]], symmetric=True)
        return FactoredCompliance(
            Factors(
                left=shapes, right=shapes, weight=weight, slope=np.zeros_like(weight),
                parts=parts, part_weight=share, part_slope=np.zeros_like(share),
            )
        )  # fmt: skip

    def static_modes(self, free: Factors) -> tuple[Array, ComplexArray]:
        """Modes (n_ports, n_modes) of the static structure with springs, and weights without damping between them."""
        moving = 1.0 / free.weight - 1.0 / free.weight[0].real
        return self._static_shapes, 1.0 / (self._roots + moving @ self._vectors**2)

    @cached_property
    def _static_shapes(self) -> Array:
        n = len(self._roots)
        return np.asarray(self.shapes[:, :n] @ self._vectors)


class SpringCompliance:
    """``conj(A_K)`` at the frequencies of one Jacobian, from and to some ports alone too.

    Numbers at ports are complex, (any, n + 1) as of ``FactoredCompliance``; with ``transposed`` it is ``A_K^T``.

    Parameters
    ----------
    attached
        The structure with springs.
    shapes, modal
        Modes, and their motion by modal forces: ``S`` of all shapes, or weights (n + 1, m).
    loss
        e (n + 1,).
    ports
        Numbers of some ports.

    Attributes
    ----------
    every
        Whether these are all.
    """

    def __init__(
        self, attached: Attached, shapes: Array, modal: ComplexArray, loss: ComplexArray, ports: NDArray[np.intp]
    ) -> None:
        self.ports, self._attached, self._springs = ports, attached, attached.springs[:, None]
        self._modal, self._loss, self.every = modal.conj(), loss.conj(), len(ports) == len(attached.springs)
        self._shapes, self._own_shapes = shapes, shapes[ports]
        self._to_own, self._own, self._own_by_loss = attached.between(ports)

    def own(self, F: ComplexArray) -> ComplexArray:
        """Motion of the ports by forces on them."""
        out = _product(self._own, F) + _times(self._own_shapes, self._by_modes(_times(self._own_shapes.T, F)))
        return out + self._loss * _product(self._own_by_loss, F) if self._loss.any() else out

    def answer(self, F: ComplexArray, *, transposed: bool = False) -> ComplexArray:
        """Motion of all ports by forces on all."""
        modal = self._by_modes(_times(self._shapes.T, F), transposed=transposed)
        return self._whole(_product(self._attached.residual, F), modal, transposed=transposed)

    def answer_to_own(self, F: ComplexArray) -> ComplexArray:
        """Motion of all ports by forces on the ports."""
        return self._whole(_times(self._to_own.T, F), self._by_modes(_times(self._own_shapes.T, F)))

    def eliminated(self, X: ComplexArray, solve: _Map, forces: _Map) -> ComplexArray:
        """Y of ``X = Y + A_K (K X + F)``: at the ports ``solve`` of it without F, whose ``forces`` are F."""
        moved, modal = self._by_springs(X), _times(self._shapes.T, self._springs * X)
        here = moved[self.ports]
        own = X[self.ports] - here - _times(self._own_shapes, self._by_modes(modal))
        if self._loss.any():
            back = self._by_springs(moved) if self.every else _times(self._to_own, self._springs * moved)
            own -= self._loss * (here - back)
        own = solve(own)
        if self.every:
            return own
        F = forces(own)
        moved += _times(self._to_own.T, F)
        modal += _times(self._own_shapes.T, F)
        out = X - self._whole(moved, self._by_modes(modal))
        out[self.ports] = own
        return out

    def released_transposed(self, X: ComplexArray) -> ComplexArray:
        """``(I + A K)^-T X``, which is ``X - K A_K^T X``."""
        return X - self._springs * self.answer(X, transposed=True)

    def _whole(self, moved: ComplexArray, modal: ComplexArray, *, transposed: bool = False) -> ComplexArray:
        """Motion of all ports by ``G F`` and the motion of the modes."""
        out = moved + _times(self._shapes, modal)
        if self._loss.any():
            loss = self._loss.conj() if transposed else self._loss
            out += loss * (moved - self._by_springs(moved))
        return out

    def _by_springs(self, X: ComplexArray) -> ComplexArray:
        """``G K X`` for motion of all ports."""
        return self._attached.moved(np.ascontiguousarray(X).view(float)).view(complex)

    def _by_modes(self, f: ComplexArray, *, transposed: bool = False) -> ComplexArray:
        """Motion along the shapes by forces along them, (any, n + 1): the second half of all shapes is by the loss."""
        if self._modal.ndim == 2:
            return np.ascontiguousarray(f * (self._modal.conj() if transposed else self._modal).T)
        S, loss, m = self._modal, self._loss, len(f) // 2
        if transposed:
            S, loss = S.conj().transpose(0, 2, 1), loss.conj()
        moved = (S @ (f[:m] + loss * f[m:]).T[:, :, None])[:, :, 0].T
        return np.concatenate([moved, loss * moved])


def _times(matrix: Array, x: ComplexArray) -> ComplexArray:
    """A real matrix times pairs of real and imaginary parts."""
    return np.asarray(matrix @ np.ascontiguousarray(x).view(float)).view(complex)


def _product(matrix: Array, x: ComplexArray) -> ComplexArray:
    """The same of a symmetric matrix."""
    return np.asarray(symmetric_product(matrix, np.ascontiguousarray(x).view(float)).view(complex))


class StuckStructure:
    """A structure with springs along the ports of all contacts, of which some are weakened or taken away again.

    Parameters
    ----------
    free
        The factors without springs, at any frequency; symmetric.
    stuck
        Stiffness (n_ports,) >= 0 of each port while its contact sticks.
    residual
        The static residual ``R`` between the ports, (n_ports, n_ports).
    """

    def __init__(self, free: Factors, stuck: Array, residual: Array) -> None:
        self._free, self.stuck = free, stuck
        self._residual, self._sign = residual, 1
        self._growing, self._grows = _growing(free)
        if self._residual.any():
            factors = lu_factor(np.eye(len(stuck)) + self._residual * stuck, check_finite=False)
            self._sign = _sign(*factors)
            self._residual = lu_solve(factors, self._residual, check_finite=False)
        self._latest: tuple[Array, Attached] | None = None

    def at(self, share: Array) -> Attached:
        """The structure with the springs of all ports times shares (n_ports,) from 0 to 1."""
        if self._latest is None or not np.array_equal(self._latest[0], share):
            self._latest = share, self._with(share * self.stuck)
        return self._latest[1]

    @property
    def has_residual(self) -> bool:
        """Whether there is a residual, of which products cost most."""
        return bool(self._residual.any())

    def compliance(
        self, attached: Attached, free: Factors, ports: NDArray[np.intp], *, near: bool = False
    ) -> SpringCompliance:
        """With springs attached, from and to some ports, at the frequencies of factors without them.

        ``near``: without damping between the modes of the static structure with springs, and what grows.
        """
        if near:
            return SpringCompliance(attached, *attached.static_modes(free), np.zeros(len(free.weight), complex), ports)
        grown, loss = [free.part_weight[p][:, None] * values for p, values in self._grows], _loss(free)
        modal = attached.modal(np.hstack([free.weight, *grown]), loss)
        return SpringCompliance(attached, attached.shapes, modal, loss, ports)

    def _with(self, springs: Array) -> Attached:
        """With other springs, softer along some ports: ``G + G_p (D_p^-1 - G_pp)^-1 G_p^T``, D being what they lack."""
        lacking, residual, sign = self.stuck - springs, self._residual, self._sign
        ports = np.flatnonzero(lacking > 0.0)
        if ports.size and residual.any():
            columns = residual[:, ports]
            factors = lu_factor(np.diag(1.0 / lacking[ports]) - columns[ports], check_finite=False)
            sign *= _sign(*factors)
            residual = residual + columns @ lu_solve(factors, columns.T, check_finite=False)
        return Attached(self._free, springs, residual, sign, self._growing)


def stuck_structure(balance: Balance, free: Factors) -> StuckStructure | None:
    """The structure of a balance with its stuck contacts; None where they are soft, or it is not symmetric."""
    n = len(free.left)
    if n > MOST_PORTS or free.columns is not None:
        return None
    static = free.weight[0].real
    if not (np.array_equal(free.left, free.right[:n]) and np.all(static > 0.0) and np.all(free.weight != 0.0)):
        return None
    stuck, ports = _stuck_stiffness(balance), np.arange(n)
    own = sum(e * w.real for e, w in zip(free.parts.entries(ports, ports), free.part_weight[:, 0], strict=True))
    # both are parts of the trace of A K, so that its largest eigenvalue is not far
    by_modes = np.sum(static * (free.left**2 * stuck[:, None]))
    if max(by_modes, np.max(own * stuck, initial=0.0)) < STIFF_FROM:
        return None
    residual = _residual(free)
    if np.abs(residual - residual.T).max(initial=0.0) > _SYMMETRIC * np.abs(residual).max(initial=0.0):
        return None
    return StuckStructure(free, stuck, residual)


def _residual(free: Factors) -> Array:
    """Static residual between the ports, (n_ports, n_ports)."""
    n, unit = len(free.left), np.eye(len(free.left))
    out = np.zeros((n, n))
    for first in range(0, n, _TOGETHER):
        columns = unit[:, first : first + _TOGETHER].astype(complex)
        weight = np.repeat(free.part_weight[:, :1], columns.shape[1], axis=1)
        out[:, first : first + _TOGETHER] = np.asarray(free.parts.times(columns, weight)).real
    return out


def _loss(free: Factors) -> ComplexArray:
    """By how much the residual of the static structure is larger at the frequencies of factors, e (n + 1,)."""
    static = free.part_weight[:, 0] != 0.0
    if not static.any():
        return np.zeros(len(free.weight), dtype=complex)
    return np.asarray((free.part_weight[static] / free.part_weight[static, :1] - 1.0).mean(axis=0), dtype=complex)


def _growing(free: Factors) -> tuple[Array, list[tuple[int, Array]]]:
    """Shapes (n_ports, r) of the residuals that are zero in harmonic 0; and the number of each, with its values (r,).

    By a product with random columns, and one with what they span (N. Halko et al., SIAM Review 53, 2011, 217).
    """
    n, shapes, values = len(free.left), [np.empty((len(free.left), 0))], list[tuple[int, Array]]()
    random = np.random.default_rng(_SEED).standard_normal((n, min(n, _RANK + _MORE)))
    for p in np.flatnonzero(free.part_weight.any(axis=1) & (free.part_weight[:, 0] == 0.0)):
        weight = np.zeros((len(free.part_weight), random.shape[1]), dtype=complex)
        weight[p] = 1.0
        span = np.linalg.qr(np.asarray(free.parts.times(random.astype(complex), weight)).real)[0]
        within = span.T @ np.asarray(free.parts.times(span.astype(complex), weight)).real
        roots, vectors = eigh((within + within.T) / 2.0, check_finite=False)
        largest = np.argsort(-np.abs(roots))[:_RANK]
        shapes.append(span @ vectors[:, largest])
        values.append((int(p), roots[largest]))
    return np.hstack(shapes), values


def _sign(factors: Array, swaps: Array) -> int:
    """Sign of the determinant of a factorised matrix."""
    turned = np.count_nonzero(swaps != np.arange(len(swaps))) + np.count_nonzero(factors.diagonal() < 0.0)
    return -1 if turned % 2 else 1


def _stuck_stiffness(balance: Balance) -> Array:
    """Stiffness of each port (n_ports,) with every contact closed and stuck."""
    stiffness = np.zeros(balance.n_ports)
    for batch, given in zip(balance.batches, balance.problem.inputs.batches, strict=True):
        states = (batch.law.linear(name, given.values, given.drift(1.0)) for name in ("pressed", "stuck"))
        held = next((state for state in states if state is not None), None)
        for i, port in enumerate(batch.ports):
            if held is not None and (i, i) in held.stiffness:
                port.add(held.stiffness[i, i][port.members], stiffness)
    return np.where(np.isfinite(stiffness) & (stiffness > 0.0), stiffness, 0.0)
