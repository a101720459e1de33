"""A problem in a results file: arrays, and JSON that says what they belong to. Nothing in it is executed when read.

Every part of a problem is written as the arguments it is made from, and made again by its own constructor, which checks
them as it checks a user's. Laws and structures that a user wrote are code, not numbers: they are not stored.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import issparse

from slipstick.balance.contacts import ContactPair
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.contact.friction import FrictionContact
from slipstick.contact.hysteresis import BoucWenContact, DahlContact, IwanContact
from slipstick.contact.planar import PlanarFrictionContact
from slipstick.contact.rubbing import SECOND, RubbingMotion
from slipstick.contact.stator import StatorContact
from slipstick.contact.velocity_friction import StribeckContact
from slipstick.errors import InputError
from slipstick.faults import warn
from slipstick.io.netcdf import Group, StoredVariable, read_netcdf
from slipstick.results.table import ResultTable
from slipstick.results.view import names_of
from slipstick.state.registry import STORED_STATES
from slipstick.structure.cyclic import CyclicStructure, TravellingWave
from slipstick.structure.disc import Disc
from slipstick.structure.free import FreeStructure
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import LoadShape, ModalStructure
from slipstick.structure.reduction.sector import SectorModes
from slipstick.structure.residuals import FullModel, NearField
from slipstick.structure.skin import Skin
from slipstick.structure.solved_modes import SolvedModes
from slipstick.structure.strains import StrainPlaces, Strains
from slipstick.structure.tabulated import TabulatedStructure
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import AnyArray
from slipstick.units import Units

GROUP = "problem"
"""Name of the group in a results file."""
PROBLEM_FORMAT = 1
MOST_MODAL_DOFS = 20_000
"""A modal structure has the square of that many compliances, which no other size in a file bounds."""
DESCRIPTION, WITHOUT = "description", "without"
"""Attributes of the group: the JSON, or why there is none."""


def _by_fields(thing: Any) -> dict[str, Any]:
    return {f.name: getattr(thing, f.name) for f in fields(thing) if f.name != "_"}


def _arguments(problem: Problem) -> dict[str, Any]:
    """Arguments of a problem; states only where there are any."""
    return {name: value for name, value in _by_fields(problem).items() if name != "states" or value}


def _friction(contact: FrictionContact) -> dict[str, Any]:
    """Likewise with the motion at rest only where it is known."""
    return {name: value for name, value in _by_fields(contact).items() if value is not None}


def _rubbing(motion: RubbingMotion) -> dict[str, Any]:
    """Likewise without what goes along a second direction."""
    return {name: value for name, value in _by_fields(motion).items() if not name.startswith(SECOND) or np.any(value)}


def _pair(pair: ContactPair) -> dict[str, Any]:
    """Likewise without an area where there is none."""
    return {name: value for name, value in _by_fields(pair).items() if name != "area" or value is not None}


STORED_PARTS: dict[str, tuple[type, Callable[[Any], dict[str, Any]]]] = {
    "problem": (Problem, _arguments),
    "matrices": (MatrixStructure, lambda s: s.arguments),
    "modes": (ModalStructure, lambda s: s.arguments),
    "solved modes": (SolvedModes, lambda s: s.arguments),
    "full model": (FullModel, lambda full: full.arguments),
    "near field": (NearField, _by_fields),
    "sector": (CyclicStructure, lambda s: s.arguments),
    "reduced sector": (SectorModes, lambda s: s.arguments),
    "wave": (TravellingWave, lambda s: s.arguments),
    "disc": (Disc, lambda s: s.arguments),
    "free": (FreeStructure, lambda s: s.arguments),
    "tabulated receptances": (TabulatedStructure, lambda s: s.arguments),
    "load shape": (LoadShape, _by_fields),
    "skin": (Skin, lambda skin: skin.arguments),
    "strains": (Strains, lambda strains: strains.arguments),
    "strain places": (StrainPlaces, _by_fields),
    "contact": (ContactPair, _pair),
    "friction": (FrictionContact, _friction),
    "planar friction": (PlanarFrictionContact, _friction),
    "stator": (StatorContact, _by_fields),
    "Iwan": (IwanContact, lambda law: law.arguments),
    "Dahl": (DahlContact, lambda law: law.arguments),
    "Bouc-Wen": (BoucWenContact, lambda law: law.arguments),
    "velocity friction": (StribeckContact, lambda law: law.arguments),
    "rubbing": (RubbingMotion, _rubbing),
    "load": (Load, _by_fields),
    "harmonics": (Harmonics, lambda h: {"orders": list(h.orders)}),
    "units": (Units, _by_fields),
    **STORED_STATES,
}
"""Classes a file may hold: a word for each, and a function of the arguments that make an equal object."""

_WORDS = {kind: word for word, (kind, _) in STORED_PARTS.items()}


def describe(problem: Problem) -> Group:
    """A problem as the variables and attributes of a group; without variables, and the reason, where it cannot be."""
    unstorable = [p for p in problem.contacts if type(p.contact) not in _WORDS]
    if type(problem.structure) not in _WORDS:
        return _left_out(f"its structure is a {type(problem.structure).__name__}, which is code and not numbers")
    if unstorable:
        law = type(unstorable[0].contact).__name__
        return _left_out(f"the law of contact '{unstorable[0].name}' is a {law}, which is code and not numbers")
    arrays: dict[str, StoredVariable] = {}
    try:
        text = json.dumps(_plain(problem, "", arrays), allow_nan=False)
    except (TypeError, ValueError) as error:
        return _left_out(str(error))
    return Group(variables=arrays, attributes={"format": PROBLEM_FORMAT, DESCRIPTION: text})


def fingerprint(problem: Problem) -> str:
    """SHA-256 of every number and name of a problem; of one that cannot be stored, of the reason."""
    group = describe(problem)
    digest = sha256(json.dumps(group.attributes, sort_keys=True).encode())
    for name, variable in sorted(group.variables.items()):
        digest.update(f"{name} {variable.values.dtype.str} {variable.values.shape}".encode())
        digest.update(np.ascontiguousarray(variable.values).tobytes())
    return digest.hexdigest()


def _left_out(reason: str) -> Group:
    return Group(variables={}, attributes={WITHOUT: reason})


def _plain(value: Any, where: str, arrays: dict[str, StoredVariable]) -> Any:
    """A value as JSON; arrays go to ``arrays``, under the names of the arguments that lead to them."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        if value.size < 2:
            return value.tolist()
        name = where.removeprefix(".")
        arrays[name] = StoredVariable(
            dims=tuple(f"axis{axis}_{n}" for axis, n in enumerate(value.shape)), values=np.asarray(value)
        )
        return {"array": name}
    if issparse(value):
        csc = value.tocsc()
        parts = [_plain(getattr(csc, p), f"{where}.{p}", arrays) for p in ("data", "indices", "indptr")]
        return {"csc": parts} | ({} if csc.shape[0] == csc.shape[1] else {"rows": int(csc.shape[0])})
    if isinstance(value, Mapping):
        items = enumerate(value.items())
        return {"map": [[_plain(k, where, arrays), _plain(v, f"{where}.{i}", arrays)] for i, (k, v) in items]}
    if isinstance(value, tuple | list | frozenset):
        items = enumerate(sorted(value) if isinstance(value, frozenset) else value)
        return [_plain(v, f"{where}.{i}", arrays) for i, v in items]
    word = _WORDS.get(type(value))
    if word is None:
        raise TypeError(f"{where.removeprefix('.')}: a {type(value).__name__} is code and not numbers")
    arguments = STORED_PARTS[word][1](value).items()
    return {"kind": word, "arguments": {name: _plain(v, f"{where}.{name}", arrays) for name, v in arguments}}


def read_problem(path: Path, table: ResultTable) -> tuple[Problem | None, str]:
    """The problem in a results file; None and the reason where there is none, or none that fits the numbers.

    Warns
    -----
    SlipstickWarning
        Where there is one that cannot be read.
    """
    try:
        group = read_netcdf(path, GROUP)
        if DESCRIPTION not in group.attributes:
            return None, str(group.attributes.get(WITHOUT, "the file does not hold it"))
        if int(group.attributes["format"]) > PROBLEM_FORMAT:
            raise ValueError(f"its format is {group.attributes['format']}, this program reads up to {PROBLEM_FORMAT}")
        arrays = {name: variable.values for name, variable in group.variables.items()}
        problem = _made(json.loads(str(group.attributes[DESCRIPTION])), arrays)
        fault = misfit(problem, table)
        if fault:
            raise ValueError(fault)
    except Exception as error:  # of a stranger's file: whatever constructors say of arguments of any kind
        reason = f"the problem in {path.name} cannot be read ({' '.join(str(error).split()) or type(error).__name__})"
        warn([f"{path}: {reason}; the numbers are there without it"])
        return None, reason
    return problem, ""


def _made(plain: object, arrays: Mapping[str, AnyArray]) -> Any:
    """The object that JSON of ``_plain`` describes; KeyError, TypeError or ValueError for other JSON."""
    if isinstance(plain, list):
        return [_made(item, arrays) for item in plain]
    if not isinstance(plain, dict):
        return plain
    if "array" in plain:
        return arrays[plain["array"]]
    if "csc" in plain:
        data, indices, indptr = (np.asarray(_made(part, arrays)) for part in plain["csc"])
        return _sparse(data, indices, indptr, plain.get("rows"))
    if "map" in plain:
        return {_made(key, arrays): _made(value, arrays) for key, value in plain["map"]}
    arguments = {name: _made(value, arrays) for name, value in plain["arguments"].items()}
    if plain["kind"] == "modes" and len(arguments["dofs"]) > MOST_MODAL_DOFS:
        raise ValueError(f"modes at {len(arguments['dofs'])} dofs; expected at most {MOST_MODAL_DOFS}")
    if plain["kind"] == "disc" and (size := _disc_dofs(arguments["sector"])) > MOST_MODAL_DOFS:
        raise ValueError(f"a disc of {size} dofs; expected at most {MOST_MODAL_DOFS}")
    return STORED_PARTS[plain["kind"]][0](**arguments)


def _disc_dofs(sector: CyclicStructure) -> int:
    return sector.sectors * len(sector.dofs)


def _sparse(data: AnyArray, indices: AnyArray, indptr: AnyArray, rows: int | None) -> Any:
    """A matrix, square where ``rows`` are not given; its size and indices are checked against its arrays."""
    from scipy.sparse import csc_array

    columns = len(indptr) - 1
    matrix = csc_array((data, indices, indptr), shape=(columns if rows is None else int(rows), columns))
    matrix.check_format(full_check=True)
    return matrix


def misfit(problem: object, table: ResultTable) -> str:
    """Why the numbers cannot be those of a problem, or nothing."""
    if not isinstance(problem, Problem):
        raise InputError("problem: expected an ss.Problem")
    labels = {"dof": problem.outputs or (), "coefficient": problem.harmonics.labels, "contact": problem.elements}
    for dim, names in labels.items():
        if dim in table and names_of(table, dim) != list(names):
            return f"its {dim} labels are {', '.join(names[:8])}, those of the results are others"
    return ""
