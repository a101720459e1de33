"""Sobol indices: how much of the variance of a peak each parameter makes, alone and with the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import number, shown, text, warn, whole
from slipstick.results.table import is_dataset
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

_QUANTITIES = ("peak_amplitude", "peak_omega", "peak_parameter")


def sobol_indices(
    study: xarray.Dataset, quantity: str = "peak_amplitude", *, confidence: float = 0.95, seed: int = 0
) -> xarray.Dataset:
    """First-order and total indices of the peaks of a study with ``method="saltelli"``.

    The first-order index of a parameter is the share of the variance that would go with it, were it known; the total
    index is the share that would be left, were all others known [Sobol, Math. Comput. Simul. 55 (2001) 271-280].
    Parameters are independent. The estimates are those of SALib: Saltelli et al. (2010), table 2, (b) and (f).

    Parameters
    ----------
    study
        The dataset of the study.
    quantity
        "peak_amplitude", "peak_omega" or "peak_parameter".
    confidence, seed
        Level of the intervals, which are resampled (bootstrap), and the seed of that.

    Returns
    -------
    xarray.Dataset
        ``first``, ``total`` over (parameter, dof), ``first_interval``, ``total_interval`` with their half widths, and
        ``variance`` (dof).

    Raises
    ------
    InputError
        Without SALib, for another study, and where fewer than two groups of its samples are complete.

    Warns
    -----
    SlipstickWarning
        Where samples failed: the groups they belong to are left out.
    """
    if not is_dataset(study, "peak_amplitude") or "study_parameters" not in study.attrs:
        raise InputError(f"Sobol indices: found {shown(study)}; expected the dataset that ss.study returns")
    if study.attrs.get("study_method") != "saltelli":
        found = f'a study with method = "{study.attrs.get("study_method", "")}"'
        raise InputError(Fault("Sobol indices", found=found, expected='method = "saltelli"'))
    known = [name for name in _QUANTITIES if name in study]
    if text("quantity", quantity, f"one of {', '.join(known)}") not in known:
        raise InputError(Fault("quantity", found=shown(quantity), expected=f"one of {', '.join(known)}"))
    values = np.where((study["outcome"] == "COMPLETED").to_numpy()[:, None], study[quantity].to_numpy(), np.nan)
    names = str(study.attrs["study_parameters"]).splitlines()
    dofs = study["dof"].to_numpy().tolist()
    return indices(values, names, dofs, confidence=confidence, seed=seed)


def indices(
    values: Array, names: Sequence[str], dofs: Sequence[str], *, confidence: float = 0.95, seed: int = 0
) -> xarray.Dataset:
    """As :func:`sobol_indices`, of values (n_samples, n_dofs) at the samples of "saltelli", nan where unknown."""
    import xarray

    analyze = _salib()
    confidence = number("confidence", confidence, "a number between 0 and 1", above=1e-9)
    if confidence >= 1.0:
        raise InputError(Fault("confidence", found=f"{confidence:g}", expected="a number between 0 and 1"))
    group, seed = len(names) + 2, whole("seed", seed)
    columns = {key: np.full((len(names), len(dofs)), np.nan) for key in ("S1", "S1_conf", "ST", "ST_conf")}
    variance = np.full(len(dofs), np.nan)
    problem: dict[str, Any] = {"num_vars": len(names), "names": list(names), "bounds": [[0.0, 1.0]] * len(names)}
    for d in range(len(dofs)):
        groups = values[:, d].reshape(-1, group)
        sound = groups[np.isfinite(groups).all(axis=1)]
        if len(sound) < 2:
            continue
        if len(sound) < len(groups):
            said = f"{len(groups) - len(sound)} of {len(groups)} groups of samples are left out of {dofs[d]}"
            warn([f"Sobol indices: {said}: not all of their cases completed"])
        variance[d] = np.var(sound[:, [0, -1]])
        if not variance[d] > 0.0:
            continue
        told = analyze(problem, sound.ravel(), calc_second_order=False, conf_level=confidence, seed=seed)
        for key, column in columns.items():
            column[:, d] = told[key]
    if not np.isfinite(variance).any():
        raise InputError("Sobol indices: fewer than two groups of samples are complete")
    level = f"half width of the interval of {100 * confidence:g} %"
    about = {"S1": "first-order Sobol index", "ST": "total Sobol index", "S1_conf": level, "ST_conf": level}
    keys = {"first": "S1", "first_interval": "S1_conf", "total": "ST", "total_interval": "ST_conf"}
    return xarray.Dataset(
        {
            **{
                name: (("parameter", "dof"), columns[key], {"units": "1", "long_name": about[key]})
                for name, key in keys.items()
            },
            "variance": ("dof", variance),
        },
        coords={"parameter": list(names), "dof": list(dofs)},
    )


def has_salib() -> bool:
    """Whether there can be Sobol indices."""
    from importlib.util import find_spec

    return find_spec("SALib") is not None


def _salib() -> Any:
    if not has_salib():
        raise InputError("Sobol indices need SALib, which is not installed; run: pip install 'slipstick[uncertainty]'")
    from SALib.analyze.sobol import analyze

    return analyze
