"""Tables of verbs of their own: ``[track]``, ``[optimal]``, ``[modes]``, ``[cycles]``.

A peak over a parameter, where it is lowest, a nonlinear mode, self-excited vibration over a parameter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.sentences import place, toml, unexpected
from slipstick.case.tables import Table, positive_frequency
from slipstick.case.validation import ReadTable, read_table
from slipstick.errors import Fault, InputError
from slipstick.faults import shown, suggestion

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem


def _frequencies(value: Any) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise unexpected('two frequencies such as [2.0, 15.0] or ["1 Hz", "40 Hz"]')
    first, last = (positive_frequency(end) for end in value)
    if first == last:
        raise unexpected("two different frequencies")
    return first, last


Frequencies = Annotated[tuple[float, float], PlainValidator(_frequencies)]

_OMEGA = "the range in which the highest peak is meant, two frequencies; by default that of [response]"


class TrackTable(Table):
    """``[track]``: the peak over a parameter."""

    parameter: str = Field(description='the name of a parameter such as "damper.normal_load"')
    start: float = Field(alias="from", description="a number")
    stop: float = Field(alias="to", description="a number")
    dof: str | None = Field(default=None, description="the name of an output")
    omega: Frequencies | None = Field(default=None, description=_OMEGA)
    at: list[float] = Field(default=[], description="a list of values that become exact points")


class OptimalTable(Table):
    """``[optimal]``: the value of a parameter at which the peak is lowest."""

    parameter: str = Field(description='the name of a parameter such as "damper.normal_load"')
    start: float | None = Field(default=None, description="a number, the value to begin at")
    dof: str | None = Field(default=None, description="the name of an output")
    omega: Frequencies | None = Field(default=None, description=_OMEGA)


class ModesTable(Table):
    """``[modes]``: free vibration in a mode over its amplitude."""

    start: Annotated[float, Field(gt=0)] = Field(alias="from", description="a number > 0, the first amplitude")
    stop: Annotated[float, Field(gt=0)] = Field(alias="to", description="a number > 0, the last amplitude")
    mode: int = Field(default=1, ge=1, description="a whole number >= 1, the mode of the structure without contacts")
    dof: str | None = Field(default=None, description="the name of an output")
    load_factors: list[Annotated[float, Field(gt=0)]] = Field(
        default=[], description="a list of factors > 0 on the loads, whose forced peaks become exact points"
    )


class CyclesTable(Table):
    """``[cycles]``: self-excited vibration over a parameter."""

    parameter: str = Field(description='the name of a parameter such as "pad.mu"')
    start: float = Field(alias="from", description="a number, where steady sliding is stable")
    stop: float = Field(alias="to", description="a number")
    dof: str | None = Field(default=None, description="the name of an output")
    at: list[float] = Field(default=[], description="a list of values that become exact points")


PEAK_TABLES: Mapping[str, type[Table]] = {
    "track": TrackTable, "optimal": OptimalTable, "modes": ModesTable, "cycles": CyclesTable
}  # fmt: skip


def take_peak_tables(raw: dict[str, Any]) -> tuple[dict[str, Any], list[Fault]]:
    """Take these tables out of a case; what is right of them, and every fault within one."""
    found: dict[str, ReadTable] = {}
    faults: list[Fault] = []
    for name, model in PEAK_TABLES.items():
        given = raw.pop(name, None)
        if isinstance(given, Mapping):
            found[name], wrong = read_table(model, given, (name,))
            faults += wrong
        elif given is not None:
            faults.append(Fault(name, found=toml(given), expected=f"one table [{name}]"))
    return {name: row.table for name, row in found.items()}, faults


def peak_table_faults(problem: Problem, tables: Mapping[str, Any], *, swept: bool) -> Iterator[Fault]:
    """What of them does not fit the problem; ``swept``: the response is over a parameter, not versus frequency."""
    from slipstick.balance.checks import requested_faults

    for name, table in tables.items():
        if refused := _refused(problem, name):
            cannot = f"cannot be computed of this case: {refused}"
            yield Fault(name, cannot, remedy=f"leave [{name}] out, or what it does not allow")
        if isinstance(table, TrackTable | OptimalTable | CyclesTable):
            yield from _parameter_faults(problem, name, table)
        if isinstance(table, TrackTable | CyclesTable):
            outside = requested_faults(table.at, table.start, table.stop)
            yield from (replace(fault, where=(name, "at")) for fault in outside)
        if isinstance(table, ModesTable) and table.mode > (count := len(problem.structure.natural_frequencies)):
            yield Fault((name, "mode"), found=str(table.mode), expected=f"a mode of the structure, from 1 to {count}")
        if isinstance(table, TrackTable | OptimalTable) and swept and table.omega is None:
            yield Fault((name, "omega"), "is missing", remedy="give the range of frequencies of the peak")
        known = tuple(problem.outputs or ())
        if table.dof is not None and table.dof not in known:
            yield Fault((name, "dof"), f"there is no output {shown(table.dof)}", remedy=suggestion(table.dof, known))
        if name != "optimal" and table.start == table.stop:
            yield Fault((name, "to"), f"is {table.stop:g}, the same as from", remedy="give a range that is not empty")


def _refused(problem: Problem, name: str) -> str:
    """Why there is no mode, or no self-excited vibration, of a problem, whatever the table asks; in one sentence."""
    from slipstick.analysis.modes.nonlinear_modes import motion_faults
    from slipstick.analysis.self_excited.limit_cycles import autonomous_faults

    checks = {"modes": motion_faults, "cycles": autonomous_faults}
    found = checks[name](problem) if name in checks else []
    return ", ".join(
        f"{place(fault.where)}: {fault.found or fault.statement}"
        + (f" (expected {fault.expected})" * bool(fault.expected))
        for fault in found
    )


def _parameter_faults(problem: Problem, name: str, table: TrackTable | OptimalTable | CyclesTable) -> Iterator[Fault]:
    values = [value for end in ("start", "stop") if (value := getattr(table, end, None)) is not None]
    try:
        problem.parameter_target(table.parameter)
        for value in values:
            problem.at_parameter(table.parameter, value)
    except InputError as error:
        yield from (fault.inside(name, "parameter") for fault in error.faults)
