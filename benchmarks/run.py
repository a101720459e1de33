"""All benchmarks in one table: ``make bench``. Figures belong to the machine they were taken on; none is a test."""

import os
import platform

import curves
import element
import numba
import numpy as np
import startup
from rich.console import Console
from rich.table import Table


def table(title, rows):
    """A table of dictionaries with equal keys."""
    out = Table(title=title, title_justify="left")
    for key in rows[0]:
        out.add_column(key)
    for row in rows:
        out.add_row(*(f"{value:.4g}" if isinstance(value, float) else str(value) for value in row.values()))
    return out


def main():
    console = Console(width=150)
    versions = f"Python {platform.python_version()}, numpy {np.__version__}, numba {numba.__version__}"
    console.print(f"{platform.machine()}, {os.cpu_count()} cores, {versions}")
    for title, measured in (("element, one core", element.measure()), ("start", startup.measure())):
        console.print(table(title, [{"what": key, "value": value} for key, value in measured.items()]))
    console.print(table("curves, after warm-up", list(curves.measure())))


if __name__ == "__main__":
    main()
