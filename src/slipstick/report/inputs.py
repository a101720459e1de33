"""Tables of what was computed: the model, its modes, its loads, its contacts by kind."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.balance.base_motion import MOTION_UNITS
from slipstick.balance.contact_words import direction_words, rubbing_words, shown_quantities
from slipstick.balance.parameters import FACTORS
from slipstick.html import MOST_SHOWN, some
from slipstick.structure.cyclic import TravellingWave
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import ModalStructure
from slipstick.units import Units

if TYPE_CHECKING:
    from collections.abc import Mapping

    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.structure.protocol import Structure

MOST_MODES = 10
MOST_LOADS = 30
_MOST_MASSES = 6
_MOST_WORDS = 3
"""Directions and rubbing motions that are listed of one kind of contact."""


def inputs_of(problem: Problem | None, attributes: Mapping[str, Any], frequency_unit: str) -> list[dict[str, Any]]:
    """Tables ``{"title", "head", "rows"}`` of texts; where the problem is not known, those of the text of the case.

    ``attributes`` are those of the results, which hold that text; frequencies are in ``frequency_unit``.
    """
    if problem is None:
        return inputs_of_case(str(attributes.get("case", "")))
    tables = [
        _table("Model", (), _model(problem, attributes)),
        _table(*_modes(problem, frequency_unit)),
        _table("Loads", ("on", "as", "harmonic", "amplitude", "phase"), _loads(problem)),
        _table(*_contacts(problem)),
    ]
    return [table for table in tables if table["rows"]]


def inputs_of_case(text: str) -> list[dict[str, Any]]:
    """Structure, loads and contacts as the text of a case gives them; none of another text."""
    case = _parsed(text)
    top = [(name, _said(case[name])) for name in ("harmonics", "period_ratio", "units") if name in case]
    structure = case.get("structure", {})
    rows = [(name, _said(value)) for name, value in structure.items()] if isinstance(structure, dict) else []
    tables = [_table("Model", (), iter([*rows, *top] if rows else []))]
    for title, name in (("Loads", "load"), ("Contacts", "contact")):
        listed = case.get(name)
        given = [row for row in listed if isinstance(row, dict)] if isinstance(listed, list) else []
        head = list(dict.fromkeys(key for row in given for key in row))
        said = [key.replace("_", " ") for key in head]
        tables.append(_table(title, said, ([_said(row.get(key, "-")) for key in head] for row in given[:MOST_LOADS])))
        if len(given) > MOST_LOADS:
            tables[-1]["rows"].append([f"and {len(given) - MOST_LOADS} more", *[""] * (len(head) - 1)])
    return [table for table in tables if table["rows"]]


def _parsed(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return {}


_LONGEST = 100
"""Characters of a value in a table; of a longer one the beginning is shown."""


def _said(value: Any) -> str:
    """A value of a case in few words."""
    if isinstance(value, dict):
        said = ", ".join(f"{name} {_said(each)}" for name, each in value.items())
    elif isinstance(value, list):
        joined = ", ".join(map(_said, value))
        said = joined if all(isinstance(each, str) for each in value) else f"[{joined}]"
    else:
        said = f"{value:g}" if isinstance(value, float) else str(value)
    return said if len(said) <= _LONGEST else f"{said[:_LONGEST]} ..."


def _table(title: str, head: Sequence[str], rows: Iterator[Sequence[str]]) -> dict[str, Any]:
    return {"title": title, "head": list(head), "rows": [list(row) for row in rows]}


def _model(problem: Problem, attributes: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    structure, units = problem.structure, problem.units
    yield "structure", _kind(structure)
    if origin := _origin(str(attributes.get("case", ""))):
        yield "from", origin
    yield "degrees of freedom", _counted(structure.dofs)
    if isinstance(structure, MatrixStructure):
        yield "masses", _masses(structure, units)
    if structure.load_shapes:
        yield "load shapes", some(structure.load_shapes)
    if problem.relative:
        yield "motion", "relative to the moving support"
    for state in problem.contact_states:
        yield state.has, some(state.names)
    named = [units.label(base) for base in ("length", "force", "time", "temperature")]
    if not problem.thermal and named[3] == "temperature":  # nobody asked for one
        named.pop()
    yield "units", ", ".join(named) if units != Units() else "not named; any that are consistent"
    unknowns = sum(pair.n_ports for pair in problem.contacts) * problem.harmonics.size
    yield "harmonics", f"{some(problem.harmonics.orders, 14)}; {unknowns} unknowns"
    if problem.period_ratio != (1, 1):
        yield "period of the load over that of the rub", "{}/{}".format(*problem.period_ratio)
    for name, on in FACTORS.items():
        if (factor := getattr(problem, name)) != 1.0:
            yield f"factor on {on}", f"{factor:g}"


def _kind(structure: Structure) -> str:
    if isinstance(structure, TravellingWave):
        return f"wave of engine order {structure.engine_order} on {structure.sectors} sectors"
    if isinstance(structure, ModalStructure):
        return f"{len(structure.natural_frequencies)} modes"
    if isinstance(structure, MatrixStructure):
        return "matrices"
    return type(structure).__name__


def _origin(case: str) -> str:
    """Kind and files of the structure in the text of a case; empty of a problem made in Python."""
    table = _parsed(case).get("structure", {})
    if not isinstance(table, dict) or not table:
        return ""
    files = [value for value in table.values() if isinstance(value, str) and value.rpartition(".")[2] in _ENDINGS]
    return ", ".join([f'kind "{table.get("kind", "")}" of the case file', *files])


_ENDINGS = ("npz", "mtx", "h5", "inp", "msh", "bdf", "dat", "nas", "csv", "full", "op2", "unv")
"""Ends of the names of files that hold a structure."""


def _masses(structure: MatrixStructure, units: Units) -> str:
    masses = np.real(structure.M.diagonal())
    unit = units.after("force time^2/length")
    if masses.size <= _MOST_MASSES:
        return ", ".join(f"{dof} {mass:.6g}{unit}" for dof, mass in zip(structure.dofs, masses, strict=True))
    return f"{masses.min():.6g} to {masses.max():.6g}{unit} on the diagonal"


def _modes(problem: Problem, unit: str) -> tuple[str, tuple[str, ...], Iterator[tuple[str, ...]]]:
    """The lowest modes without contacts."""
    structure, size = problem.structure, problem.units.frequencies.get(unit, 1.0)
    natural = np.asarray(structure.natural_frequencies, dtype=float)
    ratios = structure.damping_ratios
    shown = natural[:MOST_MODES]
    count = f", the first {shown.size} of {natural.size}" if shown.size < natural.size else ""
    head = ("mode", f"undamped frequency [{unit}]", *(() if ratios is None else ("damping ratio",)))
    rows = (
        (str(k + 1), f"{omega / size:.6g}", *(() if ratios is None else (f"{float(ratios[k]):.4g}",)))
        for k, omega in enumerate(shown)
    )
    return f"Modes without contacts{count}", head, rows


def _loads(problem: Problem) -> Iterator[tuple[str, ...]]:
    for load in problem.loads[:MOST_LOADS]:
        phase = "-" if load.harmonic == 0 else f"{load.phase + 0.0:.4g} rad"
        yield load.target, *_measure(load, problem.units), phase
    if len(problem.loads) > MOST_LOADS:
        yield f"and {len(problem.loads) - MOST_LOADS} more", "", "", "", ""


def _measure(load: Load, units: Units) -> tuple[str, str, str]:
    """Kind, harmonic and amplitude of a load; a constant one keeps its sign."""
    size = load.cos if load.harmonic == 0 else load.amplitude
    if load.motion is not None:
        kind, unit = load.motion, units.after(MOTION_UNITS[load.motion])
    elif load.shape is not None:
        kind, unit = "load shape", " times the shape"
    else:
        kind, unit = "force", units.after("force")
    return kind, str(load.harmonic), f"{size:.6g}{unit}"


def _contacts(problem: Problem) -> tuple[str, tuple[str, ...], Iterator[tuple[str, ...]]]:
    """A row for each kind of contact: those of one law with the same ports and quantities."""
    elements = [(pair, k) for pair in problem.contacts for k in range(len(pair))]
    kinds: list[list[tuple[ContactPair, int]]] = []
    order: dict[Any, int] = {}
    for key, members in groupby(elements, key=lambda each: _alike(*each)):
        if key not in order:
            order[key] = len(kinds)
            kinds.append([])
        kinds[order[key]] += members
    columns = dict.fromkeys(name for kind in kinds for name in shown_quantities(*kind[0]))
    head = ("contacts", "law", "along", *(name.replace("_", " ") for name in columns), "rubbing")
    return "Contacts", head, (_row(kind, list(columns), problem.units) for kind in kinds)


def _alike(pair: ContactPair, k: int) -> tuple[Any, ...]:
    ports = tuple(port for port in pair.contact.ports if pair.direction(port, k) is not None)
    return type(pair.contact), ports, tuple(shown_quantities(pair, k)), bool(pair.rubbing.moves)


def _row(kind: list[tuple[ContactPair, int]], columns: Sequence[str], units: Units) -> tuple[str, ...]:
    first, _ = kind[0]
    names = [pair.elements[k] for pair, k in kind]
    law, own = first.contact, shown_quantities(*kind[0])
    ways = dict.fromkeys(_along(pair, k) for pair, k in kind)
    cells = [
        _range([float(pair.values(name)[k]) for pair, k in kind], units.after(law.unit(name))) if name in own else "-"
        for name in columns
    ]
    moves = dict.fromkeys(_rubbing(pair, k, units) for pair, k in kind)
    return _counted(names), type(law).__name__, some(ways, _MOST_WORDS), *cells, some(moves, _MOST_WORDS)


def _along(pair: ContactPair, k: int) -> str:
    """Directions of the ports of a contact."""
    said = [(port, direction_words(pair.direction(port, k))) for port in pair.contact.ports]
    return " and ".join(f"{port} {words}" for port, words in said if words)


def _rubbing(pair: ContactPair, k: int, units: Units) -> str:
    """The rubbing motion with the amplitudes of its periodic parts."""
    parts = [(name, float(pair.values(name)[k])) for name, _ in pair.rubbing.components() if "velocity" not in name]
    listed = [f"{name} {value:g}{units.after('length')}" for name, value in parts if value]
    words = rubbing_words(pair, k, units)
    return f"{words} ({', '.join(listed)})" if listed else words


def _counted(names: Sequence[str]) -> str:
    """How many names, and the first of them."""
    return f"{len(names)}: {some(names)}" if 1 < len(names) <= MOST_SHOWN else some(names)


def _range(values: Sequence[float], unit: str) -> str:
    """One number, or the smallest and the largest."""
    low, high = f"{min(values):.6g}", f"{max(values):.6g}"
    return f"{low}{unit}" if low == high else f"{low} to {high}{unit}"
