"""Reading of a case: all its faults, found as far as what they concern is right, or the problem it describes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case.body import Body, Tell, silent
from slipstick.case.fe_tables import SurfaceContactTable
from slipstick.case.following import parameter_faults
from slipstick.case.frequencies import blade_faults, display_unit, frequency_faults
from slipstick.case.heating import OWN, heating_faults, shared_influence, thermal_model
from slipstick.case.held import held_faults
from slipstick.case.parts import in_block, load_of, placed_contacts
from slipstick.case.reach import reaching
from slipstick.case.response_table import ResponseTable, frequencies_met
from slipstick.case.sections import Sections, read_sections
from slipstick.case.sentences import in_case
from slipstick.case.structures import Described, read_structure
from slipstick.case.tables import UnitsTable
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering

if TYPE_CHECKING:
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem


@dataclass(frozen=True, kw_only=True)
class Reading:
    """What a case without faults says."""

    title: str
    body: Body
    problem: Problem
    response: ResponseTable
    frequency_unit: str
    warnings: tuple[str, ...]
    """What looks wrong in the text itself."""


def read_case(raw: Mapping[str, Any], folder: Path, tell: Tell = silent) -> Reading:
    """The objects a case describes; files it names lie in ``folder``, ``tell`` hears of stages that take time.

    Raises
    ------
    InputError
        With every fault: each check runs as soon as what it needs is right, whatever else is wrong.
    """
    sections, faults = read_sections(raw)
    described, wrong = read_structure(reaching(raw), folder, tell) if "structure" in raw else (Described(), [])
    parts = _Parts(sections, described, folder)
    faults += [*wrong, *parts.faults]
    units = (sections.top.get("units") or UnitsTable()).units
    if sections.top.right("units"):
        faults += [*frequency_faults(raw, units), *blade_faults(raw, units)]
    if not faults:
        try:
            problem = parts.problem()
            faults += parts.reduction_faults(problem)
        except InputError as error:
            faults += [in_block(fault, parts.placed) for fault in error.faults]
    if faults:
        raise InputError(faults, in_case)
    assert described.body is not None
    assert sections.response is not None
    return Reading(
        title=sections.top.table.title, body=described.body, problem=problem,
        response=sections.response.table, frequency_unit=display_unit(raw, units),
        warnings=tuple(_phases(sections, parts.loads)),
    )  # fmt: skip


def _phases(sections: Sections, loads: Sequence[Load]) -> Iterator[str]:
    """Phases that look like degrees."""
    from slipstick.balance.loads import phase_warnings

    for row, load in zip(sections.loads, loads, strict=True):
        yield from phase_warnings(load.target, row.table.phase)


class _Parts:
    """Loads, contacts and heat of a case, made as far as they are right; ``faults`` of all of them."""

    def __init__(self, sections: Sections, described: Described, folder: Path) -> None:
        self._sections, self._described = sections, described
        found = Gathering()
        made = [load_of(row) for row in sections.loads]
        self.loads: Sequence[Load] = [load for load, _ in made if load is not None]
        found.faults += [fault for _, faults in made for fault in faults]
        reduced = described.body.reduced if described.body is not None else None
        known = described.body is not None or described.made
        self.placed, faults = placed_contacts(sections.contacts, sections.thermal, reduced, known)
        found.faults += [*faults, *held_faults(sections, described, self.placed)]
        on_surface = any(isinstance(row.table, SurfaceContactTable) for row in sections.contacts)
        named = [*(c.name for c in self.placed), *(row.table.name for row in sections.contacts if row.right("name"))]
        unnamed = (on_surface and not known) or not all(row.right("name") for row in sections.contacts)
        found.faults += heating_faults(self.placed, sections.thermal, None if unnamed else [*dict.fromkeys(named)])
        self._points = reduced.points if reduced is not None else None
        self._influence = None if unnamed else found.take(self._read_influence, folder)
        found.faults += parameter_faults(sections, self.loads, self.placed, described)
        self.faults = found.faults

    def _read_influence(self, folder: Path) -> Any:
        top = self._sections.thermal
        if top is None or not top.right("influence", "contacts"):
            return None
        if top.table.influence == OWN and self._described.body is None:
            return None
        return shared_influence(top, self.placed, self._points, folder)

    def problem(self) -> Problem:
        """The problem of a case without faults."""
        from slipstick.balance.problem import Problem

        top, output = self._sections.top.table, self._sections.output
        assert self._described.structure is not None
        problem = Problem(
            self._described.structure,
            contacts=[c.pair for c in self.placed],
            loads=self.loads,
            harmonics=top.harmonics,
            outputs=None if output is None else output.table.dofs,
            period_ratio=self._sections.period_ratio or (1, 1),
            title=top.title,
            units=top.units.units,
            thermal=thermal_model(self.placed, self._sections.thermal, self._influence),
            told=None,
        )
        self._follow(problem)
        return problem

    def _follow(self, problem: Problem) -> None:
        """The followed parameter takes both ends of its range; InputError where it does not."""
        response = self._sections.response
        if response is None or response.table.parameter is None:
            return
        try:
            for end in (response.table.start, response.table.stop):
                problem.at_parameter(response.table.parameter, float(end))
        except InputError as error:
            raise InputError([fault.inside("response", "parameter") for fault in error.faults]) from None

    def reduction_faults(self, problem: Problem) -> list[Fault]:
        """Whether the structure is reduced too far for what is asked of it."""
        from slipstick.balance.reduction import reduction_faults

        body, response = self._described.body, self._sections.response
        if body is None or body.force or response is None:
            return []
        count = body.reduced.modes_below if body.reduced is not None else None
        found = reduction_faults(problem, frequencies_met(response.table), count)
        return [fault.inside("structure") for fault in found]
