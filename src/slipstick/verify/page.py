"""The table of ``slipstick verify`` as a page of markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from slipstick.verify.table import Row

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
        "Your installation: `slipstick verify`, ten seconds.\n"
        "This page: `slipstick verify --markdown docs/validation.md`.\n",
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
