"""Responses per force, and universal files of them: data sets 58, which programs for modal tests read.

The format is fixed: a frequency has 13 characters, here as many digits as these hold (eleven or twelve), real and
imaginary parts have 13 digits. Nodes are numbers; other names of dofs stand in the second line of a data set.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import enumerated
from slipstick.results.view import analysis_of, names_of
from slipstick.typing import Array, ComplexArray
from slipstick.units import SIZES, Units, is_rotation, unit_of_dof

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions

NAMED = "slipstick: "
"""Begins the line of a data set that has the names of both dofs."""
DIRECTIONS = {1: "x", 2: "y", 3: "z", 4: "rx", 5: "ry", 6: "rz"}
"""Directions of a node, by their numbers in universal files."""
FRF = 4
"""A frequency response function, among the functions of a data set 58."""
OTHER_FILES = "write a .csv, .mat or .xlsx file"
"""What to do where results are no response functions."""
_NODE = re.compile(r"n(\d{1,9})(r?[xyz])")
_FREQUENCY, _DISPLACEMENT, _FORCE, _COMPLEX = 18, 8, 13, 6
_LINE, _LABEL, _WIDTH = 80, 20, 13
_ANALYSES = ("response", "linear", "steady")


def single_force(problem: Problem) -> tuple[str, int, complex]:
    """The one vibrating force: its dof, its harmonic and its complex amplitude ``z`` of ``Re(z exp(i m tau))``.

    Raises
    ------
    InputError
        Where there is none, or more than one dof or harmonic is excited: there is no response per force then.
    """
    vibrating = [load for load in problem.loads if load.harmonic and load.amplitude]
    others = [load.target for load in vibrating if load.dof is None or load.motion is not None]
    places = dict.fromkeys((load.target, load.harmonic) for load in vibrating)
    if others or len(places) != 1:
        found = enumerated([f"{target} (harmonic {m})" for target, m in places]) or "none"
        remedy = "a response function is the motion per one force" + (f", not of {others[0]}" if others else "")
        raise InputError(Fault("loads", found=found, expected="one force on one dof, of one harmonic", remedy=remedy))
    ((dof, harmonic),) = places
    force = problem.load * sum(complex(load.cos, -load.sin) for load in vibrating)
    return dof, harmonic * problem.load_order, force


def write_functions(solutions: Solutions, target: Path) -> None:
    """The responses of all outputs per force, length/force, at all points in their order.

    Raises
    ------
    InputError
        For results that are no frequency response, whose problem is not known, or of several forces.
    """
    data = solutions.table
    if solutions.followed != "omega" or analysis_of(data) not in _ANALYSES:
        found = f"results of the analysis {analysis_of(data)!r}, over {solutions.followed}"
        raise InputError(Fault("table", found=found, expected="a frequency response", remedy=OTHER_FILES))
    if solutions.problem is None:
        said = f"the forces are not known: {solutions.without}"
        raise InputError(Fault("table", said, remedy=OTHER_FILES))
    with_force = single_force(solutions.problem)
    units = Units.of_results(data.attrs)
    labels = names_of(data, "coefficient")
    at = [labels.index(f"{part}{with_force[1]}") for part in "cs"]
    parts = data["displacement"].to_numpy()[:, :, at]
    values = (parts[..., 0] - 1j * parts[..., 1]) / with_force[2]
    hertz = data["omega"].to_numpy() * with_force[1] / (2.0 * np.pi) / _seconds(units)
    outputs = names_of(data, "dof")
    known = list(dict.fromkeys([*outputs, with_force[0]]))
    with target.open("w", encoding="ascii", errors="replace", newline="\n") as file:
        for dof, one in zip(outputs, values.T, strict=True):
            for line in _data_set(dof, with_force[0], known, hertz, one, units):
                file.write(f"{line}\n")


def _seconds(units: Units) -> float:
    name = "s" if units.time == "time" else units.time
    if name not in SIZES["time"]:
        said = f"frequencies in Hz are not known: the unit of time is {units.time!r}"
        raise InputError(Fault("table", said, remedy=OTHER_FILES))
    return SIZES["time"][name]


def _data_set(
    dof: str, force: str, known: list[str], hertz: Array, values: ComplexArray, units: Units
) -> Iterator[str]:
    length, newton = units.label("length"), units.label("force")
    over = "" if length == "length" else unit_of_dof(length, dof)
    under = "" if newton == "force" else f"{newton} {length}" if is_rotation(force) else newton
    names = f"{NAMED}{dof}/{force}"
    plain = names.isascii() and len(names) <= _LINE and "/" not in dof and "/" not in force
    (node, direction), (reference, along) = (_node(name, known) for name in (dof, force))
    yield f"{-1:6d}"
    yield f"{58:6d}".ljust(_LINE)
    yield from (line[:_LINE].ljust(_LINE) for line in (
        f"displacement of {dof} by a force on {force}", names if plain else "NONE", "NONE", "NONE", "NONE",
    ))  # fmt: skip
    yield (f"{FRF:5d}{0:10d}{0:5d}{0:10d} {'NONE':<10}{node:10d}{direction:4d} "
           f"{'NONE':<10}{reference:10d}{along:4d}")  # fmt: skip
    yield f"{_COMPLEX:10d}{hertz.size:10d}{0:10d}{0.0:13.5e}{0.0:13.5e}{0.0:13.5e}"
    yield _axis(_FREQUENCY, "Frequency", "Hz")
    yield _axis(_DISPLACEMENT, "Displacement", over)
    yield _axis(_FORCE, "Force", under)
    yield _axis(0, "", "")
    for at, value in zip(hertz.tolist(), values.tolist(), strict=True):
        yield f"{_short(at)}{value.real:20.12e}{value.imag:20.12e}"
    yield f"{-1:6d}"


def _axis(kind: int, label: str, unit: str) -> str:
    return f"{kind:10d}{0:5d}{0:5d}{0:5d} {(label or 'NONE')[:_LABEL]:<20} {(unit or 'NONE')[:_LABEL]:<20}"


def _node(dof: str, known: list[str]) -> tuple[int, int]:
    """Number of a node and direction; of a dof of another name its place among all, as a scalar."""
    match = _NODE.fullmatch(dof)
    if match is None:
        return known.index(dof) + 1, 0
    return int(match[1]), next(code for code, name in DIRECTIONS.items() if name == match[2])


def _short(value: float) -> str:
    """A number in the 13 characters of a frequency, with as many digits as these hold.

    >>> _short(12.345678901234), _short(0.123456789012345), _short(0.00012345678901234)
    ('12.3456789012', '.123456789012', '.000123456789')
    """
    texts = [f"{value:.{digits}{kind}}".removeprefix("0") for digits in range(1, _WIDTH) for kind in "fe"]
    fitting = [text for text in texts if len(text) <= _WIDTH]
    return min(fitting, key=lambda text: abs(float(text) - value)).rjust(_WIDTH)
