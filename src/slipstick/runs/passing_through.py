"""Run-ups and other long integrations in time: kept period by period in a folder, gone on with, brought together."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.road.events import Event, EventFunction, PointFound
from slipstick.analysis.road.request import heard_by
from slipstick.analysis.time_domain.long_run import LongRun, PeriodDone, checked
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import IS_MISSING, Fault, InputError, Outcome
from slipstick.faults import MOST_ITEMS, Gathering, frequency, number, one, path, real_path, whole, wrong
from slipstick.interrupts import held
from slipstick.io.journal import Journal, journal_of, read_journal, unpacked
from slipstick.io.loading import load_dataset
from slipstick.io.lock import FolderLock
from slipstick.io.problem import fingerprint
from slipstick.io.store import save_dataset
from slipstick.replacing import make_folder, telling
from slipstick.results.run_up import CONTACT_STATES, RunUp
from slipstick.results.schema import ANALYSIS, attributes_of, versions
from slipstick.runs.checkpoints import checkpoints_in
from slipstick.runs.folder import OR_REPLACE, PASSED
from slipstick.typing import Array, Frequency, FrequencyRange

if TYPE_CHECKING:
    from slipstick.case.case import Case


def run_up(
    problem: Problem,
    omega: Frequency | FrequencyRange,
    *,
    rate: float | None = None,
    periods: int | None = None,
    samples: int = 32,
    steps: int | None = None,
    folder: str | Path | None = None,
    listener: Callable[[PeriodDone], object] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> RunUp:
    """Passing through: the motion while the speed of the excitation grows or falls evenly, or stays.

    It begins at rest, or in the state of the preload where there is one.

    The integration is that of ``ss.transient``, exact but for rounding between changes of contact state, and
    independent of the balance. The excitation turns by ``phi(t) = omega_1 t + rate t^2 / 2``: loads and periodic
    rubbing motions of harmonic m follow ``m phi``, unbalance and moving supports by the exact second derivative,
    rubbing velocities that are tied to the speed follow it.

    Parameters
    ----------
    problem
        Structure with contacts, of all laws that ``ss.transient`` takes.
    omega
        First and last speed, rad/s, ``(4.0, 15.0)``, or down, ``(15.0, 4.0)``; one number for a speed that stays.
    rate
        Growth (or fall) of the speed, rad/s^2, > 0; of two speeds.
    periods
        Periods of the excitation; of one speed needed, of two at most so many.
    samples
        Samples of the outputs in a period at the highest speed; 0 for none.
    steps
        Steps of a period at the highest speed; by default by the fastest motion. The result does not depend on it but
        for events that begin and end within a thirteenth of a step.
    folder
        Where every period is kept as soon as it is done, and ``run_up.nc`` in the end. Memory does not grow with the
        periods meanwhile. Called again with the same arguments, a run that was killed goes on to the last bit.
    listener
        Called with a ``PeriodDone`` after every period.
    listeners
        As of ``forced_response``; a point is a period: ``listeners=ss.Progress()``.

    Returns
    -------
    RunUp
        ``dataset``, ``peak``, ``lag``, ``envelope``, ``section``, ``spectrum``, ``spectrogram``, ``motion``. After
        Ctrl-C it holds the periods so far, and says so.

    Raises
    ------
    InputError
        For values out of range, a structure that turns with the excitation, laws that are not told in time, planar
        contacts whose rubbing velocity is tied to a speed that grows, a folder with another run, a preload without
        equilibrium under the static loads.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.ContactPair(name="damper", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0),
    ...     tangential="x")
    >>> problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))
    >>> passed = ss.runs.run_up(problem, (9.0, 13.0), rate=0.2)
    >>> round(passed.peak().omega, 2), round(passed.peak().amplitude, 2)
    (11.06, 3.33)
    """
    run = _checked(problem, omega, rate, periods, samples, steps)
    if listener is not None and not callable(listener):
        raise wrong("run_up, listener", listener, "a function of one event, or None")
    heard = _heard(listener, heard_by(listeners))
    if folder is None:
        rows: list[PeriodDone] = []
        outcome = _integrated(run, _heard(rows.append, heard))
        layout = run.recorder().layout
        return RunUp(_dataset(run, [layout.pack(done.values) for done in rows], [done.note for done in rows], outcome))
    place = path("run_up, folder", folder, "the path of a folder")
    make_folder(place)
    with telling(place):
        lock = FolderLock(place)
    try:
        return _in_folder(run, place, heard)
    finally:
        lock.release()


def run_up_of_case(
    case: Case, table: Any, folder: Path, listener: Callable[[PeriodDone], object] | None = None,
    listeners: tuple[EventFunction, ...] = (),
) -> RunUp:  # fmt: skip
    """What the table "run_up" of a case asks for; the folder holds the case too, so that ``resume`` can go on.

    Whoever calls holds the folder.
    """
    run = _checked(case.problem(), table.omega, table.rate, table.periods, table.samples, None)
    return _in_folder(replace(run, warnings=()), folder, _heard(listener, listeners), case)  # told of by the case


def _heard(
    listener: Callable[[PeriodDone], object] | None, others: tuple[EventFunction, ...]
) -> tuple[EventFunction, ...]:
    """Who hears of events, with one who hears of periods alone."""

    def period(event: Event) -> None:
        if isinstance(event, PointFound):
            assert listener is not None
            listener(event.point)  # type: ignore[arg-type]

    return others if listener is None else (period, *others)


def _integrated(run: LongRun, listeners: tuple[EventFunction, ...]) -> Outcome:
    """Every period told to the listeners in their order; how it ended."""
    under_way = run.run()
    for _ in under_way.follow(*listeners, guard=held):
        pass
    if under_way.error is not None:
        raise under_way.error
    return under_way.outcome


def _in_folder(run: LongRun, folder: Path, listeners: tuple[EventFunction, ...], case: Case | None = None) -> RunUp:
    make_folder(folder)
    file, mark = folder / PASSED, _mark(run)
    place, remedy = journal_of(file), "choose another folder" if case is None else OR_REPLACE
    if file.exists() and not place.exists():
        kept = load_run_up(file)
        if kept.dataset.attrs.get("run_up") == mark:
            return kept
        raise InputError(f"{folder} already holds another run-up ({PASSED}); {remedy}")
    keep = 0
    if place.exists():
        recorded = read_journal(place)
        if recorded.about.get("run_up") != mark:
            raise InputError(f"{folder} already holds another run-up that did not end; {remedy}")
        run, keep = replace(run, checkpoints=checkpoints_in(recorded, run)), recorded.ends[-1]
    names: dict[str, str] = {} if case is None else case.names
    about = {ANALYSIS: "run_up", "run_up": mark, "case_path": "" if case is None else str(real_path(case.path))}
    layout = replace(run.recorder().layout, attributes={**versions(), **names})
    journal = Journal(place, layout, about, keep)

    def add(event: Event) -> None:
        if isinstance(event, PointFound) and event.checkpoint is not None:
            journal.append(layout.pack(event.values), event.checkpoint.plain())

    try:
        outcome = _integrated(run, (add, *listeners))
    finally:
        journal.close(remove=False)
    recorded = read_journal(place)
    dataset = _dataset(run, recorded.rows, [unpacked(note) for note in recorded.notes()], outcome)
    dataset.attrs |= {"run_up": mark, **names}
    save_dataset(dataset, file)
    if outcome.ok:
        place.unlink()
    return RunUp(dataset)


def load_run_up(file: str | Path) -> RunUp:
    """The run-up in ``run_up.nc``."""
    return RunUp(load_dataset(file))


def _dataset(run: LongRun, rows: Sequence[Any] | Array, notes: list[dict[str, Any]], outcome: Outcome) -> Any:
    import xarray

    layout, label = run.recorder().layout, run.problem.units.label
    values = layout.unpack(np.asarray(rows, dtype=float).reshape(len(rows), layout.size))
    data: dict[str, Any] = {
        name: (("period", *d.dims), values[name], {"units": d.units, "long_name": d.long_name})
        for name, d in layout.variables.items()
    }
    count, of_dofs = len(layout.labels["dof"]), run.problem.units.of_dofs(layout.labels["dof"])
    if run.samples:
        series = np.concatenate([np.zeros(0), *(note["series"] for note in notes)]).reshape(-1, count)
        times = np.concatenate([np.zeros(0), *(note["times"] for note in notes)])
        data["sample_time"] = "sample", times, {"units": label("time"), "long_name": "time"}
        data["displacement"] = ("sample", "dof"), series, {"units": of_dofs, "long_name": "displacement"}
    changes = np.concatenate([np.zeros(0), *(note["changes"] for note in notes)]).reshape(-1, 4)
    names = run.changing
    data["change_time"] = "change", changes[:, 0], {"units": label("time"), "long_name": "change of a contact state"}
    data["change_contact"] = "change", np.array([names[int(c)] for c in changes[:, 1]], dtype=np.str_)
    for k, name in ((2, "change_before"), (3, "change_after")):
        data[name] = "change", np.array([CONTACT_STATES[int(s)] for s in changes[:, k]], dtype=np.str_)
    coords = {name: (name, np.array(known, dtype=np.str_)) for name, known in layout.labels.items()}
    said = f"{len(rows)} of {run.periods} periods are integrated"
    attributes = attributes_of(run.problem, outcome, said, problem_warnings(run.problem), analysis="run_up")
    attributes |= {"start": run.start, "stop": run.stop, "rate": run.rate, "periods": run.periods}
    return xarray.Dataset(data, coords={**coords, "period": np.arange(1, len(rows) + 1)}, attrs=attributes)


def _mark(run: LongRun) -> str:
    asked = [fingerprint(run.problem), run.start, run.stop, run.rate, run.periods, run.samples, run.steps]
    return sha256(json.dumps(asked).encode()).hexdigest()


def _checked(problem: Any, omega: Any, rate: Any, periods: Any, samples: Any, steps: Any) -> LongRun:
    problem = one("problem", problem, Problem, "an ss.Problem")
    checks, where = Gathering(), "run_up, {}".format
    speeds = list(_speeds(checks, omega, problem))
    most = None if periods is None else checks.take(whole, where("periods"), periods, 1, MOST_ITEMS)
    samples = checks.take(whole, where("samples"), samples, 0, 4096)
    steps = None if steps is None else checks.take(whole, where("steps"), steps, 1, MOST_ITEMS)
    swept = len(speeds) == 2
    if swept and rate is None:
        checks.faults.append(Fault(where("rate"), IS_MISSING, remedy="give the growth of the speed, rad/s^2"))
    if rate is not None:
        rate = checks.take(number, where("rate"), rate, "a number > 0", above=1e-300)
        if speeds and not swept:
            said = "it is given, but the speed stays"
            checks.faults.append(Fault(where("rate"), said, remedy="give two speeds, omega=(4.0, 15.0)"))
    if speeds and not swept and periods is None:
        checks.faults.append(Fault(where("periods"), IS_MISSING, remedy="give how many, such as periods=500"))
    checks.end()
    checked(problem, swept=swept)
    if not swept:
        return LongRun(
            problem=problem, start=speeds[0], stop=speeds[0], rate=0.0, periods=int(most or 1),
            samples=int(samples or 0), steps=steps, warnings=problem_warnings(problem),
        )  # fmt: skip
    start, stop = speeds
    count = int((start + stop) * abs(stop - start) / (4 * np.pi * float(rate)) + 1e-9)
    if not 1 <= count <= MOST_ITEMS:
        found = f"{count} periods between {start:g} and {stop:g} rad/s at {rate:g} rad/s^2"
        raise InputError(Fault(where("rate"), found=found, expected=f"1 to {MOST_ITEMS}"))
    signed = float(rate) if stop > start else -float(rate)
    return LongRun(
        problem=problem, start=start, stop=stop, rate=signed, periods=min(count, most or count),
        samples=int(samples or 0), steps=steps, warnings=problem_warnings(problem),
    )  # fmt: skip


def _speeds(checks: Gathering, omega: Any, problem: Problem) -> Iterator[float]:
    given = list(omega) if isinstance(omega, tuple | list) else [omega]
    if len(given) not in (1, 2) or not given:
        checks.faults.append(
            Fault("run_up, omega", found=repr(omega)[:60], expected="one speed, or the first and the last")
        )
        return
    for value in given:
        speed = checks.take(frequency, "run_up, omega", value, problem.units)
        if speed is not None:
            yield speed
    if len(given) == 2 and given[0] == given[1]:
        checks.faults.append(Fault("run_up, omega", "the speed stays", remedy="give one number, and periods"))
