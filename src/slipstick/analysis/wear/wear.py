"""Wear over cycles of vibration: steady motion at worn depths, integrated in long steps of many cycles."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np

from slipstick.analysis.peaks.tracking import one_dof
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks, Request
from slipstick.analysis.road.run import Run
from slipstick.analysis.wear.motion import AtFrequency, AtPeak, SteadyWear, WornMotion, mean_load
from slipstick.balance.checks import requested_values, two_frequencies, two_numbers
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import frequency, number, numbers, old_names, whole, wrong
from slipstick.interrupts import pass_on
from slipstick.results.record import Point, Recorder
from slipstick.results.schema import CYCLES, Declared, Layout
from slipstick.solve.continuation.events import BracketedRoot
from slipstick.solve.norm import norm
from slipstick.solve.runge_kutta import (
    DORMAND_PRINCE,
    EULER,
    MIDPOINT,
    RK4,
    ROSENBROCK_ORDER,
    StepEnd,
    explicit_step,
    rosenbrock_step,
)
from slipstick.state.wear import WearModel, WornContacts, by_contact
from slipstick.typing import AnyArray, Array, Frequency, FrequencyRange, Real, Reals

PEAK = "peak"
"""Value of ``omega`` for wear at the peak of the response."""

FIXED = {"euler": EULER, "midpoint": MIDPOINT, "rk4": RK4}
METHODS = ("auto", "explicit", "implicit", *FIXED)


@old_names(requested="at")
def wear(
    problem: Problem,
    kappa: Reals | Mapping[str, Reals],
    cycles: tuple[Real, Real],
    *,
    omega: Frequency,
    at: Iterable[Real] | Real = (),
    range: FrequencyRange | None = None,
    dof: str | None = None,
    depth: Real | Mapping[str, Reals] | None = None,
    method: str = "auto",
    steps: int | None = None,
    tolerance: Real = 1e-7,
    max_change: Real = 0.05,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Branch:
    """Wear of the contacts over cycles of steady vibration, in steps of many cycles.

    Friction opens the gap of contact i by ``kappa_i`` times the energy that it dissipates: Archard's law with
    ``kappa = alpha / (mu A)`` for a worn volume ``alpha`` per load and way of sliding, an area A and constant friction
    ``mu``; of the energy law it is the volume per energy over the area. At every worn depth the vibration is the
    steady one. A contact that sticks all period never wears; its mean friction force is the middle of the admissible
    ones, on which the path of wear depends where sticking contacts begin to slip.

    Parameters
    ----------
    problem
        What vibrates; heated contacts wear at their temperature. Contacts need a normal stiffness ``kn``: the load that
        is lost is ``kn`` times the depth.
    kappa
        Gap opened per dissipated energy, length / (force x length), >= 0: one number for all, or by name of a contact
        pair (one number, or one for each of its contacts) or of a contact. Those not named do not wear.
    cycles
        First and last number of cycles: periods of the fundamental frequency. The contacts are as in the problem at
        the first.
    omega
        Frequency of the vibration, rad/s; or "peak": at every worn depth that at which the amplitude of ``dof`` is
        largest. That of a whole range is sought at the first cycle.
    at
        Numbers of cycles at which points are wanted; one or a list.
    range
        Of "peak": range of frequencies, rad/s, in which the highest peak is meant. It may leave the range.
    dof
        Of "peak": name of the output; by default the first.
    depth
        Depth at which a contact is worn out, length > 0, for all or by name as ``kappa``; it ends there. None: never.
    method
        "explicit": Dormand and Prince's pair of order 5; "implicit": RODAS, of order 4, with exact derivatives, for
        surfaces over which the load is redistributed; "auto": at each step the one that suits. With ``steps`` equal
        steps: "euler", "midpoint", "rk4", of orders 1, 2, 4.
    steps
        Number of steps of those methods.
    tolerance
        Error of a step: of the load of each contact, over the largest load at the first cycle.
    max_change
        Largest change of a load in a step, over that load.
    listeners
        Called with every event, as of ``forced_response``.

    Returns
    -------
    Branch
        Points over ``parameter``, the ``cycles``: ``worn_depth`` and ``normal_load`` (the mean normal force) of each
        contact, ``amplitude``, ``omega`` and all else. ``problem_at(point)`` is the problem with the gaps as they are
        there. It ends before the last cycle, with its ``outcome``, where a contact is worn out ("worn out"), where the
        contacts have lost their load ("separation", a part of 1e-6 of the largest is left), and where the steady motion
        ends, as at a fold.

    Raises
    ------
    InputError
        For arguments that cannot be used, laws without gap, and where no first motion is found.

    Warns
    -----
    SlipstickWarning
        As ``forced_response``; for a contact without ``kn``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, normal_load=800.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    >>> worn = wear(problem, {"damper": 8e-4}, cycles=(0, 400), omega=10.7901)
    >>> float(worn.dataset.normal_load[-1, 0].round(3)), float(worn.dataset.amplitude[-1, 0].round(4))
    (542.141, 2.6954)
    """
    arguments = locals()
    return Branch.of(wear_request(**arguments).solutions())


def wear_request(
    problem: Any,
    kappa: Any,
    cycles: Any,
    *,
    omega: Any,
    at: Any = (),
    range: Any = None,
    dof: Any = None,
    depth: Any = None,
    method: Any = "auto",
    steps: Any = None,
    tolerance: Any = 1e-7,
    max_change: Any = 0.05,
    listeners: Any = (),
) -> WearRequest:
    """Request of ``wear``; its arguments, checked.

    Raises
    ------
    InputError
        With all faults.
    """
    checks = Checks(problem)
    worn = checks.take(worn_problem, checks.problem, kappa) if checks.problem is not None else None
    ends = checks.take(_cycles, cycles)
    points = checks.take(_points, at, ends)
    at_peak = isinstance(omega, str) and omega == PEAK
    output = None
    if at_peak:
        if range is None:
            checks.faults.append(Fault("range", "is missing", remedy='give the range of frequencies of the "peak"'))
        else:
            sought = checks.take(two_frequencies, range, checks.units)
        output = checks.take(one_dof, checks.problem, dof) if checks.problem is not None else None
    else:
        value = checks.take(frequency, "omega", omega, checks.units)
        sought = None if value is None else (value, value)
        for name, given in (("range", range), ("dof", dof)):
            if given is not None:
                checks.faults.append(
                    Fault(name, 'is for omega="peak", but a frequency is given', remedy="leave it out")
                )
    elements = checks.problem.elements if checks.problem is not None else ()
    limits = checks.take(depths, depth, elements) if depth is not None and elements else None
    how = checks.take(_method, method, steps)
    accuracy = checks.take(_between, "tolerance", tolerance, 1e-14, 0.1)
    change = checks.take(_between, "max_change", max_change, 1e-6, 1.0)
    checks.problem = worn or checks.problem
    common = checks.common(points or (), listeners=listeners)
    assert worn is not None
    assert ends is not None
    assert how is not None
    assert accuracy is not None
    assert change is not None
    assert sought is not None
    balance = common["balance"]
    return WearRequest(
        problem=worn, balance=balance, start=ends[0], stop=ends[1], parameter=CYCLES, requested=points or (),
        listeners=common["listeners"], omega=sought, dof=output or "", depth=limits, method=how, steps=steps or 0,
        tolerance=accuracy, max_change=change,
        warnings=[*problem_warnings(worn, sought, balance.receptance.static), *wear_warnings(worn)],
    )  # fmt: skip


def worn_problem(problem: Problem, kappa: Any) -> Problem:
    """The problem with contacts that wear; raises InputError where they cannot."""
    others = [model for model in problem.states if not isinstance(model, WearModel)]
    worn = replace(problem, states=[*others, WearModel(kappa=kappa)])
    if not any(isinstance(state, WornContacts) for state in worn.contact_states):
        raise InputError(Fault("kappa", "no contact wears", remedy="give a kappa > 0"))
    return worn


def _cycles(cycles: Any) -> tuple[float, float]:
    first, last = two_numbers(cycles, "cycles")
    if not 0.0 <= first < last:
        raise InputError(Fault("cycles", found=f"{first:g} to {last:g}", expected="two numbers >= 0, the larger last"))
    return first, last


def _points(at: Any, ends: tuple[float, float] | None) -> tuple[float, ...]:
    if isinstance(at, tuple | list) and not at:
        return ()
    values = np.unique(requested_values(at))
    for value in values:
        if ends is not None and not ends[0] <= value <= ends[1]:
            raise InputError(Fault("at", found=f"{value:g}", expected=f"cycles from {ends[0]:g} to {ends[1]:g}"))
    return tuple(float(value) for value in values)


def depths(depth: Any, names: Sequence[str]) -> Array:
    """Depths (n,) at which contacts are worn out; raises InputError for other values."""
    expected = "a depth > 0, for all or by the names of contacts"
    given = depth if isinstance(depth, Mapping) else number("depth", depth, expected)
    values = {name: numbers(("depth", name), value, expected) for name, value in given.items()} if isinstance(
        given, Mapping
    ) else given  # fmt: skip
    limits = by_contact("depth", values, names, missing=np.inf)
    if not np.all(limits > 0.0):
        raise wrong("depth", depth, expected)
    return limits


_MOST_STEPS = 100_000
"""Largest number of equal steps; each costs one steady motion or more."""


def _method(method: Any, steps: Any) -> str:
    if not isinstance(method, str) or method not in METHODS:
        raise wrong("method", method, "one of " + ", ".join(f'"{name}"' for name in METHODS))
    if method in FIXED:
        if steps is None:
            raise InputError(Fault("steps", "is missing", remedy=f'give the number of equal steps of "{method}"'))
        whole("steps", steps, 1, _MOST_STEPS)
    elif steps is not None:
        raise InputError(Fault("steps", f'is for equal steps, but "{method}" chooses them', remedy="leave it out"))
    return method


def _between(name: str, value: Any, low: float, high: float) -> float:
    expected = f"a number from {low:g} to {high:g}"
    value = number(name, value, expected)
    if not low <= value <= high:
        raise wrong(name, value, expected)
    return float(value)


def wear_warnings(problem: Problem) -> list[str]:
    """Sentences about wearing contacts without a known normal stiffness."""
    wearing = {
        name
        for state in problem.contact_states
        if isinstance(state, WornContacts)
        for name, kappa in zip(state.names, state.kappa, strict=True)
        if kappa
    }
    return [
        f"contact '{pair.name}' wears but its normal stiffness kn is not given and taken as 1: "
        "a depth of 1 then takes a load of 1 off; give kn"
        for pair in problem.contacts
        if pair.contact._scaled and wearing & set(pair.elements)
    ]


@dataclass(frozen=True, kw_only=True)
class WearRequest(Request):
    """A request to follow wear over cycles.

    Attributes
    ----------
    omega
        The frequency twice, or the range in which the peak of ``dof`` is sought.
    depth
        At which each contact of the problem is worn out, (n_contacts,); None: never.
    """

    analysis: ClassVar[str] = "wear"
    omega: tuple[float, float]
    dof: str
    depth: Array | None
    method: str
    steps: int
    tolerance: float
    max_change: float

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint with everything on which further steps depend, from its journal.

        Its ``own`` are depths ``z`` and motion ``y`` with what it was found ``near``, the ``length`` of the step that
        comes and whether it is ``implicit``, the ``reference`` of loads, ``smooth``, ``iterations`` and ``work``.
        """
        with undamaged():  # older journals name the followed value "cycles"
            point = Checkpoint.from_plain(plain, "cycles" if "cycles" in plain else "value")
            z, y, near = (np.asarray(plain[name], dtype=float) for name in ("z", "y", "near"))
            if any(array.ndim != 1 for array in (z, y, near)) or not np.all(np.isfinite(y)):
                raise ValueError
            first, second, third = map(int, plain["work"])
            own = {
                "z": z, "y": y, "near": near, "work": (first, second, third), "length": float(plain["length"]),
                "reference": float(plain["reference"]), "implicit": bool(plain["implicit"]),
                "smooth": bool(plain["smooth"]), "iterations": int(plain["iterations"]),
            }  # fmt: skip
            return replace(point, own=own)

    def run(self) -> WearRun:
        """The run that follows wear."""
        return WearRun(self)

    def recorder(self) -> WearRecorder:
        """Recorder with the variables of wear."""
        return WearRecorder(self.balance)


WEAR_VARIABLES: Mapping[str, Declared] = {
    "parameter": Declared((), "1", CYCLES),
    CYCLES: Declared((), "1", "cycles of vibration"),
    "normal_load": Declared(("contact",), "force", "normal load (mean normal force)"),
}


class WearRecorder(Recorder):
    """Recorder of points with cycles and loads."""

    @cached_property
    def layout(self) -> Layout:
        """Layout of a branch with the variables of wear."""
        layout, units = super().layout, self.balance.problem.units
        more = {name: d._replace(units=units.label(d.units)) for name, d in WEAR_VARIABLES.items()}
        return replace(layout, variables={**layout.variables, **more})

    def further(self, points: Sequence[Point]) -> Mapping[str, AnyArray]:
        """Cycles and loads."""
        loads = np.full((len(points), self.balance.n_contacts), np.nan)
        for k, batch in enumerate(self.balance.batches):
            for row, point in zip(loads, points, strict=True):
                row[batch.elements] = mean_load(self.balance, point.detail, k)
        return {CYCLES: np.array([point.parameter for point in points], dtype=float), "normal_load": loads}


class _Ahead(NamedTuple):
    """State of the step control for the next step: length, method and history."""

    length: float
    implicit: bool


_SAFETY, _SHRINK, _GROW = 0.9, 0.2, 4.0
"""Safety factor, and smallest and largest ratio of successive step lengths."""
_LOST_FACTOR = 0.25
"""Factor on the length of a step in which no motion was found."""
_SHORTEST = 1e-7
"""Length over the range, below which a step without a motion is the end of the solution."""
_TOUCHING = 1e-4
"""Load over the largest load, below which contact is lost."""
_STIFF, _MILD = 3.0, 1.0
"""Step times spectral radius above which explicit steps are bounded by stability, and below which they are cheap."""
_JUMP, _LEAST_JUMP = 4.0, 0.02
"""Change of the motion over its prediction by the derivative, and over the motion, above which it is another motion."""
_SAME = 1e-9
"""Relative margin for rounding of that load."""
_LOCATED, _TRIALS = 1e-12, 60
"""Width over the length of the step at which an end of wear is located, and largest number of trials."""


class WearRun(Run[WearRequest]):
    """Run that follows wear."""

    def __init__(self, request: WearRequest) -> None:
        super().__init__(request)
        own: Mapping[str, Any] = request.checkpoints[-1].own if request.checkpoints else {"work": (0, 0, 0)}
        balance = request.balance
        balance.anchor_if_undamped(request.omega[0])
        low = request.omega[0]
        dof = request.dof or str((request.problem.outputs or ("",))[0])
        self.steady: SteadyWear = (
            AtPeak(balance, request.omega, dof) if request.dof else AtFrequency(balance, low, dof, self.tell)
        )
        self._span = request.stop - request.start
        self._work: tuple[int, int, int] = own["work"]
        self._limits = np.full(self.steady.size, np.inf)
        if request.depth is not None:
            places = {name: i for i, name in enumerate(request.problem.elements)}
            self._limits = request.depth[[places[name] for name in self.steady.names]]
        self._reference: float = own.get("reference", 0.0)
        self._per_depth = np.zeros(self.steady.size)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Output whose peak is followed, if any, and work."""
        steps, motions, rejected = self._work
        more = {"peak_of": self.request.dof} if self.request.dof else {}
        return {**more, "wear_steps": steps, "motions": motions, "rejected_steps": rejected}

    def points(self) -> Generator[Point, None, None]:
        """Points from the first cycle."""
        request = self.request
        if request.checkpoints:
            n, own = request.checkpoints[-1].value, request.checkpoints[-1].own
            ahead = _Ahead(own["length"], own["implicit"])
            here = self.steady.at(own["z"], own["y"], own["near"], own["iterations"])
            assert here is not None
            here = replace(here, smooth=own["smooth"])
        else:
            n, here = request.start, self.steady.first()
            if here is None:
                self.outcome, self.message = Outcome.NO_FIRST_POINT, self._none_found
                return
            self._reference = float(np.nanmax(np.abs(self.steady.loads(here.detail)[self.steady.kappa > 0.0])))
        self._per_depth = self.steady.stiffness(here.detail)
        if not request.checkpoints:
            ahead = self._first_step(here)
            yield self._point(n, here, "start", ahead)
        while n < request.stop:
            if (ended := self._over(here)) is not None:
                self.outcome, self.message = ended, f"{ended.text} (after {n:.6g} cycles)"
                return
            step = self._step(n, here, ahead)
            if step is None:
                self.outcome = Outcome.MOTION_LOST
                self.message = f"{self.outcome.text} (after {n:.8g} cycles)"
                return
            n, here, kind, ahead = step
            self.progress = (n - request.start) / self._span
            yield self._point(n, here, kind, ahead)
            pass_on()
        if (ended := self._over(here)) is not None:
            self.outcome, self.message = ended, f"{ended.text} (after {n:.6g} cycles)"
            return
        self.outcome, self.message = Outcome.COMPLETED, Outcome.COMPLETED.text

    @property
    def _none_found(self) -> str:
        request = self.request
        if not request.dof:
            return Outcome.NO_FIRST_POINT.text
        where = " to ".join(f"{w:g}" for w in request.omega)
        return f"no peak of {request.dof} was found from {where} {request.problem.units.angular}"

    def _point(self, n: float, here: WornMotion, kind: str, ahead: _Ahead) -> Point:
        steady = self.steady
        self.step = ahead.length
        self.checkpoint = Checkpoint(value=n, seconds=self.seconds, own={
            "z": here.z, "y": here.y, "near": here.near, "length": ahead.length, "implicit": ahead.implicit,
            "reference": self._reference, "smooth": here.smooth, "iterations": here.iterations, "work": self._work,
        })  # fmt: skip
        return Point.at(
            here.detail, x=steady.x(here.y), residual=here.residual, iterations=here.iterations, kind=kind,
            parameter=n, peak_of=self.request.dof,
        )  # fmt: skip

    # ends of wear

    def _load_share(self, here: WornMotion) -> float:
        """Largest load of the contacts now, over that at the first cycle."""
        wearing = self.steady.kappa > 0.0
        return float(np.nanmax(np.abs(self.steady.loads(here.detail)[wearing]))) / (self._reference or 1.0)

    def _left(self, here: WornMotion) -> float:
        """Smallest remaining depth of a contact over the depth at which it is worn out; negative beyond."""
        limits = self._limits
        return float(np.min(1.0 - here.z / limits))

    def _over(self, here: WornMotion) -> Outcome | None:
        if self._left(here) <= _LOCATED:
            return Outcome.WORN_OUT
        return Outcome.NOTHING_TOUCHES if self._load_share(here) <= _TOUCHING * (1.0 + _SAME) else None

    # steps

    def _first_step(self, here: WornMotion) -> _Ahead:
        request = self.request
        if request.method in FIXED:
            return _Ahead(self._span / request.steps, False)
        fastest = float(np.max(self._per_depth * here.rate, initial=0.0)) / (self._reference or 1.0)
        length = self._span if fastest == 0.0 else min(self._span, 0.2 * request.max_change / fastest)
        return _Ahead(length, request.method == "implicit")

    def _step(self, n: float, here: WornMotion, ahead: _Ahead) -> tuple[float, WornMotion, str, _Ahead] | None:
        """The next point, its kind and the state after it; None where even the shortest step finds no motion."""
        request = self.request
        drift = self.steady.drift(here)
        slopes = None
        if request.method in ("auto", "implicit"):
            slopes = self.steady.slopes(here)
        length, implicit, refused = ahead.length, ahead.implicit, False
        if request.method == "auto" and slopes is not None:
            radius = length * float(np.max(np.abs(np.linalg.eigvals(slopes)), initial=0.0))
            implicit = radius > (_MILD if implicit else _STIFF)
        while True:
            target, kind = self._next_stop(n, length)
            h = target - n
            end = self._tried(here, drift, h, slopes if implicit else None)
            if end is None:
                if h <= _SHORTEST * self._span or request.method in FIXED:
                    return None
                length, refused = _LOST_FACTOR * h, True
                self._count(rejected=1)
                continue
            error = self._error(end)
            order = ROSENBROCK_ORDER if implicit else DORMAND_PRINCE.order
            factor = _GROW if error == 0.0 else min(_GROW, max(_SHRINK, _SAFETY * error ** (-1.0 / order)))
            if request.method not in FIXED and error > 1.0:
                length = min(factor, 0.9) * h
                refused = True
                self._count(rejected=1)
                continue
            there: Any = end.besides
            located = self._located(here, there, drift, h, slopes if implicit else None)
            if located is not None:
                h, there, kind = located
                target = n + h
            self._count(steps=1)
            if request.method not in FIXED:
                grown = h * (min(factor, 1.0) if refused else factor)
                # a step shortened for a requested point does not determine the next length
                length = max(grown, ahead.length) if kind != "regular" and not refused else grown
                length = min(length, self._longest(here, there, h))
            return target, there, kind, _Ahead(length, implicit)

    def _next_stop(self, n: float, length: float) -> tuple[float, str]:
        """End of a step of a length: a requested point or the last cycle, if either is close."""
        request = self.request
        stops = sorted({*(value for value in request.requested if value > n), request.stop})
        stop = stops[0]
        if n + length < stop - 1e-9 * self._span:
            if request.method not in FIXED and n + 2.0 * length > stop:  # no tiny step remains
                return n + 0.5 * (stop - n), "regular"
            return n + length, "regular"
        return stop, "requested" if stop in request.requested else "end"

    def _longest(self, here: WornMotion, there: WornMotion, h: float) -> float:
        """Length in which no load changes by more than its limit, at the rates of the last step."""
        before, after = (np.nan_to_num(self.steady.loads(motion.detail)) for motion in (here, there))
        part = self.request.max_change
        allowed = part * np.maximum(np.abs(after), part * self._reference)
        change = np.abs(after - before)
        return float(h * np.min(np.divide(allowed, change, out=np.full_like(change, np.inf), where=change > 0.0)))

    def _tried(self, here: WornMotion, drift: Array, h: float, slopes: Array | None) -> StepEnd | None:
        """A step of length ``h``; None where a motion in it is not found, or is another one."""
        near = self.steady.onward(here)

        def f(z: Array, part: float) -> tuple[Array, WornMotion] | None:
            self._count(motions=1)
            motion = self.steady.solve(z, here.y + part * h * drift, near)
            if motion is None or self._leaps(here, motion, part * h * drift):
                return None
            return motion.rate, motion

        if slopes is not None:
            return rosenbrock_step(f, here.z, here.rate, h, slopes)
        method = FIXED.get(self.request.method, DORMAND_PRINCE)
        return explicit_step(f, here.z, here.rate, h, method)

    def _leaps(self, here: WornMotion, there: WornMotion, expected: Array) -> bool:
        """Whether a motion is another one: its change is much larger than the derivative predicts."""
        x = self.steady.x
        moved = norm(x(there.y) - x(here.y))
        return moved > max(_JUMP * norm(x(expected)), _LEAST_JUMP * norm(x(here.y)))

    def _error(self, end: StepEnd) -> float:
        """Error of the depths as loads, over its limit: a share of the largest load, or of the depth."""
        allowed = np.maximum(self._reference, self._per_depth * end.state) * self.request.tolerance
        error = np.abs(end.error) * self._per_depth
        return float(np.max(np.divide(error, allowed, out=np.zeros_like(error), where=allowed > 0.0), initial=0.0))

    def _located(
        self, here: WornMotion, there: WornMotion, drift: Array, h: float, slopes: Array | None
    ) -> tuple[float, WornMotion, str] | None:
        """The step up to an end of wear, if this one goes beyond, by bisection of its length."""
        watched = {"worn out": self._left, "separation": lambda motion: self._load_share(motion) - _TOUCHING}
        found: tuple[float, WornMotion, str] | None = None
        for kind, left in watched.items():
            if left(there) >= 0.0:
                continue
            root, motions = BracketedRoot(0.0, left(here), h, left(there)), {h: there}
            while root.width > _LOCATED * h and len(motions) < _TRIALS:
                length = root.trial
                end = self._tried(here, drift, length, slopes)
                if end is None:
                    break
                motion: Any = end.besides
                motions[length] = motion
                root.update(length, left(motion), _LOCATED * h)
            length = min(motions, key=lambda trial: abs(left(motions[trial])))
            h, there = length, motions[length]
            found = h, there, kind
        return found

    def _count(self, *, steps: int = 0, motions: int = 0, rejected: int = 0) -> None:
        self._work = (self._work[0] + steps, self._work[1] + motions, self._work[2] + rejected)
