"""Nonlinear modes with friction: frequency and damping of free vibration over its amplitude."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import log
from typing import Any, ClassVar, cast

import numpy as np

from slipstick.analysis.curve.state_continuation import relative_residual
from slipstick.analysis.modes.following import ModePath, first_guess
from slipstick.analysis.modes.free_problem import FreeProblem, LinearMode, free_problem
from slipstick.analysis.modes.system import ModeDetail, ModeSystem
from slipstick.analysis.peaks.continuation import NEWTON
from slipstick.analysis.peaks.tracking import one_dof
from slipstick.analysis.road.checkpoint import Checkpoint, undamaged
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import Checks, Request
from slipstick.analysis.road.run import Run, Work, counted
from slipstick.balance.checks import two_numbers
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import numbers, whole, wrong
from slipstick.interrupts import pass_on
from slipstick.results.record import Point, Recorder
from slipstick.results.result_warnings import result_warnings
from slipstick.results.schema import Declared, Layout
from slipstick.results.solutions import Solutions
from slipstick.solve.continuation import BranchEvent, Continuation, Step
from slipstick.solve.newton import NewtonOptions
from slipstick.typing import AnyArray, Array, ComplexArray

MODES = {"first_step": 0.01, "max_step": 0.03, "event_tolerance": 1e-9, "newton": NEWTON, "output_tolerance": 4e-4}
"""Default options of a nonlinear mode: steps of 3 % of the logarithmic range of the amplitude; frequency and damping
are linear between two points to 4e-4."""

_MANY = 500
"""Unknowns above which corrections are damped: of many contacts one is at a corner nearly everywhere, and shorter steps
do not pass it."""
_DAMPED = NewtonOptions(max_iterations=8, min_damping=0.4, non_monotone=1)
"""Newton's method there, as along forced curves."""

_SAME_FACTOR = 1e-6
"""Relative difference up to which a point is at a load factor."""
_LIMIT = 0.01
"""Damping ratio above which the mode predicts forced peaks to a per cent only, and no decay."""
_TURNED = 1e-12
"""Phase angle at the output above which a point is turned to a cosine."""


def nonlinear_modes(
    problem: Problem,
    *,
    amplitude: tuple[float, float],
    mode: int = 1,
    dof: str | None = None,
    load_factors: Iterable[float] | float = (),
    options: Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Branch:
    """Follow free vibration in a mode over its amplitude: frequency, damping, the forced peak of every load level.

    Extended periodic motion: what friction takes is given back by a damping ``xi`` taken from all modes, which makes
    the motion periodic. ``D = xi / (2 w)`` is the damping ratio of the mode at that amplitude, all damping together.
    Viscous damping of matrices may couple the modes; they then move together, each with its own phase.

    Parameters
    ----------
    problem
        What vibrates. Of its loads only the static ones act; harmonic ones set the scale of ``load_factor``. A constant
        rubbing velocity acts, a periodic one has no meaning here and is refused.
    amplitude
        Amplitude of the motion at ``dof`` in harmonic 1 from which and to which the mode is followed, > 0, length.
    mode
        Number of the mode of the structure without contacts, from 1. The mode begins with contacts as they are at rest:
        it is the one that this becomes while their tangent stiffness grows from nothing to what it is.
    dof
        The output that moves in the mode; by default the first.
    load_factors
        Factors on the loads of the problem whose forced peaks are wanted as exact points.
    options
        Step control, as of ``forced_response``; ``output_tolerance`` is how far frequency and damping may be off the
        line between two points, over their own size.
    listeners
        Functions, or subclasses of ``slipstick.analysis.events.Listener``, told of each point and, where it takes long,
        of what is done: ``listeners=ss.Progress()``.

    Returns
    -------
    Branch
        Points over ``omega`` with ``amplitude`` and all else, ``modal_amplitude``, ``modal_damping`` (D) and
        ``load_factor``: the factor on the loads of the problem with which the forced response peaks there. Drawn into
        the figure of forced curves it is the line through their peaks. Above 1 % of damping peaks are right to about a
        per cent, but free decay follows another path; the warnings say so. Where D is negative friction feeds the
        motion.

    Raises
    ------
    InputError
        For a structure that is not known by its modes, periodic rubbing motions, and arguments that cannot be used.

    Warns
    -----
    SlipstickWarning
        Where the damping exceeds 1 %, and where ``xi`` exceeds the damping of other modes.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.01]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=1.0, mu=0.3, normal_load=10.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=1.0), harmonics=range(6))
    >>> branch = nonlinear_modes(problem, amplitude=(1.0, 30.0))
    >>> float(branch.dataset.omega[0].round(6)), float(branch.dataset.modal_damping[0].round(8))
    (6.403124, 0.00078087)
    """
    return Branch.of(mode_request(problem, amplitude, mode, dof, load_factors, options, listeners).solutions())


def mode_request(
    problem: Any, amplitude: Any, mode: Any = 1, dof: Any = None, load_factors: Any = (), options: Any = None,
    listeners: Any = (),
) -> ModeRequest:  # fmt: skip
    """What is asked for, checked; InputError with all faults."""
    checks = Checks(problem)
    ends = checks.take(_amplitudes, amplitude)
    number = checks.take(whole, "mode", mode, 1)
    factors = checks.take(_factors, load_factors)
    output = checks.take(one_dof, checks.problem, dof) if checks.problem is not None else None
    chosen = {**MODES, **options} if isinstance(options, Mapping) else MODES if options is None else options
    common = checks.common((), options=chosen, listeners=listeners)
    assert checks.problem is not None
    assert ends is not None
    assert number is not None
    assert output is not None
    free, linear = free_problem(checks.problem, number - 1, output, common["options"].jacobian)
    if free.balance.size > _MANY and "newton" not in (options or {}):
        common["options"] = replace(common["options"], newton=_DAMPED)
    return ModeRequest(
        problem=checks.problem, balance=free.balance, free=free, linear=linear, number=number - 1, start=ends[0],
        stop=ends[1], dof=output, factors=factors or (), options=common["options"],
        listeners=common["listeners"],
        warnings=problem_warnings(checks.problem, free=True),
    )  # fmt: skip


def _amplitudes(amplitude: Any) -> tuple[float, float]:
    first, last = two_numbers(amplitude, "amplitude")
    if not (first > 0.0 and last > 0.0 and first != last):
        raise InputError(Fault("amplitude", found=f"{first:g} to {last:g}", expected="two different amplitudes > 0"))
    return first, last


def _factors(factors: Any) -> tuple[float, ...]:
    expected = "factors > 0, one or a list"
    if isinstance(factors, tuple | list) and not factors:
        return ()
    values: Array = np.atleast_1d(numbers("load_factors", factors, expected))
    if values.ndim > 1 or not np.all(values > 0.0):
        raise wrong("load_factors", factors, expected)
    return tuple(float(f) for f in values)


class ModeRecorder(Recorder):
    """Recorder with amplitude and damping of the mode, and load factor; ``force`` as in ``peak_forces``."""

    def __init__(self, free: FreeProblem) -> None:
        super().__init__(free.balance)
        self._forced, self._force = free.forced, free.mode_force()

    @cached_property
    def layout(self) -> Layout:
        """Layout of a branch of a nonlinear mode."""
        return mode_layout(super().layout, self._forced)

    def further(self, points: Sequence[Point]) -> Mapping[str, AnyArray]:
        """Amplitude, damping and load factor."""
        return mode_values([cast(ModeDetail, point.detail) for point in points], self._force)


@dataclass(frozen=True, kw_only=True)
class ModeRequest(Request):
    """A request to follow a mode between two amplitudes at ``dof``; no loads act in its results."""

    analysis: ClassVar[str] = "modes"
    free: FreeProblem
    linear: LinearMode
    number: int
    dof: str
    factors: tuple[float, ...]

    def run(self) -> ModeRun:
        """The run that follows the mode."""
        return ModeRun(self)

    without: ClassVar[str] = "it is a free vibration, not that of a problem with loads"

    @property
    def vibrating(self) -> Problem | None:
        """None: loads excite the problem, but not the mode."""
        return None

    def solutions(self) -> Solutions:
        """Compute all points and return them in memory."""
        found = super().solutions()
        found.excited = self.problem
        return found

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint of ``ModePath.checkpoint``, from its journal."""
        with undamaged():
            point = Checkpoint.from_plain(plain, size=self.balance.size + 5)
            if not point.goes_on:
                return point
            if point.restart_point is None:
                raise ValueError
            own = {"begin": float(plain["begin"]), "most": float(plain["most"])}
            return replace(point, own={**own, "work": Work._make(map(int, plain["work"]))})

    def recorder(self) -> ModeRecorder:
        """Recorder with the variables of a mode."""
        return ModeRecorder(self.free)

    def value_warnings(self, values: Mapping[str, Array]) -> list[str]:
        """Warnings about limits of the mode and about suspicious values."""
        free = self.free.problem
        found = result_warnings("omega", values, free.elements, loaded=free.preloaded_elements)
        return [*self._mode_warnings(values), *found]

    def _mode_warnings(self, values: Mapping[str, Array]) -> Iterator[str]:
        damping, xi = values["modal_damping"], values["modal_damping"] * 2.0 * values["omega"]
        yield from self._passed_over(values)
        if np.nanmax(np.abs(damping)) > _LIMIT:
            yield (
                f"the damping ratio of the mode reaches {100.0 * np.nanmax(np.abs(damping)):.2g} %: above "
                f"{100 * _LIMIT:g} % it gives forced peaks to about one per cent, but not free decay"
            )
        if np.nanmax(xi) > self.linear.least:
            yield (
                "the damping of this mode is taken off the whole structure to find it, and exceeds that of another "
                "mode with the contacts as they are at rest: check the harmonics near the frequency of that mode"
            )

    def _passed_over(self, values: Mapping[str, Any]) -> Iterator[str]:
        """Load factors that the mode passes without a point."""
        here, asked = np.asarray(values["load_factor"]), np.asarray(values["kind"]) == "requested"
        missed = []
        for factor in sorted(set(self.factors)):
            off = here - factor
            met = asked & (np.abs(off) <= _SAME_FACTOR * factor)
            if np.any((off[:-1] * off[1:] < 0.0) & ~met[:-1] & ~met[1:]):
                missed.append(f"{factor:g}")
        if missed:
            yield (
                f"load_factors: a point was requested at {', '.join(missed)}, but no solution was found there: "
                "try a smaller max_step"
            )


class ModeRun(Run[ModeRequest]):
    """Run that follows a nonlinear mode."""

    def __init__(self, request: ModeRequest) -> None:
        super().__init__(request)
        free = request.free
        reference = first_guess(free.balance, free.target, request.linear, request.start)[:-2]
        self._system, self._at_dof = free.system(reference), free.system(reference, at_dof=True)
        ends = request.start, request.stop
        self._path = ModePath(self._system, self._at_dof, request.linear, ends, request.options)
        self._force = free.mode_force()

    def points(self) -> Generator[Point, None, None]:
        """Points from the first amplitude to exactly the last one."""
        request, path, latest = self.request, self._path, list[Step]()
        resumed, span = request.checkpoints[-1:], log(request.stop / request.start)
        self.outcome, self.doing = Outcome.NO_FIRST_POINT, f"looking for the mode at the amplitude {request.start:.6g}"
        with self.keeping_points(latest):
            levels = [self._level(factor) for factor in request.factors]
            run: Continuation | None = None
            if resumed:
                run = path.resumed(resumed[0], levels)
            elif (first := path.begin()) is not None:
                run = path.follow(*first, levels)
            if run is not None:
                self.doing = ""
                checkpoint: Checkpoint | None = None
                for step in path.refined(run):
                    pass_on()
                    if latest:
                        self.checkpoint = checkpoint
                        yield self._point(self._system, latest[0])
                    latest[:], checkpoint = [step], path.checkpoint(run, step, self.seconds)
                    self.progress = min(max(log(step.evaluation.detail.amplitude / request.start) / span, 0.0), 1.0)
                self.outcome, self.message = run.outcome or Outcome.INTERRUPTED, run.message
        if self.outcome is Outcome.NO_FIRST_POINT:
            self.message = f"no free vibration was found at the amplitude {request.start:.6g}: begin at a smaller one"
        if not latest:
            return
        last, system = latest[0], self._system
        if self.outcome is Outcome.COMPLETED:
            self.outcome, self.message = path.arrived(last)
        if self.outcome is Outcome.COMPLETED:
            last, system = path.finished(last), self._at_dof
        else:
            self.message = f"{self.message}; the last amplitude is {last.evaluation.detail.amplitude:.6g}"
        amplitude = float(last.evaluation.detail.amplitude)
        self.checkpoint = Checkpoint(
            value=amplitude, seconds=self.seconds, goes_on=False, own={}
        )  # computed anew on resuming
        yield self._point(system, last)

    @property
    def attributes(self) -> Mapping[str, Any]:
        """Mode, output and work."""
        return {"mode": self.request.number + 1, "mode_of": self.request.dof, **counted(self._path.work)}

    def _point(self, system: ModeSystem, step: Step) -> Point:
        """Point of the results, its phase such that harmonic 1 at the output is a cosine."""
        y, detail = step.x, step.evaluation.detail
        angle = -float(np.angle(detail.at_dof))
        if abs(angle) > _TURNED:
            y = np.append(system.turned(y[:-2], angle), y[-2:])
            detail = system.evaluate(y, step.parameter, step.evaluation.context).detail
        return Point.at(
            detail, x=y[:-4] * system.sizes(detail.size)[:-2], residual=relative_residual(step),
            iterations=step.iterations, kind=step.kind, parameter=detail.omega, peak_of="",
        )  # fmt: skip

    def _level(self, factor: float) -> BranchEvent:
        """Event where the forced response to the loads times a factor peaks."""
        return BranchEvent(
            name=f"{factor:g}", kind="requested", exact=True,
            function=lambda step: peak_forces([step.evaluation.detail], self._force)[0] - factor,
        )  # fmt: skip


MODE_VARIABLES: Mapping[str, Declared] = {
    "modal_amplitude": Declared((), "length", "amplitude of the mode: of harmonic 1 at its output"),
    "modal_damping": Declared((), "1", "damping ratio of the mode (all damping together)"),
    "load_factor": Declared((), "1", "factor on the loads of the problem whose forced response peaks here"),
}


def mode_layout(layout: Layout, problem: Problem) -> Layout:
    """Layout of a branch with the variables of a mode."""
    of_modes = {name: d._replace(units=problem.units.label(d.units)) for name, d in MODE_VARIABLES.items()}
    return replace(layout, variables={**layout.variables, **of_modes})


def mode_values(details: Sequence[ModeDetail], force: ComplexArray) -> dict[str, Array]:
    """Values (n_points,) of these variables, from details of a nonlinear mode; ``force`` as in ``peak_forces``."""
    omega, xi = (np.array([getattr(d, n) for d in details], dtype=float) for n in ("omega", "xi"))
    return {
        "modal_amplitude": np.array([d.amplitude for d in details], dtype=float),
        "modal_damping": xi / (2.0 * omega),
        "load_factor": peak_forces(details, force),
    }


def peak_forces(details: Sequence[ModeDetail], force: ComplexArray) -> Array:
    """Factors (n_points,) on loads whose forced response peaks there; nan where loads do not act on the mode.

    In phase resonance the power of the loads is that of ``xi``: ``factor |p^H q| = xi w |q|^2``, with the
    phasors of the mass-normalised modes in harmonic 1, and of the loads on them ``force`` (n_modes,).
    """
    dissipated = np.array([d.xi * d.omega * np.sum(np.abs(d.modal) ** 2) for d in details], dtype=float)
    power = np.array([abs(np.vdot(force, d.modal)) for d in details], dtype=float)
    return np.divide(dissipated, power, out=np.full_like(dissipated, np.nan), where=power > 0.0)
