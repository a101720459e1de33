"""A structure with springs in the place of its stuck contacts, for the preconditioner of stiff contacts.

With springs K along the ports the compliance ``A`` becomes ``A_K = (I + A K)^-1 A``: contacts that stick ask no more of
an iteration, and what is left of the coupling between contacts decays within a few of them. For ``A = R + U W U^T``,
residual and modes, it is ``G + V S V^T`` with ``G = (I + R K)^-1 R``, ``V = U - G K U`` and ``S^-1 = W^-1 + U^T K V``
(M. A. Woodbury, Princeton Statistical Research Group, Memorandum Report 42, 1950). The eigenvectors of the static S are
the new modes. Left out are damping between them, and the share of the residual that grows with the frequency.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, lu_factor, lu_solve

from slipstick.balance.compliance import FactoredCompliance
from slipstick.structure.receptance import Factors
from slipstick.structure.residuals import WrittenResiduals
from slipstick.typing import Array, BoolArray

if TYPE_CHECKING:
    from slipstick.balance.balance import Balance

STIFF_FROM = 100.0
"""Stiffness of stuck contacts over that of the structure, from which they are attached to it: soft ones do without."""
MOST_PORTS = 4000
"""Ports up to which the residual is written out with the springs: 128 MB, and some seconds once."""
_SHARE = 1 / 3
"""Springs over the stiffness of stuck contacts: iterations are fewest between a fifth and a half, as some slip."""
_STICKING = 0.4
"""Mean stiffness over a period, over that of a stuck contact, from which a contact has its springs."""
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

    Attributes
    ----------
    sign
        Sign of the determinant of ``I + A K`` in harmonic 0; in all others together it is positive.
    """

    def __init__(self, free: Factors, springs: Array, residual: Array, sign: int) -> None:
        self.springs, static = springs, 1.0 / free.weight[0].real
        moved = free.left - residual @ (springs[:, None] * free.left)
        stiffness = np.diag(static) + free.left.T @ (springs[:, None] * moved)
        self._roots, vectors = eigh(stiffness, check_finite=False)
        self._shapes, self._shares = moved @ vectors, vectors**2
        self._parts = WrittenResiduals([residual], symmetric=True)
        self.sign: int = -sign if np.count_nonzero(self._roots < 0.0) % 2 else sign

    def compliance(self, free: Factors) -> FactoredCompliance:
        """``A_K`` between the ports at the frequencies of the factors without springs."""
        moving = 1.0 / free.weight - 1.0 / free.weight[0].real
        weight = 1.0 / (self._roots + moving @ self._shares)
        share = np.ones((1, len(weight)), dtype=complex)
        return FactoredCompliance(
            Factors(
                left=self._shapes, right=self._shapes, weight=weight, slope=np.zeros_like(weight),
                parts=self._parts, part_weight=share, part_slope=np.zeros_like(share),
            )
        )  # fmt: skip


class StuckStructure:
    """A structure with springs along the ports of all contacts, of which those that slip or open are taken away again.

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
        self._free, self._stuck, self._springs = free, stuck, _SHARE * stuck
        self._residual, self._sign = residual, 1
        if self._residual.any():
            factors = lu_factor(np.eye(len(stuck)) + self._residual * self._springs, check_finite=False)
            self._sign = _sign(*factors)
            self._residual = lu_solve(factors, self._residual, check_finite=False)
        self._latest: tuple[BoolArray, Attached] | None = None

    def at(self, stiffness: Array) -> Attached:
        """The structure with the springs of those ports whose mean stiffness (n_ports,) says that they stick."""
        sticking = stiffness >= _STICKING * self._stuck
        if self._latest is None or not np.array_equal(self._latest[0], sticking):
            self._latest = sticking, self._without(np.flatnonzero(~sticking & (self._stuck > 0.0)))
        return self._latest[1]

    def _without(self, ports: NDArray[np.intp]) -> Attached:
        """Without the springs of some ports: ``G + G_p (K_p^-1 - G_pp)^-1 G_p^T``."""
        springs, residual, sign = self._springs.copy(), self._residual, self._sign
        springs[ports] = 0.0
        if ports.size and residual.any():
            columns = residual[:, ports]
            factors = lu_factor(np.diag(1.0 / self._springs[ports]) - columns[ports], check_finite=False)
            sign *= _sign(*factors)
            residual = residual + columns @ lu_solve(factors, columns.T, check_finite=False)
        return Attached(self._free, springs, residual, sign)


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
