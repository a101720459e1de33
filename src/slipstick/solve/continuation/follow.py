"""Pseudo-arclength continuation of ``residual(x, parameter) = 0`` as an iterator of points.

H. B. Keller's bordered system (Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977) with a
cubic Hermite predictor through the last two points and a scaled arclength.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from slipstick.errors import InputError
from slipstick.solve.continuation.events import BranchEvent, Watched
from slipstick.solve.continuation.metric import ArclengthScaling
from slipstick.solve.continuation.options import ContinuationOptions
from slipstick.solve.continuation.path import Continuation
from slipstick.solve.continuation.place import Place
from slipstick.solve.continuation.readings import Readings
from slipstick.solve.continuation.step import Step
from slipstick.solve.newton import System
from slipstick.typing import Array


def continuation(
    system: System,
    x0: ArrayLike,
    start: float,
    stop: float,
    *,
    options: ContinuationOptions | None = None,
    scaling: ArclengthScaling | None = None,
    events: Sequence[BranchEvent] = (),
    requested: Sequence[float] = (),
    at: float | None = None,
    direction: ArrayLike | None = None,
    context: Any = None,
    places: Sequence[Place] = (),
    doubted: Callable[[Step, Step, Array], bool] | None = None,
    readings: Readings | None = None,
    watched: Watched | None = None,
) -> Continuation:
    """Follow the branch through ``x0`` from ``start`` to ``stop``.

    Parameters
    ----------
    system
        Anything with ``evaluate(x, parameter) -> Evaluation``.
    x0
        A solution at ``start`` or a guess near one (N,): it is first corrected at the fixed parameter.
    start, stop
        Range of the parameter, in either order. The branch may turn back inside; it ends exactly on ``stop``, or on
        ``start`` when it comes back there (outcome TURNED_BACK).
    events
        Sign changes to locate.
    requested
        Parameter values within the range at which a point is wanted; every passage (also on overhanging branches)
        gives one. The two ends are points anyway.
    at, direction
        To take up a branch inside the range: ``x0`` belongs to the parameter ``at``, and the branch is followed along
        ``direction`` (N + 1,), the ``tangent`` of an earlier step there. Default: from ``start`` towards ``stop``.
    context
        What the point before handed on, see ``System``; None for a start from nothing.
    places
        To go on where another continuation with the same arguments stood: its last ``place``, preceded by the one
        before where there is one. The points to come are those it would have found, to the last bit on one machine.
    doubted
        Whether a point is not to be believed: of the last point, the new one and what was expected of its state. A
        shorter step is taken then, down to ``kink_step``.
    readings
        What is read off the states besides, which is to be as good and as finely resolved as they are.
    watched
        What the largest values are sought of, see ``Watched``: ordinary points are put where one exceeds all before.

    Returns
    -------
    Continuation
        An iterator of ``Step``; afterwards its ``outcome``, ``message`` and work counters say how it ended (the
        outcome is also the value of the last ``StopIteration``, so of ``yield from``).

    Raises
    ------
    InputError
        For a range, guess or request that cannot be followed, before anything is computed.

    Examples
    --------
    >>> from slipstick.solve.linear.dense import DenseJacobian
    >>> from slipstick.solve.newton import Evaluation
    >>> class Line:
    ...     def evaluate(self, x, p):
    ...         return Evaluation(x - p, DenseJacobian(np.eye(1)), -np.ones(1))
    >>> run = continuation(Line(), [0.0], 0.0, 1.0)
    >>> steps = list(run)
    >>> steps[-1].kind, steps[-1].parameter, run.outcome.name
    ('end', 1.0, 'COMPLETED')
    """
    _check(np.asarray(x0, dtype=float), start, stop, np.asarray(requested, dtype=float), at, direction)
    return Continuation(
        system,
        np.array(x0, dtype=float),
        (float(start), float(stop)),
        options=options or ContinuationOptions(),
        scaling=scaling or ArclengthScaling(),
        events=events,
        requested=np.unique(np.asarray(requested, dtype=float)),
        at=float(start if at is None else at),
        direction=None if direction is None else np.asarray(direction, dtype=float),
        context=context,
        places=tuple(places),
        doubted=doubted,
        readings=readings,
        watched=watched,
    )


def _check(
    x: Array, start: float, stop: float, requested: Array, at: float | None, direction: ArrayLike | None
) -> None:
    faults = []
    if x.ndim != 1 or x.size == 0 or not np.all(np.isfinite(x)):
        faults.append(f"continuation x0: found shape {x.shape}; expected finite numbers of shape (N,)")
    if not (np.isfinite(start) and np.isfinite(stop)) or start == stop:
        faults.append(f"continuation range: found {start} to {stop}; expected two different finite numbers")
    low, high = min(start, stop), max(start, stop)
    outside = requested[~((requested >= low) & (requested <= high))]
    if outside.size:
        faults.append(f"requested parameter value {outside.flat[0]:g}: outside of the range {low:g} to {high:g}")
    if at is not None and not low <= at <= high:
        faults.append(f"continuation at: found {at:g}; expected a value within the range {low:g} to {high:g}")
    if direction is not None and np.shape(direction) != (x.size + 1,):
        faults.append(f"continuation direction: found shape {np.shape(direction)}; expected ({x.size + 1},)")
    if faults:
        raise InputError(faults)
