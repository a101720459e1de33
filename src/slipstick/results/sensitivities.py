"""Derivatives along a branch as one labelled dataset, and the parameters that they can be by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from slipstick.balance.inputs import Inputs
from slipstick.balance.parameters import load_names, parameter_path, parameter_units
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names
from slipstick.results.schema import VARIABLES, state_names
from slipstick.results.view import analysis_of, view_of
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.contacts import ContactPair
    from slipstick.balance.problem import Problem
    from slipstick.results.solutions import Solutions


def known_problem(branch: Solutions) -> Problem:
    """The problem whose parameters results depend on; InputError where the results have none."""
    problem = branch.problem or branch.excited
    if problem is None:
        remedy = "; give it to ss.load(path, problem)" if analysis_of(branch.table) == "modes" else ""
        raise InputError(f"sensitivities need the problem of the branch, which is not known: {branch.without}{remedy}")
    return problem


def parameter_names(problem: Problem, asked: Any = None) -> tuple[str, ...]:
    """The parameters requested; by default those of every contact pair, every load and the structure.

    The default leaves out parameters that a contact state replaces, and those without effect.

    Raises
    ------
    InputError
        For a name that is none, and for one of those.
    """
    if asked is None:
        of_contacts = [f"{pair.name}.{quantity}" for pair in problem.contacts for quantity in pair.quantities]
        known = [*of_contacts, *load_names(problem), *problem.structure.values]
        return tuple(name for name in dict.fromkeys(known) if _can_vary(problem, name))
    chosen, faults = names("parameters", asked, 'a name such as "damper.mu"'), Gathering()
    for name in chosen:
        faults.take(direction_of, problem, name)
    faults.end()
    return tuple(dict.fromkeys(chosen))


def direction_of(problem: Problem, name: str) -> Inputs:
    """How the inputs move with a parameter; InputError where they cannot."""
    target = problem.parameter_target(name)
    for p, k in target.members:
        pair = problem.contacts[p]
        if not _holds(pair, target.quantity, k):
            raise InputError(
                Fault(
                    name, f"does not say the gap of '{pair.elements[k]}', which is open at rest", remedy="vary the gap"
                )
            )
    return parameter_path(problem, name).at(problem.parameter(name))[1]


def _holds(pair: ContactPair, quantity: str, k: int) -> bool:
    """Whether a contact is as it is where a quantity of it is set to what it is: a normal load of 0 closes a gap."""
    value = float(pair.values(quantity)[k])
    same = pair.with_value(quantity, value, k)
    return all(np.allclose(same.values(n), pair.values(n), rtol=1e-9, atol=0.0) for n in pair.contact.values)


def _can_vary(problem: Problem, name: str) -> bool:
    try:
        direction_of(problem, name)
    except InputError:
        return False
    return True


class PointDerivatives(NamedTuple):
    """Derivatives at one point, (n_parameters,) each; those that have no meaning there are nan."""

    amplitude: Array
    mean: Array
    dissipated_power: Array
    states: Array
    """Of the largest value under each name of ``state_names``, (n_names, n_parameters)."""
    followed: Array
    """Of the place of a peak along the branch; nan where it is no smooth one, whose height then changes otherwise."""
    above: Array
    """Of the amplitude where the parameter grows: not that where it falls if the amplitude is a tie of extremes."""
    below: Array
    """Of the amplitude where it falls."""
    found: Mapping[str, Array] = MappingProxyType({})
    """Of what is found with the motion where nothing prescribes it, by name: of the frequency of free vibration."""


SUBJECTS = {
    "amplitude": "amplitude of {dof}",
    "mean": "mean of {dof}",
    "dissipated_power": "dissipated power of all contacts",
}
"""What is differentiated, by the name of its variable; besides these, each contact state."""


def sensitivity_dataset(
    branch: Solutions, dof: str, parameters: Sequence[str], at: Sequence[int], points: Sequence[PointDerivatives]
) -> xarray.Dataset:
    """The dataset of ``Branch.sensitivity``, at the points of the numbers ``at``."""
    import xarray

    problem, table, followed = known_problem(branch), branch.table, branch.followed
    label = problem.units.label
    rates = {name: np.array([getattr(p, name) for p in points]).T for name in (*SUBJECTS, "followed")}
    subjects = {name: (subject.format(dof=dof), VARIABLES[name].units) for name, subject in SUBJECTS.items()}
    for side, way in (("above", "grows"), ("below", "falls")):
        rates[f"amplitude_{side}"] = np.array([getattr(p, side) for p in points]).T
        subjects[f"amplitude_{side}"] = f"amplitude of {dof} where the parameter {way}", VARIABLES["amplitude"].units
    for s, (name, state) in enumerate(dict(zip(state_names(problem), problem.contact_states, strict=True)).items()):
        rates[name] = np.array([p.states[s] for p in points]).T
        subjects[name] = state.extreme_name, state.variable.units
    data: dict[str, Any] = {}
    for name, (subject, units) in subjects.items():
        meaning = {"long_name": f"derivative of the {subject}", "of": label(units)}
        data[name] = (("parameter", "point"), rates[name], meaning)
    for name in points[0].found if points else ():
        about = table[name].attrs
        meaning = {"long_name": f"derivative of the {about['long_name']}", "of": str(about["units"])}
        data[name] = (("parameter", "point"), np.array([p.found[name] for p in points]).T, meaning)
    of = table["peak_dof"].to_numpy()[list(at)] == branch.dof_index(dof)
    peaks, where = np.flatnonzero(of), table[followed]
    place = {"long_name": f"derivative of where {dof} peaks", "of": str(where.attrs.get("units", "1"))}
    heights = np.where(np.isnan(rates["followed"]), np.nan, rates["amplitude"])
    data["peak_amplitude"] = (("parameter", "peak"), heights[:, peaks], data["amplitude"][2])
    data[f"peak_{followed}"] = (("parameter", "peak"), rates["followed"][:, peaks], place)
    coords, attributes = _about(branch, dof, parameters, at)
    return xarray.Dataset(data, coords={**coords, "peak": ("peak", np.asarray(at)[peaks])}, attrs=attributes)


def corner_warnings(found: xarray.Dataset) -> list[str]:
    """By which parameters an amplitude of ``sensitivity_dataset`` has a corner, and how steep it is on both sides."""
    sentences = []
    for k, name in enumerate(found["parameter"].values.tolist()):
        above, below = (found[f"amplitude_{side}"].values[k] for side in ("above", "below"))
        corner = np.isnan(found["amplitude"].values[k]) & np.isfinite(above)
        if not corner.any():
            continue
        first, where = int(np.flatnonzero(corner)[0]), found.attrs["followed"]
        sentences.append(
            f"the amplitude of {found.attrs['dof']} has no derivative by {name} at {corner.sum()} of {corner.size} "
            f"points: extremes of the motion are equal there, and part with {name}; at {where} = "
            f"{float(found['at'][first]):.6g} it is {above[first]:.4g} where {name} grows and {below[first]:.4g} "
            "where it falls (amplitude_above, amplitude_below)"
        )
    return sentences


def motion_dataset(
    branch: Solutions, dof: str, parameters: Sequence[str], at: Sequence[int], rates: Array
) -> xarray.Dataset:
    """Derivatives (parameter, point, coefficient) of a motion, and of the phase of its harmonics."""
    import xarray

    problem, table = known_problem(branch), branch.table
    U = table["displacement"].to_numpy()[list(at), branch.dof_index(dof)]
    orders = branch.harmonics.orders[1:]
    c, s, dc, ds = U[:, 1::2], U[:, 2::2], rates[..., 1::2], rates[..., 2::2]
    size = c**2 + s**2
    with np.errstate(divide="ignore", invalid="ignore"):
        phase = np.where(size > 0.0, (s * dc - c * ds) / size, np.nan)
    unit = problem.units.label(VARIABLES["displacement"].units)
    data = {
        "displacement": (
            ("parameter", "point", "coefficient"), rates,
            {"long_name": f"derivative of the displacement of {dof}", "of": unit},
        ),
        "phase": (
            ("parameter", "point", "harmonic"), phase,
            {"long_name": f"derivative of the phase of {dof}, x = a cos(m tau + phase)", "of": "rad"},
        ),
    }  # fmt: skip
    coords, attributes = _about(branch, dof, parameters, at)
    coords |= {"coefficient": table["coefficient"].to_numpy(), "harmonic": np.asarray(orders, dtype=int)}
    return xarray.Dataset(data, coords=coords, attrs=attributes)


def _about(
    branch: Solutions, dof: str, parameters: Sequence[str], at: Sequence[int]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Coordinates and attributes of derivatives along a branch."""
    problem, followed = known_problem(branch), view_of(branch.table).over[0]
    where = branch.table[followed]
    by = [problem.units.label(parameter_units(problem, name)) for name in parameters]
    coordinates = {
        "parameter": ("parameter", np.array(parameters, dtype=np.str_)),
        "units": ("parameter", np.array(by, dtype=np.str_)),
        "value": ("parameter", np.array([problem.parameter(name) for name in parameters], dtype=float)),
        "point": ("point", np.asarray(at)),
        "at": ("point", where.to_numpy()[list(at)], dict(where.attrs)),
    }
    return coordinates, {"dof": dof, "followed": str(branch.table.attrs.get("parameter", "")) or followed}
