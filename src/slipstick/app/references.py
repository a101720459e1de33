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


def linear_references(problem: Problem, omega: tuple[float, float]) -> Iterator[tuple[str, xarray.Dataset]]:
    """Label and response of each limit over a range of frequencies; a limit that cannot be computed is left out.

    As many frequencies as a few seconds allow: structures that are solved anew at each get fewer.
    """
    from slipstick.analysis.response import linear_response

    low, high = sorted(omega)
    for state, label in (("free", "without contact"), ("stuck", "stuck")):
        try:
            for samples in (1, 4):  # the first time includes what is done once
                begin = time.perf_counter()
                linear_response(problem, omega=np.linspace(low, high, samples), state=state)
            count = int(np.clip(4 * _SECONDS / (time.perf_counter() - begin), _LEAST, _MOST))
            yield label, linear_response(problem, omega=np.linspace(low, high, count), state=state).dataset
        except InputError:
            continue
