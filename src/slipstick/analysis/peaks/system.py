"""The balance at a peak of an amplitude as a system of equations.

A peak is ``R(X, w, s) = 0`` with ``G = da/dw = 0``: one more unknown, w, and one more equation. Its Jacobian is that of
the balance with a border, which is eliminated: one factorisation gives ``t``, ``z`` and the Newton step.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from slipstick.analysis.augmented import Augmented, Bordered
from slipstick.analysis.peaks.gradient import Extreme, PeakGradient, StateSpace
from slipstick.analysis.sensitivity.linearization import FREQUENCY, NOTHING, Linearization
from slipstick.balance.evaluation import Detail
from slipstick.balance.inputs import Inputs
from slipstick.solve.linear.jacobian import Eliminated
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True, slots=True)
class PeakDetail(Detail):
    """What a peak keeps of its evaluation.

    Attributes
    ----------
    amplitude, rate
        Of the extreme followed, and its derivative by the parameter.
    bend
        Its second derivative by the frequency along the solutions: negative at a maximum.
    ahead
        Largest other extreme in time over the one followed, less 1.
    motion, extreme
        The motion (L,) of the output, and its extreme in time that is followed.
    """

    amplitude: float
    rate: float
    bend: float
    ahead: float
    motion: Array
    extreme: Extreme


class PeakSystem(Augmented):
    """``(R, G) = 0`` for the unknowns ``(X, w)`` over a parameter.

    Parameters
    ----------
    space
        The states, with one output, and a parameter if they are looked at over one.

    Attributes
    ----------
    factorisations
        How many Jacobians of the balance were factorised so far.
    """

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.balance = space.outputs.balance
        self.factorisations = 0

    def at(self, parameter: float) -> tuple[Inputs, float]:
        """Inputs at ``parameter``; the frequency is not known there."""
        return self.space.at_value(parameter), float("nan")

    def slope(
        self, y: Array, parameter: float, context: Array | None = None
    ) -> tuple[Linearization, PeakGradient] | None:
        """The balance linearised at a state and the slope of its amplitude over frequency; None where it is no motion.

        ``context`` holds the time of the extreme that is followed (nan: the largest), and contact states (n_states,).
        """
        if not (isfinite(y.dot(y)) and y[-1] > 0.0 and isfinite(parameter)):
            return None
        near = None if context is None or context.size == 1 else context[1:]
        here = self.space.at(y[:-1], float(y[-1]), parameter, near)
        if here.lost or not np.all(np.isfinite(here.at.residual)) or here.jacobian.singular:
            return None
        U, h = here.motion()[0], self.balance.harmonics
        extreme = (
            Extreme.largest(h, U) if context is None or np.isnan(context[0]) else Extreme.near(h, U, float(context[0]))
        )
        self.factorisations += 1
        return here, PeakGradient(self.space, here, parameter, extreme)

    def state(self, y: Array, parameter: float, context: Array | None = None) -> Bordered | None:
        """The balance with ``G = 0``; ``detail`` is a ``PeakDetail``."""
        sloped = self.slope(y, parameter, context)
        if sloped is None:
            return None
        here, slope = sloped
        beside = slope.displaced(here.omega)
        row = np.append(beside.by_motion(), beside.along(FREQUENCY))
        along = NOTHING if self.space.path is None else self.space.along(parameter)
        R, U = here.change(np.zeros_like(here.x), along)
        carried = np.zeros(0) if here.detail.carried is None else here.detail.carried
        detail = PeakDetail(
            responses=here.detail.responses, inputs=here.detail.inputs, omega=here.omega, states=here.detail.states,
            amplitude=slope.extreme.value, rate=float(np.sum(slope.extreme.h * U) - slope.z @ R),
            bend=float(row @ np.append(slope.t, 1.0)), ahead=slope.extreme.ahead(here.motion()[0]),
            motion=here.motion()[0], extreme=slope.extreme,
        )  # fmt: skip
        return Bordered(
            here, Eliminated(here.jacobian, slope.R[:, None], row[None], -slope.t[:, None]),
            np.array([slope.value]), np.array([slope.size]), lambda way: np.array([beside.along(way)]),
            np.append(R, beside.along(along)), detail, np.append(slope.extreme.time, carried),
        )  # fmt: skip
