"""The linear limits of a case: without contact and with every contact stuck."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from slipstick.errors import InputError

if TYPE_CHECKING:
    import xarray

    from slipstick.balance.problem import Problem

_MOST, _LEAST = 1501, 61
_SECONDS = 2.0
_DOFS, _ROUNDS, _NEARER = 3, 6, 9


def linear_references(problem: Problem, omega: tuple[float, float]) -> Iterator[tuple[str, xarray.Dataset]]:
    """Label and response of each limit over a range of frequencies; a limit that cannot be computed is left out.

    As many frequencies as a few seconds allow, structures that are solved anew at each get fewer; the natural ones
    besides, and more about the largest amplitudes, so that these do not depend on how many there are.
    """
    from slipstick.analysis.response import linear_response

    low, high = sorted(omega)
    for state, label in (("free", "without contact"), ("stuck", "stuck")):
        try:
            for samples in (1, 4):  # the first time includes what is done once
                begin = time.perf_counter()
                linear_response(problem, omega=np.linspace(low, high, samples), state=state)
            count = int(np.clip(4 * _SECONDS / (time.perf_counter() - begin), _LEAST, _MOST))
            known = np.asarray(problem.structure.natural_frequencies, dtype=float)
            grid = np.union1d(np.linspace(low, high, count), known[(known > low) & (known < high)])
            yield label, _with_peaks(problem, linear_response(problem, omega=grid, state=state).dataset, state)
        except InputError:
            continue


def _with_peaks(problem: Problem, data: xarray.Dataset, state: str) -> xarray.Dataset:
    """More frequencies between the neighbours of the largest amplitude of each of the first dofs, nearer and nearer."""
    import xarray

    from slipstick.analysis.response import linear_response

    for _ in range(_ROUNDS):
        w = data["omega"].to_numpy()
        tops = {int(at) for at in data["amplitude"].to_numpy()[:, :_DOFS].argmax(axis=0)}
        near = [np.linspace(w[max(k - 1, 0)], w[min(k + 1, w.size - 1)], _NEARER) for k in tops]
        new = np.setdiff1d(np.concatenate(near), w)
        if not new.size:
            break
        further = linear_response(problem, omega=new, state=state).dataset
        data = xarray.concat([data, further], "point", data_vars="minimal", combine_attrs="override").sortby("omega")
    return data
