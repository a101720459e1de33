"""Long integrations in time, period by period: at a speed that grows evenly, or stays.

Only the state and the current period are in memory; the results of each period are yielded. An integration resumes from
the state at the end of a period with identical results.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from slipstick.analysis.road.checkpoint import Checkpoint, undamaged, vector
from slipstick.analysis.road.request import AnalysisRequest
from slipstick.analysis.road.run import Run
from slipstick.analysis.time_domain.equilibrium import equilibrium
from slipstick.analysis.time_domain.event_integrator import StateChange, Stepper
from slipstick.analysis.time_domain.initial_state import started
from slipstick.analysis.time_domain.period_record import Energy, PeriodSums
from slipstick.analysis.time_domain.piecewise import Combination, PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_elements, friction_system, integration_faults
from slipstick.analysis.time_domain.swept import SweptPiecewise, SweptStepper, SweptSystem, fewest_steps
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError, Outcome
from slipstick.interrupts import pass_on
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.run_up import CONTACT_STATES, VARIABLES
from slipstick.results.schema import Layout, unit_in
from slipstick.typing import Array


@dataclass(frozen=True, kw_only=True)
class PeriodEnd:
    """The state at the end of a period, from which an integration goes on."""

    period: int
    z: Array
    states: Combination
    energy: Energy

    @property
    def plain(self) -> dict[str, Any]:
        """As numbers, texts and lists of them, and arrays."""
        energy = vars(self.energy)
        return {
            "period": self.period, "states": [int(s) for s in self.states], "z": self.z,
            "energy": np.array(list(energy.values()), dtype=float), "energy_names": list(energy),
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PeriodDone:
    """Results of a period."""

    values: Mapping[str, Any]
    """By the names of ``VARIABLES`` in ``slipstick.results.run_up``."""
    times: Array
    series: Array
    """Outputs at equidistant times, (n_times, n_outputs)."""
    changes: tuple[tuple[float, int, int, int], ...]
    """Changes of contact state: time, number of the contact, state before and after."""
    checkpoint: PeriodEnd
    kind: ClassVar[str] = "period"

    @property
    def omega(self) -> float:
        """Speed of the excitation in the middle of the period, rad/s."""
        return float(self.values["omega"])

    parameter = omega

    @property
    def note(self) -> dict[str, Any]:
        """Arrays to be stored with the values, in one row each."""
        changes = np.array(self.changes, dtype=float).reshape(-1, 4)
        return {"times": self.times, "series": self.series.ravel(), "changes": changes.ravel()}


class PeriodRecorder:
    """Values of all variables at periods."""

    def __init__(self, problem: Problem) -> None:
        units, dofs = problem.units, tuple(problem.outputs or ())
        labels = {"dof": dofs, "contact": tuple(problem.elements)}
        variables = {
            name: declared._replace(units=unit_in(units, declared, dofs)) for name, declared in VARIABLES.items()
        }
        self.layout, self.postprocessing = Layout(labels=labels, variables=variables), Postprocessing()

    def record(self, period: PeriodDone) -> Mapping[str, Any]:
        """Values of one period."""
        return period.values


@dataclass(frozen=True, kw_only=True)
class LongRun(AnalysisRequest):
    """A request for an integration, period by period.

    Attributes
    ----------
    start, stop
        Speed of the excitation at the start and the end, rad/s; equal where it stays.
    rate
        Its growth, rad/s^2, with its sign.
    periods
        Number of periods.
    samples
        Samples of the outputs in a period at the highest speed; 0 for none.
    steps
        Steps in a period at the highest speed; None: by the fastest motion.
    """

    analysis: ClassVar[str] = "run_up"
    rate: float
    periods: int
    samples: int
    steps: int | None = None

    def checkpoint(self, plain: Mapping[str, Any]) -> Checkpoint:
        """Checkpoint of a period; journals of earlier versions have no value and no seconds."""
        with undamaged():
            energy = dict(zip(plain["energy_names"], vector(plain["energy"]).tolist(), strict=True))
            states = self.states(map(int, plain["states"]))
            end = PeriodEnd(period=int(plain["period"]), z=vector(plain["z"]), states=states, energy=Energy(**energy))
            return Checkpoint.from_plain({"value": end.period, "seconds": 0.0, **plain, "end": end})

    def run(self) -> PeriodRun:
        """The integration to run."""
        return PeriodRun(self)

    def recorder(self) -> PeriodRecorder:
        """The recorder of periods."""
        return PeriodRecorder(self.problem)

    @property
    def reference(self) -> float:
        """The highest speed, rad/s."""
        return max(self.start, self.stop)

    @cached_property
    def stepper(self) -> Stepper:
        """The integrator, at a constant or a growing speed."""
        if self.rate:
            system = swept_system(self.problem, self.start, self.rate, self.reference)
            return SweptStepper(SweptPiecewise(system), self.steps)
        model = PiecewiseLinear(friction_system(self.problem, self.start))
        return Stepper(model, self.steps or fewest_steps(model))

    def time_of(self, period: int) -> float:
        """When a period ends, s."""
        system = self.stepper.model.system
        return system.time_of_phase(2 * np.pi * period) / system.omega

    def after(self, begin: PeriodEnd | None = None) -> Iterator[PeriodDone]:
        """Every period from the start, or after a checkpoint, on."""
        stepper, energy = self.stepper, Energy()
        system = stepper.model.system
        outputs = slice(len(system.equations.rows) - len(self.problem.outputs or ()), len(system.equations.rows))
        if begin is None:
            stepper.z, stepper.states = started(stepper, equilibrium(self.problem, self.start))
            energy.at_start = PeriodSums(stepper=stepper, outputs=outputs, energy=energy).stored()
        else:
            stepper.z, stepper.states, energy = begin.z.copy(), begin.states, Energy(**asdict(begin.energy))
        every = max(1, stepper.steps // self.samples) if self.samples else 0
        for period in range(0 if begin is None else begin.period, self.periods):
            stepper.reset_lengths()
            sums = PeriodSums(stepper=stepper, outputs=outputs, energy=energy)
            base = 0.0 if self.rate else 2 * np.pi * period
            times, series, last = [], [], -1
            for item in stepper.turn(period):
                sums.add(item)
                if not every or isinstance(item, StateChange):
                    continue
                step = round(item.tau / stepper.step)
                if step != last and step % every == 0 and abs(item.tau - step * stepper.step) < 1e-9 * stepper.step:
                    times.append((base + item.tau) / system.omega)
                    series.append(
                        item.linear.motion[outputs] @ stepper.model.extended(item.linear, item.start[None])[0]
                    )
                    last = step
            yield PeriodDone(
                values=self._values(period, sums, outputs, base),
                times=np.array(times),
                series=np.array(series).reshape(len(times), outputs.stop - outputs.start),
                changes=tuple(
                    ((base + c.tau) / system.omega, c.contact, before, after)
                    for c in sums.changes
                    if not self._is_slider(c.contact)
                    for before, after in [
                        (self._state_number(c.contact, c.before), self._state_number(c.contact, c.after))
                    ]
                    if before != after
                ),
                checkpoint=PeriodEnd(
                    period=period + 1, z=stepper.z.copy(), states=stepper.states, energy=Energy(**asdict(energy))
                ),
            )

    @cached_property
    def _sliders(self) -> Array:
        """Whether friction contacts are sliders of one contact, which has no states."""
        friction = friction_elements(self.problem)
        return np.asarray(np.bincount(friction, minlength=1)[friction] > 1)

    def _state_number(self, contact: int, state: int) -> int:
        """Number of a state, or of the state that a regime of a law that switches is, among ``CONTACT_STATES``."""
        system = self.stepper.model.system
        if contact < system.n_contacts:
            return int(state)
        return CONTACT_STATES.index(system.laws.switching[contact - system.n_contacts].regimes.names[state])

    @property
    def changing(self) -> tuple[str, ...]:
        """Names of the contacts by the numbers in ``PeriodDone.changes``."""
        switching = [own.number for own in self.stepper.model.system.laws.switching]
        return tuple(self.problem.elements[e] for e in [*friction_elements(self.problem).tolist(), *switching])

    def states(self, numbers: Iterable[int]) -> Combination:
        """States of the friction contacts, then regimes, from their numbers."""
        count = self.stepper.model.system.n_contacts
        return tuple(State(s) if k < count else s for k, s in enumerate(numbers))

    def _is_slider(self, contact: int) -> bool:
        return contact < len(self._sliders) and bool(self._sliders[contact])

    def _values(self, period: int, sums: PeriodSums, outputs: slice, base: float) -> dict[str, Any]:
        stepper, system, end = self.stepper, self.stepper.model.system, self.time_of(period + 1)
        begin = self.time_of(period)
        low, high, at_low, at_high = sums.extremes()
        count = len(self.problem.elements)
        friction = friction_elements(self.problem)
        power, fractions = np.full(count, np.nan), np.full((count, len(CONTACT_STATES)), np.nan)
        power[friction], fractions[friction] = 0.0, np.pad(sums.fractions, ((0, 0), (0, 1)))
        np.add.at(power, friction, sums.work / (end - begin))
        fractions[friction[self._sliders]] = np.nan
        for own, in_regime in zip(system.laws.switching, sums.time_in_regime, strict=True):
            fractions[own.number] = 0.0
            for name, part in zip(own.regimes.names, in_regime, strict=True):
                fractions[own.number, CONTACT_STATES.index(name)] += part
        for law, rows, *_ in system.laws.each:
            power[law.elements] = sums.law_work[rows].reshape(-1, len(law.elements)).sum(axis=0) / (end - begin)
        linear, z = stepper.model(stepper.states), stepper.z
        extended, size = stepper.model.extended(linear, z[None])[0], system.size
        rate = np.zeros_like(extended)  # motion does not depend on rates of forces
        rate[:size] = stepper.model.rate(linear, z[None])[0]
        rate[size : (size + len(extended)) // 2] = extended[(size + len(extended)) // 2 :]
        return {
            "time": end,
            "omega": self.start + self.rate * 0.5 * (begin + end),
            "amplitude": 0.5 * (high - low), "mean": sums.mean, "highest": high, "lowest": low,
            "highest_time": (base + at_high) / system.omega, "lowest_time": (base + at_low) / system.omega,
            "section_displacement": linear.motion[outputs] @ extended,
            "section_velocity": system.omega * linear.motion[outputs] @ rate,
            "dissipated_power": power,
            "separation_fraction": fractions[:, State.SEPARATION], "stick_fraction": fractions[:, State.STICK],
            "slip_fraction": fractions[:, State.SLIP_PLUS :].sum(axis=1),
            "energy_error": sums.energy.error(sums.stored()),
        }  # fmt: skip


class PeriodRun(Run[LongRun]):
    """An integration under way: its points are periods."""

    def points(self) -> Generator[PeriodDone, None, None]:
        """Every period, from the beginning or after the last checkpoint."""
        request = self.request
        for done in request.after(request.checkpoints[-1].own["end"] if request.checkpoints else None):
            end = done.checkpoint
            self.progress = end.period / request.periods
            own = {**done.note, **end.plain}
            self.checkpoint = Checkpoint(value=end.period, seconds=self.seconds, own=own)
            yield done
            pass_on()
        self.outcome = Outcome.COMPLETED


def swept_system(problem: Problem, start: float, rate: float, reference: float) -> SweptSystem:
    """The system of a problem whose excitation speeds up from ``start``, rad/s, by ``rate``, rad/s^2."""
    base, half = friction_system(problem, reference), friction_system(problem, 0.5 * reference)
    count = 2 * len(base.orders)

    def over_u(coefficients: Array) -> Array:
        return np.hstack([coefficients, np.zeros((len(coefficients), 1 + 2 * count))])

    # loads are forces, or grow with the square of the speed: an unbalance, a support that moves
    square = (base.loads - half.loads) / 0.75
    loads = over_u(base.loads - square)
    loads[:, 2 + 2 * count :] = square[:, 1:]
    slope = (base.velocity - half.velocity) / 0.5
    known = dict(vars(base))
    known |= {"approach": over_u(base.approach), "rubbing": over_u(base.rubbing), "loads": loads}
    law_slope = (base.law_velocity - half.law_velocity) / 0.5
    known |= {"velocity": base.velocity - slope, "velocity_per_nu": slope}
    known |= {"law_motion": over_u(base.law_motion), "law_velocity": base.law_velocity - law_slope}
    known |= {"law_velocity_per_nu": law_slope}
    return SweptSystem(**known, first=start / reference, growth=rate / reference**2)


def sweep_faults(problem: Problem, *, swept: bool) -> Iterator[Fault]:
    """Properties of a problem that long integrations, or a growing speed, do not allow."""
    yield from integration_faults(problem)
    for pair in problem.contacts:
        tied = pair.rubbing.velocity_per_omega, pair.rubbing.second_velocity_per_omega
        if swept and pair.contact.regimes is not None and any(map(np.any, tied)):
            said = f"the rubbing velocity of contact '{pair.name}' grows with the speed, and its law holds it constant"
            yield Fault("run_up", said, remedy="give it a fixed velocity, or integrate at one speed")
    if swept and problem.structure.tied:
        said = "the structure turns with the excitation, and its matrices are known at a constant speed alone"
        yield Fault("run_up", said, remedy="give the structure a fixed speed, or integrate at one speed")
    moved = any(problem.load_columns.motions)
    if swept and moved:
        static = friction_system(problem, 1.0).equations.feedthrough
        if np.any(static[:, -len(problem.load_columns.motions) :]):
            said = "an unbalance or a moving support acts through a static residual, whose rate is not known"
            yield Fault("run_up", said, remedy="give the structure more modes and no residual")


def checked(problem: Problem, *, swept: bool) -> None:
    """Raises InputError with all faults of :func:`sweep_faults`."""
    faults = list(sweep_faults(problem, swept=swept))
    if faults:
        raise InputError(faults)
