"""The thermal model of a case as lines of a script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from slipstick.case.fe_tables import SurfaceContactTable
from slipstick.case.heating import OWN, background_of
from slipstick.case.script_text import call, file_code, here, literal
from slipstick.case.tables import ThermalTable

_PARAMETERS = ("mu", "kt", "kn")
_ARRAYS = ("influence", "thermal_influence")


def heat_lines(
    tables: Sequence[Any], top: ThermalTable | None, variables: Mapping[str, str], folder: Path
) -> list[str]:
    """Curves, background and resistance; ``variables`` hold the contacts of a block on a surface, by its name."""
    curves: dict[str, str] = {}
    lines: list[str] = []
    for table in tables:
        curve = _curve(table)
        if curve is not None and curve not in curves.values():
            lines.append(f"curve{f'_{len(lines) + 1}' if lines else ''} = {curve}")
        if curve is not None:
            curves[table.name] = curve
    named = {line.partition(" = ")[2]: line.partition(" = ")[0] for line in lines}
    if len(curves) == len(tables) and len(lines) == 1:
        arguments = {"curve": "curve"}
    else:
        by_contact = [_by_name(t, named[curves[t.name]], variables) for t in tables if t.name in curves]
        arguments = {"curve": f"{{{', '.join(by_contact)}}}"}
    arguments["background"] = _background(tables, top, variables)
    arguments |= _resistance(tables, top, variables, folder, lines)
    return [*lines, f"thermal = {call('ss.ThermalModel', **arguments)}"]


def _by_name(table: Any, value: str, variables: Mapping[str, str]) -> str:
    """One item of a dict, or those of all contacts of a block."""
    if isinstance(table, SurfaceContactTable):
        return f"**{{pair.name: {value} for pair in {variables[table.name]}}}"
    return f"{literal(table.name)}: {value}"


def _curve(table: Any) -> str | None:
    given = {name: value for name in _PARAMETERS if isinstance(value := getattr(table, name), dict)}
    if not given:
        return None
    kinds = {name: str(value.get("interpolation", "pchip")) for name, value in given.items()}
    values = {name: literal(value["table"]) for name, value in given.items()}
    if set(kinds.values()) != {"pchip"}:
        values["interpolation"] = literal(kinds)
    return call("ss.FrictionCurve", **values)


def _background(tables: Sequence[Any], top: ThermalTable | None, variables: Mapping[str, str]) -> str:
    """One number, or one for each contact; those without any take the first."""
    own = [background_of(table, top) for table in tables]
    common = next(value for value in own if value is not None)
    filled = [common if value is None else value for value in own]
    if len(set(filled)) == 1:
        return literal(filled[0])
    items = [_by_name(table, literal(value), variables) for table, value in zip(tables, filled, strict=True)]
    return f"{{{', '.join(items)}}}"


def _resistance(
    tables: Sequence[Any], top: ThermalTable | None, variables: Mapping[str, str], folder: Path, lines: list[str]
) -> dict[str, str]:
    """Keywords ``resistance`` and ``contacts``; what they need goes to ``lines``."""
    alone = {t.name: t.thermal.resistance or 0.0 for t in tables if t.thermal is not None}
    if top is None:
        lines.append("names = [name for pair in contacts for name in pair.elements]")
        items = [_by_name(t, literal(alone.get(t.name, 0.0)), variables) for t in tables]
        lines.append(f"own = {{{', '.join(items)}}}")
        return {"resistance": "np.diag([own[name] for name in names])"}
    if top.influence == OWN:
        matrix, heated, beside = _conducted(tables, top, variables, alone, lines)
    else:
        matrix, beside = _matrix(top.influence, folder), alone
        heated = literal(top.contacts) if top.contacts is not None else ""
    others = [t for t in tables if beside.get(t.name)]
    if not others:
        return {"resistance": matrix, **({"contacts": heated} if heated else {})}
    lines.append("names = [name for pair in contacts for name in pair.elements]")
    lines.append(f"heated = {heated or 'names'}")
    lines.append("at = [names.index(name) for name in heated]")
    lines.append("resistance = np.zeros((len(names), len(names)))")
    lines.append(f"resistance[np.ix_(at, at)] = {matrix}")
    for table in others:
        chosen = variables.get(table.name)
        every = f"[pair.name for pair in {chosen} if pair.name not in heated]" if chosen else literal([table.name])
        lines.append(f"for i in map(names.index, {every}):")
        lines.append(f"    resistance[i, i] = {literal(beside[table.name])}")
    return {"resistance": "resistance"}


def _conducted(
    tables: Sequence[Any], top: ThermalTable, variables: Mapping[str, str], alone: Mapping[str, float], lines: list[str]
) -> tuple[str, str, dict[str, float]]:
    """``influence = "structure"``: the matrix, the names it heats or nothing for all, and what is beside it.

    Contacts on the surface are named by their points; the matrix holds their own resistances.
    """
    blocks = [table for table in tables if table.name in variables]
    single = {t.name: alone[t.name] for t in tables if t not in blocks and t.name in alone}
    if len(blocks) == 1 and top.contacts is None and blocks[0].points == "all":
        own = alone.get(blocks[0].name, 0.0)
        names = "" if len(tables) == 1 else f"[pair.name for pair in {variables[blocks[0].name]}]"
        return call("body.points.resistance", **({"own": literal(own)} if own else {})), names, single
    chosen = [f"[(p.name, {literal(alone.get(t.name, 0.0))}) for p in {variables[t.name]}]" for t in blocks]
    lines.append(f"own = dict({' + '.join(chosen)})")
    if top.contacts is not None:
        lines.append(f"own = {{name: own[name] for name in own if name in {literal(top.contacts)}}}")
        single |= {t.name: alone[t.name] for t in blocks if t.name in alone}
    lines.append('points = [int(name.rpartition(" ")[2]) for name in own]')
    return "body.points.resistance(points, own=[*own.values()])", "[*own]", single


def _matrix(value: Any, folder: Path) -> str:
    """The influence matrix, written out or read."""
    from slipstick.structure.npz import array_shapes

    if not isinstance(value, str):
        return call("np.array", literal(value))
    known = [key for key in _ARRAYS if value.lower().endswith(".npz") and key in array_shapes(folder / value)]
    if known:
        return f"np.load({here(value)})[{literal(known[0])}]"
    code = file_code(value, folder)
    return code if code.startswith("np.") else f"{code}.toarray()"
