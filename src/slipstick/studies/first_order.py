"""How sure a curve is where its parameters are not, to first order: by exact derivatives, without samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.analysis.sensitivity.sensitivity import sensitivity_of
from slipstick.errors import InputError
from slipstick.faults import Gathering, one, table
from slipstick.results.solutions import Solutions
from slipstick.studies.parameter_values import distribution

if TYPE_CHECKING:
    import xarray


def first_order(branch: Solutions, distributions: Any, dof: str | None = None) -> xarray.Dataset:
    """Mean and standard deviation of amplitude and peaks for independent parameters.

    ``mean = a + sum a_s (m_s - s)`` and ``variance = sum (a_s sigma_s)^2`` with the derivatives ``a_s`` of the branch
    at its own parameters s [the first-order second-moment method; Ang and Tang, Probability Concepts in Engineering,
    2nd ed., 2007, 4.3]. What bends within a standard deviation it does not see: samples of ``ss.study`` do.

    Parameters
    ----------
    branch
        With its problem.
    distributions
        By name of parameter, ``{"damper.mu": scipy.stats.norm(0.3, 0.02)}``: frozen distributions of scipy.stats, or
        ``{"distribution": "norm", "loc": 0.3, "scale": 0.02}``.
    dof
        Name of the dof; by default the first.

    Returns
    -------
    xarray.Dataset
        ``amplitude_mean``, ``amplitude_deviation`` over (point), ``peak_amplitude_mean``, ``peak_amplitude_deviation``,
        ``peak_omega_mean``, ``peak_omega_deviation`` over (peak), and ``variance_share`` (parameter, point): what each
        parameter adds to the variance of the amplitude. Where a derivative has no meaning they are nan.

    Raises
    ------
    InputError
        For a branch without problem, unknown names, and what is no distribution.
    """
    import xarray

    known, given = one("branch", branch, Solutions, "an ss.Branch with its problem"), Gathering()
    asked = table("distributions", distributions, 'distributions by name such as {"damper.mu": scipy.stats.norm(0.3)}')
    if known.problem is None:
        raise InputError(f"distributions need the problem of the branch, which is not known: {known.without}")
    parts = {name: given.take(distribution, ("distributions", name), value) for name, value in asked.items()}
    if not parts and not given.faults:
        raise InputError("distributions: no parameter is given")
    given.end()
    name = str(known.table["dof"].to_numpy()[known.dof_index(dof)])
    rates = sensitivity_of(known, list(parts), name, together=False)
    sound = [part for part in parts.values() if part is not None]
    sigma = np.array([part.deviation for part in sound])
    shift = np.array([part.mean for part in sound]) - rates["value"].to_numpy()
    peaks, d = rates["peak"].to_numpy(), known.dof_index(dof)
    size = known.table["amplitude"].to_numpy()[:, d]
    at = known.table[known.followed].to_numpy()
    followed = f"peak_{known.followed}"
    values = {"amplitude": size, "peak_amplitude": size[peaks], followed: at[peaks]}
    data: dict[str, Any] = {}
    for key, value in values.items():
        slopes, dim = rates[key].to_numpy(), "point" if key == "amplitude" else "peak"
        units = {"units": str(known.table[key.removeprefix("peak_")].attrs.get("units", "1"))}
        data[f"{key}_mean"] = dim, value + shift @ slopes, {**units, "long_name": f"mean of {key}, to first order"}
        data[f"{key}_deviation"] = dim, np.sqrt(sigma**2 @ slopes**2), {**units, "long_name": f"deviation of {key}"}
    parts_of = (rates["amplitude"].to_numpy() * sigma[:, None]) ** 2
    with np.errstate(invalid="ignore"):
        data["variance_share"] = ("parameter", "point"), parts_of / parts_of.sum(axis=0)
    coordinates = {name: rates[name] for name in ("parameter", "point", "peak", "at", "value")}
    return xarray.Dataset(data, coords=coordinates, attrs={"dof": name})
