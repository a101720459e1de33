"""A case file: read, checked as a whole, turned into the public objects."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case import RENAMED
from slipstick.case.contact import build_contacts, in_block
from slipstick.case.cross_checks import (
    described_joints,
    heating_faults,
    joint_faults,
    joint_loads,
    parameter_faults,
    reached_faults,
    request_faults,
    support_faults,
    table_faults,
    unit_faults,
)
from slipstick.case.fe import reaching
from slipstick.case.joint import joint_tables
from slipstick.case.load import build_load
from slipstick.case.preload import LoadSteps, build_bolts
from slipstick.case.response import (
    STEP_KEYS,
    ResponseTable,
    Spacing,
    display_unit,
    frequencies_met,
    swept_value,
)
from slipstick.case.sections import Sections, in_case, read_sections, read_structure, take_requests
from slipstick.case.source import parse, read_text
from slipstick.case.structure import Body, Described, Tell, silent
from slipstick.case.study import check_study, study_plan
from slipstick.case.table import RawTable, at
from slipstick.case.thermal import OF_STRUCTURE, shared_influence, thermal_model
from slipstick.case.top import UnitsTable
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, one, real_path, warn, wrong
from slipstick.faults import path as path_of

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest
    from slipstick.analysis.preload.preload import Preload
    from slipstick.analysis.road.events import EventFunction
    from slipstick.analysis.road.request import Request, ResponseOptions
    from slipstick.balance.balance import Balance
    from slipstick.balance.loads import Load
    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch
    from slipstick.results.solutions import Solutions
    from slipstick.structure.protocol import Structure
    from slipstick.studies.plan import StudyPlan
    from slipstick.studies.solving import Job
    from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A case without faults, read."""

    title: str
    author: str
    remarks: str
    body: Body
    problem: Problem
    steps: LoadSteps
    response: ResponseTable
    frequency_unit: str
    warnings: tuple[str, ...]
    """Suspicious values in the text itself, one sentence each."""


def read_case(raw: RawTable, folder: Path, tell: Tell = silent) -> Reading:
    """The objects a case describes; files it names lie in ``folder``, ``tell`` hears of stages that take time.

    Raises
    ------
    InputError
        With every fault: a check runs as soon as its own input is right, whatever else is wrong.
    """
    sections, faults = read_sections(raw)
    faults += joint_faults(raw)
    described, wrong = read_structure(reaching(raw), folder, tell) if "structure" in raw else (Described(), [])
    parts = _Builder(sections, described, folder)
    faults += [*wrong, *parts.faults]
    units = (sections.top.get("units") or UnitsTable()).units
    if sections.top.right("units"):
        gathering, known = Gathering(), None if described.structure is None else described.structure.units
        units = gathering.take(units.filled, known) or units
        faults += [*gathering.faults, *unit_faults(raw, units)]
    if not faults:
        try:
            cut = None if described.body is None else described.body.bolts
            patches = {one.name: own for one in joint_tables(raw) if (own := one.gathering)}
            steps = LoadSteps(sections.bolts, sections.steps, () if cut is None else cut.steps, patches)
            problem = parts.problem()
            faults += [*parts.reduction_faults(problem), *steps.faults(problem)]
        except InputError as error:
            faults += [in_block(fault, parts.placed) for fault in error.faults]
    if faults:
        raise InputError(faults, in_case)
    assert described.body is not None
    assert sections.response is not None
    return Reading(
        title=sections.top.table.title, author=sections.top.table.author, remarks=sections.top.table.remarks,
        body=described.body, problem=problem, steps=steps,
        response=sections.response.table, frequency_unit=display_unit(raw["response"], units),
        warnings=(*parts.phases, *parts.noticed),
    )  # fmt: skip


class _Builder:
    """Loads, contacts and heat of a case, made as far as they are right; ``faults`` of all of them."""

    def __init__(self, sections: Sections, described: Described, folder: Path) -> None:
        self._sections, self._described = sections, described
        self.noticed: tuple[str, ...] = ()
        gathering = Gathering()
        with warnings.catch_warnings(record=True) as phases:
            warnings.simplefilter("always")
            made = [build_load(row) for row in sections.loads]
        self.phases = [str(warning.message) for warning in phases]
        """Those that look like degrees, in words."""
        self.loads: Sequence[Load] = [load for load, _ in made if load is not None]
        gathering.faults += [fault for _, faults in made for fault in faults]
        reduced = None if described.body is None else described.body.reduced or described.body.sector
        known = described.body is not None or described.made
        self.placed, faults = build_contacts(sections.contacts, sections.thermal, reduced, known)
        gathering.faults += [*faults, *table_faults(sections, described, self.placed)]
        on_surface = any(row.table.on_surface for row in sections.contacts)
        named = [*(c.name for c in self.placed), *(row.table.name for row in sections.contacts if row.right("name"))]
        unnamed = (on_surface and not known) or not all(row.right("name") for row in sections.contacts)
        gathering.faults += heating_faults(self.placed, sections.thermal, None if unnamed else [*dict.fromkeys(named)])
        self._points = reduced.points if reduced is not None else None
        self._influence = None if unnamed else gathering.take(self._read_influence, folder)
        gathering.faults += parameter_faults(sections, self.loads, self.placed, described)
        self.faults = gathering.faults

    def _read_influence(self, folder: Path) -> tuple[list[str], Array] | None:
        top = self._sections.thermal
        if top is None or not top.right("influence", "contacts"):
            return None
        if top.table.influence == OF_STRUCTURE and self._described.body is None:
            return None
        return shared_influence(top, self.placed, self._points, folder)

    def problem(self) -> Problem:
        """The problem of a case without faults."""
        from slipstick.balance.problem import Problem

        top, output, body = self._sections.top.table, self._sections.output, self._described.body
        assert self._described.structure is not None
        problem = Problem(
            self._described.structure,
            contacts=[
                *(c.pair for c in self.placed),
                *described_joints(self._described),
                *build_bolts(self._sections.bolts, [] if body is None else body.bolts or []),
            ],
            loads=[*self.loads, *joint_loads(self._described)],
            harmonics=top.harmonics,
            outputs=None if output is None or self._described.disc is not None else output.table.dofs,
            period_ratio=self._sections.period_ratio or (1, 1),
            title=top.title,
            units=top.units.units,
            thermal=thermal_model(self.placed, self._sections.thermal, self._influence),
            told=None,
        )
        problem = self._straightened(problem)
        disc = None if self._described.body is None else self._described.body.disc
        if disc is not None:
            problem = disc.problem(problem, None if output is None else output.table.dofs)
        self._follow(problem)
        return problem

    def _straightened(self, problem: Problem) -> Problem:
        """With ``friction = "auto"``, contacts of one direction where the motion is nearly straight."""
        chosen = [c.name for c in self.placed if c.row.table.chosen_by_motion]
        if not chosen or self._sections.response is None:
            return problem
        from slipstick.models.straight import STRAIGHT, straightened

        problem, told = straightened(problem, frequencies_met(self._sections.response.table), chosen, STRAIGHT)
        self.noticed = (f'friction = "auto": {told}',)
        return problem

    def _follow(self, problem: Problem) -> None:
        """The followed parameter takes both ends of its range; InputError where it does not."""
        response = self._sections.response
        if response is None or response.table.parameter is None:
            return
        with at("response", "parameter"):
            for end in (response.table.start, response.table.stop):
                problem.at_parameter(response.table.parameter, float(end))

    def reduction_faults(self, problem: Problem) -> list[Fault]:
        """Whether the structure is reduced too far for what is asked of it."""
        from slipstick.balance.reduction import reduction_faults

        body, response = self._described.body, self._sections.response
        if body is None or body.force or response is None:
            return []
        count = body.reduced.modes_below if body.reduced is not None else None
        faults = reduction_faults(problem, frequencies_met(response.table), count)
        return [fault.inside("structure") for fault in faults]


def _once(reading: Reading, plan: StudyPlan | None) -> list[str]:
    """Whether parameters change that load steps depend on."""
    if not reading.steps.steps or (plan is None and reading.response.parameter is None):
        return []
    return [
        "load steps are computed once, with the values of the file: parameters that change later do not change them"
    ]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A checked case: the objects it describes and what is to be followed.

    Raises nothing itself; :meth:`from_file` and :meth:`from_text` raise InputError with all faults at once.

    Examples
    --------
    >>> import slipstick as ss
    >>> text = '''
    ... format = 1
    ... harmonics = "0..5"
    ... structure = { kind = "matrices", dofs = ["x"], mass = [[1.0]], damping = [[0.4]], stiffness = [[40.0]] }
    ... load = [{ dof = "x", sin = 5.0 }]
    ... contact = [{ name = "foot", tangential = "x", kt = 100.0, mu = 0.3, normal_load = 10.0 }]
    ... response = { from = 4.0, to = 14.0 }
    ... '''
    >>> branch = ss.Case.from_text(text).run()
    >>> [(round(omega, 3), round(amplitude, 3)) for omega, amplitude in branch.peaks("x")]
    [(6.467, 0.533)]
    """

    path: Path
    text: str = field(repr=False)
    title: str
    body: Body = field(repr=False)
    problem_: Problem = field(repr=False)
    response: ResponseTable
    frequency_unit: str = "rad/s"
    """As the range is written: "Hz", "kHz", "rpm", or rad over the unit of time."""
    further: Mapping[str, Any] = field(default_factory=dict)
    """The tables that have a command of their own, ``[track]``, ``[wear]`` and so on, by name."""
    plan: StudyPlan | None = None
    """The cases of ``[study]``."""
    noticed: tuple[str, ...] = ()
    """Approximations and suspicious values of the model and of the text, one sentence each."""
    author: str = ""
    remarks: str = ""
    steps: LoadSteps | None = field(default=None, repr=False)
    """The load steps before the vibration."""

    @classmethod
    def from_file(cls, path: str | Path, tell: Tell = silent) -> Case:
        """Read a case file; ``tell`` hears of stages that take time.

        Raises
        ------
        InputError
            One sentence for each fault in the file.
        """
        path = path_of("case", path, "the path of a case file such as case.toml")
        return cls.from_text(read_text(path), path, tell)

    @classmethod
    def from_text(cls, text: str, path: str | Path = "case.toml", tell: Tell = silent) -> Case:
        """A case from its text; files it names are looked for in the folder of ``path``."""
        path, text = (
            path_of("case", path, "the path of a case file such as case.toml"),
            one("case", text, str, "the text of a case"),
        )
        if not callable(tell):
            raise wrong("tell", tell, "a function of a text")
        raw = parse(text, path.name)
        section = raw.pop("study", None)
        requests, faults = take_requests(raw)
        reading = None
        try:
            reading = read_case(raw, real_path(path).parent, tell)
        except InputError as error:
            faults = [*error.faults, *faults]
        if reading is not None and not faults:
            swept = reading.response.parameter is not None
            faults = list(request_faults(reading.problem, requests, swept=swept))
            if not swept:
                ends = [swept_value(end, False) for end in (reading.response.start, reading.response.stop)]
                faults += reached_faults(reading.problem, ends)
            where = ("structure", "stiffness") if "stiffness" in raw["structure"] else ("structure",)
            faults += support_faults(reading.problem, where)
        if reading is None or faults:
            gathering = Gathering()
            if section is not None:
                gathering.take(check_study, section)
            raise InputError([*faults, *gathering.faults], in_case)
        try:
            plan = None if section is None else study_plan(section, reading.problem)
        except InputError as error:
            raise InputError(error.faults, in_case) from None
        renamed = [f"[{name}] is now called [{RENAMED[name]}]" for name in requests if name in RENAMED]
        case = cls(
            path=path,
            text=text,
            title=reading.title or path.stem,
            author=reading.author,
            remarks=reading.remarks,
            body=reading.body,
            problem_=reading.problem,
            response=reading.response,
            frequency_unit=reading.frequency_unit,
            plan=plan,
            further={RENAMED.get(name, name): table for name, table in requests.items()},
            noticed=(*reading.body.warnings, *reading.warnings, *renamed, *_once(reading, plan)),
            steps=reading.steps,
        )
        if plan is not None and plan.tuned is not None:
            try:
                case.study_job()  # whether the response can be that of its discs
            except InputError as error:
                raise InputError(error.faults, in_case) from None
        return case

    def study_job(self) -> Job:
        """The computation that a study repeats for every case."""
        from slipstick.studies.solving import Job
        from slipstick.studies.study import job_for

        job = Job(
            problem=self.problem(), span=self.span, parameter=self.parameter or "", omega=self.omega[0],
            requested=self.requested, peaks_of=self.response.peaks_of, options=self.options(),
            stability=self.response.judged,
        )  # fmt: skip
        return job if self.plan is None else job_for(job, self.plan, "response")

    @property
    def structure(self) -> Structure:
        """The structure the case describes."""
        return self.body.structure

    def problem(self) -> Problem:
        """The problem the case describes; its vibration begins from the load steps, computed at the first call."""
        return self._loaded

    @cached_property
    def preloaded(self) -> Preload | None:
        """The load steps of the case, computed; None where there are none. InputError where they cannot be."""
        try:
            return None if self.steps is None else self.steps.computed(self.problem_, self.body.joints)
        except InputError as error:
            raise InputError(error.faults, in_case) from None

    @cached_property
    def _loaded(self) -> Problem:
        return self.problem_ if self.preloaded is None else self.preloaded.problem.preloaded(self.preloaded)

    @cached_property
    def balance(self) -> Balance:
        """The problem made ready: its warnings and the recorder of a run share one projection of the structure."""
        from slipstick.balance.balance import Balance

        return Balance(self.problem())

    @property
    def name(self) -> str:
        """The file's name without its ending."""
        return self.path.stem

    @property
    def parameter(self) -> str | None:
        """The named parameter that is followed; None where it is the frequency."""
        return self.response.parameter

    @property
    def span(self) -> tuple[float, float]:
        """Start and stop of the followed quantity, rad/s or the parameter's own unit."""
        swept = self.parameter is not None
        return swept_value(self.response.start, swept), swept_value(self.response.stop, swept)

    def frequency_text(self, omega: float) -> str:
        """A frequency (rad/time) for the reader, also in the unit the range is written in."""
        return self.problem().units.frequency_text(omega, self.frequency_unit)

    @property
    def request(self) -> str:
        """The range that is followed, in words, and the frequency where that is fixed."""
        start, stop = self.span
        if self.parameter is None:
            return f"{self.frequency_text(start)} to {self.frequency_text(stop)}"
        _, unit = self.shown_in
        return f"{self.parameter} from {start:g} to {stop:g}{unit} at {self.frequency_text(self.omega[0])}"

    @property
    def shown_in(self) -> tuple[float, str]:
        """The unit that the followed quantity is shown in: its size, and how it stands after a number."""
        from slipstick.balance.parameters import parameter_units

        units = self.problem().units
        if self.parameter is not None:
            return 1.0, units.after(parameter_units(self.problem(), self.parameter))
        return units.frequency_factor(self.frequency_unit), f" {self.frequency_unit}"

    @property
    def requested(self) -> tuple[float, ...]:
        """Values at which exact points are wanted."""
        wanted = self.response.at
        if isinstance(wanted, Spacing):
            return wanted.values(*self.span)
        return tuple(swept_value(v, self.parameter is not None) for v in wanted)

    @property
    def omega(self) -> tuple[float, float]:
        """The frequencies met, rad/s: a range, or twice the fixed one."""
        return frequencies_met(self.response)

    def options(self) -> ResponseOptions:
        """Continuation options given in ``[response]``, over the defaults."""
        from slipstick.analysis.curve.response import response_options

        options = {name: value for name in STEP_KEYS if (value := getattr(self.response, name)) is not None}
        return response_options(**options)

    def warnings(self) -> list[str]:
        """Suspicious but computable input, one sentence each."""
        from slipstick.balance.physics_checks import parameter_warnings, problem_warnings

        static = self.balance.receptance.static
        if self.parameter is not None:
            sentences = parameter_warnings(
                self.problem(), self.parameter, self.span, self.omega[0], static, steady=self._steady
            )
        else:
            sentences = problem_warnings(self.problem(), self.omega, static, steady=self._steady)
        if "wear" in self.further:
            from slipstick.analysis.wear.wear import wear_warnings, worn_problem

            sentences += wear_warnings(worn_problem(self.problem(), self.further["wear"].kappa))
        return [*self.noticed, *sentences]

    @property
    def _steady(self) -> bool:
        """Whether steady sliding is of interest by itself."""
        return "limit_cycles" in self.further or (self.parameter is not None and bool(self.response.judged))

    def curve(self, *, listeners: Iterable[EventFunction] = ()) -> CurveRequest:
        """The curve of ``[response]``, to be followed."""
        from slipstick.analysis.curve.follow import frequency_request, parameter_request

        asked = self.response
        arguments = (self.requested, asked.peaks_of, self.options(), tuple(listeners), None, asked.judged)
        if self.parameter is None:
            return frequency_request(self.problem(), self.span, *arguments)
        return parameter_request(self.problem(), self.parameter, self.span, self.omega[0], *arguments)

    def asks(self, table: str = "") -> Request:
        """The analysis of the table of that name, or of ``[response]`` without a name."""
        if not table:
            return self.curve()
        request: Request = self.further[RENAMED.get(table, table)].request(self)
        return request

    def run(self, *, listeners: Iterable[EventFunction] = ()) -> Branch:
        """Follow the curve of ``[response]``."""
        from slipstick.branch import Branch

        solutions = self.curve(listeners=listeners).solutions()
        solutions.subharmonics = self.subharmonics(solutions)
        branch = Branch.of(solutions)
        said = dict.fromkeys([*self.noticed, *branch.warnings])
        branch.table.attrs.update({**self.names, "warnings": "\n".join(said)})
        return branch

    def subharmonics(self, branch: Solutions, *, listeners: Iterable[EventFunction] = ()) -> tuple[Solutions, ...]:
        """Branches of twice the period from those points of a branch of this case, where they are asked for."""
        from slipstick.analysis.stability.subharmonics import subharmonics_of

        if self.response.follow is None:
            return ()
        return subharmonics_of(
            branch, options=self.options(), stability=self.response.judged, listeners=tuple(listeners)
        )

    @property
    def names(self) -> dict[str, str]:
        """Attributes of results that name their case."""
        said = {"author": self.author, "remarks": self.remarks}
        return {
            "title": self.title,
            **{key: text for key, text in said.items() if text},
            "case": self.text,
            "case_file": self.path.name,
            "frequency_unit": self.frequency_unit,
        }


def load_case(path: str | Path) -> Problem:
    """The problem a case file describes, for a script or a notebook; what ``[response]`` asks for is in :class:`Case`.

    Parameters
    ----------
    path
        The case file; files it names lie in its folder, and reductions are kept there.

    Raises
    ------
    InputError
        One sentence for each fault in the file.

    Warns
    -----
    SlipstickWarning
        What is approximated or is suspicious in the model of the structure.

    Examples
    --------
    With a case file of yours:

    >>> import slipstick as ss
    >>> problem = ss.load_case("blade.toml")  # doctest: +SKIP
    >>> branch = ss.forced_response(problem, omega=("200 Hz", "260 Hz"))  # doctest: +SKIP
    """
    case = Case.from_file(path)
    warn(case.noticed)
    return case.problem()
