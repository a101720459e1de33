"""The motion of a body's whole surface along a branch, from the forces on its dofs: how it looks while it vibrates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from slipstick.balance.balance import Balance
from slipstick.errors import InputError
from slipstick.results.truncation import moved
from slipstick.structure.skin import AtSkin, Skin
from slipstick.typing import Array

if TYPE_CHECKING:
    from slipstick.balance.problem import Problem
    from slipstick.branch import Branch
    from slipstick.results.table import ResultTable

LEFT_OUT = 1e-4
"""What is left out of the motion of the skin, relative to the largest along the branch."""


@dataclass(frozen=True, kw_only=True)
class Deflection:
    """Motion of a skin at n points of a branch: ``fields @ coefficients``.

    ``fields`` (3 n_nodes, k) are orthonormal shapes, the largest first; ``coefficients`` (n, k, L) what each of them
    does, length.
    """

    skin: Skin
    fields: Array
    coefficients: Array

    def at(self, point: int) -> Array:
        """Displacement coefficients of all nodes at a point, (n_nodes, 3, L)."""
        fields: Array = (self.fields @ self.coefficients[point]).reshape(-1, 3, self.coefficients.shape[2])
        return fields


def deflection_of(branch: Branch, *, small: float = LEFT_OUT) -> Deflection:
    """The motion of the surface at every point of a branch; shapes that add less than ``small`` are left out.

    Raises
    ------
    InputError
        Where the problem is not known, or its structure has no skin.
    """
    if branch.problem is None:
        raise InputError(f"the problem of this branch is not known: {branch.without}")
    skin = getattr(branch.problem.structure, "skin", None)
    if skin is None:
        raise InputError("the structure of this branch has no surface to be seen; a model with a mesh has one")
    basis = skin.basis
    motion = np.concatenate([_motion(balance, skin, basis, data) for balance, data in _parts(branch)])
    n, k, L = motion.shape
    shapes, sizes, _ = np.linalg.svd(motion.transpose(1, 0, 2).reshape(k, n * L), full_matrices=False)
    kept = max(1, int(np.sum(sizes > small * sizes[0])) if sizes.size else 1)
    kept_shapes = shapes[:, :kept]
    return Deflection(skin=skin, fields=basis @ kept_shapes, coefficients=kept_shapes.T @ motion)


def _parts(branch: Branch) -> Iterator[tuple[Balance, ResultTable]]:
    """Points of one problem together: all of them, or one by one where a parameter was followed."""
    problem: Problem | None = branch.problem
    assert problem is not None
    if not branch.table.attrs.get("parameter"):
        yield Balance(problem), branch.table
        return
    for point in range(len(branch)):
        yield Balance(branch.problem_at(point)), branch.table.at([point])


def _motion(balance: Balance, skin: Skin, basis: Array, data: ResultTable) -> Array:
    """Coefficients (n, k, L) of the basis."""
    problem = balance.problem
    at_skin = AtSkin(problem.structure, skin, basis)  # type: ignore[arg-type]
    receptance = problem.load_columns.receptance(at_skin, np.zeros((0, 0)), balance.directions)  # type: ignore[arg-type]
    omega = data["omega"].to_numpy()
    P = np.broadcast_to(-problem.inputs.P, (len(omega), *problem.inputs.P.shape))
    G = np.concatenate([_forces(balance, data), P], axis=1)
    out = moved(receptance, balance.orders, G[:, :, 1:], omega, [{}] * len(omega))
    out[:, :, 0] = -(G[:, :, 0] @ receptance.static.T)
    return out


def _forces(balance: Balance, data: ResultTable) -> Array:
    """Forces at the ports (n, n_ports, L)."""
    force = np.zeros((data.sizes["point"], balance.n_ports, balance.L))
    for batch in balance.batches:
        for name, port in zip(batch.law.force_names, batch.ports, strict=True):
            force[:, port.rows] = data[f"{name}_force"].to_numpy()[:, batch.elements][:, port.members]
    return force
