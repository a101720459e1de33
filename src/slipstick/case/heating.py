"""Heat in a case file: tables over temperature, ``[contact.thermal]`` and ``[thermal]``, made a thermal model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case.paths import inside
from slipstick.case.tables import ContactTable, ThermalTable
from slipstick.case.validation import ReadTable
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import suggestion

if TYPE_CHECKING:
    from slipstick.case.parts import Placed
    from slipstick.fem.contact_points import ContactPoints
    from slipstick.state.thermal.friction_curve import FrictionCurve
    from slipstick.state.thermal.model import ThermalModel
    from slipstick.typing import Array

OWN = "structure"
"""``[thermal] influence = "structure"``: the matrix of the finite element model."""

_PARAMETERS = ("mu", "kt", "kn")
_THERMAL = ("background", "resistance")
_ARRAYS = ("influence", "thermal_influence")
_TEMPERATURE = "give the temperature without friction"


def cold_value(value: float | dict[str, Any], background: float | None) -> float:
    """A number of the file, or what its table says at the background temperature (at its first row without one)."""
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
    own = contact.thermal.background if contact.thermal is not None else None
    return own if own is not None else (top.background if top is not None else None)


def heating_faults(contacts: Sequence[Placed], top: ReadTable | None, named: Sequence[str] | None) -> list[Fault]:
    """What is missing or said twice about heat; ``named`` are the contacts there are, if all are known."""
    listed = heated_names(contacts, top)
    faults = [
        Fault(("thermal", "contacts"), f"there is no contact '{name}'", remedy=suggestion(name, named or ()))
        for name in listed or ()
        if named is not None and name not in named and not (top is not None and top.get("influence") == OWN)
    ]
    for row, names in _by_row(contacts):
        heated = None if listed is None else bool(set(names) & set(listed))
        faults += [fault.inside(*row.where) for fault in _contact_faults(row, top, heated)]
    return faults


def heated_names(contacts: Sequence[Placed], top: ReadTable | None) -> list[str] | None:
    """The contacts that share ``[thermal]``; None where that is not known."""
    if top is None:
        return []
    if not top.right("contacts"):
        return None
    if top.table.contacts is not None:
        return list(top.table.contacts)
    own = top.get("influence") == OWN
    return [c.name for c in contacts if not own or c.point is not None]


def _by_row(contacts: Sequence[Placed]) -> list[tuple[ReadTable, list[str]]]:
    rows: dict[Any, tuple[ReadTable, list[str]]] = {}
    for contact in contacts:
        rows.setdefault(contact.row.where, (contact.row, []))[1].append(contact.name)
    return list(rows.values())


def _contact_faults(row: ReadTable, top: ReadTable | None, heated: bool | None) -> list[Fault]:
    """Faults of one block; ``heated``: whether ``[thermal]`` holds it, if known."""
    own, faults = row.table.thermal, []
    tables = [name for name in _PARAMETERS if isinstance(row.get(name), dict)]
    wrong = {place[1:2] for place in row.wrong if place[:1] == ("thermal",)}
    background = (
        background_of(row.table, None if top is None else top.table) is not None
        or ("background",) in wrong
        or () in wrong
    )
    background = background or (top is not None and not top.right("background"))
    resistance = (own is not None and own.resistance is not None) or ("resistance",) in wrong
    shared = top is not None and top.get("influence") != OWN
    if own is not None and own.resistance is not None and heated and shared:
        remedy = "keep one"
        faults.append(
            Fault(("thermal", "resistance"), "is given, and [thermal] influence holds this contact", remedy=remedy)
        )
    if (own is not None or heated) and not background:
        faults.append(Fault(("thermal", "background"), IS_MISSING, remedy=_TEMPERATURE))
    if own is not None and not resistance and heated is False:
        remedy = "give temperature per power, or [thermal] influence"
        faults.append(Fault(("thermal", "resistance"), IS_MISSING, remedy=remedy))
    if tables and own is None and not wrong and heated is False:
        cold = "is a table over temperature, but the temperature of the contact is not given"
        remedy = "give [contact.thermal] with background and resistance, or [thermal] with influence"
        faults.append(Fault(tables[0], cold, remedy=remedy))
    return faults


def shared_influence(
    top: ReadTable, contacts: Sequence[Placed], points: ContactPoints | None, folder: Path
) -> tuple[list[str], Array]:
    """The names of the contacts that ``[thermal]`` holds, and temperature per power among them.

    Raises
    ------
    InputError
        If the matrix cannot be read or does not fit, or the structure has none.
    """
    import numpy as np

    order = heated_names(contacts, top) or []
    if top.table.influence == OWN:
        return order, _own_influence(contacts, order, points)
    given = top.table.influence
    matrix = _read(given, folder) if isinstance(given, str) else np.array(given, dtype=float)
    if matrix.shape != (len(order), len(order)):
        raise InputError(
            Fault(
                ("thermal", "influence"),
                found=f"a matrix of shape {matrix.shape}",
                expected=f"{(len(order), len(order))}, one row and one column for each contact",
            )
        )
    return order, matrix


def _own_influence(contacts: Sequence[Placed], order: Sequence[str], points: ContactPoints | None) -> Array:
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
    return points.resistance(numbers, own=[_own_resistance(on[name].row) for name in order])


def _own_resistance(row: ReadTable) -> float:
    return row.table.thermal.resistance or 0.0 if row.table.thermal is not None else 0.0


def thermal_model(
    contacts: Sequence[Placed], top: ReadTable | None, shared: tuple[list[str], Array] | None
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
    resistance = np.diag([0.0 if contact.name in order else _own_resistance(contact.row) for contact in contacts])
    at = [names.index(name) for name in order]
    resistance[np.ix_(at, at)] = matrix
    return ThermalModel(
        curve={contact.name: curve for contact in contacts if (curve := _curve(contact.row)) is not None},
        background={name: common if value is None else value for name, value in backgrounds.items()},
        resistance=resistance,
    )


def _curve(contact: ReadTable) -> FrictionCurve | None:
    from slipstick.state.thermal.friction_curve import FrictionCurve

    given = {name: value for name in _PARAMETERS if isinstance(value := getattr(contact.table, name), dict)}
    if not given:
        return None
    kinds = {name: str(value.get("interpolation", "pchip")) for name, value in given.items()}
    return FrictionCurve(interpolation=kinds, **{name: value["table"] for name, value in given.items()})


def _read(name: str, folder: Path) -> Array:
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix
    from slipstick.structure.npz import array_shapes, read_arrays

    try:
        path = inside(folder, name)
        if path.suffix.lower() == ".npz":
            known = [key for key in _ARRAYS if key in array_shapes(path)]
            if known:
                return read_arrays(path, {known[0]: 2})[known[0]]
        matrix = read_matrix(path)
    except InputError as error:
        raise InputError([fault.inside("thermal", "influence") for fault in error.faults]) from None
    return np.asarray(matrix.todense() if hasattr(matrix, "todense") else matrix, dtype=float)
