"""The table that ``run.py`` keeps: one file for a machine and its versions, for programs (.json) and for people (.md).

python benchmarks/table.py      writes the tables into the pages again
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rich.table import Table

RESULTS = Path(__file__).parent / "results"
PAGES = [Path(__file__).parents[1] / "docs" / f"{name}.md" for name in ("accuracy-and-speed", "which-law")]
_BLOCK = re.compile(r"<!-- table (?P<section>[\w-]+)(?P<where>.*?) -->\n.*?<!-- end -->", re.DOTALL)
_NAMED = re.compile(r"benchmarks/results/([\w.-]+)\.md")
Rows = list[dict[str, Any]]


def shown(value: Any) -> str:
    """A figure with three digits."""
    return f"{value:.3g}" if isinstance(value, float) else str(value)


@dataclass
class Stored:
    """What was measured on one machine, by section."""

    path: Path
    machine: dict[str, str]
    sections: dict[str, dict[str, Any]]

    @classmethod
    def open(cls, machine: dict[str, str]) -> Stored:
        """What there is of this machine with these versions, or nothing yet."""
        parts = [f"{machine['processor']}-{machine['cores']}-cores"]
        parts += [f"{name}-{machine[name]}" for name in ("python", "numpy", "numba")]
        path = RESULTS / (re.sub(r"[^\w.]+", "-", "-".join(parts)).strip("-").lower() + ".json")
        return cls.read(path) if path.exists() else cls(path, machine, {})

    @classmethod
    def read(cls, path: Path) -> Stored:
        kept = json.loads(path.read_text(encoding="utf-8"))
        return cls(path, kept["machine"], kept["sections"])

    def put(self, name: str, title: str, rows: Rows, *, made: dict[str, str]) -> None:
        """``made``: when, of which sources, beside which load, and by which command."""
        self.sections[name] = {"title": title, **made, "rows": rows}

    def rows(self, name: str, **where: Any) -> Rows:
        """Rows of a section with these values."""
        rows: Rows = self.sections[name]["rows"]
        return [row for row in rows if all(row[key] == value for key, value in where.items())]

    def write(self) -> None:
        RESULTS.mkdir(exist_ok=True)
        kept = json.dumps({"machine": self.machine, "sections": self.sections})
        for start in ("{", '"sections"', '"rows"'):  # a line for each of these
            kept = kept.replace(f", {start}", f",\n{start}")
        self.path.write_text(kept + "\n", encoding="utf-8")
        self.path.with_suffix(".md").write_text(self.text(), encoding="utf-8")

    def text(self) -> str:
        """All of it, to be read."""
        versions = ", ".join(f"{name} {value}" for name, value in self.machine.items())
        parts = [
            "# Benchmarks\n",
            f"{versions}. Seconds of processor time; made by `make bench` and `make bench-all`.\n",
        ]
        for section in self.sections.values():
            made = f"{section['date']}, sources {section['commit']}"
            if "command" in section:
                made += f", load of the machine {section['load']} (1 is the benchmark's own), by `{section['command']}`"
            parts += [f"## {section['title']}\n", f"{made}\n", markdown(section["rows"])]
        return "\n".join(parts)


def markdown(rows: Rows) -> str:
    """Rows that may lack some columns."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    lines = [columns, ["---"] * len(columns), *([shown(row.get(key, "")) for key in columns] for row in rows)]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def rich_table(title: str, rows: Rows) -> Table:
    """The same for a terminal."""
    out = Table(title=title, title_justify="left")
    columns = list(dict.fromkeys(key for row in rows for key in row))
    for key in columns:
        out.add_column(key)
    for row in rows:
        out.add_row(*(shown(row.get(key, "")) for key in columns))
    return out


def of_page(text: str) -> Stored:
    """The table that a page names."""
    named = _NAMED.search(text)
    if named is None:
        raise ValueError("the page names no table in benchmarks/results")
    return Stored.read(RESULTS / f"{named[1]}.json")


def filled(text: str) -> str:
    """The page with its tables as they are stored.

    ``<!-- table SECTION key = value, key = value or value: column; column -->`` takes these rows and columns.
    """
    stored = of_page(text)

    def block(found: re.Match[str]) -> str:
        head = found[0].split("\n", 1)[0]
        condition, _, wanted = found["where"].strip().partition(":")
        where = dict(part.split(" = ") for part in condition.split(", ") if part)
        rows = [
            row
            for row in stored.rows(found["section"])
            if all(shown(row[key]) in values.strip().split(" or ") for key, values in where.items())
        ]
        columns = [name.strip() for name in wanted.split(";") if name.strip()]
        picked = [{name: row[name] for name in columns if name in row} for row in rows] if columns else rows
        return f"{head}\n{markdown(picked)}<!-- end -->"

    return _BLOCK.sub(block, text)


if __name__ == "__main__":
    for page in PAGES:
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
