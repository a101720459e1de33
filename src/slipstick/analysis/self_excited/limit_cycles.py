"""Self-excited vibration over a parameter: steady sliding, its Hopf point, and the limit cycles from there."""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from slipstick.analysis.peaks.system import StateSpace
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks, Request
from slipstick.analysis.road.run import NO_WORK, Run, Work, counted
from slipstick.analysis.self_excited.steady_sliding import Sliding, SteadySliding, WaveAtRest, damped_as_vibrating
from slipstick.analysis.self_excited.system import CycleSpecialPoints, CycleStart, CycleWatch
from slipstick.balance.balance import Balance
from slipstick.balance.evaluation import terms
from slipstick.balance.parameters import parameter_path
from slipstick.balance.physics_checks import parameter_warnings
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.contact.friction_law import is_friction
from slipstick.contact.law import Law
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import old_names
from slipstick.interrupts import pass_on
from slipstick.results.record import Outputs, Point, Recorder
from slipstick.results.schema import SELF_EXCITED
from slipstick.results.stability import HOPF, STATE_CHANGE
from slipstick.solve.continuation import ArclengthScaling, BranchEvent, RestartPoint, Step, continuation
from slipstick.solve.norm import relative
from slipstick.structure.cyclic import TravellingWave
from slipstick.typing import Array, Real

CYCLE_OPTIONS = {"jacobian": "dense", "event_tolerance": 1e-8}
"""Options of limit cycles where nothing else is said."""

CYCLE_PART, SLIDING_PART = 1, 2
"""Parts of the branch."""

_SLIDING_POINTS = 61
"""Number of values of the parameter at which steady sliding is computed."""
_SAME_VALUE = 1e-9
"""Difference of the parameter over the range, up to which two values are the same."""
_MOVED = 1e-6
"""Distance over the range between the Hopf points of eigenvalues and balance, above which the message has both."""
_DECAYED = 1e-3
"""Size of the vibration over that of the first cycle, at which the branch ends in steady sliding."""
_NO_CYCLE = "no limit cycle near the Hopf point lies in the range"
_HYSTERETIC = (
    "hysteretic damping has no meaning for disturbances that grow: steady sliding and multipliers have viscous "
    "damping, equal to it at {}; the limit cycles have hysteretic damping"
)


@old_names(requested="at")
def limit_cycles(
    problem: Problem,
    parameter: str,
    span: tuple[Real, Real],
    *,
    at: Iterable[Real] | Real = (),
    options: Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Branch:
    """Follow self-excited vibration over a parameter: steady sliding, its Hopf point, and the limit cycles from there.

    Nothing may vary in time but the motion itself: loads have harmonic 0 alone, the opposing surfaces move at constant
    velocity. The frequency is found with the motion (``omega`` in the dataset, another one at every point); the
    multiplier 1 of a shift in time is left out.

    Parameters
    ----------
    problem
        What rubs: friction contacts, or laws without memory that tell their ``rate``, on a structure that is known by
        matrices or modes; or friction contacts of a sector in a travelling wave: flutter that friction limits. The
        engine order is then that of the wave sought, which is followed whether or not other waves grow too.
    parameter, span
        As of ``parameter_response``: a name such as "brake.mu", its first and last value. Begin where steady sliding is
        stable.
    at
        Values of the parameter at which exact points are wanted; one or a list.
    options
        Step control, as of ``forced_response``. Jacobians are written out.
    listeners
        Functions, or subclasses of ``slipstick.analysis.events.Listener``, told of each point and, where it takes long,
        of what is done: ``listeners=ss.Progress()``.

    Returns
    -------
    Branch
        With stability at every point. ``branch_part`` 1 are the limit cycles that begin at the first Hopf point, with
        small motion; 2 is steady sliding over the whole range (amplitude 0; ``omega`` is the frequency of the
        disturbance that decays least, its multipliers are over that period) with every "Hopf" point. As long as all
        contacts keep their state motion of any size belongs to the Hopf point's parameter: the curve rises straight up
        to the first change of state. Look at ``outcome`` and ``message``.

    Raises
    ------
    InputError
        For a parameter, range or option that cannot be used, and for whatever varies in time by itself.

    Warns
    -----
    SlipstickWarning
        As ``parameter_response``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(
    ...     M=[[1.0, 0.0], [0.0, 1.0]], C=[[0.5, 0.0], [0.0, 0.5]], K=[[100.0, -20.0], [-20.0, 60.0]], dofs=["x", "y"])
    >>> pad = ss.FrictionContact(kt=200.0, mu=0.4, kn=40.0, gap=0.0)
    >>> brake = ss.ContactPair(
    ...     name="brake", tangential="x", normal="y", contact=pad, rubbing=ss.RubbingMotion(velocity=1.0))
    >>> problem = ss.Problem(
    ...     structure, contacts=brake, loads=ss.Load(dof="y", harmonic=0, cos=50.0), harmonics=range(11))
    >>> branch = limit_cycles(problem, "brake.mu", (0.4, 0.56), at=0.55)
    >>> [(point.kind, round(point.value, 6), round(point.omega, 6)) for point in branch.bifurcations()][-1]
    ('Hopf', 0.53125, 10.0)
    >>> round(float(branch.dataset.omega[branch.at(0.55)]), 4)
    9.9945
    """
    return Branch.of(cycles_request(problem, parameter, span, at, options, listeners).solutions())


def cycles_request(problem: Any, parameter: Any, span: Any, at: Any, options: Any, listeners: Any = ()) -> SelfExcited:
    """Request of ``limit_cycles``; its arguments, checked. Raises InputError with all faults."""
    checks = Checks(problem)
    name = checks.name(parameter, "brake.mu")
    ends, points = checks.range(span, at, name)
    if checks.problem is not None:
        faults = autonomous_faults(checks.problem)
        checks.faults += faults
        if name:
            varied = checks.take(_varied_faults, checks.problem, name, ends) or []
            checks.faults += [fault for fault in varied if fault not in faults]
    chosen = CYCLE_OPTIONS if options is None else options
    if isinstance(chosen, Mapping):
        chosen = {**CYCLE_OPTIONS, **chosen}
        checks.faults += _option_faults(chosen)
    common = checks.common(points, options=chosen, listeners=listeners)
    assert checks.problem is not None
    assert ends is not None
    request = self_excited(checks.problem, common["balance"], name, ends, points, common["options"])
    return replace(request, listeners=common["listeners"])


def self_excited(
    problem: Problem, balance: Balance, parameter: str, span: tuple[float, float], requested: tuple[float, ...],
    options: Any,
) -> SelfExcited:  # fmt: skip
    """The request and its warnings, also of hysteretic damping that is replaced by viscous damping."""
    values = {*np.linspace(*span, _SLIDING_POINTS).tolist(), *requested}
    ordered = sorted(values, reverse=span[1] < span[0])
    wave = balance.receptance.waves is not None
    sliding = WaveAtRest(balance, parameter) if wave else SteadySliding(balance, parameter)
    if not sliding.in_time:
        raise InputError("limit cycles need equations in time: give the structure as matrices or modes")
    if not wave and _hysteretic(problem, parameter, span):
        sliding = damped_as_vibrating(balance, parameter, ordered)
    warnings = [*parameter_warnings(problem, parameter, span, 1.0, balance.receptance.static, steady=True)]
    if sliding.damping_at is not None:
        warnings.append(_HYSTERETIC.format(problem.units.frequency_text(sliding.damping_at)))
    return SelfExcited(
        problem=problem, balance=balance, parameter=parameter, start=span[0], stop=span[1], requested=requested,
        options=replace(options, output_step=np.inf), warnings=warnings, sliding=sliding, values=tuple(ordered),
    )  # fmt: skip


def _hysteretic(problem: Problem, parameter: str, span: tuple[float, float]) -> bool:
    """Whether there is hysteretic damping anywhere in the range."""
    ends = (problem.at_parameter(parameter, end).structure for end in span)
    return any(np.any(np.asarray(structure.loss_factor)) for structure in ends)


def _option_faults(options: Mapping[str, Any]) -> Iterator[Fault]:
    if options.get("adapt_harmonics") is not None:
        yield Fault("options, adapt_harmonics", "limit cycles are computed with all harmonics", remedy="leave it out")
    if options.get("jacobian") == "iterative":
        yield Fault("options, jacobian", "limit cycles are computed with dense Jacobians", remedy="leave it out")


def autonomous_faults(problem: Problem) -> list[Fault]:
    """Faults: explicit functions of time, and what cannot be computed of self-excited vibration."""
    return list(_autonomous_faults(problem))


def _autonomous_faults(problem: Problem) -> Iterator[Fault]:
    instead = "use ss.forced_response or ss.parameter_response"
    for load in problem.loads:
        if load.harmonic and (load.cos or load.sin):
            fault = f"it excites at harmonic {load.harmonic}"
            where = ("load", load.dof or load.shape or "")
            yield Fault(where, fault, expected="harmonic 0 alone", remedy=instead)
    for pair in problem.contacts:
        moved = [name for name, value in pair.rubbing.components() if np.any(value)]
        if other := [name for name in moved if name not in ("velocity", "second_velocity")]:
            fault = f"the rubbing motion has {', '.join(other)}"
            yield Fault(("contact", pair.name), fault, expected="a constant velocity alone", remedy=instead)
        law = pair.contact
        remembers = law.memory and law.regimes is None and not slides(law)
        if not is_friction(law) and (remembers or not law.in_time):
            fault = "it follows a law that remembers" if law.in_time else "its law does not tell its rate in time"
            yield Fault(("contact", pair.name), fault, expected="friction, or forces of motion and velocity")
    yield from (state.self_excited_fault() for state in problem.contact_states)
    if problem.structure.tied:
        tied = "the speed of rotation is tied to a frequency that is not known before"
        yield Fault(("structure", "engine_order"), tied, remedy="give the structure a fixed speed")
    if isinstance(problem.structure, TravellingWave):
        for pair in problem.contacts:
            if not is_friction(pair.contact):
                unknown = "it follows a law whose answer to disturbances of a wave is not known"
                yield Fault(("contact", pair.name), unknown, expected="friction", remedy="compute the whole disc")
    if 1 not in problem.harmonics.orders:
        yield Fault("harmonics", "harmonic 1 is left out", expected="harmonics with 0 and 1, such as 0 to 10")


def slides(law: Law) -> bool:
    """Whether the memory of a law has no effect in steady sliding."""
    still = np.zeros((len(law.ports), 1, 1))
    values = {name: np.ravel(np.asarray(value, dtype=float))[:1, None] for name, value in law.values.items()}
    return law.memory_in_sliding(still, still, values) is not None


def _varied_faults(problem: Problem, parameter: str, span: tuple[float, float] | None) -> list[Fault]:
    """Faults at the ends of the range; raises InputError where the parameter cannot have such a value."""
    parameter_path(problem, parameter)
    ends = [autonomous_faults(problem.at_parameter(parameter, end)) for end in span or ()]
    return max(ends, key=len, default=[])


@dataclass(frozen=True, kw_only=True)
class SelfExcited(Request):
    """A request to follow self-excited vibration over a parameter.

    Attributes
    ----------
    sliding
        Steady sliding of the problem.
    values
        Values of the parameter at which it is computed, in their order.
    """

    analysis: ClassVar[str] = "cycles"
    sliding: SteadySliding
    values: tuple[float, ...]

    @cached_property
    def space(self) -> StateSpace:
        """The states over the parameter."""
        path = parameter_path(self.problem, self.parameter)
        return StateSpace(Outputs(self.balance, ()), self.problem.inputs, path)

    @property
    def span(self) -> tuple[float, float]:
        """First and last value of the parameter."""
        return self.start, self.stop

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint at a limit cycle, from its journal; steady sliding is computed again."""
        with undamaged():
            point = Checkpoint.from_plain(plain, size=self.balance.size + 2)
            if point.goes_on and point.restart_point is None:
                raise ValueError
            return point

    def run(self) -> SelfExcitedRun:
        """The run that follows the vibration."""
        return SelfExcitedRun(self)

    def recorder(self) -> Recorder:
        """Recorder with stability at every point."""
        return Recorder(self.balance, parameter=self.parameter, stability=True)


class SelfExcitedRun(Run[SelfExcited]):
    """Limit cycles from the first Hopf point, then steady sliding over the range.

    Attributes
    ----------
    beginning
        Value of the parameter at which the cycles begin; nan without cycles.
    """

    def __init__(self, request: SelfExcited) -> None:
        super().__init__(request)
        self.beginning = np.nan
        self._work: Work = NO_WORK

    def points(self) -> Generator[Point, None, None]:
        """Points of limit cycles, and after any end of those the points of steady sliding."""
        slidings, hopf = self._sliding_over_range()
        if hopf:
            self.outcome, self.message, self.beginning = Outcome.NO_FIRST_POINT, _NO_CYCLE, hopf[0].value
            yield from self.until_ended(self._cycles(hopf[0]))
        self._conclude(slidings, hopf)
        for sliding in slidings:
            yield self._sliding_point(sliding, slidings, hopf)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Kind of vibration and work."""
        return {"vibration": SELF_EXCITED, **counted(self._work)}

    def _sliding_over_range(self) -> tuple[list[Sliding], list[Sliding]]:
        """Steady sliding over the range with its Hopf points, and these alone."""
        request = self.request
        slidings = []
        self.doing = "steady sliding"
        for number, sliding in enumerate(request.sliding.over(request.values), start=1):
            slidings.append(sliding)
            pass_on()
            self.doing = f"steady sliding, value {number} of {len(request.values)}"
            self.count_evaluation()
        self.doing = "looking for Hopf points"
        hopf = request.sliding.hopf_points(slidings)
        near = _SAME_VALUE * abs(request.stop - request.start)
        apart = [s for s in slidings if all(abs(s.value - point.value) > near for point in hopf)]
        return sorted([*apart, *hopf], key=lambda s: s.value, reverse=request.stop < request.start), hopf

    def _sliding_point(self, sliding: Sliding, slidings: Sequence[Sliding], hopf: Sequence[Sliding]) -> Point:
        kind = "start" if sliding is slidings[0] else "end" if sliding is slidings[-1] else "regular"
        kind = HOPF if sliding in hopf else "requested" if sliding.value in self.request.requested else kind
        x, stability = at_rest(self.request.balance, sliding), sliding.stability
        self._set_checkpoint(sliding.value, SLIDING_PART)
        return self._uncorrected(x, sliding.omega, sliding.value, kind=kind, part=SLIDING_PART, stability=stability)

    def _uncorrected(self, x: Array, omega: float, value: float, **names: Any) -> Point:
        """Point of a motion (N,) without correction, with the residual of the balance."""
        here = self.request.space.at(x, omega, value)
        residual = relative(here.at.residual, terms(self.request.balance, x, here.at))
        return Point.at(here.detail, x=x, residual=residual, iterations=0, parameter=value, peak_of="", **names)

    def _conclude(self, slidings: Sequence[Sliding], hopf: Sequence[Sliding]) -> None:
        """Set outcome and message."""
        request = self.request
        where = f"over the whole range of {request.parameter}"
        if not slidings:
            self.outcome, self.message = Outcome.NO_FIRST_POINT, "no steady sliding was found"
        elif hopf:
            others = ", ".join(f"{s.value:.6g}" for s in hopf[1:])
            more = f"; further Hopf points, not followed from: {others}" if others else ""
            at = f"{self.beginning:.6g} ({request.parameter})"
            if abs(self.beginning - hopf[0].value) > _MOVED * abs(request.stop - request.start):
                at += f", by eigenvalues at {hopf[0].value:.6g}: equations in time leave out part of the compliance"
            self.message = f"{self.message}; Hopf point at {at}{more}"
        elif any(s.growing for s in slidings):
            self.outcome = Outcome.NO_FIRST_POINT
            self.message = (
                f"steady sliding is unstable and there is no Hopf point {where}: begin where it is stable, such as at "
                "a smaller friction coefficient"
            )
        else:
            self.outcome = Outcome.COMPLETED
            self.message = f"steady sliding is stable {where}: no vibration begins by itself"

    def _cycles(self, hopf: Sliding) -> Iterator[Point]:
        """Points from the Hopf point to the first change of contact state, then along the branch."""
        request = self.request
        self.doing = "looking for the first limit cycle"
        request.balance.anchor_if_undamped(hopf.omega)
        start = CycleStart(request.space, hopf, at_rest(request.balance, hopf), request.span)
        if not start.exists:
            self.message = "the balance has no vibration near the Hopf point of the eigenvalues"
            return
        self.beginning = start.value
        resumed = bool(request.checkpoints)
        if not resumed:
            yield self._at_hopf_point(start, hopf, 0.0, "start")
        if start.largest is None:
            self.message = "vibration grows at the Hopf point without bound: no contact changes its state"
            return
        if not (start.smooth or resumed):
            yield self._at_hopf_point(start, hopf, start.largest, STATE_CHANGE)
        first = start.first()
        if first is not None:
            yield from self._beyond_first_change(start, first)

    def _at_hopf_point(self, start: CycleStart, hopf: Sliding, size: float, kind: str) -> Point:
        """Point of the vertical part of the branch at the Hopf point."""
        x, stability = start.vibrating(size), hopf.stability
        self._set_checkpoint(start.value, CYCLE_PART)
        return self._uncorrected(x, start.omega, start.value, kind=kind, part=CYCLE_PART, stability=stability)

    def _beyond_first_change(self, start: CycleStart, first: Step) -> Iterator[Point]:
        """Points of the branch where contacts change their states."""
        request, system = self.request, start.system
        special = CycleSpecialPoints(CycleWatch(request.balance, damping_at=request.sliding.damping_at), system)
        least = _DECAYED * start.size(first.x[:-1])
        decayed = BranchEvent(
            name="the vibration dies away in steady sliding", kind="end", terminal=True, direction=-1,
            function=lambda step: start.size(step.x[:-1]) - least,
        )  # fmt: skip
        before = [point for stood in request.checkpoints[-1:] for point in (stood.before, stood.restart_point)]
        restart = [point for point in before if point is not None]
        run = continuation(
            system, first.x, *request.span, at=first.parameter, direction=first.tangent, options=request.options,
            scaling=ArclengthScaling(x=start.unit(first.x[:-1]), weight=0.1), requested=request.requested,
            events=(decayed, *special.events), restart=restart,
        )  # fmt: skip
        if run.resumed_at is not None:
            special.take_up(run.resumed_at, restart[-1].values[-1])
        self.doing, stood = "", deque(restart, maxlen=2)
        for step in run:
            pass_on()
            accepted = run.restart_point is not None and run.restart_point.state is step.state
            if accepted and run.restart_point is not None:
                stood.append(run.restart_point)
            self.progress = min(1.0, abs((step.parameter - request.start) / (request.stop - request.start)))
            # steady sliding solves the balance at every frequency: an event located there is no cycle
            if start.size(step.x[:-1]) > 0.5 * least:
                self._set_checkpoint(step.parameter, CYCLE_PART, tuple(stood) if accepted else ())
                yield self._followed(step, special)
        self.outcome, self.message = run.outcome or Outcome.INTERRUPTED, run.message
        self._work = Work(1, run.evaluations, run.solves, run.rejected)

    def _set_checkpoint(self, value: float, part: int, stood: tuple[RestartPoint, ...] = ()) -> None:
        """Set the checkpoint of the next point; a run resumes after points of the continuation only."""
        self.checkpoint = Checkpoint(
            value=value, seconds=self.seconds, part=part, goes_on=bool(stood), own={},
            restart_point=stood[-1] if stood else None, before=stood[0] if len(stood) > 1 else None,
        )  # fmt: skip

    def _followed(self, step: Step, special: CycleSpecialPoints) -> Point:
        value = step.evaluation
        kind = step.kind if special.confirmed(step) and step.kind != "start" else "regular"
        return Point.at(
            value.detail, x=step.x[:-1], residual=relative(value.residual, value.terms()), iterations=step.iterations,
            kind=kind, parameter=step.parameter, peak_of="", part=CYCLE_PART,
            stability=special.judged(step, compare=kind not in ("regular", STATE_CHANGE)),
        )  # fmt: skip


def at_rest(balance: Balance, sliding: Sliding) -> Array:
    """Unknowns (N,) of steady sliding."""
    X = np.zeros((balance.n_ports, balance.L))
    X[:, 0] = sliding.x
    return X.reshape(-1)
