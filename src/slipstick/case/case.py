"""A case file: read, checked as a whole, turned into the public objects."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.case.body import Body, Tell, silent
from slipstick.case.peak_tables import peak_table_faults, take_peak_tables
from slipstick.case.reading import read_case
from slipstick.case.response_table import ResponseTable, frequencies_met, swept_value
from slipstick.case.sentences import in_case
from slipstick.case.source import parse, read_text
from slipstick.case.spacing import Spacing
from slipstick.case.steps import STEP_KEYS
from slipstick.case.studying import check_study, study_plan
from slipstick.errors import InputError
from slipstick.faults import Gathering, one, warn, wrong
from slipstick.faults import path as path_of

if TYPE_CHECKING:
    from slipstick.analysis.curve.follow import CurveRequest
    from slipstick.balance.ports import Balance
    from slipstick.balance.problem import Problem
    from slipstick.results.branch import Branch
    from slipstick.structure.protocol import Structure
    from slipstick.studies.plan import StudyPlan
    from slipstick.studies.solving import Job


@dataclass(frozen=True, kw_only=True)
class Case:
    """A checked case: the objects it describes and what is to be followed.

    Raises nothing itself; :meth:`from_file` and :meth:`from_text` raise InputError with all faults at once.
    """

    path: Path
    text: str
    title: str
    body: Body = field(repr=False)
    problem_: Problem = field(repr=False)
    response: ResponseTable
    frequency_unit: str = "rad/s"
    """As the range is written: "Hz", "kHz", "rpm", or rad over the unit of time."""
    further: Mapping[str, Any] = field(default_factory=dict)
    """What ``[track]``, ``[optimal]``, ``[modes]`` and ``[cycles]`` ask for, by name."""
    plan: StudyPlan | None = None
    """What ``[study]`` asks for."""
    noticed: tuple[str, ...] = ()
    """What is approximated or looks wrong in the model and in the text itself, one sentence each."""

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
        further, faults = take_peak_tables(raw)
        reading = None
        try:
            reading = read_case(raw, path.resolve().parent, tell)
        except InputError as error:
            faults = [*error.faults, *faults]
        if reading is not None and not faults:
            swept = reading.response.parameter is not None
            faults = list(peak_table_faults(reading.problem, further, swept=swept))
        if reading is None or faults:
            found = Gathering()
            if section is not None:
                found.take(check_study, section)
            raise InputError([*faults, *found.faults], in_case)
        return cls(
            path=path,
            text=text,
            title=reading.title or path.stem,
            body=reading.body,
            problem_=reading.problem,
            response=reading.response,
            frequency_unit=reading.frequency_unit,
            plan=None if section is None else study_plan(section, reading.problem),
            further=further,
            noticed=(*reading.body.warnings, *reading.warnings),
        )

    def study_job(self) -> Job:
        """What a study does for every case."""
        from slipstick.studies.solving import Job

        return Job(
            problem=self.problem(), span=self.span, parameter=self.parameter or "", omega=self.omega[0],
            requested=self.requested, peaks_of=self.response.peaks_of, options=self.options(),
            stability=self.response.judged,
        )  # fmt: skip

    @property
    def structure(self) -> Structure:
        """The structure the case describes."""
        return self.body.structure

    def problem(self) -> Problem:
        """The problem the case describes."""
        return self.problem_

    @cached_property
    def balance(self) -> Balance:
        """The problem made ready: its warnings and the recorder of a run share one projection of the structure."""
        from slipstick.balance.ports import Balance

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
        """What is followed, in words: from where to where, and at which frequency."""
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

    def options(self) -> Any:
        """Continuation options given in ``[response]``, over the defaults."""
        from slipstick.analysis.curve.response import response_options

        given = {name: value for name in STEP_KEYS if (value := getattr(self.response, name)) is not None}
        return response_options(**given)

    def warnings(self) -> list[str]:
        """What can be computed but is suspicious, one sentence each."""
        from slipstick.balance.preflight import parameter_warnings, problem_warnings

        static = self.balance.receptance.static
        if self.parameter is not None:
            found = parameter_warnings(
                self.problem(), self.parameter, self.span, self.omega[0], static, steady=self._steady
            )
        else:
            found = problem_warnings(self.problem(), self.omega, static, steady=self._steady)
        return [*self.noticed, *found]

    @property
    def _steady(self) -> bool:
        """Whether steady sliding is of interest by itself."""
        return "cycles" in self.further or (self.parameter is not None and bool(self.response.judged))

    def curve(self, *, listeners: Iterable[Callable[[Any], None]] = ()) -> CurveRequest:
        """What ``[response]`` asks for, to be followed."""
        from slipstick.analysis.curve.follow import frequency_request, parameter_request

        asked = self.response
        given = (self.requested, asked.peaks_of, self.options(), tuple(listeners), None, asked.judged)
        if self.parameter is None:
            return frequency_request(self.problem(), self.span, *given)
        return parameter_request(self.problem(), self.parameter, self.span, self.omega[0], *given)

    def run(self, *, listeners: Iterable[Callable[[Any], None]] = ()) -> Branch:
        """Follow what ``[response]`` asks for."""
        branch = self.curve(listeners=listeners).branch()
        branch.subharmonics = self.subharmonics(branch)
        said = dict.fromkeys([*self.noticed, *branch.warnings])
        branch.table.attrs.update({**self.names, "warnings": "\n".join(said)})
        return branch

    def subharmonics(self, branch: Branch, *, listeners: Iterable[Callable[[Any], None]] = ()) -> tuple[Branch, ...]:
        """Branches of twice the period from those points of a branch of this case, where they are asked for."""
        from slipstick.analysis.stability.subharmonics import subharmonics_of

        if self.response.follow is None:
            return ()
        return subharmonics_of(
            branch, options=self.options(), stability=self.response.judged, listeners=tuple(listeners)
        )

    @property
    def names(self) -> dict[str, str]:
        """What results say of the case they are of."""
        return {
            "title": self.title,
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
    """
    case = Case.from_file(path)
    warn(case.noticed)
    return case.problem()
