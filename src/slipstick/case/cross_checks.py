"""Checks between tables of a case; each runs as soon as its own input is right."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from slipstick.case.contact import CaseContact, StatorTable
from slipstick.case.preload import of_sections
from slipstick.case.requests import RequestTable
from slipstick.case.response import written_frequencies
from slipstick.case.sections import Sections, place
from slipstick.case.structure import Described
from slipstick.case.table import RawTable, toml
from slipstick.case.thermal import OF_STRUCTURE, OVER_TEMPERATURE, background_of, heated_names, is_table
from slipstick.case.validation import ReadTable
from slipstick.case.velocity_friction import is_over_velocity
from slipstick.errors import IS_MISSING, Fault, InputError, Where
from slipstick.faults import suggestion
from slipstick.quantities import frequency_unit, unit_of_time_fault
from slipstick.results.schema import LARGEST
from slipstick.units import Units

if TYPE_CHECKING:
    from slipstick.balance.checks import Known
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.structure.protocol import Structure

_TEMPERATURE = "give the temperature without friction"
_SI = {"length": "m", "force": "N", "time": "s"}


def table_faults(sections: Sections, described: Described, placed: Sequence[CaseContact]) -> Iterator[Fault]:
    """Faults between sections; where one of them is not right, nothing is held against it."""
    from slipstick.balance.checks import Known
    from slipstick.balance.contacts import cosine_faults

    known = Known(
        structure=described.structure,
        dofs=described.dofs,
        orders=sections.top.get("harmonics"),
        period_ratio=sections.period_ratio,
    )
    if forgotten := _not_kept(sections, described):
        keep = f"keep = [{', '.join(toml(dof) for dof in forgotten)}]"
        yield Fault(("structure", "keep"), "lacks dofs of the mesh that other tables name", remedy=f"add {keep}")
        known = replace(known, dofs=(*(known.dofs or ()), *forgotten))
    yield from _names((*sections.contacts, *sections.joints, *sections.bolts))
    for row in sections.loads:
        yield from (fault.inside(*row.where) for fault in _load(row, known))
    for row in sections.contacts:
        yield from (fault.inside(*row.where) for fault in _contact(row, known))
    for row in sections.bolts:
        yield from (f.inside(*row.where, "elongation") for f in cosine_faults(row.get("elongation") or {}, known.dofs))
    disc = described.disc
    if disc is not None:
        for row in (*sections.bolts, *sections.steps):
            yield Fault(row.where, "bolts and load steps are of single bodies, and the structure is a disc")
    yield from _dofs(sections, known if disc is None else replace(known, dofs=(*disc.sector.dofs, *disc.dofs)))
    yield from _sizes(sections, known, placed)


def _not_kept(sections: Sections, described: Described) -> list[str]:
    """Dofs of the full model that loads, bolts and results name, and the reduced one has not."""
    if described.body is None or described.body.reduced is None:
        return []
    named = [row.get("dof") for row in sections.loads]
    named += [dof for row in sections.bolts for dof in row.get("elongation") or ()]
    named += [] if sections.output is None else sections.output.get("dofs") or ()
    model, kept = described.body.reduced.full().model, described.dofs or ()
    return [dof for dof in dict.fromkeys(named) if dof and dof not in kept and model.has_direction(dof)]


def described_joints(described: Described) -> list[ContactPair]:
    """The contacts of all joints."""
    return [] if described.body is None else [pair for joint in described.body.joints for pair in joint]


def joint_loads(described: Described) -> list[Load]:
    """Static loads that hold the pressures of joints which a file gives."""
    return [] if described.body is None else [load for joint in described.body.joints for load in joint.loads]


def joint_faults(raw: RawTable) -> Iterator[Fault]:
    """Joints and sections where the structure has none, or joints beside heat, which none of them carries."""
    structure, contacts = raw.get("structure"), raw.get("contact")
    if isinstance(structure, Mapping) and structure.get("kind") != "fe" and of_sections(raw.get("bolt")):
        kind = f"the structure is of kind {toml(structure.get('kind'))}"
        yield Fault("bolt", kind, remedy='sections of bolts are those of kind = "fe"; else give elongation, stiffness')
    if not raw.get("joint"):
        return
    if isinstance(structure, Mapping) and structure.get("kind") != "fe":
        kind = f"the structure is of kind {toml(structure.get('kind'))}"
        yield Fault("joint", kind, remedy='joints lie between surfaces of kind = "fe"')
    own = (
        any(isinstance(one, Mapping) and "thermal" in one for one in contacts) if isinstance(contacts, list) else False
    )
    if "thermal" in raw or own:
        yield Fault("joint", "is given together with thermal", remedy="leave one out: joints are not heated here")


def _names(rows: Sequence[ReadTable]) -> Iterator[Fault]:
    """Names of contacts, each at its block."""
    from slipstick.balance.checks import contact_name_faults

    right = [row for row in rows if row.right("name")]
    for fault in contact_name_faults([row.table.name for row in right]):
        first = next(row for row in right if row.table.name == fault.where[1])
        yield fault.below("contact", first.table.name).inside(*first.where)


def _load(row: ReadTable, known: Known) -> Iterator[Fault]:
    """The place and the harmonic of a load, as far as they are right."""
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

    if not row.table.on_surface:
        for side in ("tangential", "normal"):
            given = row.get(side) or {}
            for i, cosines in enumerate(given if isinstance(given, tuple) else (given,)):
                at = (side, i) if isinstance(given, tuple) else (side,)
                yield from (fault.inside(*at) for fault in cosine_faults(cosines, known.dofs))
    if isinstance(row.table, StatorTable) and row.right("ports"):
        for port, cosines in row.table.ports.model_dump().items():
            yield from (fault.inside("ports", port) for fault in cosine_faults(cosines, known.dofs))
    rubbing = row.table.rubbing
    if rubbing is not None:
        yield from (fault.inside("rubbing") for fault in motion_faults(rubbing.parts, known))


def _dofs(sections: Sections, known: Known) -> Iterator[Fault]:
    """Dofs of the results and of the peaks."""
    from slipstick.balance.checks import output_faults, peak_faults

    outputs = sections.output.get("dofs") if sections.output is not None else None
    wrong = list(output_faults(outputs, known.dofs)) if outputs is not None else []
    yield from (fault.inside("output", "dofs") for fault in wrong)
    peaks = sections.response.get("peaks_of") if sections.response is not None else None
    if peaks is not None:
        names = [peaks] if isinstance(peaks, str) else list(peaks)
        names = [] if names == [LARGEST] else names
        if known.structure is not None and known.dofs is not None and outputs is not None:
            outputs = [one for name in outputs for one in (name, *(d for d in known.dofs if d.startswith(f"{name}@")))]
        yield from (
            f.inside("response", "peaks_of") for f in peak_faults(names, None if wrong else outputs, known.dofs)
        )


def _sizes(sections: Sections, known: Known, placed: Sequence[CaseContact]) -> Iterator[Fault]:
    """One ratio of periods, and no more unknowns than can be computed."""
    from slipstick.balance.jacobian_backends import MOST_UNKNOWNS, size_fault
    from slipstick.structure.matrices import MatrixStructure

    ratios = [row.get("period_ratio") for row in (sections.top, sections.response) if row is not None]
    if len(set(ratios) - {None}) > 1:
        where = ("response", "period_ratio")
        yield Fault(where, "is another than the period_ratio at the top", remedy="keep one")
    size = 0 if known.orders is None else 2 * len(known.orders) - 1
    unknowns = sum(contact.pair.n_ports for contact in placed) * size
    backend = "dense" if isinstance(known.structure, MatrixStructure) else "iterative"
    if unknowns > MOST_UNKNOWNS[backend]:
        yield size_fault(unknowns, backend)


def heating_faults(contacts: Sequence[CaseContact], top: ReadTable | None, named: Sequence[str] | None) -> list[Fault]:
    """Missing or repeated statements about heat; ``named`` are the names of all contacts, if known."""
    listed = heated_names(contacts, top)
    faults = [
        Fault(("thermal", "contacts"), f"there is no contact '{name}'", remedy=suggestion(name, named or ()))
        for name in listed or ()
        if named is not None and name not in named and not (top is not None and top.get("influence") == OF_STRUCTURE)
    ]
    for row, names in _by_row(contacts):
        heated = None if listed is None else bool(set(names) & set(listed))
        faults += [fault.inside(*row.where) for fault in _heat_faults(row, top, heated)]
    return faults


def _by_row(contacts: Sequence[CaseContact]) -> list[tuple[ReadTable, list[str]]]:
    rows: dict[Where, tuple[ReadTable, list[str]]] = {}
    for contact in contacts:
        rows.setdefault(contact.row.where, (contact.row, []))[1].append(contact.name)
    return list(rows.values())


def _heat_faults(row: ReadTable, top: ReadTable | None, heated: bool | None) -> list[Fault]:
    """Faults of one block; ``heated``: whether ``[thermal]`` holds it, if known."""
    thermal, faults = row.table.thermal, []
    tables = [name for name in OVER_TEMPERATURE if is_table(row.get(name))]
    wrong = {place[1:2] for place in row.wrong if place[:1] == ("thermal",)}
    background = (
        background_of(row.table, None if top is None else top.table) is not None
        or ("background",) in wrong
        or () in wrong
    )
    background = background or (top is not None and not top.right("background"))
    resistance = (thermal is not None and thermal.resistance is not None) or ("resistance",) in wrong
    shared = top is not None and top.get("influence") != OF_STRUCTURE
    if thermal is not None and thermal.resistance is not None and heated and shared:
        remedy = "keep one"
        faults.append(
            Fault(("thermal", "resistance"), "is given, and [thermal] influence holds this contact", remedy=remedy)
        )
    if (thermal is not None or heated) and not background:
        faults.append(Fault(("thermal", "background"), IS_MISSING, remedy=_TEMPERATURE))
    if thermal is not None and not resistance and heated is False:
        remedy = "give temperature per power, or [thermal] influence"
        faults.append(Fault(("thermal", "resistance"), IS_MISSING, remedy=remedy))
    if is_over_velocity(row.get("mu")) and (thermal is not None or heated):
        remedy = "give mu as a number or over temperature, or leave the heat out"
        faults.append(Fault("mu", "depends on the velocity, and the contact is heated", remedy=remedy))
    if tables and thermal is None and not wrong and heated is False:
        cold = "is a table over temperature, but the temperature of the contact is not given"
        remedy = "give [contact.thermal] with background and resistance, or [thermal] with influence"
        faults.append(Fault(tables[0], cold, remedy=remedy))
    return faults


@dataclass(frozen=True, kw_only=True)
class _Named:
    """The parts of a problem in which names of parameters are looked up."""

    contacts: Sequence[ContactPair]
    loads: Sequence[Load]
    structure: Structure | None


def parameter_faults(
    sections: Sections, loads: Sequence[Load], placed: Sequence[CaseContact], described: Described
) -> list[Fault]:
    """An unknown name, or an end of the range that the named parameter cannot take."""
    from slipstick.balance.parameters import changed, parameter_target

    name = sections.response.get("parameter") if sections.response is not None else None
    joints = described_joints(described)
    known = _Named(contacts=[*(c.pair for c in placed), *joints], loads=loads, structure=described.structure)
    disc, wave = described.disc, described.structure
    if disc is not None:
        E: int = wave.engine_order  # type: ignore[union-attr]
        known = _Named(
            contacts=[disc.contacts(pair, E) for pair in known.contacts],
            loads=[own for load in loads for own in disc.loads(load, E)], structure=disc,
        )  # fmt: skip
    if name is None or sections.response is None or _may_be_of_what_is_wrong(name, sections, known, placed):
        return []
    try:
        target = parameter_target(known, name)
    except InputError as error:
        return [fault.inside("response", "parameter") for fault in error.faults]
    faults: list[Fault] = []
    for key, field in (("from", "start"), ("to", "stop")):
        end: Any = sections.response.get(key, field)
        try:
            if end is not None:
                changed(known, target, name, float(end))
        except InputError as error:
            faults += [replace(fault, where=("response", key)) for fault in error.faults]
    return faults


def _may_be_of_what_is_wrong(name: str, sections: Sections, known: _Named, placed: Sequence[CaseContact]) -> bool:
    """Whether a name could belong to a part that could not be read."""
    missing = {row.where for row in sections.contacts} - {contact.row.where for contact in placed}
    if name.startswith("load."):
        return len(known.loads) < len(sections.loads)
    return bool(missing) if "." in name else known.structure is None and name not in ("load", "friction")


def unit_faults(raw: RawTable, units: Units) -> Iterator[Fault]:
    """Frequencies in Hz, rpm or rad/s where the unit of time is no second; units other than SI beside the blade."""
    response, structure = (raw[key] if isinstance(raw.get(key), Mapping) else {} for key in ("response", "structure"))
    written = [*written_frequencies(response), (("structure", "up_to"), structure.get("up_to"))]
    for where, value in written:
        if not units.in_seconds and frequency_unit(value) is not None:
            yield unit_of_time_fault(where, toml(value), units.time, units.angular)
    why = 'but a structure of kind "blade" is in SI units'
    for name, unit in _SI.items():
        if structure.get("kind") == "blade" and getattr(units, name) not in (unit, name):
            yield Fault(("units", name), found=f"{toml(getattr(units, name))}, {why}", expected=toml(unit))


def request_faults(problem: Problem, tables: Mapping[str, RequestTable], *, swept: bool) -> Iterator[Fault]:
    """Tables of commands that do not fit the problem; ``swept``: the response is over a parameter."""
    for name, table in tables.items():
        if refused := ", ".join(map(_refusal, table.impossible(problem))):
            cannot = f"cannot be computed of this case: {refused}"
            yield Fault(name, cannot, remedy=f"leave [{name}] out, or what it does not allow")
        yield from (fault.inside(name) for fault in table.faults(problem, swept=swept))


def reached_faults(problem: Problem, ends: Sequence[float]) -> list[Fault]:
    """Frequencies of the response whose harmonics a table of receptances does not reach."""
    from slipstick.balance.checks import reach_faults

    return [replace(fault, where=("response",)) for fault in reach_faults(problem, ends)]


def support_faults(problem: Problem, stiffness: Where) -> list[Fault]:
    """Why nothing holds the structure in harmonic 0; ``stiffness`` is where the case says its stiffness."""
    try:
        problem.support  # noqa: B018
    except InputError as error:
        return [replace(f, where=stiffness if f.where[:1] == ("K",) else ("load",)) for f in error.faults]
    return []


def _refusal(fault: Fault) -> str:
    expected = f" (expected {fault.expected})" * bool(fault.expected)
    return f"{place(fault.where)}: {fault.found or fault.statement}{expected}"
