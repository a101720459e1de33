"""``I + A dF/dX`` of many contacts, never written out (for Newton with thousands of unknowns).

The forces of an element answer to its own motion only, so ``dF/dX`` is a block for each element, and ``A`` is a few modes
and residuals. What stands for the whole while it is solved: the blocks of single elements, ``D = I + A_own dF/dX``, and the
modes that carry most from one element to another, exactly (Woodbury's formula).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from slipstick.balance.factored import FactoredCompliance
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance, Tangents
    from slipstick.thermal.model import Heat

MOST_APART = 264
"""Coefficients of modes that the preconditioner holds exactly: 24 modes with the harmonics 0 to 5."""


class _Elements:
    """The elements of one batch: their port numbers (n, p), -1 where there is none, and ``dF/dX`` (n, p L, p L)."""

    def __init__(self, balance: Balance, k: int, tangents: Mapping[tuple[int, int], Array]) -> None:
        batch, L = balance.batches[k], balance.L
        n, p = batch.count, len(batch.ports)
        self.shape = n, p, L
        self.rows = np.full((n, p), -1)
        for i, port in enumerate(batch.ports):
            self.rows[port.members, i] = np.arange(balance.n_ports)[port.rows]
        tangent = np.zeros((n, p, L, p, L))
        for (i, j), part in tangents.items():
            tangent[:, i, :, j, :] = part * self._here(i, j)
        self.tangent = tangent.reshape(n, p * L, p * L)
        self.own = self.tangent  # as far as an element answers to its own motion
        self.heat: tuple[Array, Array, Array] | None = None

    def _here(self, *ports: int) -> Array:
        return np.asarray(np.all(self.rows[:, list(ports)] >= 0, axis=1), dtype=float)[:, None, None]

    def warm(self, heat: Heat) -> None:
        """Add what friction heat does: powers by motion (n, p L), gain (n, n), forces by temperature (n, p L)."""
        n, p, L = self.shape
        power, force = np.zeros((n, p, L)), np.zeros((n, p, L))
        for j, part in heat.power.by_motion.items():
            power[:, j] = part * self._here(j)[:, 0]
        for i, part in heat.tangent.by_temperature.items():
            force[:, i] = part * self._here(i)[:, 0]
        rows, columns, gain = power.reshape(n, -1), force.reshape(n, -1), heat.tangent.gain
        self.heat = rows, gain, columns
        self.own = self.tangent + np.diag(gain)[:, None, None] * columns[:, :, None] * rows[:, None, :]

    def gather(self, X: Array) -> Array:
        """Values (n, p L) of the elements from those of all ports (n_ports + 1, L), whose last row is zero."""
        return X[self.rows].reshape(len(self.rows), -1)

    def scatter(self, values: Array, out: Array) -> None:
        """Values (n, p L) of the elements into those of all ports (n_ports + 1, L)."""
        out[self.rows] = values.reshape(self.shape)

    def forces(self, q: Array, *, transposed: bool = False) -> Array:
        """``dF/dX q`` for motion (n, p L) of the elements, or with the transpose."""
        tangent = self.tangent.transpose(0, 2, 1) if transposed else self.tangent
        found = (tangent @ q[:, :, None])[:, :, 0]
        if self.heat is not None:
            rows, gain, columns = self.heat
            if transposed:
                found += (gain.T @ np.einsum("nk,nk->n", columns, q))[:, None] * rows
            else:
                found += (gain @ np.einsum("nk,nk->n", rows, q))[:, None] * columns
        return found


class ContactJacobian(IterativeJacobian):
    """``I + A dF/dX`` for a structure known by its modes.

    Parameters
    ----------
    tangents
        ``dF/dX`` by batch and port.
    """

    def __init__(
        self, balance: Balance, tangents: Tangents, compliance: FactoredCompliance, heat: Heat | None = None
    ) -> None:
        self._n_ports, self._L, self._compliance = balance.n_ports, balance.L, compliance
        self._elements = [_Elements(balance, k, given) for k, given in enumerate(tangents) if given]
        if heat is not None:
            self._elements[heat.batch].warm(heat)

    @property
    def size(self) -> int:
        """N."""
        return self._n_ports * self._L

    def _forces(self, x: Array, *, transposed: bool = False) -> Array:
        """``dF/dX x`` on all ports, (n_ports, L), or with the transpose."""
        X, out = self._rows(x), self._rows(None)
        for own in self._elements:
            own.scatter(own.forces(own.gather(X), transposed=transposed), out)
        return out[:-1]

    def _rows(self, x: Array | None) -> Array:
        """Values of all ports with a row of zeros at the end, (n_ports + 1, L)."""
        out = np.zeros((self._n_ports + 1, self._L))
        if x is not None:
            out[:-1] = x.reshape(self._n_ports, self._L)
        return out

    def multiply(self, x: Array, *, transposed: bool = False) -> Array:
        """``J @ x``, or the transpose times x."""
        if x.ndim == 2:
            return np.column_stack([self.multiply(column, transposed=transposed) for column in x.T])
        if transposed:
            return x + self._forces(_real(self._compliance.transposed(_complex(x, self._L))), transposed=True).ravel()
        return x + _real(self._compliance.answer(_complex(self._forces(x), self._L))).ravel()

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more: both coefficients of a harmonic get the sum of their sizes."""
        X, sizes = self._rows(np.abs(x)), self._rows(None)
        for own in self._elements:
            moved = (np.abs(own.tangent) @ own.gather(X)[:, :, None])[:, :, 0]
            if own.heat is not None:
                rows, gain, columns = map(np.abs, own.heat)
                moved += (gain @ np.einsum("nk,nk->n", rows, own.gather(X)))[:, None] * columns
            own.scatter(moved, sizes)
        G = _complex(sizes[:-1], self._L).real + _complex(sizes[:-1], self._L).imag
        by_order = self._compliance.reach_by_order(G)
        return np.abs(x) + np.hstack([by_order[:, :1], np.repeat(by_order[:, 1:], 2, axis=1)]).ravel()

    @cached_property
    def _standing_in(self) -> _Preconditioner | None:
        try:
            return _Preconditioner(self._elements, self._compliance, self._L)
        except np.linalg.LinAlgError:
            return None

    @property
    def preconditioner_sign(self) -> int:
        """Sign of the determinant of P; 0 where it is singular."""
        return 0 if self._standing_in is None else self._standing_in.sign

    def precondition(self, x: Array, *, transposed: bool = False) -> Array:
        """``P^-1 @ x`` (N,), or with the transpose."""
        if self._standing_in is None:
            return np.full(x.shape, np.nan)
        return self._standing_in.solve(self._rows(x), transposed=transposed)[:-1].ravel()

    def __repr__(self) -> str:
        return f"ContactJacobian({self.size})"


class _Preconditioner:
    """``P = D + U W``: ``D`` the single elements, ``U`` the modes set apart at the ports, ``W`` what moves them."""

    def __init__(self, elements: Sequence[_Elements], compliance: FactoredCompliance, L: int) -> None:
        self.elements, self.L = elements, L
        f = compliance.factors
        apart = _apart(f.weight, f.left, f.right[: compliance.n_rows])
        orders, self.modes = np.nonzero(apart)
        # an order has one coefficient if it is 0, else two; each pair stands together
        twice = np.where(orders > 0, 2, 1)
        self.first = np.cumsum(twice) - twice
        self.modes, orders, self.weight = np.repeat(self.modes, twice), np.repeat(orders, twice), f.weight[apart].conj()
        self.coefficient = np.where(orders > 0, 2 * orders - 1, 0)
        self.coefficient[1:] += (np.diff(self.modes) == 0) & (np.diff(orders) == 0) & (orders[1:] > 0)
        self.left = np.vstack([f.left, np.zeros(f.left.shape[1])])[:, self.modes]
        self.right = np.vstack([f.right[: compliance.n_rows], np.zeros(f.right.shape[1])])[:, self.modes]
        self.inverse, self.moved, sign = [], [], 1
        for own in elements:
            D = _answered(compliance.local(own.rows, apart), own.own)
            sign *= int(np.prod(np.linalg.slogdet(D)[0]))
            self.inverse.append(np.linalg.inv(D))
            self.moved.append(self._along_modes(own, self.inverse[-1]))
        C = self._weighted(sum((self._modal(o, o.own @ m) for o, m in zip(elements, self.moved, strict=True)), 0.0))
        C.reshape(-1)[:: len(C) + 1] += 1.0
        self.sign = sign * int(np.linalg.slogdet(C)[0]) if len(C) else sign
        self._lu = lu_factor(C, check_finite=False) if len(C) else None

    def _along_modes(self, own: _Elements, inverse: Array) -> Array:
        """``D^-1 U`` (n, p L, q) of the elements."""
        n, p, L = own.shape
        columns = inverse.reshape(n, p * L, p, L)
        return np.asarray(
            sum(columns[:, :, i, self.coefficient] * self.left[own.rows[:, i]][:, None] for i in range(p))
        )

    def _modal(self, own: _Elements, forces: Array) -> Array:
        """Forces (n, p L, ...) of the elements on the modes set apart, (q, ...)."""
        n, p, L = own.shape
        F = forces.reshape(n, p, L, -1)
        out = np.zeros((self.modes.size, F.shape[3]))
        shapes = self.right[own.rows]  # (n, p, q)
        for l in np.unique(self.coefficient):
            at = self.coefficient == l
            out[at] = shapes[:, :, at].reshape(n * p, -1).T @ F[:, :, l].reshape(n * p, -1)
        return out

    def _weighted(self, f: Array, *, transposed: bool = False) -> Array:
        """What modal forces (q, ...) move the modes by."""
        out, single = np.array(f, dtype=float), self.weight.imag * 0.0
        pairs = np.append(self.first[1:], self.modes.size) - self.first == 2
        one, two = self.first[~pairs], self.first[pairs]
        weight = self.weight.conj() if transposed else self.weight
        out[one] = weight[~pairs].real[:, None] * f[one]
        z = weight[pairs][:, None] * (f[two] + 1j * f[two + 1])
        out[two], out[two + 1] = z.real, z.imag
        return out

    def solve(self, X: Array, *, transposed: bool = False) -> Array:
        """``P^-1 X`` for values (n_ports + 1, L) of all ports, or with the transpose."""
        out = np.zeros_like(X)
        if transposed:
            return self._solve_transposed(X, out)
        y = [(inv @ own.gather(X)[:, :, None])[:, :, 0] for own, inv in zip(self.elements, self.inverse, strict=True)]
        if self._lu is not None:
            parts = zip(self.elements, y, strict=True)
            forces = sum((self._modal(own, (own.own @ v[:, :, None])[:, :, 0]) for own, v in parts), 0.0)
            a = lu_solve(self._lu, self._weighted(np.asarray(forces))[:, 0], check_finite=False)
            y = [v - m @ a for v, m in zip(y, self.moved, strict=True)]
        for own, v in zip(self.elements, y, strict=True):
            own.scatter(v, out)
        return out

    def _solve_transposed(self, X: Array, out: Array) -> Array:
        """``P^-T X = D^-T (X - W^T C^-T U^T D^-T X)``."""
        forces = np.zeros_like(X)
        if self._lu is not None:
            t = sum(np.tensordot(own.gather(X), m, 2) for own, m in zip(self.elements, self.moved, strict=True))
            g = self._weighted(lu_solve(self._lu, t, trans=1, check_finite=False)[:, None], transposed=True)[:, 0]
            for l in np.unique(self.coefficient):
                at = self.coefficient == l
                forces[:, l] = self.right[:, at] @ g[at]
        for own, inv in zip(self.elements, self.inverse, strict=True):
            pulled = (own.own.transpose(0, 2, 1) @ own.gather(forces)[:, :, None])[:, :, 0]
            own.scatter((inv.transpose(0, 2, 1) @ (own.gather(X) - pulled)[:, :, None])[:, :, 0], out)
        return out


def _apart(weight: ComplexArray, left: Array, right: Array) -> Array:
    """Which modes of which orders carry most between the ports, (n + 1, n_modes)."""
    size = np.abs(weight) * np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0)
    order = np.argsort(-size, axis=None, kind="stable")
    places = np.where(np.arange(size.size) // size.shape[1] > 0, 2, 1)[order]
    chosen = order[np.cumsum(places) <= MOST_APART]
    apart = np.zeros(size.shape, dtype=bool)
    apart.reshape(-1)[chosen] = True
    return apart


def _answered(local: ComplexArray, tangent: Array) -> Array:
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


def _complex(X: Array, L: int) -> ComplexArray:
    """Coefficients (rows, L), or flat, as complex numbers (rows, n + 1)."""
    given = X.reshape(-1, L)
    out = np.zeros((len(given), L + 1))
    out[:, 0], out[:, 2:] = given[:, 0], given[:, 1:]
    return out.view(complex)


def _real(z: ComplexArray) -> Array:
    """Complex numbers (rows, n + 1) as coefficients (rows, L)."""
    pairs = np.ascontiguousarray(z).view(float)
    return np.delete(pairs, 1, axis=1)
