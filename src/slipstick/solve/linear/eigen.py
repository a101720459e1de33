"""Lowest modes of sparse symmetric ``K phi = lambda M phi``."""

from __future__ import annotations

from slipstick.errors import InputError
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.solve.linear.modes import EigenOptions, Modes, StageListener
from slipstick.typing import Array, Sparse


def modes(
    K: Sparse,
    M: Sparse,
    n_modes: int,
    *,
    shift: float = 0.0,
    solver: str | None = None,
    options: EigenOptions | None = None,
    start: Array | None = None,
    listener: StageListener | None = None,
) -> Modes:
    """The ``n_modes`` lowest modes of sparse symmetric K, M (n, n), M positive definite.

    ``shift`` must lie below the lowest eigenvalue; zero asks for a K without free motions, a negative one serves free
    bodies. ``start`` (n, block) overrides the random first block. Raises InputError for a singular ``K - shift M`` or
    an impossible number, EigenError without convergence.

    >>> from scipy import sparse
    >>> modes(sparse.diags_array([4.0, 1.0, 9.0]), sparse.eye_array(3), 2).omega
    array([1., 2.])
    """
    iteration = BlockLanczos(K, M, shift=shift, solver=solver, options=options, start=start, listener=listener)
    if iteration.inertia is not None and iteration.inertia.negative:
        raise InputError(f"{iteration.inertia.negative} eigenvalues lie below the shift {shift:g}; give a lower one")
    return iteration.modes(n_modes)
