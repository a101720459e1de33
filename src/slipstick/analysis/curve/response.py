"""Forced response: branches of steady vibration over frequency or over any named parameter."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Literal

from numpy.typing import ArrayLike

from slipstick.analysis.curve.follow import CurveRequest
from slipstick.analysis.curve.linear import linear_response
from slipstick.analysis.curve.request import Checks, StabilityRequest, adapted_to, response_options
from slipstick.analysis.events import EventFunction
from slipstick.balance.parameters import parameter_path
from slipstick.balance.preflight import parameter_warnings, problem_warnings
from slipstick.balance.problem import Problem
from slipstick.balance.systems import AnySystem, FrequencySystem, ParameterSystem
from slipstick.errors import Outcome
from slipstick.faults import frequency, warn, wrong
from slipstick.results.besides import Besides
from slipstick.results.branch import Branch
from slipstick.results.record import Point
from slipstick.solve.continuation import ContinuationOptions

FollowRequest = Literal["subharmonic"] | None
"""Which branches are followed besides."""


def forced_response(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
    follow: FollowRequest = None,
) -> Branch:
    """Follow the steady vibration over frequency.

    Parameters
    ----------
    problem
        What vibrates.
    omega
        First and last principal frequency, rad/s, in either order.
    requested
        Frequencies at which exact points are wanted, rad/s; one or a list.
    peaks_of
        Names of output dofs whose amplitude's local maxima are located; by default all of at most 3 outputs, else those
        that are loaded or, without such, of the first contact's tangential direction, and of up to 100 others the
        largest amplitude. The attributes ``peaks_of`` and ``largest_of`` of the results say which.
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
        For what looks wrong over that range, such as frequencies in Hz or a structure without damping; all that looks
        wrong, also in the problem itself, is in ``dataset.attrs["warnings"]``, one sentence a line. Also where the
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
    branch = frequency_request(problem, omega, requested, peaks_of, options, listeners, guess, stability).branch()
    return _with_subharmonics(branch, options, stability) if subharmonics else branch


def follow(
    problem: Problem,
    *,
    omega: tuple[float, float],
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
) -> Generator[Point, None, tuple[Outcome, str]]:
    """The points behind ``forced_response``, one by one; the generator's value is the outcome and its message."""
    request = frequency_request(problem, omega, requested, peaks_of, options, listeners, guess, stability)
    return (yield from request.run().follow())


def parameter_response(
    problem: Problem,
    parameter: str,
    span: tuple[float, float],
    *,
    omega: float,
    requested: Iterable[float] | float = (),
    peaks_of: Sequence[str] | str | None = None,
    options: ContinuationOptions | Mapping[str, Any] | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
    guess: ArrayLike | None = None,
    stability: StabilityRequest = False,
    follow: FollowRequest = None,
) -> Branch:
    """Follow the steady vibration at one frequency over a named parameter.

    Parameters
    ----------
    parameter
        Such as "damper.velocity", "damper.normal_load" (at fixed kn), ``"*.mu"`` (all contacts), "rubbing.cos1",
        "load.x.amplitude", "load.x.phase" (rad; "load.x.2.phase" of one harmonic among several), "loss_factor" and
        "damping" of the structure (a factor on its viscous damping), and the factors "load" and "friction".
    span
        First and last value.
    omega
        Principal frequency, rad/s.

    The other arguments, the result and the errors are those of ``forced_response``.
    """
    subharmonics, stability = _follows(follow, stability)
    given = (requested, peaks_of, options, listeners, guess, stability)
    branch = parameter_request(problem, parameter, span, omega, *given).branch()
    return _with_subharmonics(branch, options, stability) if subharmonics else branch


def frequency_request(problem: Problem, omega: tuple[float, float], requested: Any = (), *given: Any) -> CurveRequest:
    """What ``forced_response`` follows; its arguments in their order."""
    checks = Checks(problem)
    ends, points = checks.range(omega, requested, "frequency range", positive=True)
    common = checks.common(points, *given)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, "", None, ends, common)


def parameter_request(
    problem: Problem, parameter: str, span: tuple[float, float], omega: float, requested: Any = (), *given: Any
) -> CurveRequest:
    """What ``parameter_response`` follows; its arguments in their order."""
    checks = Checks(problem)
    parameter = checks.name(parameter)
    at = checks.take(frequency, "omega", omega)
    ends, points = checks.range(span, requested, f"range of {parameter}" if parameter else "range", positive=False)
    checks.takes(parameter, ends)
    common = checks.common(points, *given)
    assert checks.problem is not None
    assert ends is not None
    return curve_over(checks.problem, parameter, at, ends, common)


def curve_over(
    problem: Problem, parameter: str, omega: float | None, ends: tuple[float, float], common: Mapping[str, Any]
) -> CurveRequest:
    """A curve over a parameter at a frequency, or over the frequency; of what was checked already."""
    balance, start, static = common["balance"], ends[0], common["balance"].receptance.static
    if not parameter:
        balance.anchor_if_undamped(start)
        return CurveRequest(
            problem=problem, system=_harmonics_by_need(FrequencySystem(balance, problem.inputs), common["options"]),
            inputs=problem.inputs, omega=start, start=start, stop=ends[1],
            warnings=problem_warnings(problem, ends, static), **common,
        )  # fmt: skip
    assert omega is not None
    path = parameter_path(problem, parameter)
    system = _harmonics_by_need(ParameterSystem(balance, path, omega), common["options"], parameter)
    return CurveRequest(
        problem=problem, system=system, inputs=path.at(start)[0], omega=omega, start=start, stop=ends[1],
        parameter=parameter, warnings=parameter_warnings(problem, parameter, ends, omega, static), **common,
    )  # fmt: skip


def _harmonics_by_need(system: AnySystem, options: ContinuationOptions, parameter: str = "") -> AnySystem:
    """The system as it is, or with harmonics by need where that is asked for."""
    tolerance = adapted_to(options)
    if tolerance is None:
        return system
    from slipstick.analysis.curve.harmonic_selection import adapted

    return adapted(system, tolerance, parameter)


def _follows(given: Any, stability: StabilityRequest) -> tuple[bool, StabilityRequest]:
    """Whether branches of twice the period are asked for, which need stability."""
    if given is not None and not (isinstance(given, str) and given == "subharmonic"):
        raise wrong("follow", given, '"subharmonic" or None')
    return given is not None, True if given is not None and stability is False else stability


def _with_subharmonics(branch: Branch, options: Any, stability: StabilityRequest) -> Branch:
    """The branch with those of twice the period that begin on it."""
    from slipstick.analysis.stability.subharmonics import subharmonics_of

    besides = Besides()
    branch.subharmonics = besides.take(
        "motion of twice the period", partial(subharmonics_of, branch, options=options, stability=stability), ()
    )
    warn(besides.sentences)
    return branch


__all__ = ["follow", "forced_response", "linear_response", "parameter_response", "response_options"]
