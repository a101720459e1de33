"""Tables of verbs of their own: ``[track]``, ``[optimal]``, ``[modes]``, ``[limit_cycles]``, ``[wear]``,
``[run_up]``, ``[identify]``.

Another one is another class here, and its name in :data:`slipstick.case.sections.REQUESTS`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field, PlainValidator

from slipstick.case.table import NotNegative, Positive, Table, is_number, positive_frequency, unexpected
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import shown, suggestion
from slipstick.results.bifurcations import bifurcations_of
from slipstick.results.view import names_of, value_text
from slipstick.units import after_number

if TYPE_CHECKING:
    from slipstick.analysis.road.request import Request
    from slipstick.balance.problem import Problem
    from slipstick.case.case import Case
    from slipstick.results.solutions import Solutions
    from slipstick.results.table import ResultTable


def _frequencies(value: object) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:
        raise unexpected('two frequencies such as [2.0, 15.0] or ["1 Hz", "40 Hz"]')
    first, last = (positive_frequency(end) for end in value)
    if first == last:
        raise unexpected("two different frequencies")
    return first, last


Frequencies = Annotated[tuple[float, float], PlainValidator(_frequencies)]
Speed = Annotated[float, PlainValidator(positive_frequency)]
_MOST_LINES = 12
"""So many contacts are told of."""
_OMEGA = "the range in which the highest peak is meant, two frequencies; by default that of [response]"


class RequestTable(Table):
    """A table that has a command of its own."""

    verb: ClassVar[str]
    """The function of the library that computes it, as it is called after ``ss.``: ``init --python`` names it."""
    onward: ClassVar[str] = "another part begins"
    """The message where another part of the branch begins."""
    nothing: ClassVar[Mapping[str, Any]] = {}
    """Further results for a program where nothing was found."""

    @classmethod
    def impossible(cls, problem: Problem) -> list[Fault]:
        """Why it cannot be computed of this problem whatever the table says."""
        return []

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Faults against the problem; ``swept``: ``[response]`` is over a parameter, not versus frequency."""
        raise NotImplementedError

    def request(self, case: Case) -> Request:
        """The analysis to be computed."""
        raise NotImplementedError

    def description(self, case: Case) -> str:
        """The same in words."""
        raise NotImplementedError

    def shown_in(self, case: Case) -> str:
        """The unit of the followed quantity, as it stands after a number."""
        raise NotImplementedError

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """The findings in sentences, and the same as data for ``--json``."""
        raise NotImplementedError

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """Functions that draw its figures, by name."""
        raise NotImplementedError


class TrackTable(RequestTable):
    """``[track]``: the peak over a parameter."""

    verb: ClassVar[str] = "track_peak"
    onward: ClassVar[str] = "another peak is followed on"

    parameter: str = Field(description='the name of a parameter such as "damper.normal_load"')
    start: float = Field(alias="from", description="a number")
    stop: float = Field(alias="to", description="a number")
    omega: Frequencies | None = Field(default=None, description=_OMEGA)
    at: list[float] = Field(default=[], description="a list of values that become exact points")
    dof: str | None = Field(default=None, description="the name of an output")

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Parameter, points, range of frequencies, dof."""
        from slipstick.balance.checks import requested_faults

        yield from _parameter_faults(problem, self.parameter, self.start, self.stop)
        yield from requested_faults(self.at, self.start, self.stop)
        yield from _omega_faults(self.omega, swept)
        yield from _dof_faults(problem, self.dof)
        yield from _range_faults(self.start, self.stop)

    def request(self, case: Case) -> Request:
        """The peak to be followed, by default in the range of ``[response]``."""
        from slipstick.analysis.peaks.tracking import tracked_peak

        omega = case.span if self.omega is None else self.omega
        return tracked_peak(case.problem(), self.parameter, (self.start, self.stop), omega, self.at, self.dof, None)

    def description(self, case: Case) -> str:
        """The peak and its parameter."""
        return f"the peak over {self.parameter} from {self.start:g} to {self.stop:g}{self.shown_in(case)}"

    def shown_in(self, case: Case) -> str:
        """That of the parameter."""
        return _unit_of(case, self.parameter)

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """Optima, turning points and ties."""
        data = branch.table
        value, kinds = data["parameter"].to_numpy(), data["kind"].to_numpy()
        dof, at = str(data.attrs["peak_of"]), [value_text(data, "parameter", float(own)) for own in value]
        marked = np.flatnonzero(np.isin(kinds, ("optimum", "turning point", "tie")))
        peaks = [_peak(data, dof, int(k)) for k in marked]
        lines = [
            f"{kinds[k]}: {self.parameter} = {at[k]}, {_peak_text(case, data, dof, peak)}"
            for k, peak in zip(marked, peaks, strict=True)
        ]
        answers = [
            {"kind": str(kinds[k]), "parameter": value[k], **peak} for k, peak in zip(marked, peaks, strict=True)
        ]
        return lines, {"marked": answers}

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """The peak over the parameter."""
        from slipstick import plots

        return {"response": lambda: plots.response(branch, str(branch.table.attrs["peak_of"]))}


class OptimalTable(RequestTable):
    """``[optimal]``: the value of a parameter at which the peak is lowest."""

    verb: ClassVar[str] = "optimal"
    onward: ClassVar[str] = "another peak is followed on"
    nothing: ClassVar[Mapping[str, Any]] = {"value": np.nan, "omega": np.nan, "amplitude": np.nan, "kind": ""}

    parameter: str = Field(description='the name of a parameter such as "damper.normal_load"')
    omega: Frequencies | None = Field(default=None, description=_OMEGA)
    dof: str | None = Field(default=None, description="the name of an output")
    start: float | None = Field(default=None, description="a number, the value to begin at")

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Parameter, range of frequencies, dof."""
        yield from _parameter_faults(problem, self.parameter, self.start)
        yield from _omega_faults(self.omega, swept)
        yield from _dof_faults(problem, self.dof)

    def request(self, case: Case) -> Request:
        """The optimum, and the peak from a quarter of its value to four times it."""
        from slipstick.analysis.peaks.optimum import optimum_request

        omega = case.span if self.omega is None else self.omega
        return optimum_request(case.problem(), self.parameter, self.start, omega, self.dof, beside=4.0)

    def description(self, case: Case) -> str:
        """Over what."""
        return f"the value of {self.parameter} at which the peak is lowest"

    def shown_in(self, case: Case) -> str:
        """That of the parameter."""
        return _unit_of(case, self.parameter)

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """The optimum."""
        data, about = branch.table, branch.table.attrs
        dof, unit = str(about["peak_of"]), after_number(str(data["parameter"].attrs.get("units", "")))
        value, kind = float(about["optimum"]), str(about["optimum_kind"])
        peak = {name: float(about[f"optimum_{name}"]) for name in ("omega", "amplitude")}
        at = f"{self.parameter} = {value:.8g}{unit}"
        said = f"the peak of {dof} is {kind} at {at}: {_peak_text(case, data, dof, peak)}"
        return [said], {"value": value, **peak, "kind": kind}

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """The peak over the parameter."""
        from slipstick import plots

        return {"response": lambda: plots.response(branch, str(branch.table.attrs["peak_of"]))}


class ModesTable(RequestTable):
    """``[modes]``: free vibration in a mode over its amplitude."""

    verb: ClassVar[str] = "nonlinear_modes"

    start: Positive = Field(alias="from", description="a number > 0, the first amplitude")
    stop: Positive = Field(alias="to", description="a number > 0, the last amplitude")
    mode: int = Field(default=1, ge=1, description="a whole number >= 1, the mode of the structure without contacts")
    dof: str | None = Field(default=None, description="the name of an output")
    load_factors: list[Positive] = Field(
        default=[], description="a list of factors > 0 on the loads, whose forced peaks become exact points"
    )

    @classmethod
    def impossible(cls, problem: Problem) -> list[Fault]:
        """A problem that has no nonlinear modes."""
        from slipstick.analysis.modes.free_problem import motion_faults

        return list(motion_faults(problem))

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Mode, dof, range of amplitudes."""
        if self.mode > (count := len(problem.structure.natural_frequencies)):
            yield Fault("mode", found=str(self.mode), expected=f"a mode of the structure, from 1 to {count}")
        yield from _dof_faults(problem, self.dof)
        yield from _range_faults(self.start, self.stop)

    def request(self, case: Case) -> Request:
        """The mode to be followed."""
        from slipstick.analysis.modes.nonlinear_modes import mode_request

        return mode_request(case.problem(), (self.start, self.stop), self.mode, self.dof, self.load_factors)

    def description(self, case: Case) -> str:
        """Which mode, between which amplitudes."""
        return f"mode {self.mode} from the amplitude {self.start:g} to {self.stop:g}{self.shown_in(case)}"

    def shown_in(self, case: Case) -> str:
        """That of a length."""
        return case.problem().units.after("length")

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """The first, the most damped and the last point, and the forced peaks of the load factors."""
        data = branch.table
        factor, ratio, dof = (
            data["load_factor"].to_numpy(),
            data["modal_damping"].to_numpy(),
            str(data.attrs["mode_of"]),
        )
        marked = {"first": 0, "most damped": int(np.argmax(ratio)), "last": len(ratio) - 1}
        points = [{"kind": name, **_peak(data, dof, k), "damping": ratio[k]} for name, k in marked.items()]
        lines = [
            f"{point['kind']}: {_peak_text(case, data, dof, point)}, damping ratio {100.0 * point['damping']:.3g} %"
            for point in points
        ]
        asked = np.flatnonzero(data["kind"].to_numpy() == "requested")
        peaks = [_peak(data, dof, int(k)) for k in asked]
        lines += [
            f"loads times {factor[k]:.6g}: {_peak_text(case, data, dof, peak)}, damping ratio {100.0 * ratio[k]:.3g} %"
            for k, peak in zip(asked, peaks, strict=True)
        ]
        answers = [
            {"load_factor": factor[k], **peak, "damping": ratio[k]} for k, peak in zip(asked, peaks, strict=True)
        ]
        return lines, {"marked": points, "peaks": answers}

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """Frequency and damping over the amplitude."""
        from slipstick import plots

        return {"backbone": lambda: plots.backbone(branch), "damping": lambda: plots.damping(branch)}


class LimitCyclesTable(RequestTable):
    """``[limit_cycles]``: self-excited vibration over a parameter."""

    verb: ClassVar[str] = "limit_cycles"
    onward: ClassVar[str] = "steady sliding over the range"

    parameter: str = Field(description='the name of a parameter such as "pad.mu"')
    start: float = Field(alias="from", description="a number, where steady sliding is stable")
    stop: float = Field(alias="to", description="a number")
    at: list[float] = Field(default=[], description="a list of values that become exact points")
    dof: str | None = Field(default=None, description="the name of an output")

    @classmethod
    def impossible(cls, problem: Problem) -> list[Fault]:
        """A problem that does not vibrate by itself."""
        from slipstick.analysis.self_excited.limit_cycles import autonomous_faults

        return list(autonomous_faults(problem))

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Parameter, points, dof, range."""
        from slipstick.balance.checks import requested_faults

        yield from _parameter_faults(problem, self.parameter, self.start, self.stop)
        yield from requested_faults(self.at, self.start, self.stop)
        yield from _dof_faults(problem, self.dof)
        yield from _range_faults(self.start, self.stop)

    def request(self, case: Case) -> Request:
        """The limit cycles to be followed."""
        from slipstick.analysis.self_excited.limit_cycles import cycles_request

        return cycles_request(case.problem(), self.parameter, (self.start, self.stop), self.at, None)

    def description(self, case: Case) -> str:
        """The parameter and its range."""
        over = f"{self.parameter} from {self.start:g} to {self.stop:g}{self.shown_in(case)}"
        return f"self-excited vibration over {over}"

    def shown_in(self, case: Case) -> str:
        """That of the parameter."""
        return _unit_of(case, self.parameter)

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """Bifurcations, and the limit cycles at the values asked for; where there are several at one, each."""
        data, d = branch.table, branch.dof_index(self.dof)
        dof = names_of(data, "dof")[d]
        lines: list[str] = []
        answers: dict[str, Any] = {"marked": [], "cycles": []}
        for found in bifurcations_of(branch):
            at = f"{self.parameter} = {value_text(data, 'parameter', found.value)}"
            lines.append(f"{found.kind}: {at}, {case.frequency_text(found.omega)}")
            marked = {"kind": found.kind, "parameter": found.value, "omega": found.omega}
            answers["marked"].append({**marked, "before": found.before, "after": found.after})
        part, kinds, stable, value = (data[n].to_numpy() for n in ("branch_part", "kind", "stable", "parameter"))
        for k in np.flatnonzero((kinds == "requested") & (part == 1)):
            sure, peak = {0: False, 1: True}.get(int(stable[k])), _peak(data, dof, int(k))
            verdict = {False: ", unstable", True: ", stable", None: ""}[sure]
            there = (
                f"{self.parameter} = {value_text(data, 'parameter', value[k])}: {case.frequency_text(peak['omega'])}"
            )
            size = value_text(data, "amplitude", peak["amplitude"], dof)
            lines.append(f"limit cycle at {there}, amplitude {size} of {dof}{verdict}")
            answers["cycles"].append({"parameter": value[k], **peak, "stable": sure})
        return lines, answers

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """The vibration over the parameter, and its stability."""
        from slipstick import plots

        return {"response": lambda: plots.response(branch, self.dof), "stability": lambda: plots.stability(branch)}


def _by_contact(value: Any) -> Any:
    """A number >= 0 for all contacts, or numbers, or lists of them, by name."""
    expected = "a number >= 0, or numbers by the names of contacts such as { tip = 1e-9 }"
    by_name = value if isinstance(value, dict) and value else {"": value}
    for numbers in by_name.values():
        several = numbers if isinstance(numbers, list) and numbers and by_name is value else [numbers]
        if not all(is_number(number) and number >= 0 for number in several):
            raise unexpected(expected)
    return value


def _frequency_or_peak(value: Any) -> Any:
    return value if value == "peak" else positive_frequency(value)


ByContact = Annotated[Any, PlainValidator(_by_contact)]
FrequencyOrPeak = Annotated[Any, PlainValidator(_frequency_or_peak)]


class WearTable(RequestTable):
    """``[wear]``: wear of the contacts over cycles of vibration."""

    verb: ClassVar[str] = "wear"

    kappa: ByContact = Field(description="gap opened per dissipated energy, a number or numbers by name of contact")
    start: NotNegative = Field(default=0.0, alias="from", description="a number >= 0 of cycles")
    stop: Positive = Field(alias="to", description="a number > 0 of cycles")
    omega: FrequencyOrPeak = Field(description='a frequency such as 9.0 or "50 Hz", or "peak"')
    at: list[float] = Field(default=[], description="a list of numbers of cycles that become exact points")
    range: Frequencies | None = Field(default=None, description='of "peak": ' + _OMEGA)
    dof: str | None = Field(default=None, description='of "peak": the name of an output')
    depth: ByContact = Field(default=None, description="a depth > 0, or depths by name of contact")
    method: Literal["auto", "explicit", "implicit"] = Field(
        default="auto", description='one of "auto", "explicit", "implicit"'
    )
    tolerance: Positive = Field(default=1e-7, le=0.1, description="a number from 1e-14 to 0.1", ge=1e-14)
    max_change: Positive = Field(default=0.05, le=1.0, description="a number from 1e-6 to 1", ge=1e-6)

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Contacts, cycles, range of frequencies, dof."""
        from slipstick.analysis.wear.wear import depths, worn_problem

        try:
            worn_problem(problem, self.kappa)
            if self.depth is not None:
                depths(self.depth, problem.elements)
        except InputError as error:
            yield from error.faults
        if not self.start < self.stop:
            yield Fault("to", f"is {self.stop:g}, not more than from", remedy="give a range that is not empty")
        for i, value in enumerate(self.at):
            if not self.start <= value <= self.stop:
                yield Fault(("at", i), found=f"{value:g}", expected=f"cycles from {self.start:g} to {self.stop:g}")
        if self.omega == "peak":
            yield from (replace(fault, where=("range",)) for fault in _omega_faults(self.range, swept))
        for name in ("range", "dof"):
            if self.omega != "peak" and getattr(self, name) is not None:
                yield Fault(name, 'is for omega = "peak", but a frequency is given', remedy="leave it out")
        yield from _dof_faults(problem, self.dof)

    def request(self, case: Case) -> Request:
        """Wear at a frequency or at the peak."""
        from slipstick.analysis.wear.wear import wear_request

        peak = {"range": self.range or case.omega, "dof": self.dof} if self.omega == "peak" else {}
        return wear_request(
            case.problem(), self.kappa, (self.start, self.stop), omega=self.omega, at=self.at, depth=self.depth,
            method=self.method, tolerance=self.tolerance, max_change=self.max_change, **peak,
        )  # fmt: skip

    def description(self, case: Case) -> str:
        """Over which cycles, at what frequency."""
        at = "the peak of the response" if self.omega == "peak" else case.frequency_text(self.omega)
        return f"wear from {self.start:g} to {self.stop:g} cycles at {at}"

    def shown_in(self, case: Case) -> str:
        """Cycles."""
        return " cycles"

    def summary(self, case: Case, branch: Solutions) -> tuple[list[str], dict[str, Any]]:
        """A sentence for each contact that is worn, the deepest first: its depth, and its load at first and at last."""
        data = branch.table
        depth, load = data["worn_depth"].to_numpy(), data["normal_load"].to_numpy()
        force = after_number(data["normal_load"].attrs["units"])
        last, names = np.nan_to_num(depth[-1]), data["contact"].to_numpy()
        worn = [value_text(data, "worn_depth", own) for own in last]
        return [
            f"{names[i]}: worn {worn[i]}, load {load[0, i]:.6g} to {load[-1, i]:.6g}{force}"
            for i in np.argsort(-last, kind="stable")[:_MOST_LINES]
            if last[i] > 0.0
        ], {}

    def figures(self, branch: Solutions) -> dict[str, Callable[[], Any]]:
        """Wear over cycles and, of several contacts, on their surface."""
        from slipstick import plots

        every: dict[str, Callable[[], Any]] = {"wear": lambda: plots.wear(branch)[0]}
        if branch.table.sizes["contact"] > 1:
            every["worn_surface"] = lambda: plots.worn_surface(branch)[0]
        return every


class RunUpTable(RequestTable):
    """``[run_up]``: passing through, or long motion at one speed, in time."""

    verb: ClassVar[str] = "runs.run_up"

    start: Speed = Field(alias="from", description="a frequency > 0, the first speed of the excitation")
    stop: Speed | None = Field(default=None, alias="to", description="a frequency > 0; left out, the speed stays")
    rate: Positive | None = Field(default=None, description="a number > 0, how fast the speed changes, rad/s^2")
    periods: int | None = Field(default=None, ge=1, description="a whole number >= 1")
    samples: int = Field(default=32, ge=0, le=4096, description="samples in a period at the highest speed")
    dof: str | None = Field(default=None, description="the name of an output")

    @classmethod
    def impossible(cls, problem: Problem) -> list[Fault]:
        """Contacts whose law does not tell its rate."""
        from slipstick.analysis.time_domain.piecewise_model import integration_faults

        return list(integration_faults(problem))

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Rate or periods, dof, range, structures that are known at one speed alone."""
        from slipstick.analysis.time_domain.long_run import sweep_faults

        yield from _dof_faults(problem, self.dof)
        if self.stop is None:
            if self.periods is None:
                yield Fault("periods", IS_MISSING, remedy="give how many, or a second speed and its rate")
            return
        yield from _range_faults(self.start, self.stop)
        if self.rate is None:
            yield Fault("rate", IS_MISSING, remedy="give how fast the speed changes, rad/s^2")
        yield from sweep_faults(problem, swept=True)

    @property
    def omega(self) -> float | tuple[float, float]:
        """As ``ss.runs.run_up`` takes it."""
        return self.start if self.stop is None else (self.start, self.stop)


class IdentifyTable(RequestTable):
    """``[identify]``: parameters fitted to measurements."""

    verb: ClassVar[str] = "identify"

    parameters: dict[str, float] = Field(
        min_length=1, description='start values by name such as { "damper.mu" = 0.3, "damper.kt" = 1e4 }'
    )
    bounds: dict[str, Annotated[list[float], Field(min_length=2, max_length=2)]] = Field(
        default={}, description='the lowest and highest value by name such as { "damper.mu" = [0.05, 1.0] }'
    )
    noise: Positive | None = Field(default=None, description="a number > 0, the standard deviation of what is measured")
    relative_noise: float | None = Field(
        default=None, gt=0.0, lt=1.0, description="a number between 0 and 1, the noise as a share of what is measured"
    )
    starts: int = Field(default=1, ge=1, le=10_000, description="a whole number >= 1, starts spread over the bounds")
    seed: int = Field(default=0, ge=0, description="a whole number >= 0, of that spread")
    columns: dict[str, str] | None = Field(
        default=None, description='names of the columns of a file such as { x = "Disp ch3" }'
    )
    quantity: Literal["displacement", "velocity", "acceleration"] | None = Field(
        default=None,
        description='"displacement", "velocity" or "acceleration": what was measured, if the file does not say',
    )

    def faults(self, problem: Problem, *, swept: bool) -> Iterator[Fault]:
        """Parameters with their starts, bounds."""
        for name, value in self.parameters.items():
            yield from _parameter_faults(problem, name, value, key="parameters")
        for name, (low, high) in self.bounds.items():
            if name not in self.parameters:
                yield Fault("bounds", f"{shown(name)} is not in parameters", remedy=suggestion(name, self.parameters))
            elif not low <= self.parameters[name] <= high or low == high:
                start = f"[{low:g}, {high:g}] for a start of {self.parameters[name]:g}"
                yield Fault(("bounds", name), start, expected="the lowest value first, and the start between them")


def _unit_of(case: Case, parameter: str) -> str:
    """The unit of a parameter, as it stands after a number."""
    from slipstick.balance.parameters import parameter_units

    return case.problem().units.after(parameter_units(case.problem(), parameter))


def _peak(data: ResultTable, dof: str, point: int) -> dict[str, float]:
    """Frequency and amplitude of a dof at a point."""
    d = names_of(data, "dof").index(dof)
    return {"omega": data["omega"].to_numpy()[point], "amplitude": data["amplitude"].to_numpy()[point, d]}


def _peak_text(case: Case, data: ResultTable, dof: str, peak: Mapping[str, float]) -> str:
    """How high a peak of a dof is, and where."""
    size = value_text(data, "amplitude", peak["amplitude"], dof)
    return f"amplitude {size} of {dof} at {case.frequency_text(peak['omega'])}"


def _parameter_faults(problem: Problem, name: str, *values: float | None, key: str = "parameter") -> Iterator[Fault]:
    """A parameter that the problem does not have, or cannot give these values."""
    try:
        problem.parameter_target(name)
        for value in values:
            if value is not None:
                problem.at_parameter(name, value)
    except InputError as error:
        yield from (fault.inside(key) for fault in error.faults)


def _omega_faults(omega: tuple[float, float] | None, swept: bool) -> Iterator[Fault]:
    if swept and omega is None:
        yield Fault("omega", IS_MISSING, remedy="give the range of frequencies of the peak")


def _dof_faults(problem: Problem, dof: str | None) -> Iterator[Fault]:
    known = tuple(problem.outputs or ())
    if dof is not None and dof not in known:
        yield Fault("dof", f"there is no output {shown(dof)}", remedy=suggestion(dof, known))


def _range_faults(start: float, stop: float) -> Iterator[Fault]:
    if start == stop:
        yield Fault("to", f"is {stop:g}, the same as from", remedy="give a range that is not empty")
