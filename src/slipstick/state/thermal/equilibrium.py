"""Thermal equilibrium of contacts: friction heats them as much as the body cools them [THEORY.md (8.1), (8.2)].

``T = T_0 + R Edot(b(T))``: the contact parameters b follow the temperature, the power Edot follows the parameters. The
solution is the one that the body itself would reach from the start temperature, along ``dT/dt ~ T_0 + R Edot - T``:
from cold where no start is given, else from the neighbouring solution.

Elements that do not heat each other are solved one by one. Newton's method comes first, where its root is close to the
start. Else cells are marched along ``dT/dt = -G``, ``G = T - T_0 - R Edot``: they end at the rows of the tables and are
halved until the values and slopes at their ends leave no room for an equilibrium in between.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import Fault, InputError
from slipstick.solve.linear.dense import solution
from slipstick.solve.norm import norm
from slipstick.typing import Array, BoolArray
from slipstick.units import Units, after_number, power_unit

PowerFunction = Callable[[Array], tuple[Array, Array]]
"""Temperatures (n,) to powers (n,) and their derivatives by the own temperature (n,)."""

HeatBalance = Callable[[Array], tuple[Array, Array]]
"""Temperatures (n,) to ``G`` (n,) and its derivative by the own temperature (n,)."""

FIRST_CELL = 1 / 384
LONGEST_CELL = 1 / 24
SHORTEST_CELL = 1e-9
"""Lengths of cells over the range of the table."""
_MOST_CELLS = 600
"""Cells of a march, halved ones included, before it ends without a root."""
_SLOPE_CHANGE = 0.5
"""Relative change of the slope up to which a Newton step or a cell is reliable."""
_MOST_NEWTON_STEPS, _MOST_BRACKET_STEPS = 30, 200
"""Steps of Newton's method near a start, and inside brackets."""


@dataclass(frozen=True, kw_only=True)
class Equilibrium:
    """Temperatures in equilibrium with the friction power they bring about, n elements.

    ``jumped``: the equilibrium near the start temperature has vanished, and this is another one. Beyond the tables the
    parameters are those of the last row, so that a solver can pass through. Such a temperature is no result:
    ``outside`` marks it and ``problem`` reports it.
    """

    temperature: Array
    power: Array
    dpower_dT: Array
    resistance: Array
    limits: tuple[Array, Array]
    converged: bool
    near: bool
    """Whether it was sought near a start temperature, not from cold."""
    jumped: bool
    evaluations: int

    @property
    def outside(self) -> BoolArray:
        """Elements whose temperature has left the tables, (n,)."""
        return np.clip(self.temperature, *self.limits) != self.temperature

    @property
    def stable(self) -> bool:
        """Whether the body stays there: every eigenvalue of ``R dEdot/dT`` is below 1."""
        return is_stable(self.resistance, self.dpower_dT)

    def problem(self, names: Sequence[str] | None = None, units: Units | None = None) -> str | None:
        """One sentence where this equilibrium is no result, else None; ``names`` are those of the contacts."""
        if not self.converged:
            return "no thermal equilibrium was found: lower the power or the thermal resistance, or smooth the tables"
        if not np.any(self.outside):
            return None
        i = int(np.flatnonzero(self.outside)[0])
        low, high = self.limits[0][i], self.limits[1][i]
        of = Units() if units is None else units
        unit, watt = of.after("temperature"), after_number(power_unit(of.label("force length/time")))
        return (
            f"the temperature of contact {_named(i, names)} leaves its table, {low:g} to {high:g}{unit}: the "
            f"equilibrium lies near {self.temperature[i]:.4g}{unit} (power {self.power[i]:.4g}{watt})"
        )


def equilibrium(
    evaluate: PowerFunction,
    background: ArrayLike,
    resistance: ArrayLike,
    *,
    limits: tuple[ArrayLike, ArrayLike] = (-np.inf, np.inf),
    start: ArrayLike | None = None,
    tolerance: float = 1e-12,
) -> Equilibrium:
    """Solve ``T = background + resistance Edot(T)`` for n elements at once.

    Parameters
    ----------
    evaluate
        Power and its derivative by temperature, ``(n,) -> (n,), (n,)``, where each element's power depends on its own
        temperature; it is only called within the limits.
    background
        Temperature without friction, (n,).
    resistance
        Temperature per power: scalar or (n,) for elements that do not heat each other, or the influence matrix (n, n)
        of a surface, whose entry (i, j) is the rise at i by unit power at j.
    limits
        Lowest and highest temperature the parameters are known for, scalars or (n,): ``FrictionCurve.limits``.
    start
        Where to start, (n,): the neighbouring solution. Cold (the background) where it is not given.
    tolerance
        Of the temperature, relative to its size.

    Raises
    ------
    InputError
        If shapes do not fit, values are not finite, or the background lies outside the limits.

    Examples
    --------
    >>> found = equilibrium(lambda T: (10.0 - 0.01 * T, np.full_like(T, -0.01)), [20.0], 8.0)
    >>> found.temperature.round(6)  # (20 + 80) / 1.08
    array([92.592593])
    """
    T0, R, bounds = checked(background, resistance, limits)
    first = None if start is None else np.broadcast_to(np.asarray(start, dtype=float), T0.shape)
    return settled(evaluate, T0, R, bounds, first, tolerance)


def settled(
    evaluate: PowerFunction,
    T0: Array,
    R: Array,
    limits: tuple[Array, Array],
    start: Array | None = None,
    tolerance: float = 1e-12,
    knots: Array | None = None,
    hold: bool = False,
) -> Equilibrium:
    """``equilibrium`` for arguments that have been ``checked``.

    ``knots`` (k, n) are the rows of the tables, nan for none, at which cells end. With ``hold`` an equilibrium close to
    the start counts even where it is unstable at fixed motion: the response of the structure can stabilise it.
    """
    T = np.array(T0 if start is None else start, dtype=float)
    clipped = _Clipped(evaluate, limits)
    if R.ndim == 1:
        cuts = np.empty((0, T.size)) if knots is None else knots
        T, converged, jumped = _element_wise(clipped, T0, R, T, tolerance, cuts, hold=hold)
    else:
        T, converged, jumped = _coupled(clipped, T0, R, T, start is None, tolerance, hold=hold)
    T = onto(T, T0, limits)
    power, slope = clipped(T)
    return Equilibrium(
        temperature=T,
        power=power,
        dpower_dT=slope,
        resistance=R,
        limits=limits,
        converged=converged,
        near=start is not None,
        jumped=jumped and start is not None,
        evaluations=clipped.count,
    )


def dissipated(evaluate: PowerFunction) -> PowerFunction:
    """The power, at least zero: friction dissipates, and only rounding makes it negative."""

    def at(T: Array) -> tuple[Array, Array]:
        power, slope = evaluate(T)
        return np.maximum(power, 0.0), np.where(power < 0, 0.0, slope)

    return at


def onto(T: Array, T0: Array, limits: tuple[Array, Array]) -> Array:
    """Temperatures, those beyond a limit by rounding alone moved to the limit."""
    inside, span = np.clip(T, *limits), limits[1] - limits[0]
    rounding = 1e-11 * np.maximum(np.maximum(np.abs(T), np.abs(T - T0)), np.where(np.isfinite(span), span, 0.0))
    return np.asarray(np.where(np.abs(T - inside) <= rounding, inside, T))


def is_stable(resistance: Array, dpower_dT: Array) -> bool:
    """Whether every eigenvalue of ``R dEdot/dT`` is below 1, for R (n,) or (n, n)."""
    if resistance.ndim == 1:
        return bool(np.all(resistance * dpower_dT < 1.0))
    if np.max(np.abs(resistance) @ np.abs(dpower_dT), initial=0.0) < 1.0:  # a norm bounds the eigenvalues
        return True
    return bool(np.linalg.eigvals(resistance * dpower_dT).real.max(initial=0.0) < 1.0)


def checked(
    background: ArrayLike,
    resistance: ArrayLike,
    limits: tuple[ArrayLike, ArrayLike],
    names: Sequence[str] | None = None,
) -> tuple[Array, Array, tuple[Array, Array]]:
    """Background (n,), resistance (n,) or (n, n) and limits (n,), (n,), validated; a diagonal matrix becomes
    (n,)."""
    T0 = np.atleast_1d(np.asarray(background, dtype=float))
    R = np.asarray(resistance, dtype=float)
    n, faults = T0.size, []
    if T0.ndim != 1 or not np.all(np.isfinite(T0)):
        raise InputError(Fault(("thermal", "background"), found=str(T0), expected="one finite number for each element"))
    if R.shape not in ((), (n,), (n, n)):
        raise InputError(
            Fault(("thermal", "resistance"), found=f"shape {R.shape}", expected=f"a number, ({n},) or ({n}, {n})")
        )
    if R.ndim < 2:
        R = np.full(n, R)
    elif not np.any(R[~np.eye(n, dtype=bool)]):
        R = R.diagonal().copy()
    if not np.all(np.isfinite(R)) or np.any((R if R.ndim == 1 else R.diagonal()) < 0):
        faults.append(
            Fault(
                ("thermal", "resistance"), found="a negative or non-finite value", expected="temperature per power >= 0"
            )
        )
    low, high = (np.broadcast_to(np.asarray(limit, dtype=float), n) for limit in limits)
    for i in np.flatnonzero(np.clip(T0, low, high) != T0)[:1]:
        faults.append(
            Fault(
                ("thermal", "background"),
                f"{T0[i]:g} of contact {_named(i, names)} lies outside its table, {low[i]:g} to {high[i]:g}",
                remedy="extend the table to the background temperature",
            )
        )
    if faults:
        raise InputError(faults)
    return T0, R, (low, high)


def _named(i: int, names: Sequence[str] | None) -> str:
    return names[i] if names else f"element {i}"


class _Clipped:
    """The power with parameters held beyond the limits, where its derivative is zero; counts evaluations."""

    def __init__(self, evaluate: PowerFunction, limits: tuple[Array, Array]) -> None:
        self.evaluate, self.limits, self.count = dissipated(evaluate), limits, 0
        self._span = limits[1] - limits[0]
        self._known = np.isfinite(self._span)
        self.longest_step = np.where(self._known, self._span * LONGEST_CELL, np.inf)

    def __call__(self, T: Array) -> tuple[Array, Array]:
        self.count += 1
        inside = np.minimum(np.maximum(T, self.limits[0]), self.limits[1])  # np.clip takes twice as long
        power, slope = self.evaluate(inside)
        return power, np.where(inside == T, slope, 0.0)

    def size(self, T: Array, T0: Array) -> Array:
        """Size that a tolerance of the temperatures is relative to, (n,); above zero where the background is 0."""
        size = np.maximum(np.abs(T), np.abs(T - T0))
        return np.maximum(size, 1e-3 * self._span, out=size, where=self._known)

    def inside(self, T: Array) -> BoolArray:
        return np.clip(T, *self.limits) == T

    def excess(self, T: Array, step: Array) -> float:
        """Largest step over the longest one allowed; steps outside the limits are free."""
        return float(np.where(self.inside(T), np.abs(step) / self.longest_step, 0.0).max())


def _element_wise(
    power_of: _Clipped, T0: Array, R: Array, T: Array, tolerance: float, knots: Array, *, hold: bool
) -> tuple[Array, bool, bool]:
    """Newton close to the start, else the first equilibrium downhill; whether all were found, and any beyond a fold."""

    def balance(T: Array) -> tuple[Array, Array]:
        power, slope = power_of(T)
        return T - T0 - R * power, 1.0 - R * slope

    def small(T: Array) -> Array:
        return tolerance * power_of.size(T, T0) + np.finfo(float).tiny

    roots, good = near_start(balance, T, power_of.longest_step, small, hold=hold)
    if good.all():
        return roots, True, False
    walked, ended, passed = downhill(balance, np.where(good, roots, T), power_of.limits, knots, small)
    return np.where(good, roots, walked), bool((good | ended).all()), bool((~good & passed).any())


def _coupled(
    power_of: _Clipped, T0: Array, R: Array, T: Array, cold: bool, tolerance: float, *, hold: bool
) -> tuple[Array, bool, bool]:
    """Damped Newton near the start; where that fails, and from cold, implicit steps in time."""
    if not cold:
        close = _damped_newton(power_of, T0, R, T, tolerance, hold=hold)
        if close is not None:
            return close, True, False
    return *_heating(power_of, T0, R, T, tolerance), True


def _damped_newton(power_of: _Clipped, T0: Array, R: Array, T: Array, tolerance: float, *, hold: bool) -> Array | None:
    """Newton with halved steps for all elements together; None where no equilibrium close to the start is reached.

    Each step has to pass P. Deuflhard's natural monotonicity test: the simplified step after it is shorter.
    """
    one, size = np.eye(T.size), power_of.size(T, T0)
    power, slope = power_of(T)
    G, J = T - T0 - R @ power, one - R * slope
    step = solution(J, -G)
    for _ in range(40):
        if step is None or not isfinite(step.sum()):
            return None
        if (np.abs(step) <= tolerance * size).all():
            return T if hold or is_stable(R, slope) else None
        factor, length = 1.0 / max(1.0, power_of.excess(T, step)), norm(step)
        while factor > 1e-3:
            trial = T + factor * step
            power, slope = power_of(trial)
            G, size = trial - T0 - R @ power, power_of.size(trial, T0)
            simplified = solution(J, -G)
            # rounding alone keeps the last steps from shrinking
            room = (1.0 - 0.5 * factor) * length + 10.0 * tolerance * norm(size)
            if simplified is not None and norm(simplified) <= room:
                break
            factor *= 0.5
        else:
            return None
        T, J = trial, one - R * slope
        step = solution(J, -G)
    return None


def _heating(power_of: _Clipped, T0: Array, R: Array, T: Array, tolerance: float) -> tuple[Array, bool]:
    """Implicit steps along ``dT/dt = -G``, their length from the error of the linear prediction.

    For a symmetric positive influence matrix this is the descent of an energy, so it ends at a stable equilibrium.
    """
    duration = 1.0
    power, slope = power_of(T)
    G = T - T0 - R @ power
    for _ in range(500):
        J = np.eye(T.size) - R * slope
        fastest = -np.linalg.eigvals(J).real.min(initial=1.0)
        if fastest > 0:
            duration = min(duration, 0.5 / fastest)
        elif (newton := solution(J, -G)) is not None and np.all(np.abs(newton) <= tolerance * power_of.size(T, T0)):
            return T, True
        step = np.asarray(np.linalg.solve(J + np.eye(T.size) / duration, -G), dtype=float)
        too_long = power_of.excess(T, step)
        if too_long > 1.0 and duration > 1e-9:
            duration /= 2.0 * too_long
            continue
        new_power, new_slope = power_of(T + step)
        residual = T + step - T0 - R @ new_power
        error = np.abs(residual - (G + J @ step)).max() / max(np.abs(G).max(), np.finfo(float).tiny)
        rounding = np.abs(residual).max() <= tolerance * power_of.size(T, T0).max()
        if error > 0.5 and not rounding and duration > 1e-9:
            duration /= 4.0
            continue
        T, power, slope, G = T + step, new_power, new_slope, residual
        duration = min(duration * (10.0 if error < 0.1 else 2.0), 1e12)
    return T, False


class TemperatureCells(NamedTuple):
    """Ends of cells, one for each element: temperature, G and its slope, left (behind) and right (ahead)."""

    a: Array
    Ga: Array
    da: Array
    b: Array
    Gb: Array
    db: Array

    def may_hold_more_roots(self) -> BoolArray:
        """Whether the slopes at the ends allow more roots than the signs there show, (n,)."""
        rise = (self.Gb - self.Ga) * np.sign(self.b - self.a)
        crossing = self.Ga * self.Gb < 0
        against = (self.da * rise < 0) | (self.db * rise < 0)
        sign = np.where(self.Ga + self.Gb > 0, 1.0, -1.0) * np.sign(self.b - self.a)
        dips = (sign * self.da < 0) & (sign * self.db > 0)
        bend = np.where(dips, self.da - self.db, 1.0)
        turning = (self.Gb - self.Ga + self.da * self.a - self.db * self.b) / bend  # where the end tangents meet
        reached = np.sign(self.Ga + self.Gb) * (self.Ga + self.da * (turning - self.a)) <= 0
        return np.where(crossing, against, dips & reached)

    def is_curved(self) -> BoolArray:
        """Whether the slope changes too much within a cell for a judgement from its ends, (n,)."""
        return np.asarray(
            np.abs(self.db - self.da) > _SLOPE_CHANGE * np.maximum(1.0, np.minimum(abs(self.da), abs(self.db)))
        )


def near_start(
    balance: HeatBalance, T: Array, longest: Array, small: Callable[[Array], Array], *, hold: bool = False
) -> tuple[Array, BoolArray]:
    """Newton from a start (n,), and which elements found a root close to it: the slope hardly changes on the way.

    An unstable root, which an element at fixed motion would leave, counts only with ``hold``.
    """
    G, dG = balance(T)
    good = dG != 0 if hold else dG > 0
    for _ in range(_MOST_NEWTON_STEPS):
        step = np.where(good, -G / np.where(dG != 0, dG, 1.0), 0.0)
        limit = small(T)
        size = np.abs(step)
        moving = good & (size > limit)
        if not moving.any():
            return T, good
        T = np.where(moving, T + step, T)
        new_G, new_dG = balance(T)
        steady = (np.abs(new_dG - dG) <= _SLOPE_CHANGE * np.abs(dG)) & (np.abs(new_G) <= 0.5 * np.abs(G))
        steady |= size <= 1e3 * limit  # rounding alone keeps the last values from falling
        good &= ~moving | (steady & (size <= longest))
        G, dG = new_G, new_dG
    return T, np.zeros_like(good)


def downhill(
    balance: HeatBalance, T: Array, limits: tuple[Array, Array], knots: Array, small: Callable[[Array], Array]
) -> tuple[Array, BoolArray, BoolArray]:
    """First root in the direction of ``-G``, (n,), which were found, and which passed an unstable place on their way.

    Beyond the limits G has the slope 1. ``knots`` (k, n) are ends of cells of each element, nan for none.
    """
    low, high = limits
    G, dG = balance(T)
    known = np.isfinite(high - low)
    span = np.where(known, high - low, np.maximum(np.abs(T), np.abs(G)))
    way, h, longest = -np.sign(G), FIRST_CELL * span, np.where(known, LONGEST_CELL * span, np.inf)
    reached, passed, bracket = G == 0, np.zeros(T.size, dtype=bool), np.zeros(T.size, dtype=bool)
    a, Ga, da, b, Gb = T.copy(), G.copy(), dG.copy(), T.copy(), G.copy()
    passed |= ~reached & (dG <= 0)
    for _ in range(_MOST_CELLS):
        marching = ~reached & ~bracket
        if not marching.any():
            break
        leaving = marching & np.where(way > 0, a >= high, a <= low)
        a[leaving] -= Ga[leaving]  # held parameters: T = T_0 + R Edot
        reached |= leaving
        marching &= ~leaving
        ahead = np.where(marching, _next_end(a, way, h, limits, knots), a)
        G, dG = balance(ahead)
        cell = TemperatureCells(a, Ga, da, ahead, G, dG)
        finer = marching & (np.abs(ahead - a) > SHORTEST_CELL * span) & (cell.may_hold_more_roots() | cell.is_curved())
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


def _next_end(a: Array, way: Array, h: Array, limits: tuple[Array, Array], knots: Array) -> Array:
    """End of the next cell: ``h`` ahead, or at a knot before that."""
    ahead = np.clip(a + way * h, *limits)
    beyond = (knots - a) * way
    distance = np.where(beyond > 0, beyond, np.inf).min(axis=0, initial=np.inf)
    cut = distance < np.abs(ahead - a)
    return np.asarray(np.where(cut, a + way * np.where(cut, distance, 0.0), ahead))


def bracketed(
    balance: HeatBalance, a: Array, Ga: Array, b: Array, small: Callable[[Array], Array]
) -> tuple[Array, BoolArray]:
    """Newton inside brackets whose ends have different signs; a bracket without width stays as it is."""
    T, last = np.where(a == b, a, 0.5 * (a + b)), np.full_like(a, np.inf)
    done = a == b
    for _ in range(_MOST_BRACKET_STEPS):
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
