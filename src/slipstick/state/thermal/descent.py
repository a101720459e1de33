"""The first equilibrium downhill: where a body that is let go at a temperature comes to rest, each element by itself.

Newton where it stays near the start; else a march in cells along ``dT/dt = -G``, ``G = T - T_0 - R Edot``, cut at the
rows of the tables and halved until the values and slopes at its ends leave no room for an equilibrium in between.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from slipstick.typing import Array, BoolArray

HeatBalance = Callable[[Array], tuple[Array, Array]]
"""Temperatures (n,) to ``G`` (n,) and its derivative by the own temperature (n,)."""

FIRST_CELL = 1 / 384
LONGEST_CELL = 1 / 24
SHORTEST_CELL = 1e-9
"""Of the table's range."""

_BENT = 0.5
_MOST = 600


class TemperatureCells(NamedTuple):
    """Ends of cells, one for each element: temperature, G and its slope, left (behind) and right (ahead)."""

    a: Array
    Ga: Array
    da: Array
    b: Array
    Gb: Array
    db: Array

    def may_hide_more(self) -> BoolArray:
        """Whether a cell can hold more roots than the signs at its ends say, from the slopes there, (n,)."""
        rise = (self.Gb - self.Ga) * np.sign(self.b - self.a)
        crossing = self.Ga * self.Gb < 0
        against = (self.da * rise < 0) | (self.db * rise < 0)
        sign = np.where(self.Ga + self.Gb > 0, 1.0, -1.0) * np.sign(self.b - self.a)
        dips = (sign * self.da < 0) & (sign * self.db > 0)
        bend = np.where(dips, self.da - self.db, 1.0)
        turning = (self.Gb - self.Ga + self.da * self.a - self.db * self.b) / bend  # where the end tangents meet
        reached = np.sign(self.Ga + self.Gb) * (self.Ga + self.da * (turning - self.a)) <= 0
        return np.where(crossing, against, dips & reached)

    def bent(self) -> BoolArray:
        """Whether the slope changes too much within a cell to trust its ends, (n,)."""
        return np.asarray(np.abs(self.db - self.da) > _BENT * np.maximum(1.0, np.minimum(abs(self.da), abs(self.db))))


def near(
    balance: HeatBalance, T: Array, longest: Array, small: Callable[[Array], Array], *, hold: bool = False
) -> tuple[Array, BoolArray]:
    """Newton from a start (n,), and where it found a root next to it: the slope hardly changes on the way.

    An unstable root, which an element by itself would leave, counts with ``hold`` alone.
    """
    G, dG = balance(T)
    good = dG != 0 if hold else dG > 0
    for _ in range(30):
        step = np.where(good, -G / np.where(dG != 0, dG, 1.0), 0.0)
        limit = small(T)
        size = np.abs(step)
        moving = good & (size > limit)
        if not moving.any():
            return T, good
        T = np.where(moving, T + step, T)
        new_G, new_dG = balance(T)
        steady = (np.abs(new_dG - dG) <= _BENT * np.abs(dG)) & (np.abs(new_G) <= 0.5 * np.abs(G))
        steady |= size <= 1e3 * limit  # rounding alone keeps the last values from falling
        good &= ~moving | (steady & (size <= longest))
        G, dG = new_G, new_dG
    return T, np.zeros_like(good)


def downhill(
    balance: HeatBalance, T: Array, limits: tuple[Array, Array], knots: Array, small: Callable[[Array], Array]
) -> tuple[Array, BoolArray, BoolArray]:
    """First root in the direction in which ``-G`` points, (n,); beyond the limits G has the slope 1.

    ``knots`` (k, n) are cut points of each element, nan for none. Returned besides: which ones were found, and which
    ones passed an unstable place on their way.
    """
    low, high = limits
    G, dG = balance(T)
    known = np.isfinite(high - low)
    span = np.where(known, high - low, np.maximum(np.abs(T), np.abs(G)))
    way, h, longest = -np.sign(G), FIRST_CELL * span, np.where(known, LONGEST_CELL * span, np.inf)
    reached, passed, bracket = G == 0, np.zeros(T.size, dtype=bool), np.zeros(T.size, dtype=bool)
    a, Ga, da, b, Gb = T.copy(), G.copy(), dG.copy(), T.copy(), G.copy()
    passed |= ~reached & (dG <= 0)
    for _ in range(_MOST):
        marching = ~reached & ~bracket
        if not marching.any():
            break
        leaving = marching & np.where(way > 0, a >= high, a <= low)
        a[leaving] -= Ga[leaving]  # held parameters: T = T_0 + R Edot
        reached |= leaving
        marching &= ~leaving
        ahead = np.where(marching, _next_cut(a, way, h, limits, knots), a)
        G, dG = balance(ahead)
        cell = TemperatureCells(a, Ga, da, ahead, G, dG)
        finer = marching & (np.abs(ahead - a) > SHORTEST_CELL * span) & (cell.may_hide_more() | cell.bent())
        h = np.where(finer, 0.5 * np.abs(ahead - a), h)
        crossed = marching & ~finer & (Ga * G <= 0)
        bracket |= crossed
        b, Gb = np.where(crossed, ahead, b), np.where(crossed, G, Gb)
        walked = marching & ~finer & ~crossed
        a, Ga, da = np.where(walked, ahead, a), np.where(walked, G, Ga), np.where(walked, dG, da)
        passed |= walked & (dG <= 0)
        h = np.where(walked, np.minimum(2.0 * h, longest), h)
    T, closed = bracketed(balance, a, Ga, np.where(bracket, b, a), small)
    return T, reached | (bracket & closed), passed


def _next_cut(a: Array, way: Array, h: Array, limits: tuple[Array, Array], knots: Array) -> Array:
    """Where the next cell ends: ``h`` ahead, or at the cut before that."""
    ahead = np.clip(a + way * h, *limits)
    beyond = (knots - a) * way
    distance = np.where(beyond > 0, beyond, np.inf).min(axis=0, initial=np.inf)
    cut = distance < np.abs(ahead - a)
    return np.asarray(np.where(cut, a + way * np.where(cut, distance, 0.0), ahead))


def bracketed(
    balance: HeatBalance, a: Array, Ga: Array, b: Array, small: Callable[[Array], Array]
) -> tuple[Array, BoolArray]:
    """Newton kept inside brackets whose ends have different signs; a bracket without width is left as it is."""
    T, last = np.where(a == b, a, 0.5 * (a + b)), np.full_like(a, np.inf)
    done = a == b
    for _ in range(200):
        if done.all():
            break
        G, dG = balance(T)
        same = (G < 0) == (Ga < 0)
        a, b = np.where(same & ~done, T, a), np.where(same | done, b, T)
        step = np.divide(-G, dG, out=np.full_like(G, np.inf), where=dG != 0)
        done |= (G == 0) | (np.abs(b - a) <= small(T)) | (np.abs(step) <= small(T))
        fits = (T + step > np.minimum(a, b)) & (T + step < np.maximum(a, b)) & (np.abs(G) <= 0.5 * last)
        T = np.where(done, T, np.where(fits, T + step, 0.5 * (a + b)))
        last = np.abs(G)
    return T, done
