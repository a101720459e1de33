"""Loads of the steps of an input file, kept as they are stated: forces, pressures, gravity, rotation, temperatures."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.fem.load_steps import INITIAL, LoadStep, StepLoad, Vector
from slipstick.importers.abaqus.content import Content, set_name
from slipstick.importers.abaqus.keywords import KEYWORDS, Block
from slipstick.importers.findings import Verdict
from slipstick.importers.text_numbers import fortran_real, whole_number

_ROTATES = "rotates the structure: its stiffening and softening are left out"
_BODY = {"BX": (1.0, 0.0, 0.0), "BY": (0.0, 1.0, 0.0), "BZ": (0.0, 0.0, 1.0)}


def steps_of(content: Content) -> dict[str, LoadStep]:
    """Steps with their loads, in the order of the file."""
    by_step: dict[int, list[StepLoad]] = {}
    for line, load in sorted(content.loads, key=lambda pair: pair[0]):
        by_step.setdefault(bisect_right(content.step_lines, line), []).append(load)
    found: dict[str, LoadStep] = {}
    for number, loads in by_step.items():
        parameters = content.steps[number - 1] if number else {}
        found[content.step_name(number) if number else INITIAL] = LoadStep(
            procedure=content.procedures.get(number, ""),
            large=parameters.get("NLGEOM", "NO") != "NO",
            perturbation="PERTURBATION" in parameters,
            loads=tuple(loads),
        )
    return found


@KEYWORDS.reads("CLOAD DSLOAD DLOAD TEMPERATURE", stage=3)
def on_load(content: Content, block: Block) -> None:
    """A target, a direction or label and a value on each line."""
    content.note(Verdict.HARMLESS, block)
    if block.keyword == "DLOAD" and any(_label(row).startswith(("CENTRIF", "ROTA", "CORIO")) for row in block.rows):
        content.note(Verdict.APPROXIMATED, block, _ROTATES)
    _keep_rows(content, block, _MADE[block.keyword])


@KEYWORDS.reads("INITIALCONDITIONS", "TYPE", stage=3)
def on_initial(content: Content, block: Block) -> None:
    """Temperatures are kept; stresses would stiffen."""
    kind = block.parameters.get("TYPE")
    if kind in ("STRESS", "HARDENING", "PLASTICSTRAIN"):
        content.note(Verdict.APPROXIMATED, block, "sets stresses, whose stiffening is left out")
        return
    content.note(Verdict.HARMLESS, block)
    if kind == "TEMPERATURE":
        _keep_rows(content, block, _temperature)


def _keep_rows(content: Content, block: Block, made: Callable[[Content, list[str]], StepLoad | None]) -> None:
    """Keep what is made of each line; lines of other kinds, and those that cannot be read, are named."""
    lost: dict[str, int] = {}
    for line, row in zip(block.lines, block.rows, strict=True):
        try:
            load = made(content, row)
        except KeyError as missing:
            lost.setdefault(f"names {missing.args[0]}, which the file does not have: not kept as a load", line)
            continue
        except (ValueError, IndexError):
            lost.setdefault("has a line that is no load: it is not kept", line)
            continue
        if load is None or not np.isfinite(load.value):
            lost.setdefault(f"gives loads {_label(row) or row[0]}, which are not kept", line)
        else:
            content.loads.append((line, replace(load, **_shared(block))))
    if block.parameters.keys() & {"FILE", "USER", "INPUT"}:
        lost.setdefault("takes its values from elsewhere: they are not kept", block.line)
    for what, line in lost.items():
        content.add(Verdict.APPROXIMATED, block.shown, what, line)


def _shared(block: Block) -> dict[str, Any]:
    """What the keyword says of all of its lines."""
    return {"amplitude": block.parameters.get("AMPLITUDE", ""), "replaces": block.parameters.get("OP") == "NEW"}


def _label(row: list[str]) -> str:
    return row[1].upper() if len(row) > 1 else ""


def _force(content: Content, row: list[str]) -> StepLoad | None:
    where = _nodes(content, row[0])
    axis, value = whole_number(row[1]), fortran_real(row[2])
    bolt = _bolt(content, where)
    if bolt:
        return StepLoad(kind="bolt force", where=bolt, value=value)
    if not 1 <= axis <= 6:
        return None
    return StepLoad(kind="force" if axis < 4 else "moment", where=where, value=value, axis=(axis - 1) % 3 + 1)


def _bolt(content: Content, where: str) -> str:
    """The section whose node this is; empty where it is none."""
    nodes = {int(where)} if where.isdigit() else {*content.node_sets[where]}
    return next((name for name, section in content.pretension_sections.items() if nodes == {section.node}), "")


def bolt_motion(content: Content, block: Block, line: int, row: list[str], value: float) -> None:
    """Keep what *BOUNDARY says of the node of a bolt."""
    fixed = "FIXED" in block.parameters
    load = StepLoad(
        kind="bolt locked" if fixed else "bolt shortening",
        where=_bolt(content, set_name(row[0], content.node_sets)),
        value=0.0 if fixed else value,
    )
    content.loads.append((line, replace(load, **_shared(block))))


def moved_support(content: Content, block: Block, line: int, row: list[str], axes: Iterable[int], value: float) -> None:
    """Keep a displacement that *BOUNDARY prescribes, along axes from 0."""
    where = set_name(row[0], content.node_sets)
    for axis in axes:
        load = StepLoad(kind="displacement", where=where, value=value, axis=axis + 1)
        content.loads.append((line, replace(load, **_shared(block))))


def _surface_load(content: Content, row: list[str]) -> StepLoad | None:
    if not _label(row):
        raise ValueError("no label")
    where = set_name(row[0], content.surfaces)
    return StepLoad(kind="pressure", where=where, value=fortran_real(row[2])) if _label(row) == "P" else None


def _distributed(content: Content, row: list[str]) -> StepLoad | None:
    where = set_name(row[0], content.element_sets) if row[0] else ""
    label = _label(row)
    value = fortran_real(row[2]) if len(row) > 2 and row[2] else 0.0
    if label in _BODY:
        return StepLoad(kind="body force", where=where, value=value, direction=_BODY[label])
    if label == "GRAV":
        return StepLoad(kind="gravity", where=where, value=value, direction=_three(row[3:6]))
    if label == "CENTRIF":
        point, along = _three(row[3:6]), _three(row[6:9])
        return StepLoad(kind="centrifugal", where=where, value=value, point=point, direction=along)
    if len(label) == 2 and label[0] == "P" and label[1] in "123456":
        return StepLoad(kind="pressure", where=where, value=value, face=int(label[1]))
    return None


def _temperature(content: Content, row: list[str]) -> StepLoad:
    return StepLoad(kind="temperature", where=_nodes(content, row[0]), value=fortran_real(row[1]))


def _nodes(content: Content, word: str) -> str:
    """A node set, or a node of the file."""
    where = set_name(word, content.node_sets)
    if where.isdigit() and int(where) not in content.nodes:
        raise KeyError(f"node {where}")
    return where


def _three(words: list[str]) -> Vector:
    x, y, z = ([fortran_real(word) if word else 0.0 for word in words] + [0.0] * 3)[:3]
    return x, y, z


_MADE: Mapping[str, Callable[[Content, list[str]], StepLoad | None]] = {
    "CLOAD": _force,
    "DSLOAD": _surface_load,
    "DLOAD": _distributed,
    "TEMPERATURE": _temperature,
}
