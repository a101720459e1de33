"""One row of the table of ``slipstick verify``, before and after it is computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

ExpectedFound = tuple[float, float]
Compute = Callable[[], ExpectedFound]


class Row(NamedTuple):
    """One computed row; ``verdict`` is "ok", "failed", or the error that kept it from being computed."""

    name: str
    what: str
    expected: str
    found: str
    tolerance: str
    verdict: str

    @property
    def ok(self) -> bool:
        """Whether the row holds."""
        return self.verdict == "ok"


@dataclass(frozen=True, kw_only=True)
class Check:
    """One row before it is computed.

    Parameters
    ----------
    name, what
        Short name ("CF1", "C7", ...) and what is compared.
    compute
        Gives (expected, found).
    tolerance
        Largest absolute difference for ``relation`` "=", in the units of the values; slack of the inequalities.
    relation
        "=", "<" or ">": found = expected, found < expected, found > expected.
    """

    name: str
    what: str
    compute: Compute
    tolerance: float = 0.0
    relation: str = "="

    def row(self) -> Row:
        """Computes the row; an exception is a row that failed, not the end of the table."""
        try:
            expected, found = self.compute()
        except Exception as error:
            return Row(self.name, self.what, "", "", self._tolerance, f"error: {error}")
        sign = "" if self.relation == "=" else f"{self.relation} "
        verdict = "ok" if self._holds(expected, found) else "failed"
        return Row(self.name, self.what, f"{sign}{expected:.8g}", f"{found:.8g}", self._tolerance, verdict)

    @property
    def _tolerance(self) -> str:
        return f"{self.tolerance:.1e}" if self.tolerance else ""

    def _holds(self, expected: float, found: float) -> bool:
        if self.relation == "<":
            return found < expected + self.tolerance
        if self.relation == ">":
            return found > expected - self.tolerance
        return abs(found - expected) <= self.tolerance
