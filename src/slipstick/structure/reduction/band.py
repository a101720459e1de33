"""What a reduction leaves out over a whole band, from one direct solution at its top.

With all modes up to ``w_n`` kept, the error of the receptance is ``sum_r t_r w^4 / (w_r^2 - w^2)``, ``t_r = a_r a_r^T /
w_r^4``, over those left out (THEORY.md (10.2)). Between directions it is a form that grows faster than ``w^4``, so what
is measured at the top ``W`` bounds it below. From a load ``p`` the terms ``a_r (a_r . p)`` may cancel at the top and
not below; as ``g(w) = w^4 / (w_r^2 - w^2)`` is ``(w/W)^4 g(W) [1 - (W^2 - w^2) / (w_r^2 - w^2)]``, the error is at most

    (w/W)^4 [ |E_p(W)| + (W^2 - w^2) / (w_n^2 - w^2) sqrt(tr E(W)  E_pp(W)) ]

(Cauchy and Schwarz; THEORY.md (10.4)). Beside a resonance the measured figure grows without end; (10.3) is then the
better bound.
"""

from __future__ import annotations

import numpy as np

from slipstick.structure.receptance_size import ReceptanceSize, band
from slipstick.typing import Array


def band_error(size: ReceptanceSize, omega: Array, n_keep: int, *, top: float, missing: Array, second: Array) -> float:
    """Largest relative error below ``top`` (rad/s), between directions and from each load to them.

    ``missing`` is what the receptance lacks at the top, ``second`` the second residual, both between directions and
    loads after them (n, n); ``omega`` the modes kept. Infinite where these end below the top.
    """
    last = float(omega.max())
    if last <= top:
        return float("inf")
    w = band(omega, 0.0, top)
    part = (top**2 - w**2) / (last**2 - w**2)
    measured = (w / top)[:, None] ** 4 * (_norms(missing, n_keep) + part[:, None] * _most(missing, n_keep))
    known = (w**4 / (last**2 - w**2))[:, None] * np.maximum(_norms(second, n_keep), _most(second, n_keep))
    below = np.minimum(measured, known) / size.at(w)
    return float(max(below.max(), (_norms(missing, n_keep) / size.at(top)).max()))


def _norms(form: Array, n: int) -> Array:
    """Of the block between directions, then of each load's column."""
    return np.concatenate([[np.linalg.norm(form[:n, :n])], np.linalg.norm(form[:n, n:], axis=0)])


def _most(form: Array, n: int) -> Array:
    """What can hide behind cancelling terms: nothing between directions, ``sqrt(tr F  F_pp)`` for a load."""
    loads = np.sqrt(np.maximum(np.diag(form)[n:], 0.0) * max(float(np.trace(form[:n, :n])), 0.0))
    return np.concatenate([[0.0], loads])
