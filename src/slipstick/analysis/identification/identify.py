"""Parameters of contacts, loads and structures that fit what was measured, and how sure they are.

Least squares (``scipy.optimize.least_squares``: trust regions within bounds) with exact Jacobians. Of the weighted
Jacobian ``J`` at the end, columns times the parameters' values, the singular values say what the measurement tells
apart; covariance of the parameters is ``s^2 (J^T J)^-1`` (G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989,
section 2.1).

Where the noise is not given, weights come from the residuals (``noise.py``), and numbers are weighted again by the
noise of the fit until both stay: iteratively reweighted least squares (the same book, section 2.8).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slipstick.analysis.identification.descent import FAR, Descent, End, explained, weighted
from slipstick.analysis.identification.fit_request import FitRequest, fit_in_time, fit_request
from slipstick.analysis.identification.identification import IN_NOISE, Identification, result_of, statistics_of
from slipstick.analysis.identification.measured import dataset_of
from slipstick.analysis.identification.search import Tried, compared_starts, further_ends, mistakes_in
from slipstick.analysis.road.events import EventFunction
from slipstick.balance.parameters import product_warnings
from slipstick.balance.problem import Problem
from slipstick.errors import Fault, InputError, TimeIsUp
from slipstick.faults import warn


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
    columns: Mapping[str, str] | None = None,
    quantity: str | None = None,
    listeners: Iterable[EventFunction] | EventFunction = (),
) -> Identification:
    """Fit named parameters to what was measured: frequency responses, loops, backbones, time series.

    Parameters
    ----------
    problem
        What vibrates; parameters that are not sought have its values.
    measured
        An ``xarray.Dataset``, or the path of a .nc, .csv or .mat file, with one of:

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
          was set, such as ``load``, the factor on all loads;
        - ``omega`` and ``modal_damping`` (either may be missing) over ``modal_amplitude``, of harmonic 1 at one dof: a
          nonlinear mode, of the number ``mode``;
        - ``displacement(time, dof)`` with ``omega``: a steady vibration, whose last periods are taken (t = 0 is that of
          the loads), with ``force(time)`` too a loop; without ``omega`` a free decay. It gives the frequency and the
          damping of the nonlinear mode ``mode`` over its amplitude; from the values that fit these, the motion itself
          is fitted in time, from an initial state that is found along, where the contacts' laws tell a rate and have
          no states, and the state has 24 numbers at most.

        - ``receptance(omega, output, input)``, ``mobility`` or ``accelerance``, complex, as ``modal_analysis`` reads
          them, also from universal files (.unv, .uff): the motion per force, times the force of the problem. The
          problem needs one force, on one dof and of one harmonic; functions by forces elsewhere are left out.

        The two numbers of a backbone are each compared by their own size; their noise is in ``peak_omega_noise`` and
        ``peak_amplitude_noise``, ``omega_noise`` and ``modal_damping_noise``.

        The columns of a .csv file are ``omega`` (or ``frequency``, Hz), names of dofs for amplitudes ("x"), or with a
        coefficient ("x.c1"), and parameters; or ``loop``, ``displacement``, ``force``; or ``peak_omega`` (or
        ``peak_frequency``, Hz), ``modal_amplitude`` and the others; or ``time``, s, with names of dofs. Files of test
        rigs are read too: lines of their own before the names, semicolons or tabs with decimal commas, and units, in
        brackets after the names or in a line below them: frequencies, and lengths, forces and times, which are
        converted to the units of the problem. Columns of a .mat file (MATLAB, any version from 5 on) are its vectors,
        of matrices ``H(:,2)``, of structs ``rig.f``; complex numbers of a dof are ``z`` of ``Re(z e^{i tau})``. Names
        with a slash are response functions: ``tip/root`` is the motion of tip by a force on root.
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
    columns
        Of a file with other names: what its columns are, ``{"x": "Disp ch3", "frequency": "f"}``; these alone are
        read. Of a universal file what its functions are, ``{"x": "n2x/n1x"}``. A unit may stand behind a name,
        ``{"x": "disp [mm]"}``, where the file has none.
    quantity
        "velocity" or "acceleration": what of a vibration was measured, where it is no displacement and the file does
        not say so.
    listeners
        Told of each evaluation: ``listeners=ss.Progress()``. After Ctrl-C, or where one of them ends it, the result has
        the best values so far, if a step was made, and says so.

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
        For measurements that do not fit the problem, infinite numbers and nothing but zeros in them, unknown or
        overlapping parameters, a start outside its bounds, and where no motion is found at the start.

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
    if columns is not None or quantity is not None:
        measured = dataset_of(problem, measured, columns, quantity)
    request = fit_request(problem, measured, parameters, bounds, noise, relative_noise, starts, seed, listeners)
    told = [*product_warnings(problem, request.names), *request.measured.notes]
    try:
        found = _fitted(request, measured, noise, told)
    except KeyboardInterrupt as stop:
        if not request.kept:
            raise
        ((request, best),) = request.kept
        late = isinstance(stop, TimeIsUp)
        message = f"the fit was {'stopped at its time limit' if late else 'interrupted'}: the best values so far"
        found = result_of(request, best, [best.cost], None, told, stopped=message)
    warn([*found.warnings, *([] if found.converged else [found.message])])
    return found


def _fitted(request: FitRequest, measured: Any, noise: float | None, told: list[str]) -> Identification:
    """The fit from all starts, and what is tried where that ends far away."""
    in_time = fit_in_time(request, measured, noise)
    request = request if in_time is None else replace(request, noise=None, relative=None, absolute=None)
    ends = [Descent(request, start, place=k).run() for k, start in enumerate(request.starts)]
    best = min(ends, key=lambda end: end.cost)
    direct = None if in_time is None else fitted_in_time(in_time, best)
    if direct is not None and direct.misfit < 2.0 * FAR:
        assert in_time is not None
        request, best, ends = in_time, direct, [direct]
    elif in_time is not None and np.isfinite(best.cost):
        told.append("the decay itself is not fitted: the model follows it from no initial state nearby; the "
                    "values are those of the nonlinear mode")  # fmt: skip
    compared: list[Tried] = []
    if best.far and not explained(request, best) and not request.measured.in_time:
        compared = compared_starts(request)
        further, sentence = further_ends(request, best, compared)
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
    request, best, weights = weighted(request, best)
    if compared and best.far and not explained(request, best):
        told += mistakes_in(request, best, compared)
    return result_of(request, best, costs, weights, told)


def fitted_in_time(request: FitRequest, of_mode: End) -> End:
    """From the values that fit the nonlinear mode, and those given of what that does not determine."""
    start = request.starts[0]
    if np.isfinite(of_mode.cost):
        spread = float(np.sqrt(of_mode.cost / max(of_mode.left.size - start.size, 1)))
        errors = statistics_of(request.names, of_mode, spread).errors
        start = np.where(errors < IN_NOISE * np.abs(of_mode.p), of_mode.p, start)
    return Descent(request, start).run()
