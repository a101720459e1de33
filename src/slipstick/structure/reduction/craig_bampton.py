"""Reduction of matrices that need not be symmetric, to kept dofs and modes of the others with these held."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names, one, suggestion, whole
from slipstick.structure.matrices import DENSE_LIMIT, MatrixStructure
from slipstick.typing import Array, Matrix
from slipstick.units import modal_coordinate


def craig_bampton(structure: MatrixStructure, keep: Iterable[str], *, modes: int) -> MatrixStructure:
    """A smaller structure with the kept dofs as they are, and "mode 1", "mode 2", ... for the motion of the others.

    The others move as the kept ones make them at rest, and in their lowest modes with the kept ones held
    [R. R. Craig and M. C. C. Bampton, AIAA J. 6, 1968, 1313]. Of an unsymmetric stiffness the static shapes of its
    transpose are taken too, those that left vectors follow. All matrices, also gyroscopic ones for unit speed, are
    projected on these shapes: M stays symmetric, G skew, the speed and all parameters can be changed afterwards.

    At rest the receptance between kept dofs is exact (with ``circulatory``, at the speed given); at a frequency w the
    relative error is below about ``(w / w_left)^2``, with the lowest frequency left out, kept dofs held. What is loaded
    or in contact has to be kept; load shapes are projected, and not exact.

    Parameters
    ----------
    structure
        Of any size that has dense or sparse matrices, at rest or turning.
    keep
        Names of the kept dofs.
    modes
        How many, >= 0.

    Raises
    ------
    InputError
        For names that are not there, more modes than dofs, and others that move freely while the kept ones are held.

    Examples
    --------
    >>> import numpy as np
    >>> K = [[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]
    >>> chain = MatrixStructure(M=np.eye(3), K=K, dofs=["a", "b", "c"])
    >>> small = craig_bampton(chain, ["a"], modes=1)
    >>> small.dofs, small.project([[1.0], [0.0]], [[1.0], [0.0]]).static.round(12).tolist()
    (('a', 'mode 1'), [[0.75]])
    """
    checks = Gathering()
    checks.take(one, "structure", structure, MatrixStructure, "an ss.MatrixStructure")
    kept = checks.take(names, "keep", keep, "names of dofs")
    count = checks.take(whole, "modes", modes)
    checks.end()
    assert kept is not None
    assert count is not None
    dofs = structure.dofs
    for name in kept:
        if name not in dofs:
            checks.faults.append(Fault("keep", f"there is no dof '{name}'", remedy=suggestion(name, dofs)))
    if not kept or len(set(kept)) < len(kept):
        checks.faults.append(Fault("keep", found=str(list(kept)), expected="one dof or more, each once"))
    if not checks.faults and count > len(dofs) - len(kept):
        checks.faults.append(Fault("modes", found=str(count), expected=f"at most {len(dofs) - len(kept)}"))
    checks.end()
    T = _shapes(structure, [dofs.index(name) for name in kept], count)
    arguments = structure.arguments
    given = {name: arguments[name] for name in ("M", "C", "K", "gyroscopic", "circulatory") if name in arguments}
    small: dict[str, Any] = {name: _projected(matrix, T) for name, matrix in given.items()}
    for name, sign in (("M", 1.0), ("gyroscopic", -1.0), ("circulatory", -1.0)):
        if name in small:  # to the last bit
            small[name] = 0.5 * (small[name] + sign * small[name].T)
    loads = {name: T.T @ load for name, load in arguments["load_shapes"].items()}
    rest = {name: arguments[name] for name in ("loss_factor", "damping", "speed", "engine_order") if name in arguments}
    own = [*kept, *(modal_coordinate(k + 1) for k in range(T.shape[1] - len(kept)))]
    return MatrixStructure(**small, **rest, dofs=own, load_shapes=loads)


def _projected(matrix: Matrix, T: Array) -> Array:
    return np.asarray(T.T @ (matrix @ T), dtype=float)


def _shapes(structure: MatrixStructure, kept: list[int], count: int) -> Array:
    """Shapes (n, n_kept + k): static ones by each kept dof, then those of the others alone, M-orthonormal."""
    n = len(structure.dofs)
    others = np.setdiff1d(np.arange(n), kept)
    K, M = (sparse.csc_array(matrix) for matrix in (structure.static_stiffness, structure.M))
    inner, mass = K[others][:, others], M[others][:, others]
    T = np.zeros((n, len(kept)))
    T[kept, np.arange(len(kept))] = 1.0
    if not others.size:
        return T
    try:
        solve = sparse.linalg.splu(sparse.csc_array(inner))
    except RuntimeError:
        raise InputError(
            Fault("keep", "with these dofs held the others still move freely", remedy="keep one more dof of them")
        ) from None
    T[others] = -solve.solve(K[others][:, kept].toarray())
    own = [np.zeros((others.size, 0))]
    if count:
        own.append(_modes(0.5 * (inner + inner.T), mass, count))
    adjoint = -solve.solve(K[kept][:, others].T.toarray(), trans="T") - T[others]
    if np.abs(adjoint).max(initial=0.0) > 1e-10 * np.abs(T[others]).max(initial=0.0):
        own.append(adjoint)
    shapes = np.hstack(own)
    if shapes.shape[1]:
        shapes = _independent(shapes, mass)
    inside = np.zeros((n, shapes.shape[1]))
    inside[others] = shapes
    return np.hstack([T, inside])


def _modes(K: Any, M: Any, count: int) -> Array:
    """The lowest modes of symmetric matrices."""
    if K.shape[0] <= DENSE_LIMIT or count >= K.shape[0] - 1:
        from scipy.linalg import eigh

        return np.asarray(eigh(K.toarray(), M.toarray(), subset_by_index=(0, count - 1))[1])
    values, shapes = sparse.linalg.eigsh(K, k=count, M=M, sigma=0.0)
    return np.asarray(shapes[:, np.argsort(values)])


def _independent(shapes: Array, M: Any) -> Array:
    """An M-orthonormal basis of the same space."""
    size = np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes))
    shapes = shapes / size
    values, vectors = np.linalg.eigh(shapes.T @ (M @ shapes))
    kept = values > 1e-12 * values[-1]
    return np.asarray(shapes @ (vectors[:, kept] / np.sqrt(values[kept])))
