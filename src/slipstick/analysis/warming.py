"""Contact temperatures along a branch: carried from point to point, and watched."""

from __future__ import annotations

from typing import Any

from slipstick.balance.residual import Balance


class Warming:
    """Hands the temperatures of each point on to the next and notes what happens to them; idle without heat.

    Attributes
    ----------
    jumps
        Values of the followed quantity at points where the equilibrium next to the point before had vanished, so that
        another one was taken.
    """

    def __init__(self, balance: Balance) -> None:
        self._balance = balance
        self._names = [pair.name for pair in balance.problem.contacts]
        self.jumps: list[float] = []

    def accept(self, step: Any) -> str | None:
        """Take the temperatures of a step; a sentence where they are no result."""
        heat = step.evaluation.detail.heat
        if heat is None:
            return None
        fault: str | None = heat.equilibrium.problem(self._names)
        if fault is None:
            self._balance.temperature = heat.temperature
            if heat.equilibrium.jumped:
                self.jumps.append(float(step.parameter))
        return fault

    @property
    def remark(self) -> str:
        """What to add to the message of the outcome, or nothing."""
        if not self.jumps:
            return ""
        where = ", ".join(f"{value:.6g}" for value in self.jumps[:5])
        return (
            f"; at {where} the thermal equilibrium next to the point before had vanished and the contacts took another "
            "one: several exist nearby, and the way back may differ"
        )
