"""What is recorded of the stability of a point, and under which names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.results.postprocessing import Postprocessing
from slipstick.typing import AnyArray, Array, ComplexArray

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem

EIGENVALUES = "eigenvalues"
PIECES, SHOOTING, COUNT, ORDER_COUNT = "PW", "shooting", "count", "count by order"
WAVE_COUNT = "count by wave number"
STABILITY_METHODS = (PIECES, SHOOTING, COUNT, ORDER_COUNT, WAVE_COUNT, EIGENVALUES)
"""Methods, in this order: piecewise exact integration of disturbances of the balanced motion; of the motion found by
shooting; number of unstable exponents by the argument principle; the same with one receptance for each order; the same
over the wave numbers of a travelling wave; eigenvalues of steady sliding."""

TURNING_POINT = "turning point"
_AT_THE_FOLD = 0.02
"""Distance from 1 within which a multiplier at a turning point is that of a fold of the motion itself."""

WARNED_DIFFERENCE = 0.02
"""Difference of the largest multiplier from the harmonic one from which results carry a warning."""

PERIOD_DOUBLING, NEIMARK_SACKER = "period doubling", "Neimark-Sacker"
BRANCH_POINT, STATE_CHANGE = "symmetry breaking", "state change"
HOPF = "Hopf"
SPECIAL_KINDS = (PERIOD_DOUBLING, NEIMARK_SACKER, BRANCH_POINT, STATE_CHANGE, HOPF)
"""Kinds of points at which the kind of motion changes, except folds: these are turning points."""

MOST_MULTIPLIERS = 64
PARTS = ("real", "imaginary")
UNKNOWN = -1
"""Value of a count that was not computed."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PointStability:
    """Stability of the periodic motion at a point.

    Attributes
    ----------
    multipliers
        Floquet multipliers, the largest first; empty where they were not computed.
    unstable
        How many disturbances grow, ``UNKNOWN`` where nobody knows.
    method
        One of ``STABILITY_METHODS``, or empty.
    neutral
        Contacts stuck all period: in the direction of each a disturbance neither grows nor vanishes. They are left out.
    difference
        Distance of the largest multiplier from that of the harmonic form; nan where only one was computed.
    error
        How far the multipliers moved when the motion was iterated; nan where that was not looked at.
    wave_number
        Of a travelling wave: wave number of the disturbance that grows fastest, ``UNKNOWN`` where none is known.
    """

    multipliers: ComplexArray
    unstable: int
    method: str
    neutral: int
    difference: float = np.nan
    error: float = np.nan
    wave_number: int = UNKNOWN


@dataclass(frozen=True)
class Unjudged:
    """Stability of a point that is judged with others when it is recorded: together that costs less.

    Attributes
    ----------
    alone
        Computes it for this point alone.
    together
        Computes it for several points from the ``known`` of each; None for those that need ``alone``.
    """

    alone: Callable[[], PointStability]
    together: Callable[[Sequence[Any]], Sequence[PointStability | None]]
    known: Any


def judged(
    points: Sequence[PointStability | Unjudged | None], postprocessing: Postprocessing
) -> list[PointStability | None]:
    """Stability of all points of one branch."""
    out = [None if isinstance(point, Unjudged) else point for point in points]
    waiting = [(i, point) for i, point in enumerate(points) if isinstance(point, Unjudged)]
    if waiting:
        found: Sequence[PointStability | None] = [None] * len(waiting)
        with suppress(Exception):  # each alone says what fails
            found = waiting[0][1].together([point.known for _, point in waiting])
        for (i, point), stability in zip(waiting, found, strict=True):
            out[i] = stability or postprocessing.attempt("stability", point.alone, None)
    return out


def stability_sentences(name: str, at: Array, values: Mapping[str, AnyArray], unit: str) -> Iterator[str]:
    """Warnings where stability was not computed, and where there are too few harmonics for it.

    ``name`` is what ``at`` (n_points,) are values of, ``unit`` that of frequencies.
    """
    stable, apart = np.asarray(values["stable"]), np.asarray(values["hill_pw_difference"], dtype=float)
    known = f" {unit}" if name == "omega" else ""
    changing = np.isin(values.get("kind", ""), (TURNING_POINT, *SPECIAL_KINDS))  # a multiplier is on the circle there
    if unknown := np.flatnonzero((stable == UNKNOWN) & ~changing).tolist():
        yield (
            f"stability is not known at {len(unknown)} of {stable.size} points, the first at {name} = "
            f"{at[unknown[0]]:.6g}{known}"
        )
    if {"kind", "multiplier", "unstable_multipliers"} <= set(values):
        kinds = [str(kind) for kind in values["kind"]]
        for i in truncated_folds(kinds, values["unstable_multipliers"], values["multiplier"]):
            yield (
                f"the turning point at {name} = {at[i]:.6g}{known} is one of the truncated balance: no multiplier of "
                "the motion itself passes 1 there; keep more harmonics"
            )
    if np.any(np.asarray(values.get("stability_method", ())) == ORDER_COUNT):
        yield (
            "stability: the motion is a travelling wave; disturbances that break its symmetry are judged only as far "
            "as the harmonics kept can show them"
        )
    if "wave_number" in values:
        counts, numbers = np.asarray(values["unstable_multipliers"]), np.asarray(values["wave_number"])
        lost = np.flatnonzero((counts > 0) & (np.concatenate([[0], counts[:-1]]) <= 0)).tolist()
        for i in lost:
            if numbers[i] > 0:
                yield (
                    f"at {name} = {at[i]:.6g}{known} the wave loses its symmetry: a disturbance of wave number "
                    f"{numbers[i]} grows, and the sectors no longer move alike; follow the whole disc, "
                    "sector.mistuned().problem(problem)"
                )
    if np.any(apart > WARNED_DIFFERENCE):
        worst = int(np.nanargmax(apart))
        yield (
            f"stability: the exact pieces and the harmonic form give multipliers {apart[worst]:.2g} apart at {name} = "
            f"{at[worst]:.6g}{known}: keep more harmonics, or confirm by integration in time"
        )


def truncated_folds(kinds: Sequence[str], unstable: Array, multipliers: Array) -> list[int]:
    """Numbers of the turning points that the motion itself has not: no multiplier passes 1 there.

    ``unstable`` (n_points,) and ``multipliers`` (n_points, n_ranks, 2). At a fold of the motion itself the number of
    growing disturbances changes from even to odd or back, and a real multiplier is 1.
    """
    folds = []
    for i in np.flatnonzero(np.asarray(kinds) == TURNING_POINT).tolist():
        known = multipliers[i][np.abs(multipliers[i, :, 1]) == 0.0, 0]
        if known.size and np.abs(known - 1.0).min() > _AT_THE_FOLD:
            sides = [_parity(kinds, unstable, places) for places in (range(i - 1, -1, -1), range(i + 1, len(kinds)))]
            if None not in sides and sides[0] == sides[1]:
                folds.append(i)
    return folds


def _parity(kinds: Sequence[str], unstable: Array, places: range) -> bool | None:
    """Whether an odd number of disturbances grows next to a turning point, less doublings between; None: unknown."""
    passed = 0
    for i in places:
        if kinds[i] in (TURNING_POINT, BRANCH_POINT):
            return None
        passed += kinds[i] == PERIOD_DOUBLING
        if kinds[i] not in SPECIAL_KINDS:
            return None if unstable[i] == UNKNOWN else bool((int(unstable[i]) + passed) % 2)
    return None


def between_known(values: Array) -> Array:
    """Values (n_points,) for drawing, with missing ones interpolated linearly."""
    known = np.isfinite(values)
    if not known.any():
        return values
    at = np.arange(len(values))
    return np.asarray(np.interp(at, at[known], values[known]))


def ranks(problem: Problem) -> tuple[str, ...]:
    """Labels of the multipliers that are stored of every point of a problem."""
    n = len(problem.structure.natural_frequencies) or len(problem.structure.dofs)
    return tuple(str(i + 1) for i in range(min(2 * n + len(problem.elements), MOST_MULTIPLIERS)))


def is_wave(problem: Problem) -> bool:
    """Whether the structure is a sector in a travelling wave, whose disturbances have wave numbers."""
    return problem.structure.around is not None and not problem.structure.around.whole


def stability_values(
    points: Sequence[PointStability | None], n_ranks: int, *, of_wave: bool = False
) -> Mapping[str, AnyArray]:
    """Every variable of stability, (n_points, ...)."""
    multipliers = np.full((len(points), n_ranks, 2), np.nan)
    largest = np.full(len(points), np.nan)
    for i, point in enumerate(points):
        if point is not None and point.multipliers.size:
            kept = point.multipliers[:n_ranks]
            multipliers[i, : kept.size] = np.stack([kept.real, kept.imag], axis=1)
            largest[i] = abs(kept[0])
    unstable = np.array([UNKNOWN if point is None else point.unstable for point in points], dtype=np.int32)
    numbers = np.array([UNKNOWN if point is None else point.wave_number for point in points], dtype=np.int32)
    return ({"wave_number": numbers} if of_wave else {}) | {
        "multiplier": multipliers,
        "multiplier_max": largest,
        "unstable_multipliers": unstable,
        "stable": np.where(unstable == UNKNOWN, UNKNOWN, unstable == 0).astype(np.int32),
        "stability_method": np.array(["" if point is None else point.method for point in points], dtype=np.str_),
        "hill_pw_difference": np.array([np.nan if point is None else point.difference for point in points]),
        "neutral_contacts": np.array([UNKNOWN if point is None else point.neutral for point in points], dtype=np.int32),
    }
