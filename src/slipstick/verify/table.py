"""The table of ``slipstick verify``: rows that are computed when asked for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from slipstick.errors import InputError
from slipstick.verify.checks import Check, Row


def all_checks() -> tuple[Check, ...]:
    """Every row of the table, in its order."""
    from slipstick.verify import belt_checks, closed_form_checks, method_checks, oscillator_checks

    return (
        *closed_form_checks.CLOSED_FORM_CHECKS,
        *method_checks.METHOD_CHECKS,
        *oscillator_checks.OSCILLATOR_CHECKS,
        *belt_checks.BELT_CHECKS,
    )


def computed_rows(names: str | Sequence[str] | None = None) -> Iterator[Row]:
    """Rows one after another, each computed when it is asked for.

    ``names`` keeps the rows of one of the given names, such as "CF1", or of a family, such as "CF"; a text that is
    neither keeps those whose name or description contains it. Capitals do not matter.

    Raises
    ------
    InputError
        If no row is kept.
    """
    wanted = [names] if isinstance(names, str) else list(names or ())
    checks = all_checks()
    kept = {id(check) for text in wanted for check in _called(checks, text.lower())}
    chosen = [check for check in checks if not wanted or id(check) in kept]
    if not chosen:
        known = ", ".join(dict.fromkeys(check.name for check in checks))
        raise InputError(f"verify: no check is called {' or '.join(wanted)}; there are {known}")
    return (check.row() for check in chosen)


def _called(checks: Sequence[Check], text: str) -> list[Check]:
    named = [check for check in checks if check.name.lower() == text]
    family = [check for check in checks if check.name.lower().rstrip("0123456789") == text]
    return named or family or [check for check in checks if text in f"{check.name} {check.what}".lower()]


SECTIONS = {
    "Closed forms": (
        ("CF",),
        "Cases of the contact element and of one oscillator with a closed-form answer: "
        "[theory](THEORY.md), sections 2 to 8.",
    ),
    "The element by other means": (
        ("march", "slope"),
        "Random elements against a march of the contact law in small steps, derivatives against central differences.",
    ),
    "Time integration": (
        ("time",),
        "The oscillator of Petrov (2012) integrated in time, event by event ([theory](THEORY.md), section 12),\n"
        "against the exact values of its piecewise linear equations.",
    ),
    "Reference values for the published cases": (
        ("C",),
        "The oscillator of Petrov (2012): mass 1, damping 0.4, stiffness 40, load 100, kt 100, mu 0.3,\n"
        "normal load 800. The paper has statements and figures, no tables: expected are our own reference values\n"
        "for its cases, computed by independent methods. Frequencies read from a figure are allowed the width\n"
        "of its lines.",
    ),
    "The balance": (
        ("exact", "order"),
        "The multiharmonic balance with harmonics 0 to 10 against the exact values; what differs is its truncation,\n"
        "which falls with the third power of the highest harmonic (there is mass at the contact).",
    ),
    "Self-excited vibration on a belt": (
        ("belt",),
        "A mass on a belt with falling friction ([its page](falling-friction.md)): onset and amplitude of Thomsen and\n"
        "Fidlin (2003), who average over a period; and the starts that Stender and Hoffmann (2021) counted in bSTAB.",
    ),
}
"""Headings, the names of their rows (letters before the number), and what they show."""


_NOISE = 1e-9


def table_page(rows: Iterable[Row], version: str) -> str:
    """All rows by section, with what each section shows."""
    rows = list(rows)
    holding = sum(row.ok for row in rows)
    parts = [
        "# Verification table\n",
        f"{holding} of {len(rows)} checks pass, slipstick {version}.\n"
        "Your installation: `slipstick verify`, half a minute.\n"
        "This page: `slipstick verify --markdown docs/validation.md --force`.\n",
    ]
    for title, (names, about) in SECTIONS.items():
        section = [row for row in rows if row.name.rstrip("0123456789") in names]
        parts.append(f"## {title}\n\n{about}\n\n{_table(section)}" if section else "")
    return "\n".join(part for part in parts if part)


def _table(rows: Sequence[Row]) -> str:
    lines = ["| | what | expected | found | allowed | |", "|---|---|---|---|---|---|"]
    for row in rows:
        what = row.what.replace("|", "\\|")
        lines.append(f"| {row.name} | {what} | {row.expected} | {_shown(row)} | {row.tolerance} | {row.verdict} |")
    return "\n".join(lines) + "\n"


def _shown(row: Row) -> str:
    """What was found, to the digits that are the same on every machine."""
    if not row.found:
        return ""
    found, limit = float(row.found), float(row.tolerance or _NOISE)
    return f"below {limit:.0e}" if row.expected == "0" and abs(found) < limit else f"{found:.6g}"
