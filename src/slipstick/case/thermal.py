"""Heat: numbers over temperature, ``[contact.thermal]`` and ``[thermal]``, made a thermal model."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.script_text import Call, call, file_code, here, literal
from slipstick.case.source import inside
from slipstick.case.table import MatrixGiven, NotNegative, Table, at, is_number, unexpected
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, UNKNOWN_KEY, Fault, InputError
from slipstick.faults import suggestion

if TYPE_CHECKING:
    from slipstick.case.contact import CaseContact, ContactTable
    from slipstick.fem.contact_points import ContactPoints
    from slipstick.state.thermal.model import ThermalModel
    from slipstick.typing import Array

OF_STRUCTURE = "structure"
"""``[thermal] influence = "structure"``: the matrix of the finite element model."""
OVER_TEMPERATURE = ("mu", "kt", "kn")
_ARRAYS = ("influence", "thermal_influence")


def number_or_table(value: object) -> Any:
    """A number >= 0, or ``{ table = [[25, 0.5], [200, 0.45]], interpolation = "pchip" }`` over temperature."""
    if not isinstance(value, dict):
        if not is_number(value):
            raise unexpected("a number >= 0, or { table = [[temperature, value], ...] }")
        if value < 0:
            raise unexpected("a number >= 0")
        return float(value)
    from slipstick.state.thermal.friction_curve import FrictionCurve

    known = ("table", "interpolation")
    faults = [Fault(key, UNKNOWN_KEY, remedy=suggestion(key, known)) for key in value if key not in known]
    meant = [key for key in value if key not in known and "table" in get_close_matches(key, known)]
    if "table" not in value and not meant:
        faults.append(Fault("table", IS_MISSING, remedy="give rows of temperature and value"))
    elif "table" in value:
        try:
            FrictionCurve(mu=value["table"], interpolation=str(value.get("interpolation", "pchip")))
        except InputError as error:
            faults += [fault.below("mu") for fault in error.faults]
    if faults:
        raise InputError(faults)
    return value


NumberOrTable = Annotated[float | dict[str, Any], PlainValidator(number_or_table)]


class ContactThermalTable(Table):
    """``[contact.thermal]``: how friction heats one contact."""

    background: float | None = Field(default=None, description="a finite number, the temperature without friction")
    resistance: NotNegative | None = Field(default=None, description="a number >= 0, temperature per dissipated power")


class ThermalTable(Table):
    """``[thermal]``: how friction heats contacts that share a body."""

    influence: MatrixGiven = Field(
        description="a square list of rows, or the name of an .npz or .mtx file: temperature per power"
    )
    contacts: list[str] | None = Field(
        default=None, min_length=1, description="a list of contact names, in the order of the influence matrix"
    )
    background: float | None = Field(default=None, description="a finite number, the temperature without friction")


def is_table(value: object) -> bool:
    """Whether it is a table over temperature."""
    return isinstance(value, dict) and "table" in value


def cold_value(value: float | dict[str, Any], background: float | None) -> float:
    """A number of the file, or the value of its table at the background temperature (at its first row without one)."""
    if not isinstance(value, dict):
        return value
    from slipstick.state.thermal.friction_curve import FrictionCurve

    curve = FrictionCurve(mu=value["table"], interpolation=value.get("interpolation", "pchip"))
    try:
        return float(curve.mu(curve.limits[0] if background is None else background))
    except InputError as error:
        raise InputError([fault.below("mu") for fault in error.faults]) from None


def background_of(contact: ContactTable, top: ThermalTable | None) -> float | None:
    """The background temperature of a contact: its own, else the common one."""
    local = contact.thermal.background if contact.thermal is not None else None
    return local if local is not None else (top.background if top is not None else None)


def _tables_of(contact: ContactTable) -> tuple[dict[str, Any], dict[str, str]]:
    """The rows of the parameters that a contact gives over temperature, and how each is interpolated."""
    values = {name: getattr(contact, name) for name in OVER_TEMPERATURE}
    tables = {name: value for name, value in values.items() if is_table(value)}
    kinds = {name: str(value.get("interpolation", "pchip")) for name, value in tables.items()}
    return {name: value["table"] for name, value in tables.items()}, kinds


def _own_resistance(contact: ContactTable) -> float:
    return contact.thermal.resistance or 0.0 if contact.thermal is not None else 0.0


def heated_names(contacts: Sequence[CaseContact], top: ReadTable | None) -> list[str] | None:
    """The contacts that share ``[thermal]``; None where that is not known."""
    if top is None:
        return []
    if not top.right("contacts"):
        return None
    if top.table.contacts is not None:
        return list(top.table.contacts)
    on_surface = top.get("influence") == OF_STRUCTURE
    return [c.name for c in contacts if not on_surface or c.point is not None]


def shared_influence(
    top: ReadTable, contacts: Sequence[CaseContact], points: ContactPoints | None, folder: Path
) -> tuple[list[str], Array]:
    """The names of the contacts that ``[thermal]`` holds, and temperature per power among them.

    Raises
    ------
    InputError
        If the matrix cannot be read or does not fit, or the structure has none.
    """
    import numpy as np

    order = heated_names(contacts, top) or []
    if top.table.influence == OF_STRUCTURE:
        return order, _own_influence(contacts, order, points)
    influence = top.table.influence
    matrix = _read(influence, folder) if isinstance(influence, str) else np.array(influence, dtype=float)
    if matrix.shape != (len(order), len(order)):
        raise InputError(
            Fault(
                ("thermal", "influence"),
                found=f"a matrix of shape {matrix.shape}",
                expected=f"{(len(order), len(order))}, one row and one column for each contact",
            )
        )
    return order, matrix


def _own_influence(contacts: Sequence[CaseContact], order: Sequence[str], points: ContactPoints | None) -> Array:
    """The matrix of the structure among the points of some contacts, with their own resistances on its diagonal."""
    if points is None or points.influence is None:
        remedy = 'give [structure] films or cold and a conductivity (kind = "fe"), or use kind = "blade"'
        raise InputError(Fault(("thermal", "influence"), "the structure has no influence matrix", remedy=remedy))
    on = {c.name: c for c in contacts if c.point is not None}
    faults = [
        Fault(
            ("thermal", "contacts"),
            f"'{name}' does not lie on the surface of the structure",
            remedy=suggestion(name, on),
        )
        for name in order
        if name not in on
    ]
    if not order:
        remedy = 'give [[contact]] with points = "all"'
        faults.append(Fault(("thermal", "influence"), "no contact lies on the surface", remedy=remedy))
    if faults:
        raise InputError(faults)
    numbers = [(on[name].point or 0) + 1 for name in order]
    return points.resistance(numbers, own=[_own_resistance(on[name].row.table) for name in order])


def _read(name: str, folder: Path) -> Array:
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix
    from slipstick.structure.checks import dense
    from slipstick.structure.npz import array_shapes, read_arrays

    with at("thermal", "influence"):
        path = inside(folder, name)
        if path.suffix.lower() == ".npz":
            known = [key for key in _ARRAYS if key in array_shapes(path)]
            if known:
                return read_arrays(path, {known[0]: 2})[known[0]]
        matrix = read_matrix(path)
    return np.asarray(dense(matrix), dtype=float)


def thermal_model(
    contacts: Sequence[CaseContact], top: ReadTable | None, shared: tuple[list[str], Array] | None
) -> ThermalModel | None:
    """The thermal model of a case without faults; ``shared`` is its influence matrix. None where nothing is heated."""
    import numpy as np

    from slipstick.state.thermal.model import ThermalModel

    if shared is None and all(contact.row.table.thermal is None for contact in contacts):
        return None
    names = [contact.name for contact in contacts]
    backgrounds = {
        contact.name: background_of(contact.row.table, None if top is None else top.table) for contact in contacts
    }
    common = next(value for value in backgrounds.values() if value is not None)
    order, matrix = ([], np.zeros((0, 0))) if shared is None else shared
    resistance = np.diag([0.0 if contact.name in order else _own_resistance(contact.row.table) for contact in contacts])
    at = [names.index(name) for name in order]
    resistance[np.ix_(at, at)] = matrix
    return ThermalModel(
        curve={contact.name: curve.made() for contact in contacts if (curve := _curve(contact.row.table)) is not None},
        background={name: common if value is None else value for name, value in backgrounds.items()},
        resistance=resistance,
        contacts=names,
    )


def _curve(contact: ContactTable) -> Call | None:
    """The parameters of a contact over temperature; None where none depends on it."""
    tables, kinds = _tables_of(contact)
    others = {"interpolation": kinds} if set(kinds.values()) - {"pchip"} else {}
    return Call("ss.FrictionCurve", named={**tables, **others}) if tables else None


def thermal_script(
    tables: Sequence[ContactTable], top: ThermalTable | None, variables: Mapping[str, str], folder: Path
) -> list[str]:
    """Curves, background and resistance; ``variables`` hold the contacts of a block on a surface, by its name."""
    curves: dict[str, str] = {}
    lines: list[str] = []
    for table in tables:
        made = _curve(table)
        if made is None:
            continue
        curve = made.written()
        if curve not in curves.values():
            lines.append(f"curve{f'_{len(lines) + 1}' if lines else ''} = {curve}")
        curves[table.name] = curve
    named = {line.partition(" = ")[2]: line.partition(" = ")[0] for line in lines}
    if len(curves) == len(tables) and len(lines) == 1:
        arguments = {"curve": "curve"}
    else:
        by_contact = [_by_name(t, named[curves[t.name]], variables) for t in tables if t.name in curves]
        arguments = {"curve": f"{{{', '.join(by_contact)}}}"}
    arguments["background"] = _background_text(tables, top, variables)
    arguments |= _resistance_text(tables, top, variables, folder, lines)
    return [*lines, f"thermal = {call('ss.ThermalModel', **arguments)}"]


def _by_name(table: ContactTable, value: str, variables: Mapping[str, str]) -> str:
    """One item of a dict, or those of all contacts of a block."""
    if table.name in variables:
        return f"**{{pair.name: {value} for pair in {variables[table.name]}}}"
    return f"{literal(table.name)}: {value}"


def _background_text(tables: Sequence[ContactTable], top: ThermalTable | None, variables: Mapping[str, str]) -> str:
    """One number, or one for each contact; those without any take the first."""
    backgrounds = [background_of(table, top) for table in tables]
    common = next(value for value in backgrounds if value is not None)
    filled = [common if value is None else value for value in backgrounds]
    if len(set(filled)) == 1:
        return literal(filled[0])
    items = [_by_name(table, literal(value), variables) for table, value in zip(tables, filled, strict=True)]
    return f"{{{', '.join(items)}}}"


def _resistance_text(
    tables: Sequence[ContactTable],
    top: ThermalTable | None,
    variables: Mapping[str, str],
    folder: Path,
    lines: list[str],
) -> dict[str, str]:
    """Keywords ``resistance`` and ``contacts``; the lines they need are added to ``lines``."""
    alone = {t.name: t.thermal.resistance or 0.0 for t in tables if t.thermal is not None}
    if top is None:
        lines.append("names = [name for pair in contacts for name in pair.elements]")
        items = [_by_name(t, literal(alone.get(t.name, 0.0)), variables) for t in tables]
        lines.append(f"own = {{{', '.join(items)}}}")
        return {"resistance": "np.diag([own[name] for name in names])", "contacts": "names"}
    if top.influence == OF_STRUCTURE:
        matrix, heated, beside = _conducted_text(tables, top, variables, alone, lines)
    else:
        matrix, beside = _matrix_text(top.influence, folder), alone
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
    return {"resistance": "resistance", "contacts": "names"}


def _conducted_text(
    tables: Sequence[Any],
    top: ThermalTable,
    variables: Mapping[str, str],
    alone: Mapping[str, float],
    lines: list[str],
) -> tuple[str, str, dict[str, float]]:
    """``influence = "structure"``: the matrix, the heated names (none: all), and the contacts beside it.

    Contacts on the surface are named by their points; the matrix holds their own resistances.
    """
    blocks = [table for table in tables if table.name in variables]
    single = {t.name: alone[t.name] for t in tables if t not in blocks and t.name in alone}
    if len(blocks) == 1 and top.contacts is None and blocks[0].points == "all":
        resistance = alone.get(blocks[0].name, 0.0)
        names = "" if len(tables) == 1 else f"[pair.name for pair in {variables[blocks[0].name]}]"
        return call("body.points.resistance", **({"own": literal(resistance)} if resistance else {})), names, single
    chosen = [f"[(p.name, {literal(alone.get(t.name, 0.0))}) for p in {variables[t.name]}]" for t in blocks]
    lines.append(f"own = dict({' + '.join(chosen)})")
    if top.contacts is not None:
        lines.append(f"own = {{name: own[name] for name in own if name in {literal(top.contacts)}}}")
        single |= {t.name: alone[t.name] for t in blocks if t.name in alone}
    lines.append('points = [int(name.rpartition(" ")[2]) for name in own]')
    return "body.points.resistance(points, own=[*own.values()])", "[*own]", single


def _matrix_text(value: object, folder: Path) -> str:
    """The influence matrix, written out or read."""
    from slipstick.structure.npz import array_shapes

    if not isinstance(value, str):
        return call("np.array", literal(value))
    known = [key for key in _ARRAYS if value.lower().endswith(".npz") and key in array_shapes(folder / value)]
    if known:
        return f"np.load({here(value).text})[{literal(known[0])}]"
    code = file_code(value, folder)
    return code if code.startswith("np.") else f"{code}.toarray()"
