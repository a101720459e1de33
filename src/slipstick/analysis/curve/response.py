"""Forced response: branches of steady vibration versus frequency or over any named parameter."""

from __future__ import annotations

from collections.abc import Generator, Iterable, Mapping, Sequence
from functools import partial
from typing import Any, Literal

from slipstick.analysis.curve.follow import frequency_request, parameter_request
from slipstick.analysis.curve.linear import linear_response
from slipstick.analysis.curve.request import StabilityRequest
from slipstick.analysis.road.events import EventFunction
from slipstick.analysis.road.options import response_options
from slipstick.balance.problem import Problem
from slipstick.branch import Branch
from slipstick.errors import Outcome
from slipstick.faults import warn, wrong
from slipstick.results.postprocessing import Postprocessing
from slipstick.results.record import Point
from slipstick.solve.continuation import ContinuationOptions
from slipstick.typing import Frequency, FrequencyList, FrequencyRange, Real, Reals

FollowRequest = Literal["subharmonic"] | None
"""Which branches are followed besides."""


def forced_response(
    problem: Problem,
    omega: FrequencyRange,
    *,
    requested: FrequencyList = (),
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
    requested
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
    branch = frequency_request(problem, omega, requested, peaks_of, options, listeners, guess, stability).branch()
    return _with_subharmonics(branch, options, stability) if subharmonics else branch


def follow(
    problem: Problem, *, omega: FrequencyRange, requested: FrequencyList = (), **arguments: Any
) -> Generator[Point, None, tuple[Outcome, str]]:
    """The points behind ``forced_response``, one by one; the generator's value is the outcome and its message."""
    return (yield from frequency_request(problem, omega, requested, **arguments).run().follow())


def parameter_response(
    problem: Problem,
    parameter: str,
    span: tuple[Real, Real],
    *,
    omega: Frequency,
    requested: FrequencyList = (),
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
        "damping" of the structure (a factor on its viscous damping), and the factors "load" and "friction".
    span
        First and last value.
    omega
        Fundamental frequency, rad/s.

    The other arguments, the result and the errors are those of ``forced_response``.
    """
    subharmonics, stability = _follows(follow, stability)
    shared = (requested, peaks_of, options, listeners, guess, stability)
    branch = parameter_request(problem, parameter, span, omega, *shared).branch()
    return _with_subharmonics(branch, options, stability) if subharmonics else branch


def _follows(follow: Any, stability: StabilityRequest) -> tuple[bool, StabilityRequest]:
    """Whether branches of twice the period are asked for, which need stability."""
    if follow is not None and not (isinstance(follow, str) and follow == "subharmonic"):
        raise wrong("follow", follow, '"subharmonic" or None')
    return follow is not None, True if follow is not None and stability is False else stability


def _with_subharmonics(branch: Branch, options: Any, stability: StabilityRequest) -> Branch:
    """The branch with those of twice the period that begin on it."""
    from slipstick.analysis.stability.subharmonics import subharmonics_of

    postprocessing = Postprocessing()
    branch.subharmonics = postprocessing.attempt(
        "motion of twice the period", partial(subharmonics_of, branch, options=options, stability=stability), ()
    )
    warn(postprocessing.failures)
    return branch


__all__ = ["follow", "forced_response", "linear_response", "parameter_response", "response_options"]
