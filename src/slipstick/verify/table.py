"""The table of ``slipstick verify``: rows that are computed when asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from slipstick.errors import InputError

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


def all_checks() -> tuple[Check, ...]:
    """Every row of the table, in its order."""
    from slipstick.verify import closed_form_checks, method_checks, oscillator_checks

    return (*closed_form_checks.CLOSED_FORM_CHECKS, *method_checks.METHOD_CHECKS, *oscillator_checks.OSCILLATOR_CHECKS)


def computed_rows(names: str | Sequence[str] | None = None) -> Iterator[Row]:
    """Rows one after another, each computed when it is asked for.

    ``names`` keeps the rows whose name or description contains one of the given texts, whatever the case.

    Raises
    ------
    InputError
        If no row is kept.
    """
    wanted = [names] if isinstance(names, str) else list(names or ())
    checks = all_checks()
    chosen = [c for c in checks if not wanted or any(t.lower() in f"{c.name} {c.what}".lower() for t in wanted)]
    if not chosen:
        known = ", ".join(dict.fromkeys(check.name for check in checks))
        raise InputError(f"verify: no check is called {' or '.join(wanted)}; there are {known}")
    return (check.row() for check in chosen)
