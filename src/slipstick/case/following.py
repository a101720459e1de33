"""The parameter that a case follows, held against its contacts, loads and structure as far as they are right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from slipstick.case.sections import Sections
from slipstick.case.structures import Described
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.case.parts import Placed
    from slipstick.structure.protocol import Structure


@dataclass(frozen=True, kw_only=True)
class _Known:
    """What names of parameters are looked for in."""

    contacts: Sequence[ContactPair]
    loads: Sequence[Load]
    structure: Structure | None


def parameter_faults(
    sections: Sections, loads: Sequence[Load], placed: Sequence[Placed], described: Described
) -> list[Fault]:
    """A name that nothing has, or an end of the range that what it names cannot take."""
    from slipstick.balance.parameters import changed, parameter_target

    name = sections.response.get("parameter") if sections.response is not None else None
    known = _Known(contacts=[c.pair for c in placed], loads=loads, structure=described.structure)
    if name is None or sections.response is None or _may_be_of_what_is_wrong(name, sections, known, placed):
        return []
    try:
        target = parameter_target(known, name)
    except InputError as error:
        return [fault.inside("response", "parameter") for fault in error.faults]
    found: list[Fault] = []
    for key, field in (("from", "start"), ("to", "stop")):
        end: Any = sections.response.get(key, field)
        try:
            if end is not None:
                changed(known, target, name, float(end))
        except InputError as error:
            found += [replace(fault, where=("response", key)) for fault in error.faults]
    return found


def _may_be_of_what_is_wrong(name: str, sections: Sections, known: _Known, placed: Sequence[Placed]) -> bool:
    """Whether a name could belong to a part that could not be read."""
    missing = {row.where for row in sections.contacts} - {contact.row.where for contact in placed}
    if name.startswith("load."):
        return len(known.loads) < len(sections.loads)
    return bool(missing) if "." in name else known.structure is None and name not in ("load", "friction")
