"""Time integration that is exact but for rounding: an independent check of any harmonic solution.

Between changes of contact state the system is linear and is carried by its matrix exponential; the changes are roots of
polynomials. No code of the contact element or of the balance is used, and no harmonics are cut off: the difference from
a point of a branch is the truncation of the harmonic series.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from slipstick.analysis.time_domain.equilibrium import Equilibrium, equilibrium
from slipstick.analysis.time_domain.event_integrator import StateChange, Stepper
from slipstick.analysis.time_domain.initial_state import HarmonicStart, started
from slipstick.analysis.time_domain.period_record import PeriodRecord
from slipstick.analysis.time_domain.piecewise import FrictionSystem, PiecewiseLinear, State
from slipstick.analysis.time_domain.piecewise_model import friction_elements, friction_system
from slipstick.analysis.time_domain.shooting import PeriodEnd
from slipstick.analysis.time_domain.shooting import periods as follow_periods
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError
from slipstick.faults import MOST_ITEMS, Gathering, frequency, number, one, shown, whole
from slipstick.html import MOST_SHOWN, html_table
from slipstick.interrupts import pass_on
from slipstick.results.saved_table import write_table
from slipstick.trig.harmonics import Harmonics
from slipstick.typing import Array, Frequency
from slipstick.units import Units

if TYPE_CHECKING:
    import xarray

_COLUMNS = {"separation": 0, "stick": 1, "slip": 2}
"""Columns of ``fractions`` for the states of contacts that slide in a plane."""


@dataclass(frozen=True, kw_only=True)
class ContactChange:
    """A contact changes its state at ``time``."""

    time: float
    contact: str
    before: str
    after: str


@dataclass(frozen=True, kw_only=True, repr=False)
class TransientResult:
    """The last periods of a time integration.

    Time series are given at every step and every change of state; coefficients, amplitude, mean, power and fractions
    belong to the last period. Forces act on the structure's left-hand side (THEORY.md section 2). Contacts of laws
    other than friction have a power, but no friction force, normal force and fractions, which are nan. Contacts of
    several sliders have a friction force too, but no changes of state.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> result = ss.transient(ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=5.0)), omega=8.0)
    >>> result.converged, result.amplitude.round(4), result.power.round(3)
    (True, array([0.2053]), array([2.678]))
    """

    omega: float
    harmonics: Harmonics
    outputs: tuple[str, ...]
    contacts: tuple[str, ...]
    time: Array
    """(n,), s."""
    displacement: Array
    """Outputs over time, (n, n_outputs)."""
    friction_force: Array
    """(n, n_contacts)."""
    normal_force: Array
    """(n, n_contacts)."""
    coefficients: Array
    """Harmonic coefficients of the outputs, (n_outputs, L)."""
    friction_coefficients: Array
    """Harmonic coefficients F_x, (n_contacts, L)."""
    normal_coefficients: Array
    """Harmonic coefficients F_y, (n_contacts, L)."""
    amplitude: Array
    """Largest ``|x - mean|`` over the last period, (n_outputs,)."""
    mean: Array
    """Mean of the motion (harmonic 0), (n_outputs,)."""
    power: Array
    """Dissipated power of each contact, force x length / time, (n_contacts,)."""
    fractions: Array
    """Fractions of the last period in separation, stick, slip+ and slip-, (n_contacts, 4)."""
    changes: tuple[ContactChange, ...]
    """Changes of contact state in the recorded periods."""
    periods: int
    """Periods of the whole structure integrated before the recorded ones."""
    change: float
    """Relative change of the state over the last period."""
    converged: bool
    """Whether ``change`` met the tolerance."""
    error: float = np.nan
    """Estimated distance of the state after the integrated periods from the periodic one, relative to its size: the
    error of the integration itself. nan where it is unknown, as after the first periods of marching."""
    units: Units = field(default_factory=Units)
    """Names of the base units."""

    @property
    def dataset(self) -> xarray.Dataset:
        """The result with labels, over ``time``, ``dof``, ``contact``, ``coefficient`` and ``change``."""
        import xarray

        label, of_dofs = self.units.label, partial(self.units.of_dofs, self.outputs)
        coefficients = ["0", *(f"{part}{m}" for m in self.harmonics.orders[1:] for part in "cs")]
        states = zip(("separation", "stick", "slip_plus", "slip_minus"), self.fractions.T, strict=True)
        parts = [(f"{name}_fraction", ("contact",), part, "1", f"fraction of {name}") for name, part in states]
        variables: list[tuple[str, tuple[str, ...], Any, str, str]] = [
            ("displacement", ("time", "dof"), self.displacement, "length", "motion"),
            ("friction_force", ("time", "contact"), self.friction_force, "force", "friction force"),
            ("normal_force", ("time", "contact"), self.normal_force, "force", "normal force"),
            ("amplitude", ("dof",), self.amplitude, "length", "largest deviation from the mean in the last period"),
            ("mean", ("dof",), self.mean, "length", "mean of the motion"),
            ("coefficients", ("dof", "coefficient"), self.coefficients, "length", "harmonics of the motion"),
            ("friction_coefficients", ("contact", "coefficient"), self.friction_coefficients, "force", "of F_x"),
            ("normal_coefficients", ("contact", "coefficient"), self.normal_coefficients, "force", "of F_y"),
            ("power", ("contact",), self.power, "force length/time", "dissipated power in the last period"),
            *parts,
            ("change_time", ("change",), np.array([c.time for c in self.changes]), "time", "change of a contact state"),
        ]
        data: dict[str, Any] = {
            name: (dims, values, {"units": of_dofs(unit) if "dof" in dims else label(unit), "long_name": meaning})
            for name, dims, values, unit, meaning in variables
        }
        for name in ("contact", "before", "after"):
            data[f"change_{name}"] = "change", np.array([getattr(c, name) for c in self.changes], dtype=np.str_)
        names = {"dof": self.outputs, "contact": self.contacts, "coefficient": coefficients}
        coords: dict[str, Any] = {name: (name, np.array(labels, dtype=np.str_)) for name, labels in names.items()}
        said = {"omega": self.omega, "periods": self.periods, "change": self.change, "converged": int(self.converged)}
        coords["time"] = "time", self.time, {"units": label("time"), "long_name": "time"}
        return xarray.Dataset(data, coords, {**said, "error": self.error, **self.units.attributes})

    def save_table(self, path: str | Path, table: str | None = None) -> Path:
        """Write numbers for other programs and return the path: a .csv file, one table, or .xlsx and .mat, all of them.

        ``table`` chooses: "time" (of a .csv file by default), "dof", "contact" (power and fractions) or "change".

        Raises
        ------
        InputError
            For another ending or table, and where the file cannot be written.
        """
        return write_table(self.dataset, path, table)

    def __repr__(self) -> str:
        ended = "periodic" if self.converged else "not periodic"
        return (
            f"TransientResult(omega={self.omega:g}, {len(self.outputs)} outputs, {len(self.contacts)} contacts, "
            f"{len(self.time)} times, {ended} after {self.periods} periods, change {self.change:.1e})"
        )

    def _repr_html_(self) -> str:
        return html_table("Integration in time, last period", _rows(self))


def _rows(result: TransientResult) -> Iterator[tuple[str, Any]]:
    ended = "periodic" if result.converged else "not periodic"
    yield "outcome", f"{ended} after {result.periods} periods, relative change {result.change:.1e} over the last"
    yield "from the periodic motion", "unknown" if np.isnan(result.error) else f"about {result.error:.1e} of its size"
    yield "omega", f"{result.omega:.6g}"
    for dof, size, mean in list(zip(result.outputs, result.amplitude, result.mean, strict=True))[:MOST_SHOWN]:
        yield dof, f"amplitude {size:.5g}, mean {mean:.5g}"
    names = ("separation", "stick", "slip+", "slip-")
    for contact, power, parts in list(zip(result.contacts, result.power, result.fractions, strict=True))[:MOST_SHOWN]:
        shares = ", ".join(f"{name} {part:.0%}" for name, part in zip(names, parts, strict=True) if part > 0.0005)
        yield contact, f"dissipates {power:.5g}; {shares}"


def transient(
    problem: Problem,
    omega: Frequency,
    *,
    periods: int = 200,
    tolerance: float = 1e-10,
    method: Literal["shooting", "march"] = "shooting",
    initial: HarmonicStart | None = None,
    record_periods: int = 1,
    steps: int | None = None,
    held: Mapping[str, Array] | None = None,
) -> TransientResult:
    """Steady vibration by exact integration in time, independent of the balance and of the contact element.

    Parameters
    ----------
    problem
        What is to be integrated; hysteretic damping becomes viscous, equal at each mode's own frequency. A reduced
        structure is integrated as it is, without the modes that the reduction leaves out.
    omega
        Fundamental frequency, rad/s.
    periods
        Largest number of periods before the recorded ones.
    tolerance
        Stops once the state changes by less than this over a period, relative to its size.
    method
        "march" integrates period after period; "shooting" corrects the start of a period by Newton's method on the
        period map (needed where damping is light). Of a modal structure with many fast modes Newton's method sees the
        slow ones; the periods whose change is reported are those of all modes. Contacts that stick all period keep
        their friction force in these corrections. Which force others keep depends on all of the motion before, and
        that "march" follows.
    initial
        Periodic motion of the contacts to start from. None is the state of the preload, with its static loads, where
        there is one, and else rest: no displacement, no friction forces.
    record_periods
        Periods recorded at the end.
    steps
        Steps a period, at least half of those that None chooses by the fastest mode. The result does not depend on it
        but for events that begin and end within a thirteenth of a step.
    held
        Contact parameters "mu", "kt", "kn", "gap", (n_contacts,), instead of the problem's: those of hot contacts,
        whose states are not integrated in time.

    Raises
    ------
    InputError
        If an option is out of range, contacts carry a state and are not held, the mass matrix is singular, a period of
        the forcing holds too many periods of the fastest mode (1 000 000 steps), or a preload has no equilibrium under
        the static loads.

    Warns
    -----
    SlipstickWarning
        For what is suspicious in the problem.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> damper = ss.ContactPair(name="damper", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=10)
    >>> motion = ss.transient(problem, 6.3, method="shooting")
    >>> motion.converged
    True
    """
    problem = one("problem", problem, Problem, "an ss.Problem")
    omega, periods, tolerance, record_periods, steps = _checked_options(
        omega, periods, tolerance, method, record_periods, steps, initial, problem.units
    )
    system = friction_system(problem, omega, held)
    problem.warn(problem_warnings(problem))
    outputs = tuple(problem.outputs or ())
    contacts = problem.elements
    found = integrate(
        system, problem.harmonics, outputs=outputs, contacts=contacts, friction=friction_elements(problem).tolist(),
        periods=periods, tolerance=tolerance, method=method,
        initial=equilibrium(problem, omega, held) if initial is None else initial,
        record_periods=record_periods, steps=steps,
    )  # fmt: skip
    return replace(found, units=problem.units)


def integrate(
    system: FrictionSystem,
    harmonics: Harmonics,
    *,
    outputs: tuple[str, ...],
    contacts: tuple[str, ...],
    friction: Sequence[int] | None = None,
    periods: int = 200,
    tolerance: float = 1e-10,
    method: Literal["shooting", "march"] = "shooting",
    initial: HarmonicStart | Equilibrium | None = None,
    record_periods: int = 1,
    steps: int | None = None,
) -> TransientResult:
    """As :func:`transient`, of a system that is already assembled; ``friction``: numbers of the friction contacts."""
    stepper = Stepper(PiecewiseLinear(system), steps)
    if record_periods * stepper.steps > MOST_ITEMS:
        raise InputError(
            Fault(
                "time integration",
                f"{record_periods} periods of {stepper.steps} steps are more than can be recorded",
                expected=f"{MOST_ITEMS} steps at most: give fewer record_periods or steps",
            )
        )
    z, states = started(stepper, initial)
    end = None
    for end in follow_periods(stepper, z, states, shooting=method == "shooting"):
        pass_on()
        if end.change < tolerance or end.period >= periods:
            break
    assert end is not None
    z, states = end.z, end.states
    records = []
    for _ in range(record_periods):
        record = PeriodRecord(stepper, harmonics)
        for item in stepper.period(z, states):
            record.add(item)
        z, states = stepper.z, stepper.states
        records.append(record)
    return _result(
        system, harmonics, outputs, contacts, range(len(contacts)) if friction is None else friction, records,
        end, end.change < tolerance,
    )  # fmt: skip


def _result(
    system: FrictionSystem, harmonics: Harmonics, outputs: tuple[str, ...], contacts: tuple[str, ...],
    friction: Sequence[int], records: list[PeriodRecord], end: PeriodEnd, converged: bool,
) -> TransientResult:  # fmt: skip
    series = [record.series() for record in records]
    first, frictional, count = len(system.equations.rows) - len(outputs), list(friction), len(contacts)
    time = np.concatenate([tau + 2 * np.pi * k for k, (tau, *_) in enumerate(series)]) / system.omega
    motion, fx, fy = (np.concatenate([part[k] for part in series]) for k in (1, 2, 3))
    last = records[-1]
    X, Fx, Fy = last.coefficients
    low, high = last.extremes()
    mean = X[first:, 0]

    def of_all(values: Array, axis: int = 0) -> Array:
        """Values of friction contacts among those of all contacts."""
        out = np.full([count if i == axis else n for i, n in enumerate(values.shape)], np.nan)
        rows = np.moveaxis(out, axis, 0)
        rows[frictional] = 0.0
        np.add.at(rows, frictional, np.moveaxis(values, axis, 0))  # sliders of one contact carry its force together
        return out

    work, fractions = of_all(last.work), of_all(last.fractions)
    several = np.bincount(np.array(frictional, dtype=int), minlength=count) > 1
    normal, normals = of_all(fy, 1), of_all(Fy)
    fractions[several], normal[:, several], normals[several] = np.nan, np.nan, np.nan
    for law, rows, *_ in system.laws.each:
        work[law.elements] = last.law_work[rows].reshape(-1, len(law.elements)).sum(axis=0)
    for own, time_in_regime in zip(system.laws.switching, last.time_in_regime, strict=True):
        fractions[own.number] = 0.0
        for name, part in zip(own.regimes.names, time_in_regime, strict=True):
            fractions[own.number, _COLUMNS[name]] += part
    return TransientResult(
        omega=system.omega, harmonics=harmonics, outputs=outputs, contacts=contacts,
        time=time, displacement=motion[:, first:], friction_force=of_all(fx, 1), normal_force=normal,
        coefficients=X[first:], friction_coefficients=of_all(Fx), normal_coefficients=normals,
        amplitude=np.maximum(high[first:] - mean, mean - low[first:]), mean=mean,
        power=system.omega * work, fractions=fractions,
        changes=tuple(
            named for k, r in enumerate(records) for c in r.changes
            if c.contact >= system.n_contacts or not several[frictional[c.contact]]
            if (named := _named(c, k, system, contacts, frictional)).before != named.after
        ),
        periods=end.period, change=end.change, converged=converged, error=end.error,
    )  # fmt: skip


def _named(
    change: StateChange, period: int, system: FrictionSystem, contacts: Sequence[str], friction: Sequence[int]
) -> ContactChange:
    time, nc = (change.tau + 2 * np.pi * period) / system.omega, system.n_contacts
    if change.contact < nc:
        before, after = State(change.before).text, State(change.after).text
        return ContactChange(time=time, contact=contacts[friction[change.contact]], before=before, after=after)
    own = system.laws.switching[change.contact - nc]
    before, after = (own.regimes.names[regime] for regime in (change.before, change.after))
    return ContactChange(time=time, contact=contacts[own.number], before=before, after=after)


def _checked_options(
    omega: Any,
    periods: int,
    tolerance: float,
    method: str,
    record_periods: int,
    steps: int | None,
    initial: Any,
    units: Units | None = None,
) -> tuple[float, int, float, int, int | None]:
    checks, where = Gathering(), "time integration, {}".format
    values: dict[str, Any] = {
        "omega": checks.take(frequency, where("omega"), omega, units),
        "periods": checks.take(whole, where("periods"), periods, 1, MOST_ITEMS),
        "tolerance": checks.take(number, where("tolerance"), tolerance, "a number >= 0", above=0.0),
        "record_periods": checks.take(whole, where("record_periods"), record_periods, 1, MOST_ITEMS),
        "steps": None if steps is None else checks.take(whole, where("steps"), steps, 1, MOST_ITEMS),
    }
    if not isinstance(method, str) or method not in ("shooting", "march"):
        checks.faults.append(Fault("time integration, method", found=shown(method), expected='"shooting" or "march"'))
    if initial is not None:
        checks.take(one, where("initial"), initial, HarmonicStart, "a HarmonicStart or None (rest)")
    checks.end()
    return tuple(values.values())
