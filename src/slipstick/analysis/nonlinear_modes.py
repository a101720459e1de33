"""Nonlinear modes with friction: frequency and damping of free vibration over its amplitude."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import exp, log
from typing import Any

import numpy as np

from slipstick.analysis.arguments import common_arguments, followed_problem
from slipstick.analysis.locus import NEWTON
from slipstick.analysis.mode_system import ModeSystem, TargetMode
from slipstick.analysis.threads import one_thread
from slipstick.analysis.tracking import one_dof
from slipstick.analysis.warming import relative_residual
from slipstick.balance.checks import two_numbers
from slipstick.balance.loads import Load
from slipstick.balance.ports import Balance
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError, Outcome
from slipstick.faults import Gathering, numbers, warn, whole, wrong
from slipstick.results.afterwards import result_warnings
from slipstick.results.branch import Branch
from slipstick.results.modes import mode_layout, mode_values
from slipstick.results.record import Outputs, Point, Recorder
from slipstick.results.schema import attributes_of, make_table
from slipstick.solve.continuation import ArclengthScaling, BranchEvent, ContinuationOptions, Step, continuation
from slipstick.structure.matrices import MatrixStructure
from slipstick.structure.modal import ModalStructure
from slipstick.structure.prescribed_mode import MODE, PrescribedMode
from slipstick.typing import Array

MODES = {"first_step": 0.01, "max_step": 0.03, "event_tolerance": 1e-9, "newton": NEWTON}
"""Options of a nonlinear mode where nothing else is said: steps of 3 % of the range of log a."""

_LIMIT = 0.01
"""Damping ratio above which the mode tells peaks to a per cent, but no decay."""


def nonlinear_modes(
    problem: Problem,
    *,
    amplitude: tuple[float, float],
    mode: int = 1,
    dof: str | None = None,
    load_factors: Iterable[float] | float = (),
    options: Mapping[str, Any] | None = None,
) -> Branch:
    """Follow free vibration in a mode over its amplitude: frequency, damping, the forced peak of every load level.

    Extended periodic motion: what friction takes is given back by a damping ``xi`` taken from all modes, which makes
    the motion periodic. ``D = xi / (2 w)`` is the damping ratio of the mode at that amplitude, all damping together.

    Parameters
    ----------
    problem
        What vibrates. Of its loads only the static ones act; harmonic ones set the scale of ``load_factor``. A constant
        rubbing velocity acts, a periodic one has no meaning here and is refused.
    amplitude
        Amplitude of the mode at ``dof`` from which and to which it is followed, > 0: that of its motion in harmonic 1.
        Begin where contacts stick, or only slide.
    mode
        Number of the mode of the structure without contacts, from 1.
    dof
        The output that moves in the mode; by default the first.
    load_factors
        Factors on the loads of the problem whose forced peaks are wanted as exact points.
    options
        Step control, as of ``forced_response``.

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
    found = Gathering()
    checked = found.take(followed_problem, problem)
    ends = found.take(_amplitudes, amplitude)
    number = found.take(whole, "mode", mode, 1)
    factors = found.take(_factors, load_factors)
    name = found.take(one_dof, checked, dof) if checked is not None else None
    given = {**MODES, **options} if isinstance(options, Mapping) else MODES if options is None else options
    common = found.take(common_arguments, checked, (), None, given) if checked is not None else None
    found.end()
    assert checked is not None
    assert ends is not None
    assert number is not None
    assert name is not None
    assert common is not None
    twin = free_problem(checked, number - 1, name)
    with one_thread():
        return _Followed(checked, twin, ends, name, factors or (), common["options"]).branch()


def _amplitudes(given: Any) -> tuple[float, float]:
    first, last = two_numbers(given, "amplitude")
    if not (first > 0.0 and last > 0.0 and first != last):
        raise InputError(Fault("amplitude", found=f"{first:g} to {last:g}", expected="two different amplitudes > 0"))
    return first, last


def _factors(given: Any) -> tuple[float, ...]:
    expected = "factors > 0, one or a list"
    if isinstance(given, tuple | list) and not given:
        return ()
    found: Array = np.atleast_1d(numbers("load_factors", given, expected))
    if found.ndim > 1 or not np.all(found > 0.0):
        raise wrong("load_factors", given, expected)
    return tuple(float(f) for f in found)


class FreeProblem:
    """A problem whose mode moves as prescribed, and what of the given one its results are held against."""

    def __init__(self, given: Problem, structure: ModalStructure, number: int, dof: str) -> None:
        row = np.zeros(len(structure.dofs))
        row[structure.dofs.index(dof)] = 1.0
        self.given, self.modal = given, structure
        self.target = TargetMode.of(structure, number, float(row @ structure.mode_shapes[:, number]))
        still = [replace(load, cos=given.load * load.cos) for load in given.loads if load.harmonic == 0]
        self.problem = replace(
            given, structure=PrescribedMode(structure, number, self.target.scale), told=None, load=1.0,
            loads=[*still, Load(shape=MODE, cos=1.0)], period_ratio=(1, 1),
        )  # fmt: skip

    def mode_force(self) -> float:
        """Size of the force of the problem's loads on the mode, in the scale of its amplitude."""
        columns = self.given.load_columns
        names = tuple(shape for shape in columns.shapes)
        _, right, _, _ = self.modal.modal_parts(np.zeros((len(self.modal.dofs), 0)), columns.vectors, names)
        P, order = self.given.load_coefficients(), self.given.load_order
        if order not in self.given.harmonics.orders:
            return 0.0
        c, s = (self.given.harmonics.index(order, part) for part in "cs")
        return float(abs(right[:, self.target.number] @ (P[:, c] - 1j * P[:, s]))) / abs(self.target.scale)


def free_problem(problem: Problem, number: int, dof: str) -> FreeProblem:
    """The problem of free vibration in a mode; InputError where there is none."""
    structure: Any = problem.structure
    if isinstance(structure, MatrixStructure):
        structure = structure.by_modes()
    if not isinstance(structure, ModalStructure):
        name = type(structure).__name__
        raise InputError(f"nonlinear modes need a structure given by matrices or modes; found a {name}")
    faults = [
        Fault(("contact", pair.name), "its opposing surface moves periodically", remedy=_ALONE)
        for pair in problem.contacts
        if any(np.any(array) for array in _periodic(pair.rubbing))
    ]
    if 1 not in problem.harmonics.orders:
        faults.append(Fault("harmonics", "a mode vibrates in harmonic 1, which is not kept", remedy="keep it"))
    count = structure.omega.size
    shape = np.abs(structure.mode_shapes[:, number]) if number < count else np.zeros(0)
    if number >= count:
        faults.append(Fault("mode", found=str(number + 1), expected=f"a number from 1 to {count}"))
    elif shape[structure.dofs.index(dof)] <= _STILL * shape.max():
        faults.append(Fault("dof", f"{dof} does not move in mode {number + 1}", remedy="name one that does"))
    if any(load.motion is not None for load in problem.loads):
        faults.append(Fault("loads", "a support moves", remedy=_ALONE))
    if faults:
        raise InputError(faults)
    return FreeProblem(problem, structure, number, dof)


_STILL = 1e-6
_BEGIN = "at which the contacts stick, or only slide"
_ALONE = "free vibration has no such motion: leave it out"


def _periodic(rubbing: Any) -> list[Any]:
    parts = (rubbing.cos, rubbing.sin, rubbing.normal_cos, rubbing.normal_sin)
    return [value for part in parts for order, value in part.items() if order]


@dataclass(frozen=True)
class _Followed:
    """A mode to be followed."""

    given: Problem
    free: FreeProblem
    ends: tuple[float, float]
    dof: str
    factors: tuple[float, ...]
    options: ContinuationOptions

    def branch(self) -> Branch:
        """The mode as a branch."""
        clock, problem, target = time.perf_counter(), self.free.problem, self.free.target
        balance = Balance(problem)
        shape = balance.directions.T @ self.free.modal.mode_shapes[:, target.number]
        system = ModeSystem(Outputs(balance, (self.dof,)), target, shape)
        force = self.free.mode_force()
        run = continuation(
            system, self._begun(system), log(self.ends[0]), log(self.ends[1]),
            options=replace(self.options, output_step=np.inf),
            scaling=ArclengthScaling(x=self._unit(system)), events=[self._level(f, force) for f in self.factors],
        )  # fmt: skip
        steps: list[Step] = []
        try:
            steps.extend(run)
            outcome, message = run.outcome or Outcome.INTERRUPTED, run.message
        except KeyboardInterrupt:
            outcome, message = Outcome.INTERRUPTED, Outcome.INTERRUPTED.text
        if outcome is not Outcome.COMPLETED and steps:
            message = f"{message}; the last amplitude is {exp(steps[-1].parameter):.6g}"
        if outcome is Outcome.NO_FIRST_POINT:
            message = f"no free vibration was found at the amplitude {self.ends[0]:.6g}: begin at another, {_BEGIN}"
        return self._recorded(balance, steps, outcome, message, force, {
            "evaluations": run.evaluations, "linear_solves": run.solves, "rejected_steps": run.rejected,
            "seconds": time.perf_counter() - clock, "jacobian": balance.kind.name,
        })  # fmt: skip

    def _begun(self, system: ModeSystem) -> Array:
        """A guess at the first amplitude: the frequency that the force on the mode asks for, a few times over."""
        y, t = system.start(), self.free.target
        for _ in range(_GUESSES):
            found = system.evaluate(y, log(self.ends[0]))
            if found.detail is None:
                break
            moved = y.copy()
            jacobian: Any = found.jacobian
            moved[:-2] -= jacobian.inner_solve(found.residual[:-2])
            square = y[-2] ** 2 + t.square * found.residual[-2]
            moved[-2] = np.sqrt(square) if square > 0.0 else y[-2]
            moved[-1] = y[-1] + t.square / moved[-2] * found.residual[-1]
            y = moved
        return y

    def _unit(self, system: ModeSystem) -> Array:
        unit = np.ones(system.balance.size + 2)
        unit[-2:] = np.sqrt(self.free.target.square)
        return unit

    def _level(self, factor: float, force: float) -> BranchEvent:
        """Where the forced response to the loads times a factor peaks."""
        stiffness = 1.0 / self.free.target.scale**2

        def short(step: Step) -> float:
            d = step.evaluation.detail
            return float(d.xi * d.omega * d.amplitude * stiffness - factor * force)

        return BranchEvent(name=f"{factor:g}", kind="requested", function=short)

    def _recorded(
        self, balance: Balance, steps: list[Step], outcome: Outcome, message: str, force: float, work: dict[str, Any]
    ) -> Branch:
        problem, recorder = self.free.problem, Recorder(balance)
        points = [
            Point.at(
                s.evaluation.detail, x=s.x[:-2] * s.evaluation.detail.amplitude, residual=relative_residual(s),
                iterations=s.iterations, kind=s.kind, parameter=s.evaluation.detail.omega, peak_of="",
            )
            for s in steps
        ]  # fmt: skip
        details = [s.evaluation.detail for s in steps]
        values = recorder.values(points) | mode_values(details, self.free.target.scale, force)
        said = recorder.besides.said(
            lambda: [*self._warnings(values), *(result_warnings("omega", values, problem.elements) if points else [])]
        )
        warn(said)
        attributes = attributes_of(self.given, outcome, message, said, mode=self.free.target.number + 1,
                                   mode_of=self.dof, **work)  # fmt: skip
        without = "it is a free vibration, not that of a problem with loads"
        table = make_table(mode_layout(recorder.layout, self.given), values, attributes)
        return Branch(table, outcome, None, message, without=without)

    def _warnings(self, values: Mapping[str, Any]) -> list[str]:
        """Where the mode tells less than it seems to."""
        damping, xi = values["modal_damping"], values["modal_damping"] * 2.0 * values["omega"]
        if not damping.size:
            return []
        found, own = [], self.free.modal
        if np.nanmax(np.abs(damping)) > _LIMIT:
            found.append(
                f"the damping ratio of the mode reaches {100.0 * np.nanmax(np.abs(damping)):.2g} %: above "
                f"{100 * _LIMIT:g} % forced peaks are right to about a per cent, but free decay is not that of the mode"
            )
        others = np.delete(2.0 * own.damping_ratio * own.omega + own.loss_factor * own.omega, self.free.target.number)
        if others.size and np.nanmax(xi) > others.min():
            found.append(
                "what is taken of the damping exceeds the damping of another mode, which is unstable in this motion: "
                "check the harmonics near its frequency"
            )
        return found


_GUESSES = 12
