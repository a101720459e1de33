"""Run-ups and other long integrations in time: kept period by period in a folder, gone on with, brought together."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.time_domain.long_run import Checkpoint, LongRun, PeriodDone, checked
from slipstick.analysis.time_domain.period_sums import Energy
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import IS_MISSING, Fault, InputError, Outcome
from slipstick.faults import MOST_ITEMS, Gathering, frequency, number, one, path, whole, wrong
from slipstick.interrupts import held
from slipstick.io.journal import Journal, journal_of, read_journal, unpacked
from slipstick.io.loading import load_dataset
from slipstick.io.lock import FolderLock
from slipstick.io.problem import fingerprint
from slipstick.io.store import save_dataset
from slipstick.results.run_up import CONTACT_STATES, VARIABLES, RunUp
from slipstick.results.schema import ANALYSIS, Layout, attributes_of, versions
from slipstick.runs.folder import PASSED
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
) -> RunUp:
    """Passing through: the motion while the speed of the excitation grows or falls evenly, or stays, from rest.

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

    Returns
    -------
    RunUp
        ``dataset``, ``peak``, ``lag``, ``envelope``, ``section``, ``spectrum``, ``spectrogram``, ``motion``. After
        Ctrl-C it holds the periods so far, and says so.

    Raises
    ------
    InputError
        For values out of range, a structure that turns with the excitation, laws that are not told in time, planar
        contacts whose rubbing velocity is tied to a speed that grows, a folder with another run.

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
    problem.warn(problem_warnings(problem))
    if folder is None:
        rows: list[PeriodDone] = []
        outcome = _walked(run, None, rows.append, listener)
        layout = _layout(run)
        return RunUp(_dataset(run, [layout.pack(done.values) for done in rows], list(map(_note, rows)), outcome))
    return _in_folder(run, path("run_up, folder", folder, "the path of a folder"), listener)


def run_up_of_case(
    case: Case, table: Any, folder: Path, listener: Callable[[PeriodDone], object] | None = None
) -> RunUp:
    """What the table "run_up" of a case asks for; the folder holds the case too, so that ``resume`` can go on."""
    run = _checked(case.problem(), table.omega, table.rate, table.periods, table.samples, None)
    return _in_folder(run, folder, listener, case)


def _in_folder(
    run: LongRun, folder: Path, listener: Callable[[PeriodDone], object] | None, case: Case | None = None
) -> RunUp:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror or error}); choose another folder") from None
    with ExitStack() as stack:
        lock = FolderLock(folder)
        stack.callback(lock.release)
        file, mark = folder / PASSED, _mark(run)
        place = journal_of(file)
        if file.exists() and not place.exists():
            kept = load_run_up(file)
            if kept.dataset.attrs.get("run_up") == mark:
                return kept
            raise InputError(f"{folder} already holds another run-up ({PASSED}); choose another folder")
        begin, keep = _begun(run, place, mark)
        names: dict[str, str] = {} if case is None else case.names
        about = {ANALYSIS: "run_up", "run_up": mark, "case_path": "" if case is None else str(case.path.resolve())}
        layout = replace(_layout(run), attributes={**versions(), **names})
        journal = Journal(place, layout, about, keep)
        try:

            def add(done: PeriodDone) -> None:
                with held():
                    journal.append(layout.pack(done.values), {**_note(done), **_state(done.checkpoint)})

            outcome = _walked(run, begin, add, listener)
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


def _walked(
    run: LongRun,
    begin: Checkpoint | None,
    add: Callable[[PeriodDone], None],
    listener: Callable[[PeriodDone], object] | None,
) -> Outcome:
    """Every period handed on; how it ended."""
    try:
        for done in run.run(begin):
            add(done)
            if listener is not None:
                listener(done)
    except KeyboardInterrupt:
        return Outcome.INTERRUPTED
    return Outcome.COMPLETED


def _begun(run: LongRun, place: Path, mark: str) -> tuple[Checkpoint | None, int]:
    """The last period in a journal, and how much of it is sound."""
    if not place.exists():
        return None, 0
    recorded = read_journal(place)
    if recorded.about.get("run_up") != mark:
        raise InputError(f"{place.parent}: another run-up was begun in it; choose another folder")
    if not len(recorded):
        return None, recorded.ends[-1]
    said = unpacked(recorded.note(-1))
    states = run.states(map(int, said["states"]))
    energy = Energy(**dict(zip(said["energy_names"], said["energy"].tolist(), strict=True)))
    return Checkpoint(period=int(said["period"]), z=said["z"], states=states, energy=energy), recorded.ends[-1]


def _state(at: Checkpoint) -> dict[str, Any]:
    energy = vars(at.energy)
    return {
        "period": at.period, "states": [int(s) for s in at.states], "z": at.z,
        "energy": np.array(list(energy.values()), dtype=float), "energy_names": list(energy),
    }  # fmt: skip


def _note(done: PeriodDone) -> dict[str, Any]:
    changes = np.array(done.changes, dtype=float).reshape(-1, 4)
    return {"times": done.times, "series": done.series.ravel(), "changes": changes.ravel()}


def _layout(run: LongRun) -> Layout:
    label = run.problem.units.label
    labels = {"dof": tuple(run.problem.outputs or ()), "contact": tuple(run.problem.elements)}
    return Layout(labels=labels, variables={n: d._replace(units=label(d.units)) for n, d in VARIABLES.items()})


def _dataset(run: LongRun, rows: Sequence[Any] | Array, notes: list[dict[str, Any]], outcome: Outcome) -> Any:
    import xarray

    layout, label = _layout(run), run.problem.units.label
    values = layout.unpack(np.asarray(rows, dtype=float).reshape(len(rows), layout.size))
    data: dict[str, Any] = {
        name: (("period", *d.dims), values[name], {"units": d.units, "long_name": d.long_name})
        for name, d in layout.variables.items()
    }
    count = len(layout.labels["dof"])
    if run.samples:
        series = np.concatenate([np.zeros(0), *(note["series"] for note in notes)]).reshape(-1, count)
        times = np.concatenate([np.zeros(0), *(note["times"] for note in notes)])
        data["sample_time"] = "sample", times, {"units": label("time"), "long_name": "time"}
        data["displacement"] = ("sample", "dof"), series, {"units": label("length"), "long_name": "displacement"}
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
            samples=int(samples or 0), steps=steps,
        )  # fmt: skip
    start, stop = speeds
    count = int((start + stop) * abs(stop - start) / (4 * np.pi * float(rate)) + 1e-9)
    if not 1 <= count <= MOST_ITEMS:
        found = f"{count} periods between {start:g} and {stop:g} rad/s at {rate:g} rad/s^2"
        raise InputError(Fault(where("rate"), found=found, expected=f"1 to {MOST_ITEMS}"))
    signed = float(rate) if stop > start else -float(rate)
    return LongRun(
        problem=problem, start=start, stop=stop, rate=signed, periods=min(count, most or count),
        samples=int(samples or 0), steps=steps,
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
