"""Forced response: branches of steady vibration versus frequency or over any named parameter."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Literal

from slipstick.analysis.curve.follow import CurveRequest, StabilityRequest, frequency_request, parameter_request
from slipstick.analysis.curve.linear import LinearLimit, ends_of, frequencies_of
from slipstick.analysis.curve.steady import steady_request
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.request import response_options
from slipstick.balance.balance import Balance
from slipstick.balance.physics_checks import problem_warnings
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.errors import Fault, Outcome
from slipstick.faults import Gathering, old_names, one, shown, warn, wrong
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.record import Point
from slipstick.solve.continuation import ContinuationOptions
from slipstick.typing import Frequency, FrequencyList, FrequencyRange, Real, Reals

FollowRequest = Literal["subharmonic"] | None
"""The argument ``follow`` of users: further branches to follow."""


@old_names(requested="at")
def forced_response(
    problem: Problem,
    omega: FrequencyRange,
    *,
    at: FrequencyList = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: Reals | None = None,
    stability: StabilityRequest = False,
    follow: FollowRequest = None,
) -> Branch:
    """Follow the steady vibration versus frequency.

    Parameters
    ----------
    problem
        What vibrates.
    omega
        First and last fundamental frequency, rad/s, in either order.
    at
        Frequencies at which exact points are wanted, rad/s; one or a list.
    peaks_of
        Names of output dofs whose amplitude's local maxima are located; by default all of at most 3 outputs, else those
        that are loaded or, without such, of the first contact's tangential direction, and of up to 100 others the
        largest amplitude. The attributes ``peaks_of`` and ``largest_of`` of the results say which. "largest": the
        local maxima of the largest amplitude of all outputs, as of the blades of a disc; ``branch.peaks("largest")``.
    options
        Step control; by default ``response_options()``. A dict of its fields will do: ``{"max_step": 0.01}``.
    listeners
        Called with every event (``slipstick.analysis.events``).
    guess
        Unknowns at the first frequency to try first, (n_ports, L): coefficients of the relative motion of the contacts,
        first all tangential, then all normal ones.
    stability
        Whether every point is judged stable or not, by the Floquet multipliers of its motion (``multiplier``,
        ``stable`` and more in the dataset). "full" keeps all modes in motion; True those up to four times the highest
        harmonic.
    follow
        "subharmonic": where the period doubles, motion of twice the period is followed too, as branches of their own in
        ``branch.subharmonics``.

    Returns
    -------
    Branch
        With everything found, however it ended: look at ``outcome``. A KeyboardInterrupt ends it early.

    Raises
    ------
    InputError
        For a range, dof, frequency, option or guess that cannot be used.

    Warns
    -----
    SlipstickWarning
        For what is suspicious over that range, such as frequencies in Hz or a structure without damping; all of that,
        also in the problem itself, is in ``dataset.attrs["warnings"]``, one sentence a line. Also where the
        harmonics left out would add more than 1 % of the amplitude (``truncation`` in the dataset).

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> pair = ss.ContactPair(
    ...     name="damper", tangential="x", contact=ss.FrictionContact(kt=100.0, mu=0.3, kn=1.0, gap=-800.0),
    ...     rubbing=ss.RubbingMotion(velocity=100.0))
    >>> problem = ss.Problem(structure, contacts=[pair], loads=[ss.Load(dof="x", sin=100.0)], harmonics=range(11))
    >>> branch = forced_response(problem, omega=(2.0, 15.0))
    >>> [(round(w, 2), round(a, 2)) for w, a in branch.peaks("x")]
    [(6.14, 18.25)]
    """
    subharmonics, stability = _follows(follow, stability)
    request = frequency_request(problem, omega, at, peaks_of, options, listeners, guess, stability)
    return _branch(request, options, stability if subharmonics else None)


@old_names(requested="at")
def follow(
    problem: Problem, *, omega: FrequencyRange, at: FrequencyList = (), **arguments: Any
) -> Generator[Point, None, tuple[Outcome, str]]:
    """The points behind ``forced_response``, one by one; the generator's value is the outcome and its message."""
    return (yield from frequency_request(problem, omega, at, **arguments).run().follow())


@old_names(requested="at")
def parameter_response(
    problem: Problem,
    parameter: str,
    span: tuple[Real, Real],
    *,
    omega: Frequency,
    at: FrequencyList = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: Reals | None = None,
    stability: StabilityRequest = False,
    follow: FollowRequest = None,
) -> Branch:
    """Follow the steady vibration at one frequency over a named parameter.

    Parameters
    ----------
    parameter
        Such as "damper.velocity", "damper.normal_load" (at fixed kn), ``"*.mu"`` (all contacts), "rubbing.cos1",
        "load.x.amplitude", "load.x.phase" (rad; "load.x.2.phase" of one harmonic among several), "loss_factor" and
        "damping" of the structure (a factor on its viscous damping), "load", the factor on all loads, and "friction",
        that on all friction coefficients.
    span
        First and last value.
    omega
        Fundamental frequency, rad/s.

    The other arguments, the result and the errors are those of ``forced_response``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> damper = ss.ContactPair(name="damper", contact=law, tangential="x")
    >>> problem = ss.Problem(structure, contacts=damper, loads=ss.Load(dof="x", sin=100.0), harmonics=10)
    >>> branch = ss.parameter_response(problem, "damper.mu", (0.0, 0.3), omega=6.3)
    >>> round(float(branch.dataset.amplitude[0, 0]), 2), round(float(branch.dataset.amplitude[-1, 0]), 2)
    (39.39, 1.0)
    """
    subharmonics, stability = _follows(follow, stability)
    shared = (at, peaks_of, options, listeners, guess, stability)
    request = parameter_request(problem, parameter, span, omega, *shared)
    return _branch(request, options, stability if subharmonics else None)


def steady_response(
    problem: Problem,
    parameter: str | None = None,
    values: Reals | None = None,
    *,
    omega: FrequencyList,
    guess: Branch | Reals | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    stability: StabilityRequest = False,
) -> Branch:
    """Steady vibration at given frequencies, or at given values of a parameter: these points alone.

    Each point is found by itself, from ``guess`` or from nothing: where several motions exist, which one is found does
    not depend on the other points. A curve (``forced_response``) follows one from an end of its range.

    Parameters
    ----------
    problem
        What vibrates.
    parameter, values
        Name of a parameter as of ``parameter_response`` and its values, one or a list. Without, points are those of
        the frequencies.
    omega
        Fundamental frequencies, rad/s, one or a list; one alone with a ``parameter``.
    guess
        What to try first: a branch, of which the point nearest to each one is taken (with its contact states), or
        unknowns as of ``forced_response``, such as ``branch.guess(point)``.
    options, listeners, stability
        As of ``forced_response``.

    Returns
    -------
    Branch
        Points of kind "requested", in the order of the values given. Values at which no motion is found are left out:
        the ``outcome`` is that of the first of them, and ``message`` names them.

    Raises
    ------
    InputError
        For values, a parameter, a guess or an option that cannot be used.

    Warns
    -----
    SlipstickWarning
        As ``forced_response``.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=800.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(11))
    >>> branch = steady_response(problem, omega=[8.0, 9.5])
    >>> branch.dataset.amplitude.values.round(4).tolist()
    [[1.3146], [2.0042]]
    >>> steady_response(problem, "damper.mu", 0.2, omega=9.5).dataset.amplitude.values.round(4).tolist()
    [[2.7585]]
    """
    arguments = locals()
    return Branch.of(steady_request(**arguments).solutions())


def linear_response(problem: Problem, omega: FrequencyList, *, state: str = "free") -> Branch:
    """Linear response at given frequencies, as a reference for the nonlinear one.

    Parameters
    ----------
    omega
        Fundamental frequencies (n,), rad/s.
    state
        "free": without the contacts. "stuck": every friction contact that is closed at rest holds by kt and kn and
        follows the periodic rubbing motion; a constant rubbing velocity has no meaning there and is left out. Other
        laws act with their stiffness at rest.

    Returns
    -------
    Branch
        A dataset of omega, displacement, amplitude and mean; ``peaks`` are the largest among the frequencies given.

    Raises
    ------
    InputError
        For another state, or frequencies that are not positive.

    Warns
    -----
    SlipstickWarning
        As :func:`forced_response`.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> problem = ss.Problem(structure, loads=[ss.Load(dof="x", sin=100.0)], harmonics=[0, 1])
    >>> linear_response(problem, omega=[6.3182]).dataset["amplitude"].values.round(3).tolist()
    [[39.548]]
    """
    checks = Gathering()
    checks.take(one, "problem", problem, Problem, "an ss.Problem")
    w = checks.take(frequencies_of, omega, problem.units if isinstance(problem, Problem) else None)
    if not isinstance(state, str) or state not in ("free", "stuck"):
        checks.faults.append(Fault("state", found=shown(state), expected='"free" or "stuck"'))
    checks.end()
    assert w is not None
    limit = LinearLimit(Balance(problem), state)
    warnings = problem_warnings(problem, ends_of(omega, w), limit.balance.receptance.static)
    problem.warn(warnings)
    return Branch.of(limit.solutions(w, limit.motion(w), warnings))


def _follows(follow: Any, stability: StabilityRequest) -> tuple[bool, StabilityRequest]:
    """Whether to follow branches of twice the period, and the stability that they need."""
    if follow is not None and not (isinstance(follow, str) and follow == "subharmonic"):
        raise wrong("follow", follow, '"subharmonic" or None')
    return follow is not None, True if follow is not None and stability is False else stability


def _branch(request: CurveRequest, options: Any, stability: StabilityRequest | None) -> Branch:
    """The branch of a request; with a ``stability`` also branches of twice the period that start on it."""
    solutions = request.solutions()
    if stability is not None:
        from slipstick.analysis.stability.subharmonics import subharmonics_of

        postprocessing = Postprocessing()
        solutions.subharmonics = postprocessing.attempt(
            "motion of twice the period", partial(subharmonics_of, solutions, options=options, stability=stability), ()
        )
        warn(postprocessing.failures)
    return Branch.of(solutions)


__all__ = [
    "follow", "forced_response", "linear_response", "parameter_response", "response_options", "steady_response"
]  # fmt: skip
