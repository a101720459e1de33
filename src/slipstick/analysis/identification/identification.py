"""Parameters of contacts, loads and structures that fit what was measured, and how sure they are.

Least squares (``scipy.optimize.least_squares``: trust regions within bounds) with exact Jacobians. Of the weighted
Jacobian ``J`` at the end, columns times the parameters' values, the singular values say what the measurement tells
apart; covariance of the parameters is ``s^2 (J^T J)^-1`` (G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989,
section 2.1).

Where the noise is not given, weights come from the residuals (``noise.py``), and numbers are weighted again by the
noise of the fit until both stay: iteratively reweighted least squares (the same book, section 2.8).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from slipstick.analysis.curve.request import followed_problem, heard_by
from slipstick.analysis.events import EventFunction, Working
from slipstick.analysis.identification.decays import decay_of
from slipstick.analysis.identification.kinds import Backbone, Measured
from slipstick.analysis.identification.measured import dataset_of, parameter_starts, read_measured
from slipstick.analysis.identification.mistakes import Change, Scaled, changes, factor_text, round_factors
from slipstick.analysis.identification.noise import (
    Noise,
    Without,
    error_text,
    found_noise,
    given_noise,
    listed,
    neighbours,
    robust,
    too_large,
    whiteness,
    without_levels,
)
from slipstick.analysis.identification.predicted import Predictor, predictor_of
from slipstick.balance.parameters import parameter_units, product_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError, SlipstickError
from slipstick.faults import Gathering, number, numbers, shown, suggestion, warn, whole, wrong
from slipstick.results.saved_table import write_table
from slipstick.results.schema import ANALYSIS, versions
from slipstick.results.sensitivities import direction_of
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

_TOLERANCE = {"xtol": 1e-13, "ftol": 1e-15, "gtol": 1e-15}
_TOLERANCE_IN_TIME = {"xtol": 1e-8, "ftol": 1e-10, "gtol": 1e-12}
"""Of motions that are integrated."""
_MOST, _MOST_IN_TIME = 200, 30
"""Evaluations of one descent."""
_CHOICES = 5
"""Descents, each with the motions nearest to what was measured at the parameters of the one before."""
_FAR = 0.1
"""Misfit above which a fit ended far from what was measured."""
_ROUNDING = 1e-6
"""Misfit below which what is left is that of the solution, no noise."""
_LEAST_NOISE = 2e-4
"""Misfit below which weights are not taken from what is left: it is rather what the model and its harmonics lack."""
_TRIED, _FURTHER, _WIDE = 16, 3, 10.0
"""Where it ended far away so many other starts are compared, within this factor of the start where there are no bounds,
and the parameters fitted from so many of them."""
_LIKELY = 4
"""Mistakes of the measured numbers that are tried, the likeliest ones."""
_MOST_SOUGHT = 40
"""Evaluations of one descent meanwhile."""
_WEIGHTED = 8
"""Times that numbers are weighted by the noise of the fit before, at most."""
_SAME_NOISE = 1e-2
"""Relative change of the noise at which the weights stay."""
_ENOUGH, _EXACT = 1.0 / 3.0, 1.0 / 8.0
"""Share of the misfit below which a mistake is the reason for it; one with a factor that is not round."""
_INDISTINCT = 1e-7
"""Singular value over the largest below which a combination of parameters changes nothing."""
_IN_NOISE = 0.5
"""Relative standard deviation of a combination above which it is lost in the noise."""
_TAKES_PART = 0.05
"""Share of the largest from which a parameter belongs to a combination."""


@dataclass(frozen=True, kw_only=True)
class Identification:
    """Parameters that fit what was measured.

    Attributes
    ----------
    values
        By the names of the parameters.
    standard_errors
        Alike; inf of what the measurement does not determine, nan at a bound, and nan where they are ``refused``.
    correlations
        Of the errors, (parameter, other); nan where one of them is not determined.
    singular_values
        Of the Jacobian of the weighted numbers by relative changes of the parameters, the largest first.
    indistinct
        What cannot be separated, one sentence each.
    warnings
        All that the fit warned of, one sentence each, with those of ``indistinct``.
    refused
        Why there are no standard errors; empty where there are.
    misfit
        Root mean square of what is left, over that of what was measured.
    noise
        Standard deviation of one measured number: the one that was given (their root mean square), else estimated from
        what is left.
    relative_noise
        Share of what was measured that the noise is, given or found; nan where it does not grow with that.
    weights
        What noise the numbers were weighted by, in words; empty where it is equal or the one given for each.
    without_level
        How the parameters move where one of the conditions that were set is left out, to first order: by the condition
        in words, then by the name of the parameter; nan of what the others do not determine.
    reduced_chi_square
        Sum of the squares left over the noise, for each degree of freedom: near 1 where model and noise are right; nan
        where no noise was given.
    at_bound
        Names of parameters that ended at a bound.
    several
        Points at which more than one motion is possible; the nearest to what was measured was taken.
    converged
        Whether the fit ended well: at a minimum, and near what was measured.
    message
        How it ended, in words.
    problem
        With the parameters that fit.
    dataset
        Measured and fitted numbers, values, errors, correlations and all else that is here.
    evaluations
        Residuals that were asked for.
    solutions
        Motions that were solved for.
    starts
        Sum of squares that each start led to, the one of the result first, before numbers were weighted by noise found.
    """

    values: Mapping[str, float]
    standard_errors: Mapping[str, float]
    correlations: Array
    singular_values: Array
    indistinct: tuple[str, ...]
    warnings: tuple[str, ...]
    refused: str
    at_bound: tuple[str, ...]
    misfit: float
    noise: float
    relative_noise: float
    weights: str
    without_level: Mapping[str, Mapping[str, float]]
    reduced_chi_square: float
    degrees_of_freedom: int
    several: int
    converged: bool
    message: str
    problem: Problem
    dataset: xarray.Dataset
    evaluations: int
    solutions: int
    starts: tuple[float, ...]

    def interval(self, name: str, level: float = 0.9) -> tuple[float, float]:
        """Confidence interval of a parameter, of Student's t where the noise was estimated."""
        from scipy.stats import norm, t

        if name not in self.values:
            raise InputError(
                Fault("name", f"there is no parameter {shown(name)}", remedy=suggestion(name, self.values))
            )
        level = number("level", level, "a number between 0 and 1", above=0.0)
        if not 0.0 < level < 1.0:
            raise wrong("level", level, "a number between 0 and 1")
        known = np.isfinite(self.reduced_chi_square)
        quantile = norm.ppf(0.5 + level / 2) if known else t.ppf(0.5 + level / 2, max(self.degrees_of_freedom, 1))
        half = float(quantile) * self.standard_errors[name]
        return self.values[name] - half, self.values[name] + half

    def save_table(self, path: str | Path, table: str | None = None) -> Path:
        """Write the dataset for other programs and return the path: a .csv file, one table, or a .mat file, all of it.

        ``table`` chooses: "parameter" (of a .csv file by default: values, standard errors, correlations), "point"
        (measured and fitted numbers) or "rank" (singular values).

        Raises
        ------
        InputError
            For another ending or table, and where the file cannot be written.
        """
        return write_table(self.dataset, path, table)

    def summary(self) -> str:
        """All of it as a text."""
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        yield f"{self.message}; misfit {self.misfit:.3g} of what was measured, noise {self.noise:.3g}"
        if np.isfinite(self.reduced_chi_square):
            yield f"reduced chi square {self.reduced_chi_square:.3g}, {self.degrees_of_freedom} degrees of freedom"
        wide = max(map(len, self.values))
        for name, value in self.values.items():
            error, unit = self.standard_errors[name], parameter_units(self.problem, name)
            label = "" if unit == "1" else f"  {self.problem.units.label(unit)}"
            said = error_text(error, at_bound=name in self.at_bound)
            yield f"  {name:<{wide}}  {value:<12.8g} {said}{label}"
        names = list(self.values)
        for i, j in zip(*np.triu_indices(len(names), 1), strict=True):
            if abs(self.correlations[i, j]) > 0.9:
                yield f"  errors of {names[i]} and {names[j]} are correlated: {self.correlations[i, j]:.3f}"
        if self.weights:
            yield self.weights
        yield from self.warnings
        if self.several:
            yield f"{self.several} points have more than one motion: the one nearest to what was measured was taken"

    def __repr__(self) -> str:
        said = ", ".join(f"{name}={value:.6g}" for name, value in self.values.items())
        return f"Identification({said}; misfit {self.misfit:.3g})"


def identify(
    problem: Problem,
    measured: Any,
    parameters: Mapping[str, float] | Sequence[str] | str,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    noise: float | None = None,
    relative_noise: float | None = None,
    starts: int = 1,
    seed: int = 0,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Identification:
    """Fit named parameters to what was measured: frequency responses, loops, backbones, time series.

    Parameters
    ----------
    problem
        What vibrates; parameters that are not sought have its values.
    measured
        An ``xarray.Dataset``, or the path of a .nc or .csv file, with one of:

        - ``displacement(omega, dof, coefficient)``, coefficients labelled "0", "c1", "s1", ...: those measured.
          Complex numbers ``z(omega, dof)``, of ``Re(z e^{i tau})``, will do, with a dimension ``harmonic`` for others
          than the first;
        - ``amplitude(omega, dof)``: the largest ``|x - mean|`` of the period;
        - ``force(loop, tau)`` and ``displacement(loop, tau)`` of one contact over a period, as ``Branch.loop`` has
          them, with ``normal_displacement`` where it has a normal direction, and ``omega(loop)`` where it rubs. Loops
          are compared by their coefficients at the problem's harmonics; without a rubbing velocity their mean is left
          out. The contact's name is the attribute "contact".

        ``omega`` is in rad/s, or in what its attribute "units" says ("Hz", "rpm"). A dimension or variable called as a
        parameter is what was set at each point: ``displacement(load, omega, dof, coefficient)`` was measured at several
        levels of the load, "load.x.amplitude" likewise. Points may also lie along one dimension ``point``: the dataset
        of a branch will do. nan is what was not measured; a complex number, or the pair "c1", "s1", is missing where
        either part is. A variable ``noise`` has the standard deviations of the
        numbers: each is weighted by one over it.

        - ``peak_omega`` and ``peak_amplitude`` of one dof (either may be missing): where the response peaks, over what
          was set, such as ``load``;
        - ``omega`` and ``modal_damping`` (either may be missing) over ``modal_amplitude``, of harmonic 1 at one dof: a
          nonlinear mode, of the number ``mode``;
        - ``displacement(time, dof)`` with ``omega``: a steady vibration, whose last periods are taken (t = 0 is that of
          the loads), with ``force(time)`` too a loop; without ``omega`` a free decay. It gives the frequency and the
          damping of the nonlinear mode ``mode`` over its amplitude; from the values that fit these, the motion itself
          is fitted in time, from an initial state that is found along, where the contacts' laws tell a rate and have
          no states, and the state has 24 numbers at most.

        The two numbers of a backbone are each compared by their own size; their noise is in ``peak_omega_noise`` and
        ``peak_amplitude_noise``, ``omega_noise`` and ``modal_damping_noise``.

        The columns of a .csv file are ``omega`` (or ``frequency``, Hz), names of dofs for amplitudes ("x"), or with a
        coefficient ("x.c1"), and parameters; or ``loop``, ``displacement``, ``force``; or ``peak_omega`` (or
        ``peak_frequency``, Hz), ``modal_amplitude`` and the others; or ``time``, s, with names of dofs.
    parameters
        Values to begin at by names as of ``parameter_response``; names alone begin at the problem's values.
    bounds
        Lowest and highest value by name; what cannot be negative is not, without.
    noise
        Standard deviation of every measured number (of a backbone over the size of the quantity, of a decay that is
        fitted in time of a displacement); by default the dataset's, else it is estimated from what is left.
    relative_noise
        Noise as a share of each measured number, such as 0.01, beside ``noise`` or alone: of a complex number or pair
        the root mean square of its error over its modulus, of other numbers the standard deviation over their size.
        Where neither is known, noise that grows with what is measured is found from what is left.
    starts
        How many starts: the one given, and others spread over the bounds, which all parameters need then. The best end
        is the result. Where it is further than 10 % from what was measured, 16 other starts are compared, spread over
        the bounds or within a factor of 10 of the start given, and the fit is repeated from up to 3 of them.
    seed
        Of the spread.
    listeners
        Told of each evaluation: ``listeners=ss.Progress()``.

    Returns
    -------
    Identification
        With values, standard errors, correlations, and what the measurement cannot separate.

    Jacobians are exact; those of nonlinear modes take derivatives of the residual by parameters as differences, those
    of decays that are fitted in time are differences of motions.

    Where several motions are possible at one frequency, as beyond a fold, the curve is followed and the motion nearest
    to what was measured is meant. The choice is made again at the parameters found, until it stays.

    Raises
    ------
    InputError
        For measurements that do not fit the problem, unknown or overlapping parameters, a start outside its bounds, and
        where no motion is found at the start.

    Warns
    -----
    SlipstickWarning
        For parameters that the problem itself makes one, and for what cannot be separated; for a fit that ends further
        than 10 % from what was measured, with the mistake that would explain it; for residuals that are no noise, and
        for numbers that are left out. ``warnings`` of the result has the sentences.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> damper = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=300.0)
    >>> problem = ss.Problem(structure, contacts=ss.ContactPair(name="damper", tangential="x", contact=damper),
    ...                      loads=ss.Load(dof="x", sin=100.0), harmonics=range(6))
    >>> measured = ss.steady_response(problem, omega=[6.0, 8.0, 9.0, 10.0]).dataset
    >>> fit = identify(problem, measured, {"damper.kt": 70.0, "damper.mu": 0.4})
    >>> {name: round(value, 8) for name, value in fit.values.items()}
    {'damper.kt': 100.0, 'damper.mu': 0.3}
    """
    request = _request(problem, measured, parameters, bounds, noise, relative_noise, starts, seed, listeners)
    told = [*product_warnings(problem, request.names), *request.measured.notes]
    in_time = _in_time(request, measured, noise)
    request = request if in_time is None else replace(request, noise=None, relative=None, absolute=None)
    ends = [_Descent(request, start, place=k).run() for k, start in enumerate(request.starts)]
    best = min(ends, key=lambda end: end.cost)
    direct = None if in_time is None else _fitted_in_time(in_time, best)
    if direct is not None and direct.misfit < 2.0 * _FAR:
        assert in_time is not None
        request, best, ends = in_time, direct, [direct]
    elif in_time is not None and np.isfinite(best.cost):
        told.append("the decay itself is not fitted: its model does not follow it from any initial state near by; the "
                    "values are those of the nonlinear mode")  # fmt: skip
    compared: list[_Tried] = []
    if best.misfit > _FAR and not _explained(request, best) and not request.measured.in_time:
        compared = _compared(request)
        further, sentence = _further(request, best, compared)
        ends += further
        told.append(sentence)
        best = min(ends, key=lambda end: end.cost)
    if not np.isfinite(best.cost):
        raise InputError(
            Fault(
                "parameters", "no motion was found at some of the measured frequencies",
                remedy="start from other values, such as larger damping or smaller friction, and see forced_response",
            )
        )  # fmt: skip
    costs = sorted(end.cost for end in ends)
    request, best, weights = _weighted(request, best)
    if compared and best.misfit > _FAR and not _explained(request, best):
        told += _mistakes(request, best, compared)
    found = _result(request, best, costs, weights, told)
    warn([*found.warnings, *([] if found.converged else [found.message])])
    return found


@dataclass(frozen=True, kw_only=True)
class _Request:
    """What is sought, checked."""

    problem: Problem
    measured: Measured
    names: tuple[str, ...]
    starts: tuple[Array, ...]
    low: Array
    high: Array
    noise: Array | None
    """Of the shape of what was measured."""
    relative: float | None = None
    """Share of each number that the noise is, beside ``absolute``, where it was given."""
    absolute: Array | None = None
    found: bool = False
    """Whether ``noise`` was found from what is left."""
    listeners: tuple[EventFunction, ...] = ()

    def tell(self, place: int | None, evaluations: int) -> None:
        """Tell all who listen of an evaluation on the way from one of the starts; None: from the end of another."""
        count = len(self.starts)
        doing = "fitting again" if place is None else f"fitting from start {place + 1} of {count}"
        event = Working(
            doing=doing, points=0, evaluations=evaluations, progress=1.0 if place is None else place / count
        )
        for listener in self.listeners:
            listener(event)

    @property
    def known(self) -> bool:
        """Whether the noise was given."""
        return self.noise is not None and not self.found

    @cached_property
    def used(self) -> NDArray[np.bool_]:
        """Which numbers are fitted."""
        used = np.isfinite(self.measured.values)
        return np.asarray(used if self.noise is None else used & np.isfinite(self.noise))

    @cached_property
    def data(self) -> Array:
        """The numbers that are fitted, (m,)."""
        return np.asarray(self.measured.values[self.used])

    @cached_property
    def scale(self) -> Array:
        """What each of them is divided by: its noise, else the size of them all."""
        if self.noise is not None:
            return np.asarray(self.noise[self.used])
        return self.measured.scale(self.used)

    @property
    def most(self) -> int:
        """Evaluations of one descent; those of motions that are integrated take seconds."""
        return _MOST_IN_TIME if self.measured.in_time else _MOST

    def left(self, predicted: Array) -> Array:
        """Predicted less measured over the noise."""
        return np.asarray((predicted[self.used] - self.data) / self.scale)

    def misfit(self, left: Array) -> float:
        """Root mean square of weighted residuals without their weights, over that of what was measured."""
        sizes = self.measured.sizes[self.used]  # frequencies and amplitudes, each by its own size
        wrong, size = left * self.scale / sizes, self.data / sizes
        return float(np.sqrt(np.mean(wrong**2))) / (float(np.sqrt(np.mean(size**2))) or 1.0)

    def predictor(self) -> Predictor:
        """A fresh one."""
        return predictor_of(self.problem, self.names, self.measured)


def _fitted_in_time(request: _Request, of_mode: _End) -> _End:
    """From the values that fit the nonlinear mode, and those given of what that does not determine."""
    start = request.starts[0]
    if np.isfinite(of_mode.cost):
        spread = float(np.sqrt(of_mode.cost / max(of_mode.left.size - start.size, 1)))
        errors = _statistics(request.names, of_mode, spread).errors
        start = np.where(errors < _IN_NOISE * np.abs(of_mode.p), of_mode.p, start)
    return _Descent(request, start).run()


def _in_time(request: _Request, measured: Any, noise: float | None) -> _Request | None:
    """What is sought in the time series of a free decay; None for all else, and where it is not simulated."""
    mode = request.measured
    if not isinstance(mode, Backbone) or mode.kind != "mode":
        return None
    data = dataset_of(request.problem, measured)
    if "time" not in data.variables:
        return None
    decay = decay_of(request.problem, data, mode.dof, float(mode.omega[0]))
    if decay is None:
        return None
    spread = decay.noise if noise is None else np.full(decay.values.shape, float(noise))
    if request.relative is not None:  # a displacement that passes zero has the noise of the others
        share = request.relative * float(np.sqrt(np.nanmean(decay.values**2)))
        spread = np.full(decay.values.shape, share) if spread is None else np.hypot(spread, share)
    return replace(request, measured=decay, noise=spread, relative=None, absolute=None)


def _request(
    problem: Any,
    measured: Any,
    parameters: Any,
    bounds: Any,
    noise: Any,
    relative: Any,
    starts: Any,
    seed: Any,
    listeners: Any = (),
) -> _Request:
    problem = followed_problem(problem)
    values = parameter_starts(problem, parameters)
    names, checks = tuple(values), Gathering()
    table = checks.take(read_measured, problem, measured)
    checks.take(_independent, problem, names)
    low, high = checks.take(_bounds, problem, bounds, values) or (np.empty(0), np.empty(0))
    heard = checks.take(heard_by, listeners)
    count, seed = checks.take(whole, "starts", starts, 1, 10_000), checks.take(whole, "seed", seed)
    if noise is not None:
        noise = checks.take(number, "noise", noise, "a standard deviation > 0", above=0.0)
        if noise == 0.0:
            checks.faults.append(Fault("noise", "0", expected="a standard deviation > 0"))
    if relative is not None:
        relative = checks.take(number, "relative_noise", relative, "a share > 0 such as 0.01", above=0.0)
        if relative is not None and not 0.0 < relative < 1.0:
            remedy = "for 1 % give 0.01" if relative >= 1.0 else ""
            checks.faults.append(
                Fault("relative_noise", f"{relative:g}", expected="a share between 0 and 1", remedy=remedy)
            )
    if count is not None and count > 1 and low.size and not np.all(np.isfinite([low, high])):
        unbound = [name for name, a, b in zip(names, low, high, strict=True) if not np.isfinite(b - a)]
        checks.faults.append(
            Fault("bounds", f"{', '.join(unbound)} has none", expected="bounds of all where there are several starts")
        )  # fmt: skip
    if table is not None:
        for name in set(names) & set(table.conditions):
            checks.faults.append(
                Fault(
                    ("parameters", name), "is measured too: it was set at every point",
                    remedy="leave it out of one of them",
                )
            )  # fmt: skip
    checks.end()
    assert table is not None
    spread = table.noise
    if noise is not None:
        spread = np.full(table.values.shape, noise) * table.sizes
    if spread is not None and np.any(spread[np.isfinite(spread)] <= 0.0):
        raise InputError(Fault(("measured", "noise"), "0 or less", expected="standard deviations > 0"))
    absolute = spread
    if relative is not None:
        spread = given_noise(table, np.nan_to_num(table.values), absolute, relative).deviations
    request = _Request(
        problem=problem, measured=table, names=names, low=low, high=high, noise=spread, relative=relative,
        absolute=absolute,
        starts=tuple(_starts(np.array(list(values.values())), low, high, count or 1, seed or 0)),
        listeners=heard or (),
    )  # fmt: skip
    if request.data.size < len(names):
        few = f"{request.data.size} numbers"
        raise InputError(Fault("measured", few, expected=f"at least {len(names)}, one for each parameter"))
    return request


def _starts(first: Array, low: Array, high: Array, count: int, seed: int) -> Iterator[Array]:
    """The start given, then others spread over the bounds, over their logarithm where these are > 0."""
    from scipy.stats import qmc

    yield first
    if count > 1:
        decades = low > 0.0
        a, b = (np.where(decades, np.log(np.where(decades, side, 1.0)), side) for side in (low, high))
        for share in qmc.Halton(len(first), seed=seed).random(count - 1):
            at = a + share * (b - a)
            yield np.where(decades, np.exp(np.where(decades, at, 0.0)), at)


def _bounds(problem: Problem, bounds: Any, values: Mapping[str, float]) -> tuple[Array, Array]:
    given = {} if bounds is None else bounds
    if not isinstance(given, Mapping):
        raise wrong("bounds", bounds, 'lowest and highest values by name such as {"damper.mu": (0.05, 1.0)}')
    checks = Gathering()
    for name in given:
        if name not in values:
            known = f"{shown(name)} is not among the parameters"
            checks.faults.append(Fault("bounds", known, remedy=suggestion(str(name), list(values))))
    low, high = [], []
    for name, value in values.items():
        ends = given.get(name)
        if ends is None:
            low.append(0.0 if value > 0.0 and not _may_be(problem, name, -value) else -np.inf)
            high.append(np.inf)
            continue
        pair = checks.take(numbers, ("bounds", name), ends, "two numbers, the lowest and the highest")
        if pair is None:
            pair = np.array([-np.inf, np.inf])
        elif pair.shape != (2,) or not pair[0] < pair[1]:
            checks.faults.append(Fault(("bounds", name), shown(ends), expected="two numbers, the lowest first"))
            pair = np.array([-np.inf, np.inf])
        elif not pair[0] <= value <= pair[1]:
            checks.faults.append(
                Fault(("parameters", name), f"{value:g}", expected=f"a start within its bounds {pair}")
            )
        low.append(float(pair[0]))
        high.append(float(pair[1]))
    checks.end()
    return np.array(low), np.array(high)


def _may_be(problem: Problem, name: str, value: float) -> bool:
    try:
        problem.at_parameter(name, value)
    except InputError:
        return False
    return True


_MOVED = 1.01


def _independent(problem: Problem, names: Sequence[str]) -> None:
    """InputError where one of the parameters moves another, as a normal stiffness does the load at a fixed gap."""
    checks = Gathering()
    for name in names:
        checks.inside((name,), direction_of, problem, name)
        value = problem.parameter(name)
        moved = problem.at_parameter(name, _MOVED * value if value else 1.0)
        for other in names:
            before = problem.parameter(other)
            if other != name and abs(moved.parameter(other) - before) > 1e-9 * abs(before):
                remedy = "seek one of them" if name[-3:] != ".kn" else "seek the gap instead of the load"
                checks.faults.append(Fault((name,), f"moves {other} too", expected="independent ones", remedy=remedy))
    checks.end("parameters")


class _End(NamedTuple):
    """Where a descent ended."""

    p: Array
    cost: float
    left: Array
    """Weighted residuals (m,)."""
    J: Array
    """Their derivatives by the parameters (m, n_p)."""
    at_bound: NDArray[np.bool_]
    converged: bool
    predicted: Array
    evaluations: int
    predictor: Predictor
    misfit: float
    """Root mean square of what is left over that of what was measured."""


class _Descent:
    """Least squares from one start."""

    def __init__(
        self,
        request: _Request,
        start: Array,
        predictor: Predictor | None = None,
        *,
        most: int | None = None,
        place: int | None = None,
    ) -> None:
        self.place = place
        self.request, self.start, self.predictor = request, start, predictor or request.predictor()
        self.most = most or request.most
        self.unit = np.where(start != 0.0, np.abs(start), 1.0)
        self.evaluations = 0
        self._asked: tuple[Array, Array] | None = None

    def run(self) -> _End:
        """To the end, with the motions meant chosen again until they stay.

        Where that ends badly, at the start some motion was perhaps not among those possible: points far from what was
        measured are given less weight until the others have found the parameters at which it is.
        """
        best = self._chosen(self.start)
        if best.misfit > 2.0 * _FAR and not self.request.measured.in_time:
            far = self.request.predictor()
            other = _Descent(self.request, self.start, far, place=self.place)
            near = other._chosen(self.start, loss="cauchy")
            if np.isfinite(near.cost):
                near = other._chosen(near.p)
                near = near._replace(evaluations=best.evaluations + near.evaluations)
                best = min(best, near, key=lambda end: end.cost)
        return best

    def _chosen(self, p: Array, loss: str = "linear") -> _End:
        best = None
        for _ in range(_CHOICES):
            if not self.predictor.begin(p) and best is not None:
                break
            end = self._descend(p, loss)
            if best is not None and loss == "linear" and not end.cost < best.cost * (1.0 - 1e-9):
                break
            best, p = end, end.p
            if not np.isfinite(end.cost):
                break
        assert best is not None
        return best

    def _descend(self, start: Array, loss: str) -> _End:
        from scipy.optimize import least_squares

        request, unit = self.request, self.unit
        first = self._left(start / unit)
        if not np.all(np.isfinite(first)):
            empty = np.full((first.size, start.size), np.nan)
            none = np.zeros(start.size, dtype=bool)
            return _End(
                p=start, cost=np.inf, left=first, J=empty, at_bound=none, converged=False,
                predicted=request.measured.values, evaluations=self.evaluations, predictor=self.predictor,
                misfit=np.inf,
            )  # fmt: skip
        found = least_squares(
            self._left, start / unit, jac=self._slopes, bounds=(request.low / unit, request.high / unit),
            max_nfev=self.most, loss=loss, f_scale=max(float(np.median(np.abs(first))), 1e-9),
            **(_TOLERANCE_IN_TIME if request.measured.in_time else _TOLERANCE),
        )  # fmt: skip
        left, J = self._left(found.x), self._slopes(found.x)
        assert self._asked is not None
        return _End(
            p=found.x * unit, cost=float(left @ left), left=left, J=J / unit, at_bound=found.active_mask != 0,
            converged=found.status > 0, predicted=self._asked[1], evaluations=self.evaluations,
            predictor=self.predictor, misfit=request.misfit(left),
        )  # fmt: skip

    def _left(self, z: Array) -> Array:
        """Predicted less measured over the noise; nan where there is no motion, so that a smaller step is taken."""
        request = self.request
        if self._asked is None or not np.array_equal(self._asked[0], z):
            self.evaluations += 1
            request.tell(self.place, self.evaluations)
            try:
                predicted = self.predictor.values(z * self.unit)
            except InputError:  # values that the problem cannot have
                predicted = np.full(request.measured.values.shape, np.nan)
            self._asked = z.copy(), predicted
        return request.left(self._asked[1])

    def _slopes(self, z: Array) -> Array:
        self._left(z)
        rates = self.predictor.slopes(z * self.unit)[:, self.request.used]
        return np.asarray((rates / self.request.scale).T * self.unit)


def _explained(request: _Request, end: _End) -> bool:
    """Whether the noise that was given explains all that is left."""
    freedom = end.left.size - len(request.names)
    return request.known and freedom > 0 and not too_large(end.cost / freedom, freedom)


class _Tried(NamedTuple):
    """What is predicted at parameters that were compared."""

    p: Array
    predicted: Array
    cost: float


def _compared(request: _Request) -> list[_Tried]:
    """The start given and others spread around it, those with a motion, the nearest to what was measured first."""
    start = request.starts[0]
    wide = _WIDE * np.where(start != 0.0, np.abs(start), 1.0)
    positive = (start > 0.0) & (request.low >= 0.0)
    low = np.where(positive, np.maximum(request.low, start / _WIDE), np.maximum(request.low, start - wide))
    high = np.minimum(request.high, np.where(positive, _WIDE * start, start + wide))
    low, high = (np.where(np.isfinite(side), side, near) for side, near in ((request.low, low), (request.high, high)))
    low = np.where(positive & (low == 0.0), start / _WIDE, low)
    out = []
    for p in _starts(start, low, high, 1 + _TRIED, 0):
        tried = _predicted(request, p)
        if tried is not None:
            out.append(tried)
    return sorted(out, key=lambda each: each.cost)


def _predicted(request: _Request, p: Array) -> _Tried | None:
    """At parameters; None where there is no motion."""
    descent = _Descent(request, p)
    try:
        descent.predictor.begin(p)
    except SlipstickError:  # values that the problem cannot have
        return None
    left = descent._left(p / descent.unit)
    assert descent._asked is not None
    return _Tried(p, descent._asked[1], float(left @ left)) if np.all(np.isfinite(left)) else None


def _further(request: _Request, best: _End, compared: Sequence[_Tried]) -> tuple[list[_End], str]:
    """Ends of descents from the nearest of the starts compared; and what was done, in words."""
    ends: list[_End] = []
    others = [tried.p for tried in compared if not np.array_equal(tried.p, request.starts[0])]
    for p in others[:_FURTHER]:
        ends.append(_Descent(request, p, most=_MOST_SOUGHT)._chosen(p))
        if ends[-1].misfit <= _FAR:
            ends.append(_Descent(request, ends.pop().p).run())
            break
    nearest = min((end for end in ends if end.cost < best.cost), key=lambda end: end.cost, default=None)
    where = "with no motion" if not np.isfinite(best.cost) else f"far from what was measured, misfit {best.misfit:.2g}"
    outcome = "none ends nearer" if nearest is None else f"one ends at misfit {nearest.misfit:.2g} and is the result"
    return ends, (
        f"the fit from the start given ends {where}: {_TRIED} other starts were compared and the fit repeated from "
        f"{len(ends)} of them; {outcome}"
    )


def _weighted(request: _Request, end: _End) -> tuple[_Request, _End, Noise | None]:
    """The fit with numbers weighted by noise that depends on it: a given share of them, or found from what is left."""
    weights: Noise | None = None
    if not request.relative and (request.known or not _LEAST_NOISE < end.misfit < _FAR):
        return request, end, None  # each number has its own, or what is left is no noise
    for _ in range(_WEIGHTED):
        if request.relative:
            noise: Noise | None = given_noise(request.measured, end.predicted, request.absolute, request.relative)
        else:
            left, J = end.left * request.scale, end.J * request.scale[:, None]
            noise = found_noise(request.measured, end.predicted, left, J, request.used)
        if noise is None:
            break
        before, weights = request.noise, noise if weights is None or noise.relative > 0.0 else weights
        if before is not None:
            ratio = noise.deviations[request.used] / before[request.used]
            if np.max(np.abs(np.log(ratio))) < _SAME_NOISE:
                break
        other = replace(request, noise=noise.deviations, found=not request.relative)
        descent = _Descent(other, end.p, end.predictor)
        again = descent._descend(end.p, "linear")
        if not np.isfinite(again.cost):
            break
        request, end = other, again._replace(evaluations=end.evaluations + again.evaluations)
    return request, end, weights


def _mistakes(request: _Request, best: _End, compared: Sequence[_Tried]) -> list[str]:
    """What in the measured numbers would explain that the fit ends far from them, one sentence."""
    orders = np.array(request.problem.harmonics.orders[1:], dtype=float)
    likely: list[tuple[float, Array, Change, _Request]] = []
    for change in changes(request.measured, orders):
        other = replace(request, measured=change.measured, noise=None, relative=None, absolute=None, found=False)
        seen: Sequence[_Tried | None] = compared
        if not np.array_equal(change.measured.omega, request.measured.omega):
            seen = [_predicted(other, request.starts[0])]
        scaled = Scaled(other.predictor(), change.measured)
        near = [(other.misfit(other.left(scaled.scaled(tried.predicted))), tried.p) for tried in seen if tried]
        if near:
            likely.append((*min(near, key=lambda each: each[0]), change, other))
    found: list[tuple[float, str]] = []
    for _, p, change, other in sorted(likely, key=lambda each: each[0])[:_LIKELY]:
        free = _fit_scaled(other, p, None)
        if free is None or not free[0].misfit < _ENOUGH * best.misfit:
            continue
        end, factor = free
        words, remedy, certain = change.words, change.remedy, False
        for value, hint in round_factors(factor):
            fixed = _fit_scaled(other, end.p, value)
            if fixed is not None and fixed[0].misfit <= max(2.0 * end.misfit, _ROUNDING):
                end, factor, certain = fixed[0], value, True
                remedy = "; ".join(filter(None, (remedy, hint)))
                break
        if (factor == 1.0 and not words) or not (certain or end.misfit < _EXACT * best.misfit):
            continue
        if factor != 1.0:
            words += f"{' and ' if words else ''}divided by {factor_text(factor)}"
        values = ", ".join(f"{name} = {value:.4g}" for name, value in zip(request.names, end.p, strict=True))
        said = f"the measured numbers fit to {100.0 * end.misfit:.2g} % where they are {words}, with {values}"
        found.append((end.misfit, f"{said}: {remedy or 'check their scale and phase'}"))
        if certain and end.misfit <= _ROUNDING:
            break  # of amplitudes, which have no phase, another mistake may come near as well
    if found:
        return [min(found)[1]]
    return [
        "no sign, phase, scale, derivative or unit of frequency of the measured numbers explains the misfit: another "
        "law, a parameter that is not sought, or another start may"
    ]


def _fit_scaled(request: _Request, start: Array, factor: complex | None) -> tuple[_End, complex] | None:
    """The fit of numbers that are a factor times those of the problem, and that factor; None where there is none."""
    scaled = Scaled(request.predictor(), request.measured, factor)
    try:
        end = _Descent(request, start, scaled, most=_MOST_SOUGHT)._chosen(start)
    except SlipstickError:
        return None
    return (end, scaled.factor) if np.isfinite(end.cost) else None


def _result(
    request: _Request, end: _End, costs: Sequence[float], weights: Noise | None, told: Sequence[str]
) -> Identification:
    freedom = end.left.size - len(request.names)
    known = request.known
    spread = float(np.sqrt(end.cost / freedom)) if freedom > 0 else np.nan
    far, told = end.misfit > _FAR and not _explained(request, end), list(told)
    deviation, refused = 1.0 if known else spread, ""
    if far:
        deviation, refused = np.nan, (
            f"there are no standard errors: what is left, {100.0 * end.misfit:.2g} % of what was measured, is not "
            "taken for noise; if the measurement is that noisy, give noise or relative_noise"
        )  # fmt: skip
        told.append(refused)
    elif known and freedom > 0 and too_large(spread**2, freedom):
        deviation = spread
        told.append(
            f"what is left is {spread:.2g} times the noise that was given: standard errors are multiplied by it"
        )
    statistics = _statistics(request.names, end, deviation)
    left_out: list[Without] = []
    if not far and end.misfit > _ROUNDING and freedom > 2 and deviation > 0.0:
        statistics, left_out, sentences = _checked(request, end, statistics, deviation)
        told += sentences
    errors, correlations, singular, sentences, _ = statistics
    values = dict(zip(request.names, end.p.tolist(), strict=True))
    problem = request.problem.at_parameters(values)
    bound = tuple(name for name, at in zip(request.names, end.at_bound, strict=True) if at)
    message = "the fit converged" if end.converged else f"the fit did not converge in {request.most} evaluations"
    if far:
        message = f"the fit ends far from what was measured: misfit {end.misfit:.2g}"
    if bound:
        message += f", with {' and '.join(bound)} at a bound"
    found = Identification(
        values=values,
        standard_errors=dict(zip(request.names, errors.tolist(), strict=True)),
        correlations=correlations,
        singular_values=singular,
        indistinct=tuple(sentences),
        warnings=tuple(dict.fromkeys([*told, *sentences])),
        refused=refused,
        at_bound=bound,
        misfit=end.misfit,
        noise=float(np.sqrt(np.mean(request.scale**2))) * (spread if far and not known else deviation),
        relative_noise=np.nan if weights is None else weights.relative,
        weights="" if weights is None else weights.text,
        without_level={
            each.level: dict(zip(request.names, (end.p + each.shift).tolist(), strict=True)) for each in left_out
        },
        reduced_chi_square=spread**2 if known else np.nan,
        degrees_of_freedom=freedom,
        several=end.predictor.several,
        converged=end.converged and not far,
        message=message,
        problem=problem,
        dataset=_EMPTY,
        evaluations=end.evaluations,
        solutions=end.predictor.solved,
        starts=tuple(costs),
    )
    return replace(found, dataset=_dataset(request, end, found, deviation))


def _checked(
    request: _Request, end: _End, statistics: _Statistics, deviation: float
) -> tuple[_Statistics, list[Without], list[str]]:
    """Standard errors that grow with what in the residuals is no noise, the levels left out, and sentences."""
    told: list[str] = []
    size, free = np.where(end.p != 0.0, np.abs(end.p), 1.0), ~end.at_bound
    J, errors = (end.J * size)[:, free], statistics.errors.copy()
    names = [name for name, there in zip(request.names, free, strict=True) if there]
    if not J.size or not len(statistics.gain):
        return statistics, [], told
    white = whiteness(neighbours(request.measured, request.used), end.left, J, deviation)
    growth = np.ones(len(names))
    if white.told:
        growth *= white.factor
        told.append(
            f"what is left is not white: neighbouring points are alike (correlation {white.correlation:.2f}), the "
            f"model lacks something or the noise is not random; standard errors are multiplied by {white.factor:.2g}"
        )
    unequal = robust(statistics.gain, end.left, J, deviation)
    larger = unequal.told & (unequal.factor > growth)
    if larger.any():
        growth[larger] = unequal.factor[larger]
        which = [f"{name} ({factor:.2g} times)" for name, factor in zip(names, growth, strict=True)]
        told.append(
            "what is left is larger where parameters are determined: standard errors are taken from it (sandwich "
            f"estimate) for {listed([word for word, there in zip(which, larger, strict=True) if there])}"
        )
    errors[free] *= growth
    freedom = end.left.size - len(request.names)
    left_out = []
    for each in without_levels(request.measured, request.used, end.left, J, deviation, freedom):
        shift = np.zeros(len(end.p))
        shift[free] = each.shift * size[free]
        left_out.append(each._replace(shift=shift))
        moved = np.flatnonzero((np.abs(shift) > errors) & each.told)
        if len(moved):
            values = [f"{request.names[k]} would be about {end.p[k] + shift[k]:.4g}" for k in moved]
            told.append(
                f"without {each.level} {listed(values)}: the levels do not agree within the noise, and standard errors "
                "are at least these changes"
            )
            errors[moved] = np.abs(shift[moved])
    return statistics._replace(errors=errors), left_out, told


class _Statistics(NamedTuple):
    errors: Array
    """(n_p,)"""
    correlations: Array
    """(n_p, n_p)"""
    singular: Array
    sentences: list[str]
    """Of what is not separated."""
    gain: Array
    """How relative values of the free parameters follow weighted numbers (n_free, m)."""


_EMPTY: Any = None


def _statistics(
    names: Sequence[str], end: _End, deviation: float
) -> _Statistics:  # fmt: skip
    """How sure the parameters are, of noise with one standard deviation of the weighted numbers."""
    size = np.where(end.p != 0.0, np.abs(end.p), 1.0)
    free = ~end.at_bound
    scaled = (end.J * size)[:, free]
    columns, singular, rows = np.linalg.svd(scaled, full_matrices=False)
    errors, correlations = np.full(len(names), np.nan), np.full((len(names),) * 2, np.nan)
    if not singular.size:
        return _Statistics(errors, correlations, singular, [], np.empty((0, end.left.size)))
    known = singular > _INDISTINCT * singular[0]
    inverse = rows[known].T / singular[known]
    covariance = inverse @ inverse.T
    undetermined = np.any(np.abs(rows[~known]) > 1e-3, axis=0)
    own = np.sqrt(np.diag(covariance))
    errors[free] = np.where(undetermined, np.inf, deviation * own * size[free])
    with np.errstate(invalid="ignore", divide="ignore"):
        between = covariance / np.outer(own, own)
    between[undetermined], between[:, undetermined] = np.nan, np.nan
    correlations[np.ix_(free, free)] = between
    chosen = [name for name, there in zip(names, free, strict=True) if there]
    sentences = [_indistinct(chosen, row, end.p[free]) for row in rows[~known]]
    for value, row in zip(singular[known], rows[known], strict=True):
        if deviation / value > _IN_NOISE:
            sentences.append(_in_noise(chosen, row, deviation / value))
    return _Statistics(errors, correlations, singular, sentences, inverse @ columns[:, known].T)


def _indistinct(names: Sequence[str], row: Array, p: Array) -> str:
    """What a combination of relative changes that changes nothing means."""
    share = row / np.max(np.abs(row))
    part = [(name, float(r)) for name, r, v in zip(names, share, p, strict=True) if abs(r) > _TAKES_PART]
    if len(part) == 1:
        return f"{part[0][0]} has no effect on what was measured: any value fits as well"
    if len(part) == 2 and abs(abs(part[0][1]) - abs(part[1][1])) < 1e-3:
        together = "product" if part[0][1] * part[1][1] < 0.0 else "ratio"
        return (
            f"{part[0][0]} and {part[1][0]} cannot be separated: the measurement determines their {together} alone; "
            "keep one of them fixed"
        )
    changes = ", ".join(f"{r:+.2g} % of {name}" for name, r in part)
    return f"{' and '.join(name for name, _ in part)} cannot be separated: changing {changes} changes nothing measured"


def _in_noise(names: Sequence[str], row: Array, spread: float) -> str:
    part = [name for name, r in zip(names, row / np.max(np.abs(row)), strict=True) if abs(r) > 2 * _TAKES_PART]
    return f"the noise hides {' against '.join(part)}: that combination is known to {100.0 * spread:.0f} % only"


def _dataset(request: _Request, end: _End, found: Identification, deviation: float) -> xarray.Dataset:
    """Everything as labelled arrays."""
    import xarray

    measured, problem = request.measured, request.problem
    label = problem.units.label
    names = np.array(request.names, dtype=np.str_)
    units = np.array([label(parameter_units(problem, name)) for name in request.names], dtype=np.str_)
    data: dict[str, Any] = {
        "value": ("parameter", end.p, {"long_name": "parameters that fit"}),
        "standard_error": ("parameter", np.array([*found.standard_errors.values()])),
        "at_bound": ("parameter", end.at_bound.astype(np.int8)),
        "correlation": (("parameter", "other"), found.correlations),
        "singular_value": ("rank", found.singular_values),
    }
    coords: dict[str, Any] = {"parameter": names, "other": names, "units": ("parameter", units)}
    dims, own, unit, what = measured.described(problem)
    coords |= own
    about = {"units": unit}
    data["measured"] = (dims, measured.values, {**about, "long_name": f"measured {what}"})
    data["fitted"] = (dims, end.predicted, {**about, "long_name": f"fitted {what}"})
    deviations = np.full(measured.values.shape, np.nan)
    deviations[request.used] = request.scale * deviation
    data["standard_deviation"] = (dims, deviations, {**about, "long_name": f"noise of the measured {what}"})
    if found.without_level:
        coords["level"] = list(found.without_level)
        moved = np.array([[*values.values()] for values in found.without_level.values()])
        data["without_level"] = (("level", "parameter"), moved, {"long_name": "parameters without a level"})
    attributes = {
        ANALYSIS: "identify", "warnings": "\n".join(found.warnings), "refused": found.refused, "weights": found.weights,
        "misfit": found.misfit, "noise": found.noise, "converged": int(found.converged), "message": found.message,
        "indistinct": "\n".join(found.indistinct), "several": found.several,
        "degrees_of_freedom": found.degrees_of_freedom, "title": problem.title, **problem.units.attributes,
        **versions(),
    }  # fmt: skip
    if np.isfinite(found.reduced_chi_square):
        attributes["reduced_chi_square"] = found.reduced_chi_square
    if np.isfinite(found.relative_noise):
        attributes["relative_noise"] = found.relative_noise
    return xarray.Dataset(data, coords=coords, attrs=attributes)
