"""Damped Newton for piecewise smooth systems: ``System`` and ``Evaluation`` in, ``NewtonResult`` out."""

from slipstick.solve.newton.iteration import iterate, newton, newton_at
from slipstick.solve.newton.options import NewtonOptions
from slipstick.solve.newton.result import NewtonResult, NewtonStop
from slipstick.solve.newton.system import Evaluation, System

__all__ = ["Evaluation", "NewtonOptions", "NewtonResult", "NewtonStop", "System", "iterate", "newton", "newton_at"]
