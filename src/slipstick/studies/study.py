"""A study in one call: many cases of a problem, over a grid, a list or samples of its parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.analysis.curve.follow import StabilityRequest, curve_arguments
from slipstick.analysis.road.events import CaseDone
from slipstick.analysis.road.request import Checks, followed_problem
from slipstick.balance.checks import range_faults, two_frequencies
from slipstick.balance.problem import Problem
from slipstick.errors import IS_MISSING, Fault, InputError
from slipstick.faults import listed, one, path, truth, warn, whole, wrong
from slipstick.results.schema import LARGEST
from slipstick.structure.disc import MISTUNING
from slipstick.studies import CURVES_FILE, STUDY_FILE
from slipstick.studies.folder import StudyFolder
from slipstick.studies.plan import MISTUNED, StudyPlan, make_plan
from slipstick.studies.solving import CaseSolved, Job
from slipstick.studies.table import study_attributes, study_dataset
from slipstick.studies.workers import solutions
from slipstick.typing import FrequencyRange, Names

if TYPE_CHECKING:
    import xarray
    from distributed import Client

    from slipstick.case.case import Case
    from slipstick.solve.continuation import ContinuationOptions

_MOST_WORKERS = 1024
Listeners = tuple[Callable[[CaseDone], None], ...]


def study(
    problem: Problem | Case,
    parameters: Mapping[str, Any] | None = None,
    *,
    omega: FrequencyRange | None = None,
    method: str = "grid",
    samples: int | None = None,
    seed: int = 0,
    spread: float | None = None,
    peaks_of: Names = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    stability: StabilityRequest = False,
    workers: int | None = None,
    client: Client | None = None,
    folder: str | Path | None = None,
    missing: bool = False,
    listeners: Iterable[Callable[[CaseDone], None]] | Callable[[CaseDone], None] = (),
) -> xarray.Dataset:
    """Response curves for many values of any named parameters.

    Parameters
    ----------
    problem
        A problem, whose response over ``omega`` is followed, or an ``ss.Case``, which itself says what is followed.
    parameters
        Values by name, such as ``{"damper.velocity": [0, 1, 10], "damper.mu": {"from": 0.1, "to": 0.4, "count": 4}}``;
        ``"spacing": "log"`` spreads a range evenly in its logarithm. For samples it takes the two ends. A case with
        ``[study]`` needs none.
    omega
        First and last frequency, of a problem.
    method
        "grid": every combination; "list": the values side by side; "latin-hypercube" and "sobol": ``samples`` points in
        the ranges, the same for the same ``seed``; "mistuning": ``samples`` discs whose blades differ at random.
    spread
        Of "mistuning", the standard deviation of the relative stiffness of the blades; it needs no parameters. The
        deviations of the problem itself are not used.
    stability
        As in ``ss.forced_response``: ``peak_stable`` and ``unstable_points`` of every case, ``stable`` along its curve.
    peaks_of, options
        As in ``forced_response``, of a problem.
    workers
        Processes on this machine; by default one for each processor, where that saves time. With 1 everything happens
        here, without Dask. The numbers are the same.
    client
        A ``distributed.Client`` whose workers compute instead.
    folder
        Where results are kept, case by case: ``study.nc`` and ``curves.nc``. Called again with the same study, only
        cases that are not there are computed.
    missing
        Whether cases in the folder that did not complete are computed once more.
    listeners
        Called with a ``CaseDone`` for every case.

    Returns
    -------
    xarray.Dataset
        ``peak_amplitude``, ``peak_omega`` over the parameters and ``dof``, ``outcome``, ``message`` and work over the
        parameters, which are coordinates: dimensions of a grid, else along ``case``. Of "mistuning" also
        ``largest_amplitude``, ``amplification`` (over that of the tuned disc) and ``worst`` (the output), and the
        attribute ``tuned_amplitude``. A case that fails is there with its outcome. After Ctrl-C the cases computed so
        far are kept in the folder, where there is one.

    Raises
    ------
    InputError
        For an unknown parameter, values that are no numbers or not allowed, a folder with another study.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> pair = ss.ContactPair(
    ...     name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
    ...     rubbing=ss.RubbingMotion(velocity=100.0))
    >>> problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=100.0)], harmonics=range(6))
    >>> peaks = ss.study(problem, {"load.x.amplitude": [50.0, 100.0]}, omega=(5.0, 7.0), workers=1)
    >>> peaks.peak_amplitude.sel(dof="x").values.round(2).tolist()
    [16.76, 18.25]
    """
    job, about = job_of(problem, omega, peaks_of, options, stability)
    plan = getattr(problem, "plan", None) if parameters is None and method != MISTUNED else None
    plan = plan or make_plan(job.problem, parameters, method=method, samples=samples, seed=seed, spread=spread)
    job = job_for(job, plan)
    if workers is not None:
        workers = whole(("study", "workers"), workers, 1, _MOST_WORKERS)
    if client is not None and not hasattr(client, "submit"):
        raise wrong(("study", "client"), client, "a distributed.Client, or None")
    heard = _listeners(listeners)
    missing = truth(("study", "missing"), missing)
    if folder is None:
        if missing:
            said = "it is given without folder"
            raise InputError(Fault(("study", "missing"), said, remedy="give the folder of the study"))
        cases = _in_memory(job, plan, heard, workers, client)
        return _with_warnings(problem, study_dataset(job, plan, cases, study_attributes(job, plan, cases, about)))
    place = StudyFolder(path(("study", "folder"), folder, "the path of a folder"), job, plan, about=about)
    try:
        todo, total = place.todo(missing=missing), len(plan)
        if todo or not (place.folder / STUDY_FILE).exists() or not (place.folder / CURVES_FILE).exists():
            place.begin()
            try:
                for solved in solutions(job, plan, todo, workers=workers, client=client):
                    place.add(solved)
                    _tell(heard, plan, solved, len(place.cases), total)
            finally:
                dataset = place.write()
            return _with_warnings(problem, dataset)
        return _with_warnings(problem, place.dataset())
    finally:
        place.release()


def _in_memory(
    job: Job, plan: StudyPlan, heard: Listeners, workers: int | None, client: Client | None
) -> dict[int, CaseSolved]:
    cases: dict[int, CaseSolved] = {}
    for solved in solutions(job, plan, plan.order, workers=workers, client=client):
        cases[solved.row["case"]] = solved
        _tell(heard, plan, solved, len(cases), len(plan))
    return cases


def _with_warnings(problem: Any, dataset: xarray.Dataset) -> xarray.Dataset:
    """The dataset; its warnings are given, those of a problem that no analysis of it gave yet."""
    (problem.warn if isinstance(problem, Problem) else warn)(str(dataset.attrs["warnings"]).splitlines())
    return dataset


def _tell(heard: Listeners, plan: StudyPlan, solved: CaseSolved, done: int, total: int) -> None:
    case = solved.row["case"]
    values = dict(zip(plan.names, plan.values[case].tolist(), strict=True))
    for listener in heard:
        listener(CaseDone(case=case, values=values, solved=solved, done=done, total=total))


def _listeners(listeners: object) -> Listeners:
    if callable(listeners):
        return (listeners,)
    functions = listed(("study", "listeners"), listeners, "a function of one event, or a list of them")
    for listener in functions:
        if not callable(listener):
            raise wrong(("study", "listeners"), listener, "a function of one event, or a list of them")
    return functions


def job_for(job: Job, plan: StudyPlan, room: str = "study") -> Job:
    """The computation of a plan: of discs with random blades the largest amplitude of all outputs is sought.

    Raises
    ------
    InputError
        If other peaks are asked for, or the deviations themselves are followed.
    """
    if plan.tuned is None:
        return job
    if job.peaks_of not in (None, LARGEST):
        said = f'method = "{MISTUNED}" locates the largest amplitude of all outputs'
        raise InputError(Fault((room, "peaks_of"), said, remedy='leave it out, or give "largest"'))
    if job.parameter in (MISTUNING, *plan.names):
        said = f"'{job.parameter}' is followed, but method = \"{MISTUNED}\" draws the deviations"
        raise InputError(Fault((room, "parameter"), said, remedy="follow the frequency or another parameter"))
    return replace(job, peaks_of=LARGEST)


def job_of(
    problem_or_case: Any, omega: Any, peaks_of: Any = None, options: Any = None, stability: Any = False
) -> tuple[Job, dict[str, Any]]:
    """What is done for every case, and what the results say about its origin."""
    if hasattr(problem_or_case, "study_job"):
        for name, value in {"omega": omega, "peaks_of": peaks_of, "options": options, "stability": stability}.items():
            if value is not None and value is not False:
                said = "it is given, but the case says what is followed"
                raise InputError(Fault(("study", name), said, remedy="leave it out"))
        return problem_or_case.study_job(), problem_or_case.names
    problem = followed_problem(one(("study", "problem"), problem_or_case, Problem, "an ss.Problem or an ss.Case"))
    if omega is None:
        raise InputError(Fault(("study", "omega"), IS_MISSING, remedy="give frequencies such as omega=(2.0, 15.0)"))
    start, stop = two_frequencies(omega, problem.units)
    faults = range_faults(start, stop)
    if faults:
        raise InputError(faults)
    problem = replace(problem, told=None)
    arguments = curve_arguments(Checks(problem), (), peaks_of, options, (), None, stability)
    wanted = None if peaks_of is None else arguments["peaks_of"]
    job = Job(problem=problem, span=(start, stop), peaks_of=wanted, options=arguments["options"], stability=stability)
    return job, {}
