"""What one section of a case says, held against the others: dofs, harmonics, names, sizes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from slipstick.case.fe_tables import SurfaceContactTable
from slipstick.case.sections import Sections
from slipstick.case.structures import Described
from slipstick.case.validation import ReadTable
from slipstick.errors import Fault

if TYPE_CHECKING:
    from slipstick.balance.checks import Known
    from slipstick.case.parts import Placed


def held_faults(sections: Sections, described: Described, placed: Sequence[Placed]) -> Iterator[Fault]:
    """Faults between sections; where one of them is not right, nothing is held against it."""
    from slipstick.balance.checks import Known

    known = Known(
        structure=described.structure,
        dofs=described.dofs,
        orders=sections.top.get("harmonics"),
        period_ratio=sections.period_ratio,
    )
    yield from _names(sections.contacts)
    for row in sections.loads:
        yield from (fault.inside(*row.where) for fault in _load(row, known))
    for row in sections.contacts:
        yield from (fault.inside(*row.where) for fault in _contact(row, known))
    yield from _dofs(sections, known)
    yield from _sizes(sections, known, placed)


def _names(rows: Sequence[ReadTable]) -> Iterator[Fault]:
    """Names of contacts, each at its block."""
    from slipstick.balance.checks import contact_name_faults

    right = [row for row in rows if row.right("name")]
    for fault in contact_name_faults([row.table.name for row in right]):
        first = next(row for row in right if row.table.name == fault.where[1])
        yield fault.below("contact", first.table.name).inside(*first.where)


def _load(row: ReadTable, known: Known) -> Iterator[Fault]:
    """What a load acts on and its harmonic, as far as they are right."""
    from slipstick.balance.base_motion import base_faults
    from slipstick.balance.checks import force_faults, shape_faults
    from slipstick.balance.contacts import dof_faults

    dof, shape, base = (row.get(key) for key in ("dof", "shape", "base"))
    if dof is not None:
        yield from (fault.inside("dof") for fault in dof_faults(dof, known.dofs))
    if shape is not None:
        yield from shape_faults(shape, known)
    if base is not None:
        yield from base_faults(base, known.structure, known.dofs)
    if row.right("harmonic"):
        yield from force_faults(row.table.harmonic, row.get("sin"), row.get("motion"), known)


def _contact(row: ReadTable, known: Known) -> Iterator[Fault]:
    """Directions and rubbing motion of a contact, as far as they are right."""
    from slipstick.balance.checks import motion_faults
    from slipstick.balance.contacts import cosine_faults
    from slipstick.contact.rubbing import MOTION_PARTS

    if not isinstance(row.table, SurfaceContactTable):
        for side in ("tangential", "normal"):
            yield from (fault.inside(side) for fault in cosine_faults(row.get(side) or {}, known.dofs))
    rubbing = row.table.rubbing
    if rubbing is not None:
        moved = {part: getattr(rubbing, part) for part in MOTION_PARTS}
        yield from (fault.inside("rubbing") for fault in motion_faults(moved, known))


def _dofs(sections: Sections, known: Known) -> Iterator[Fault]:
    """Dofs of the results and of the peaks."""
    from slipstick.balance.checks import output_faults, peak_faults

    outputs = sections.output.get("dofs") if sections.output is not None else None
    wrong = list(output_faults(outputs, known.dofs)) if outputs is not None else []
    yield from (fault.inside("output", "dofs") for fault in wrong)
    peaks = sections.response.get("peaks_of") if sections.response is not None else None
    if peaks is not None:
        names = [peaks] if isinstance(peaks, str) else list(peaks)
        yield from (
            f.inside("response", "peaks_of") for f in peak_faults(names, None if wrong else outputs, known.dofs)
        )


def _sizes(sections: Sections, known: Known, placed: Sequence[Placed]) -> Iterator[Fault]:
    """One ratio of periods, and no more unknowns than can be computed."""
    from slipstick.balance.kinds import MOST_UNKNOWNS, size_fault
    from slipstick.structure.matrices import MatrixStructure

    ratios = [row.get("period_ratio") for row in (sections.top, sections.response) if row is not None]
    if len(set(ratios) - {None}) > 1:
        where = ("response", "period_ratio")
        yield Fault(where, "is another than the period_ratio at the top", remedy="keep one")
    size = 0 if known.orders is None else 2 * len(known.orders) - 1
    unknowns = sum(contact.pair.n_ports for contact in placed) * size
    kind = "dense" if isinstance(known.structure, MatrixStructure) else "iterative"
    if unknowns > MOST_UNKNOWNS[kind]:
        yield size_fault(unknowns, kind)
