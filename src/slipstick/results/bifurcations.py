"""Points of a branch at which the kind of its motion changes, with their multipliers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan, pi
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError
from slipstick.results.stability import (
    NEIMARK_SACKER,
    PERIOD_DOUBLING,
    SPECIAL_KINDS,
    STATE_CHANGE,
    TURNING_POINT,
    truncated_folds,
)

if TYPE_CHECKING:
    from slipstick.results.solutions import Solutions
    from slipstick.typing import Array

FOLD, TRUNCATED_FOLD = "fold", "turning point of the truncated balance"
_BESIDE = 3
"""Number of points within which a change of contact states belongs to a bifurcation."""


@dataclass(frozen=True, kw_only=True)
class Bifurcation:
    """A point at which the kind of motion changes.

    Attributes
    ----------
    kind
        "fold", "period doubling", "Neimark-Sacker", "symmetry breaking", "state change" or "Hopf"; or "turning point of
        the truncated balance", where the curve turns and the motion itself has no fold.
    point
        Its number in the branch.
    value
        Of the followed quantity.
    omega
        Fundamental frequency, rad/time.
    multiplier
        The one nearest to where it leaves the unit circle; nan where multipliers are unknown.
    second_omega
        Of a Neimark-Sacker point: the frequency that appears, up to multiples of ``omega``; else nan.
    before, after
        Numbers of growing disturbances at the nearest points on both sides, -1 where unknown.
    grazing
        Whether contacts change the order of their states close to the point: the change of motion can then be sudden.

    Examples
    --------
    Both folds of a spring that stiffens; between them the motion is unstable.

    >>> import slipstick as ss
    >>> cubic = ss.SampledLaw(force=lambda x, velocity, k3: k3 * x**3, parameters={"k3": 1.0})
    >>> duffing = ss.Problem(
    ...     ss.MatrixStructure(M=[[1.0]], C=[[0.02]], K=[[1.0]], dofs=["x"]),
    ...     contacts=ss.ContactPair(name="spring", contact=cubic, ports={"x": "x"}),
    ...     loads=ss.Load(dof="x", sin=0.02), harmonics=range(6),
    ... )
    >>> branch = ss.forced_response(duffing, (0.7, 1.6), stability=True)
    >>> [(point.kind, round(point.omega, 4), point.before, point.after) for point in branch.bifurcations()]
    [('fold', 1.2265, 0, 1), ('fold', 1.0601, 1, 0)]
    """

    kind: str
    point: int
    value: float
    omega: float
    multiplier: complex
    second_omega: float
    before: int
    after: int
    grazing: bool


def bifurcations_of(branch: Solutions) -> list[Bifurcation]:
    """As ``Branch.bifurcations``."""
    if "unstable_multipliers" not in branch.table:
        raise InputError("these results hold no stability: compute them with stability=True")
    return list(_found(branch))


def _found(branch: Solutions) -> Iterator[Bifurcation]:
    table = branch.table
    kinds = [FOLD if k == TURNING_POINT else str(k) for k in table["kind"].to_numpy()]
    stored = [str(k) for k in table["kind"].to_numpy()]
    untrue = truncated_folds(stored, table["unstable_multipliers"].to_numpy(), table["multiplier"].to_numpy())
    changes = [i for i, kind in enumerate(kinds) if kind == STATE_CHANGE]
    for i, kind in enumerate(kinds):
        if kind != FOLD and kind not in SPECIAL_KINDS:
            continue
        omega = float(table["omega"].to_numpy()[i])
        multiplier = _passing(kind, table["multiplier"].to_numpy()[i])
        yield Bifurcation(
            kind=TRUNCATED_FOLD if i in untrue else kind,
            point=i,
            value=float(table[branch.followed].to_numpy()[i]),
            omega=omega,
            multiplier=multiplier,
            second_omega=_turns(multiplier) * omega if kind == NEIMARK_SACKER else float("nan"),
            before=_unstable(branch, kinds, range(i - 1, -1, -1)),
            after=_unstable(branch, kinds, range(i + 1, len(kinds))),
            grazing=any(abs(change - i) <= _BESIDE for change in changes),
        )


def _turns(multiplier: complex) -> float:
    """Of a disturbance in one period."""
    return float(abs(np.angle(multiplier))) / (2.0 * pi)


def _passing(kind: str, multipliers: Array) -> complex:
    """The multiplier that a kind of bifurcation is about."""
    known = [complex(*m) for m in multipliers if not isnan(m[0])]
    if not known:
        return complex(np.nan, np.nan)
    if kind == NEIMARK_SACKER:
        return min((m for m in known if m.imag > 0), key=lambda m: abs(abs(m) - 1.0), default=known[0])
    if kind == STATE_CHANGE:
        return known[0]
    return min(known, key=lambda m: abs(m - (-1.0 if kind == PERIOD_DOUBLING else 1.0)))


def _unstable(branch: Solutions, kinds: list[str], places: range) -> int:
    """How many disturbances grow at the first point there that is no bifurcation itself."""
    counts = branch.table["unstable_multipliers"].to_numpy()
    return next((int(counts[i]) for i in places if kinds[i] not in (FOLD, *SPECIAL_KINDS)), -1)
