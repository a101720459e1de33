"""``[[bolt]]`` and ``[[preload]]``: bolts, and the steps in which they are tightened and loads come on."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, PlainValidator

from slipstick.case.load import LoadTable
from slipstick.case.script_text import Call, Code, listed_text
from slipstick.case.table import (
    NotNegative,
    Positive,
    RawTable,
    Table,
    cosines,
    is_number,
    positive_frequency,
    right_tables,
    unexpected,
)
from slipstick.case.validation import ReadTable, read_table
from slipstick.errors import IS_MISSING, Fault, InputError, SlipstickWarning

if TYPE_CHECKING:
    from slipstick.analysis.preload.preload import Preload
    from slipstick.analysis.preload.steps import LoadStep
    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.problem import Problem
    from slipstick.fem.model import ImportedModel
    from slipstick.models.bolts import PretensionBolts
    from slipstick.models.surface_pair import SurfacePair

BOLT, PRELOAD = "bolt", "preload"
TIGHTEN = "tighten"
"""Name of the step that the forces of ``[[bolt]]`` make."""


class BoltTable(Table):
    """``[[bolt]]``."""

    name: str = Field(min_length=1, description='a name for the bolt, such as "bolt 1"')
    elongation: Annotated[dict[str, float], PlainValidator(cosines)] | None = Field(
        default=None,
        description="dofs with their cosines, positive where the bolt gets longer: { head_z = 1.0, nut_z = -1.0 }",
    )
    stiffness: Positive | None = Field(default=None, description="a number > 0, force over elongation: E A / L")
    section: str | None = Field(default=None, description="the name of a pre-tension section of the model")
    force: NotNegative | None = Field(default=None, description="a number >= 0, to which it is tightened first")
    shortening: float | None = Field(default=None, description="a length, by which it is shortened first")

    @classmethod
    def cross_check(cls, raw: RawTable) -> list[Fault]:
        """It is made and tightened in one way."""
        own, faults = ("elongation", "stiffness"), list[Fault]()
        if "section" in raw:
            remedy = "leave it out: the model has the bolt"
            faults += [Fault(key, "is given together with section", remedy=remedy) for key in own if key in raw]
        else:
            faults += [Fault(key, IS_MISSING) for key in own if key not in raw]
        if "force" in raw and "shortening" in raw:
            faults.append(Fault("shortening", "is given together with force", remedy="keep one of them"))
        return faults

    @property
    def tightened(self) -> bool:
        """Whether it says its own force or shortening."""
        return self.force is not None or self.shortening is not None


BOLTS = "[[bolt]]"
"""Key of bolts that are sections of the model in the table of the structure; no file has it there."""

BOLT_FIELD = "bolts"
"""Field of the structure's table that holds them."""

Bolts = Annotated[list[BoltTable] | None, PlainValidator(right_tables(BoltTable))]


def of_sections(tables: object) -> list[RawTable]:
    """Those of some tables that name a section of the model."""
    return [one for one in tables if isinstance(one, Mapping) and "section" in one] if isinstance(tables, list) else []


def bolts_call(tables: Sequence[BoltTable], model: Code) -> Call:
    """Sections of the model cut; what a bolt says itself comes in place of the loads of the file."""
    loaded = [table.name for table in tables if not table.tightened]
    named = {"loaded": loaded} if len(loaded) < len(tables) else {}
    return Call("ss.models.pretension_bolts", (model, {table.name: table.section for table in tables}), named)


def cut_bolts(tables: Sequence[BoltTable], model: ImportedModel) -> PretensionBolts:
    """The same, silent; a fault of a section stands at its bolt."""
    of_section = {table.section: table.name for table in tables}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SlipstickWarning)
            made: PretensionBolts = bolts_call(tables, Code("model", model)).made()
            return made
    except InputError as error:
        raise InputError([
            replace(fault, where=(BOLT_FIELD, of_section[fault.where[1]], "section"))
            if fault.where[:1] == ("sections",) and len(fault.where) > 1 and fault.where[1] in of_section
            else fault
            for fault in error.faults
        ]) from None  # fmt: skip


def _loads(value: Any) -> list[Any]:
    if not isinstance(value, list) or not all(isinstance(one, Mapping) for one in value):
        raise unexpected('a list of static loads such as [{ dof = "x", cos = 100.0 }]')
    faults, rows = list[Fault](), []
    for place, raw in enumerate(value):
        if raw.get("harmonic", 0) != 0:
            expected = "a static load: leave harmonic out"
            faults.append(Fault((place, "harmonic"), found=f"{raw['harmonic']}", expected=expected))
            continue
        given = {**raw, "harmonic": 0}
        row, wrong = read_table(LoadTable, given, (place,))
        faults += wrong
        rows.append(row.table)
    if faults:
        raise InputError(faults)
    return rows


def _by_name(expected: str) -> PlainValidator:
    """Numbers by name."""

    def read(value: Any) -> dict[str, float]:
        if not isinstance(value, Mapping) or not all(map(is_number, value.values())):
            raise unexpected(expected)
        return {str(name): float(number) for name, number in value.items()}

    return PlainValidator(read)


_BOLTS = 'numbers by the names of bolts such as { "bolt 1" = 12e3 }'
_FIELD = 'the name of a temperature field such as "hot", or factors on several such as { hot = 0.5 }'
_SUPPORTS = "lengths by the names of supports that move, such as { jaw = 1e-4 }"


def _temperature(value: Any) -> str | dict[str, float]:
    if isinstance(value, str) and value:
        return value
    if not isinstance(value, Mapping) or not all(map(is_number, value.values())):
        raise unexpected(_FIELD)
    return {str(name): float(number) for name, number in value.items()}


def _speed(value: Any) -> float:
    return 0.0 if is_number(value) and value == 0 else positive_frequency(value)


class StepTable(Table):
    """``[[preload]]``."""

    name: str = Field(default="", description='a name for the step, such as "tighten"')
    loads: Annotated[list[Any], PlainValidator(_loads)] = Field(
        default=[], description='a list of static loads such as [{ dof = "x", cos = 100.0 }]'
    )
    bolts: Annotated[dict[str, float], _by_name(_BOLTS)] = Field(
        default={}, description='forces by the names of bolts such as { "bolt 1" = 12e3 }'
    )
    shortening: Annotated[dict[str, float], _by_name(_BOLTS)] = Field(
        default={}, description='lengths by the names of bolts such as { "bolt 1" = 1e-4 }'
    )
    temperature: Annotated[str | dict[str, float] | None, PlainValidator(_temperature)] = Field(
        default=None, description=_FIELD
    )
    displacement: Annotated[dict[str, float], _by_name(_SUPPORTS)] = Field(default={}, description=_SUPPORTS)
    speed: Annotated[float | None, PlainValidator(_speed)] = Field(
        default=None, description='a speed of rotation >= 0 such as "3000 rpm"'
    )
    increments: Annotated[int, Field(ge=1)] = Field(default=10, description="a whole number >= 1 of increments")

    @property
    def call(self) -> Call:
        """The step."""
        named = self.given("name", "bolts", "shortening", "temperature", "displacement", "speed", "increments")
        loads = [load.call for load in self.loads]
        return Call("ss.LoadStep", named={**named, **({"loads": loads} if loads else {})})


def bolt_call(table: BoltTable) -> Call:
    """The contact that a bolt is."""
    return Call("ss.bolt", named=table.given("name", "elongation", "stiffness"))


def step_calls(
    bolts: Sequence[BoltTable], steps: Sequence[StepTable], of_file: Sequence[Code] = ()
) -> list[Call | Code]:
    """All steps: first what the bolts say themselves, then those of the model's file."""
    forces = {bolt.name: bolt.force for bolt in bolts if bolt.force is not None}
    lengths = {bolt.name: bolt.shortening for bolt in bolts if bolt.shortening is not None}
    named: dict[str, Any] = {"name": TIGHTEN, "bolts": forces, "shortening": lengths}
    own = [Call("ss.LoadStep", named={key: value for key, value in named.items() if value})] * bool(forces or lengths)
    return [*own, *of_file, *(step.call for step in steps)]


class LoadSteps:
    """The load steps of a case, made; ``shift`` of them come before the first ``[[preload]]``."""

    def __init__(
        self, bolts: Sequence[ReadTable], steps: Sequence[ReadTable], of_file: Sequence[LoadStep] = (),
        gathering: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
    ) -> None:  # fmt: skip
        self._rows, self._gathering = steps, gathering
        known = [Code(step.name, step) for step in of_file]
        calls = step_calls([row.table for row in bolts], [row.table for row in steps], known)
        self.shift, self.steps = len(calls) - len(steps), []
        faults = []
        for place, call in enumerate(calls):
            try:
                self.steps.append(_made(call))
            except InputError as error:
                faults += [fault.inside(*self._where(place)) for fault in error.faults]
        if not self.steps:
            remedy = "give [[preload]], or leave out patches"
            faults += [Fault(("joint", name, "patches"), "needs load steps", remedy=remedy) for name in gathering]
        if faults:
            raise InputError(faults)

    def _where(self, place: int) -> tuple[str | int, ...]:
        return self._rows[place - self.shift].where if place >= self.shift else (BOLT,)

    def faults(self, problem: Problem) -> Iterator[Fault]:
        """What of the problem cannot be loaded so."""
        from slipstick.analysis.preload.march import unmarched
        from slipstick.analysis.preload.steps import targets

        if not self.steps:
            return
        yield from unmarched(problem)
        try:
            targets(problem, self.steps)
        except InputError as error:
            for fault in error.faults:
                steps, place, *rest = fault.where
                if steps == "steps" and isinstance(place, int):
                    fault = replace(fault, where=(*self._where(place), *rest))
                yield fault
        loads = [load for step in self.steps for load in step.loads]
        try:
            replace(problem, loads=loads, told=None)
        except InputError as error:
            numbers = [(k, i) for k, step in enumerate(self.steps) for i in range(len(step.loads))]
            for fault in error.faults:
                if fault.where[:1] == ("load",) and isinstance(fault.where[1], int):
                    step, number = numbers[fault.where[1]]
                    fault = replace(fault, where=(*self._where(step), "loads", number, *fault.where[2:]))
                yield fault

    def fields(self) -> Iterator[str]:
        """Temperatures, speeds, and supports that move, a line for each step that has some."""
        for number, step in enumerate(self.steps, 1):
            heat = step.temperature or ({} if step.temperature is None else {"none": 1.0})
            words = [f"temperature {name}{'' if size == 1.0 else f' times {size:g}'}" for name, size in heat.items()]
            words += [f"support {name} moved to {size:g}" for name, size in step.displacement.items()]
            words += [] if step.speed is None else [f"speed {step.speed:g} rad/s"]
            if words:
                yield f"  {step.name or f'step {number}'}: {', '.join(words)}"

    def computed(self, problem: Problem, joints: Sequence[SurfacePair]) -> Preload | None:
        """The steps computed; None where there are none."""
        if not self.steps:
            return None
        from slipstick.analysis.preload.preload import preload

        state = preload(problem, self.steps, pairs=joints)
        if not self._gathering:
            return state
        gathered = [
            joint.gathered(state=state, **self._gathering[joint.name]) if joint.name in self._gathering else joint
            for joint in joints
        ]
        for joint in gathered:
            problem = joint.replaced_in(problem)
        return preload(problem, self.steps, pairs=gathered)


def _made(call: Call | Code) -> Any:
    """A step with its loads."""
    if isinstance(call, Code):
        return call.value
    named = {key: [load.made() for load in value] if key == "loads" else value for key, value in call.named.items()}
    return call._replace(named=named).made()


def build_bolts(rows: Sequence[ReadTable], cut: Sequence[ContactPair]) -> list[ContactPair]:
    """The bolts whose tables are right; ``cut`` are those of sections."""
    known = {pair.name: pair for pair in cut}
    right = [row.table for row in rows if row.complete]
    return [bolt_call(table).made() if table.section is None else known[table.name] for table in right]


def preload_script(
    problem: str, calls: Sequence[Call | Code], joints: Sequence[str], gathering: Mapping[str, Mapping[str, Any]]
) -> list[str]:
    """Lines that return the preloaded problem; ``gathering`` is that of the variables of joints."""
    pairs = {"pairs": Code(f"[{', '.join(joints)}]")} if joints else {}
    if not gathering:
        state = Call("ss.preload", (Code("made"), list(calls)), pairs).written()
        return [f"made = {problem}", f"return made.preloaded({state})"]
    state = Call("ss.preload", (Code("made"), Code("steps")), pairs).written()
    steps = listed_text([call.text if isinstance(call, Code) else call.written() for call in calls])
    lines = [f"made = {problem}", f"steps = {steps}", f"state = {state}"]
    for joint, given in gathering.items():
        call = Call(f"{joint}.gathered", named={**given, "state": Code("state")}).written()
        lines += [f"{joint} = {call}", f"made = {joint}.replaced_in(made)"]
    return [*lines, f"return made.preloaded({state})"]
