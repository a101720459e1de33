"""All benchmarks in one run, kept as one table in ``benchmarks/results``: ``make bench``, and ``make bench-all``.

    OMP_NUM_THREADS=1 python benchmarks/run.py [SECTION ...] [--all]

Without a section those of some minutes are measured, with ``--all`` the long ones too. A section that is not measured
keeps what was found before. Everything in a section is measured in turn, in one run, on the same inputs; seconds are
of processor time. Figures belong to the machine they were taken on; none is a test.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import warnings
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

import against_pyharm
import curves
import element
import ensembles
import in_time
import numba
import numpy as np
import planar_against_others
import scipy
import startup
import table
from rich.console import Console

from slipstick.errors import SlipstickWarning

HERE = Path(__file__).parent
Rows = list[dict[str, Any]]


class Section(NamedTuple):
    """A table: what it is called, and what makes its rows; ``long`` ones take more than a minute or two."""

    title: str
    measure: Callable[[], Rows]
    long: bool = False


def apart(script: str, *calls: tuple[str, ...]) -> Rows:
    """Rows of a script, each call in a process of its own: their memory is told."""
    rows = []
    for call in calls:
        command = [sys.executable, "-W", "ignore", str(HERE / script), *call]
        done = subprocess.run(command, check=True, capture_output=True, text=True)
        rows += [json.loads(line) for line in done.stdout.splitlines()]
    return rows


def elements() -> Rows:
    """Exact and sampled, at every number of harmonics."""
    return [row for n in element.HARMONICS for row in element.measure(n)]


def pyharm(measure: Callable[[against_pyharm.Side], Rows], script: Path = against_pyharm.SIDE) -> Rows:
    """Nothing where pyHarm is absent."""
    python = against_pyharm.python()
    if python is None:
        return []
    with against_pyharm.Side(python, script) as side:
        return measure(side)


def planar(measure: Callable[[against_pyharm.Side], Rows]) -> Rows:
    """Friction in two directions; nothing where pyHarm is absent."""
    return pyharm(measure, planar_against_others.SIDE)


def contacts(*numbers: int, whole: bool = False) -> Rows:
    """A process for each number of contacts."""
    return apart("many_contacts.py", *((str(n), *(["--whole"] if whole else [])) for n in numbers))


def blades(*sizes: str) -> Rows:
    """128 modes, then as many as the accuracy asks for."""
    return apart("fe_pipeline.py", *(("--size", size, "--modes", n) for size in sizes for n in ("128", "0")))


SECTIONS = {
    "element": Section("The contact element, exact and sampled", elements),
    "regimes": Section("The exact element by what it does", element.by_regime),
    "pyharm-element": Section("An element with constant load, beside pyHarm", lambda: pyharm(against_pyharm.element)),
    "pyharm-curve": Section("The oscillator's curve, beside pyHarm", lambda: pyharm(against_pyharm.curve)),
    "planar-element": Section(
        "An element of two directions, beside pyHarm and tmdsimpy", lambda: planar(planar_against_others.elements)
    ),
    "planar-curve": Section(
        "A curve with a contact of two directions, beside pyHarm", lambda: planar(planar_against_others.curve)
    ),
    "call": Section("One element a call", element.one_by_one),
    "curves": Section("Curves, after warm-up", curves.measure),
    "besides": Section("What is asked of a curve besides, in curves", curves.besides),
    "ensembles": Section("Curves of a study, in lockstep and alone", ensembles.measure),
    "in-time": Section("Time integration of the reduced blade", in_time.measure),
    "contacts": Section("Many contacts, eight points on a flank", lambda: contacts(10, 50, 100, 200)),
    "contacts-whole": Section("Many contacts, whole curves", lambda: contacts(100, 1000, whole=True), long=True),
    "blade": Section("From nothing to a reduced blade", lambda: blades("medium")),
    "blade-large": Section("From nothing to a large reduced blade", lambda: blades("large"), long=True),
    "blade-huge": Section("From nothing to a reduced blade of 300 000 dofs", lambda: blades("1.43e-3"), long=True),
    "start": Section("Start", startup.measure),
}  # fmt: skip

BESIDES: dict[str, tuple[str, str, Callable[[Rows], Rows]]] = {
    "element": (
        "equal-accuracy", "Samples that the best sampled form needs, and its cost there over the exact element",
        element.equal_accuracy,
    ),
    "planar-element": (
        "planar-equal-accuracy", "Two directions: samples that the others need, and their cost there over ours",
        planar_against_others.equal_accuracy,
    ),
}  # fmt: skip
"""Tables made from those that are measured."""


def machine() -> dict[str, str]:
    """What the figures belong to."""
    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": platform.system(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "numba": numba.__version__,
    }


def processor() -> str:
    """Its name, or its kind where the system does not tell."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text().splitlines() if info.exists() else []
    return next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), platform.machine())


def load() -> str:
    """Processes that wanted a processor in the last minute, on average: figures taken beside others are larger."""
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def commit() -> str:
    """Of the sources that were measured."""
    done = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], cwd=HERE, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() or "unknown"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help=", ".join(SECTIONS))
    parser.add_argument("--all", action="store_true", help="the long sections too")
    options = parser.parse_args()
    unknown = set(options.sections) - set(SECTIONS)
    if unknown:
        parser.error(f"there is no section {', '.join(sorted(unknown))}; there are {', '.join(SECTIONS)}")
    warnings.simplefilter("ignore", SlipstickWarning)
    chosen = options.sections or [name for name, section in SECTIONS.items() if options.all or not section.long]
    console, stored = Console(width=200), table.Stored.open(machine())
    for name in chosen:
        before = load()
        rows = SECTIONS[name].measure()
        if not rows:
            console.print(f"{SECTIONS[name].title}: {against_pyharm.ABSENT}")
            continue
        made = {
            "date": f"{datetime.now(UTC):%Y-%m-%d}",
            "commit": commit(),
            "load": f"{before} before, {load()} after",
            "command": f"OMP_NUM_THREADS=1 python benchmarks/run.py {name}",
        }
        stored.put(name, SECTIONS[name].title, rows, made=made)
        if name in BESIDES:
            also, title, of_rows = BESIDES[name]
            stored.put(also, title, of_rows(rows), made=made)
        console.print(table.rich_table(SECTIONS[name].title, rows))
        console.print(f"load {made['load']}; again by: {made['command']}\n")
        stored.write()
    console.print(f"kept in {stored.path.with_suffix('.md')}")


if __name__ == "__main__":
    main()
