"""``I + A dF/dX`` of many contacts, never written out.

The forces of an element answer to its own motion only, so ``dF/dX`` is a block for each element, and ``A`` is a few
modes and residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from slipstick.balance.elements import Elements
from slipstick.balance.factored import FactoredCompliance, coefficients
from slipstick.balance.preconditioner import Preconditioner
from slipstick.solve.linear.iterative import IterativeJacobian
from slipstick.typing import Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.ports import Balance, Tangents
    from slipstick.state.contact_state import Carried


class ContactJacobian(IterativeJacobian):
    """``I + A dF/dX`` for a structure known by its modes.

    Parameters
    ----------
    tangents
        ``dF/dX`` by batch and port.
    """

    def __init__(
        self, balance: Balance, tangents: Tangents, compliance: FactoredCompliance, states: Sequence[Carried] = ()
    ) -> None:
        self._n_ports, self._L, self._compliance = balance.n_ports, balance.L, compliance
        self._elements = [Elements(balance, k, tangent) for k, tangent in enumerate(tangents)]
        for carried in states:
            if not carried.state.slow:
                self._elements[carried.batch].feed_back(carried)

    @property
    def size(self) -> int:
        """N."""
        return self._n_ports * self._L

    def _forces(self, x: Array, *, transposed: bool = False) -> Array:
        """``dF/dX x`` on all ports, (n_ports, L), or with the transpose."""
        X, out = self._rows(x), self._rows(None)
        for elements in self._elements:
            elements.scatter(elements.forces(elements.gather(X), transposed=transposed), out)
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
            onto = self._compliance.transposed(_complex(x, self._L))[: self._n_ports]
            return x + self._forces(coefficients(onto).reshape(-1, self._L), transposed=True).ravel()
        return x + self._compliance.answer(_complex(self._forces(x), self._L))

    def bound(self, x: Array) -> Array:
        """``|J| @ |x|``, or more: both coefficients of a harmonic get the sum of their sizes."""
        X, sizes = self._rows(np.abs(x)), self._rows(None)
        for elements in self._elements:
            moved = (np.abs(elements.tangent) @ elements.gather(X)[:, :, None])[:, :, 0]
            if elements.fed_back is not None:
                rows, gain, columns = map(np.abs, elements.fed_back)
                moved += (gain @ np.einsum("nk,nk->n", rows, elements.gather(X)))[:, None] * columns
            elements.scatter(moved, sizes)
        G = _complex(sizes[:-1], self._L).real + _complex(sizes[:-1], self._L).imag
        by_order = self._compliance.reach_by_order(G)
        return np.abs(x) + np.hstack([by_order[:, :1], np.repeat(by_order[:, 1:], 2, axis=1)]).ravel()

    @cached_property
    def _standing_in(self) -> Preconditioner | None:
        """What stands for the whole while it is solved, unless it is singular."""
        try:
            return Preconditioner(self._elements, self._compliance)
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
        solve = self._standing_in.solve_transposed if transposed else self._standing_in.solve
        return solve(self._rows(x))[:-1].ravel()

    def __repr__(self) -> str:
        return f"ContactJacobian({self.size})"


def _complex(X: Array, L: int) -> ComplexArray:
    """Coefficients (rows, L), or flat, as complex numbers (rows, n + 1)."""
    coefficients = X.reshape(-1, L)
    out = np.zeros((len(coefficients), L + 1))
    out[:, 0], out[:, 2:] = coefficients[:, 0], coefficients[:, 1:]
    return out.view(complex)
