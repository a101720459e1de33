"""Heat in a case file: tables over temperature, ``[contact.thermal]`` and ``[thermal]``, made a thermal model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.app.paths import inside
from slipstick.app.sentences import shown, suggestion
from slipstick.app.tables import ContactTable, ThermalTable
from slipstick.errors import InputError

if TYPE_CHECKING:
    from slipstick.thermal.friction_curve import FrictionCurve
    from slipstick.thermal.model import ThermalModel

_PARAMETERS = ("mu", "kt", "kn")
_ARRAYS = ("influence", "thermal_influence")


def cold_value(value: float | dict[str, Any], background: float | None) -> float:
    """A number of the file, or what its table says at the background temperature (at its first row without one)."""
    if not isinstance(value, dict):
        return value
    from slipstick.thermal.friction_curve import FrictionCurve

    curve = FrictionCurve(mu=value["table"], interpolation=value.get("interpolation", "pchip"))
    return float(curve.mu(curve.limits[0] if background is None else background))


def background_of(contact: ContactTable, top: ThermalTable | None) -> float | None:
    """The background temperature of a contact: its own, else the common one."""
    own = contact.thermal.background if contact.thermal is not None else None
    return own if own is not None else (top.background if top is not None else None)


def heating_faults(contacts: Sequence[ContactTable], top: ThermalTable | None) -> list[str]:
    """What is missing or said twice about heat."""
    names = [contact.name for contact in contacts]
    listed = names if top is not None and top.contacts is None else list(top.contacts or ()) if top is not None else []
    faults = [
        f"[thermal] contacts: there is no contact '{name}'; {suggestion(name, names)}"
        for name in listed
        if name not in names
    ]
    for contact in contacts:
        where, own = f"[[contact]] '{contact.name}'", contact.thermal
        tables = [name for name in _PARAMETERS if isinstance(getattr(contact, name), dict)]
        heated = contact.name in listed
        if own is not None and own.resistance is not None and heated:
            faults.append(f"{where} thermal.resistance is given, and [thermal] influence holds this contact; keep one")
        if (own is not None or heated) and background_of(contact, top) is None:
            faults.append(f"{where} thermal.background is missing; give the temperature without friction")
        if own is not None and own.resistance is None and not heated:
            faults.append(f"{where} thermal.resistance is missing; give temperature per power, or [thermal] influence")
        if tables and own is None and not heated:
            faults.append(
                f"{where} {tables[0]} is a table over temperature, but nothing says how warm the contact gets; "
                "give [contact.thermal] with background and resistance, or [thermal] with influence"
            )
    return faults


def thermal_model(contacts: Sequence[ContactTable], top: ThermalTable | None, folder: Path) -> ThermalModel | None:
    """The thermal model of a case without ``heating_faults``; None where nothing is heated.

    Raises
    ------
    InputError
        If the influence matrix cannot be read or does not fit.
    """
    import numpy as np

    from slipstick.thermal.model import ThermalModel

    if top is None and all(contact.thermal is None for contact in contacts):
        return None
    names = [contact.name for contact in contacts]
    backgrounds = {contact.name: background_of(contact, top) for contact in contacts}
    common = next(value for value in backgrounds.values() if value is not None)
    resistance = np.zeros((len(names), len(names)))
    if top is not None:
        resistance = _influence(top, names, folder)
    for i, contact in enumerate(contacts):
        if contact.thermal is not None and contact.thermal.resistance is not None:
            resistance[i, i] = contact.thermal.resistance
    return ThermalModel(
        curve={contact.name: curve for contact in contacts if (curve := _curve(contact)) is not None},
        background={name: common if value is None else value for name, value in backgrounds.items()},
        resistance=resistance,
    )


def _curve(contact: ContactTable) -> FrictionCurve | None:
    from slipstick.thermal.friction_curve import FrictionCurve

    given = {name: value for name in _PARAMETERS if isinstance(value := getattr(contact, name), dict)}
    if not given:
        return None
    kinds = {name: str(value.get("interpolation", "pchip")) for name, value in given.items()}
    return FrictionCurve(interpolation=kinds, **{name: value["table"] for name, value in given.items()})


def _influence(top: ThermalTable, names: list[str], folder: Path) -> Any:
    """The influence matrix spread over all contacts."""
    import numpy as np

    matrix = np.array(top.influence, dtype=float) if isinstance(top.influence, list) else _read(top.influence, folder)
    order = list(names if top.contacts is None else top.contacts)
    if matrix.shape != (len(order), len(order)):
        raise InputError(
            f"[thermal] influence: found a matrix of shape {matrix.shape}; expected {(len(order), len(order))}, "
            "one row and one column for each contact"
        )
    at = [names.index(name) for name in order]
    full = np.zeros((len(names), len(names)))
    full[np.ix_(at, at)] = matrix
    return full


def _read(name: str, folder: Path) -> Any:
    import numpy as np

    from slipstick.importers.plain.matrix_file import read_matrix
    from slipstick.structure.npz import array_shapes, read_arrays

    try:
        path = inside(folder, name)
    except ValueError as error:
        raise InputError(f"[thermal] influence: found {shown(name)}; {error}") from None
    if path.suffix.lower() == ".npz":
        known = [key for key in _ARRAYS if key in array_shapes(path)]
        if known:
            return read_arrays(path, {known[0]: 2})[known[0]]
    matrix = read_matrix(path)
    return np.asarray(matrix.todense() if hasattr(matrix, "todense") else matrix, dtype=float)
