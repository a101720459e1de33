"""The solution next to an interpolated point of a branch."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from slipstick.balance.ports import Balance
from slipstick.balance.systems import FrequencySystem
from slipstick.results.branch import Branch
from slipstick.results.record import Point, Recorder
from slipstick.solve.newton import newton
from slipstick.solve.norm import norm
from slipstick.typing import AnyArray


def corrected(branch: Branch, point: int) -> Mapping[str, AnyArray]:
    """Every variable of the schema at the frequency and parameter of a point, solved for from there.

    The point's own numbers where no solution is found next to them. Raises InputError where the problem is not known.
    """
    d, problem = branch.point(point), branch.problem_at(point)
    balance, omega, temperature = Balance(problem), float(d["omega"]), None
    balance.anchor_if_undamped(omega)
    if balance.heated is not None:
        temperature = d["temperature"].to_numpy()[balance.batches[balance.heated.batch].elements]
    system, start = FrequencySystem(balance, problem.inputs), branch.guess(point).ravel()
    result = newton(lambda x: system.evaluate(x, omega, temperature), start, scale=norm(start) or 1.0)
    if not result.converged:
        return {str(name): np.asarray(d[name]) for name in d}
    found = Point.at(
        result.evaluation.detail, x=result.x, residual=result.residual_norm, iterations=result.iterations,
        kind="regular", parameter=omega, peak_of="",
    )  # fmt: skip
    return Recorder(balance).record(found)
