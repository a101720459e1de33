"""Free bodies: rigid-body modes, and elastic modes with their static residual.

With the mass-normalised rigid-body modes ``R`` the receptance is ``-R R^T / w^2`` and that of the elastic modes. At
rest a load that is in equilibrium by itself, ``R^T p = 0``, gives the elastic displacement without rigid part (inertia
relief); any other load has no static response [M. Geradin and D. J. Rixen, Mechanical Vibrations, 2015].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, names, suggestion, whole
from slipstick.solve.linear.factorisation import SingularMatrixError
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.structure.checks import directions
from slipstick.structure.matrix_checks import matrix_faults
from slipstick.structure.modal import ModalStructure
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import ModalReceptance
from slipstick.structure.reduction.request import real_matrices
from slipstick.structure.truncation import Truncation
from slipstick.typing import Array, Matrix, Reals
from slipstick.units import Units

MOST_RIGID = 6
_GAP = 1e-6
"""Squared frequency of a rigid-body mode over that of the first elastic one, at most."""
_SHIFT = 1e-2
"""Shift of the singular stiffness, over the first elastic squared frequency: each iteration leaves that error."""
_ROUNDS = 40
"""Iterations with the shifted stiffness, at most."""
_BALANCED = 1e-8
"""Resultant of forces in equilibrium, over their size: the rounding of stored modes."""
_DENSE = 400
"""Dofs up to which all modes are found by a dense solver."""


class FreeStructure(Structure):
    """Elastic modes with static residual, and rigid-body modes; made by :func:`free_structure`.

    Forces along a direction are in balance by themselves where they move nothing as a rigid body, such as those of a
    contact between two dofs on one line. Contacts have to be, and so have static loads together: a problem with others
    is refused. Mean displacements are those without rigid-body motion.

    Parameters
    ----------
    elastic
        Modes with frequencies above 0, and the elastic static compliance.
    rigid_shapes
        Mass-normalised rigid-body modes at the dofs, (n_dofs, n_rigid).
    """

    def __init__(self, *, elastic: ModalStructure, rigid_shapes: Reals) -> None:
        self.loss_factor = elastic.loss_factor
        self.elastic, self.rigid_shapes = elastic, directions("rigid_shapes", rigid_shapes, len(elastic.dofs))

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom."""
        return self.elastic.dofs

    @property
    def n_rigid(self) -> int:
        """Number of its rigid-body modes."""
        return self.rigid_shapes.shape[1]

    @property
    def units(self) -> Units | None:
        """Those of the elastic modes."""
        return self.elastic.units

    @property
    def load_shapes(self) -> tuple[str, ...]:
        """There are none."""
        return ()

    @property
    def natural_frequencies(self) -> Array:
        """Of the elastic modes, rad/s, ascending."""
        return self.elastic.natural_frequencies

    @property
    def damping_ratios(self) -> Array:
        """Damping ratio of each of them."""
        return self.elastic.damping_ratios

    @property
    def energy_fed(self) -> str:
        """Elastic modes that damping feeds energy into, in words; rigid-body motion is not damped."""
        return self.elastic.energy_fed

    @property
    def self_excited(self) -> str:
        """Modes that grow by stiffness: none."""
        return self.elastic.self_excited

    def truncations(self, order: int) -> tuple[Truncation, ...]:
        """Errors by the elastic modes left out."""
        return self.elastic.truncations(order)

    def own_compliance(self, along: Any) -> tuple[Array, Array]:
        """Elastic static compliances of directions over themselves, see ``ModalStructure.own_compliance``."""
        return self.elastic.own_compliance(along)

    @property
    def values(self) -> dict[str, float]:
        """Named parameters, those of the elastic modes."""
        return self.elastic.values

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of an equal structure."""
        return {"elastic": self.elastic, "rigid_shapes": self.rigid_shapes}

    def changed(self, **values: float) -> FreeStructure:
        """A copy with other parameters."""
        return FreeStructure(elastic=self.elastic.changed(**values), rigid_shapes=self.rigid_shapes)

    def unbalanced(self, columns: Array) -> Array:
        """Forces on the rigid-body modes (n_rigid, n_columns) of columns (n_dofs, n_columns), zero in equilibrium."""
        pushed = self.rigid_shapes.T @ columns
        most = np.linalg.norm(self.rigid_shapes, axis=0)[:, None] * np.linalg.norm(columns, axis=0)
        return np.where(np.abs(pushed) > _BALANCED * most, pushed, 0.0)

    def project(self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = ()) -> ModalReceptance:
        """Receptance between directions; its static part is elastic alone."""
        elastic = self.elastic.project(rows, columns, shapes).written()
        assert isinstance(elastic, ModalReceptance)
        r, c = (np.asarray(part, dtype=float) for part in (rows, columns))
        return elastic.with_rigid(r.T @ self.rigid_shapes, c.T @ self.rigid_shapes)

    def time_equations(
        self, rows: ArrayLike, columns: ArrayLike, shapes: Sequence[str] = (), *, damping_at: float | None = None
    ) -> TimeEquations:
        """Modal equations in time, of rigid-body modes too where any of the rows moves with them."""
        e = self.elastic.time_equations(rows, columns, shapes, damping_at=damping_at)
        r, c = (np.asarray(part, dtype=float) for part in (rows, columns))
        if not np.any(self.unbalanced(r)):
            return e
        free, held = self.rigid_shapes.shape[1], len(e.M)
        both = np.zeros((2, free + held, free + held))
        both[0, free:, free:], both[1, free:, free:] = e.C, e.K
        return TimeEquations(
            M=np.eye(free + held), C=both[0], K=both[1], feedthrough=e.feedthrough,
            rows=np.hstack([r.T @ self.rigid_shapes, e.rows]), columns=np.vstack([self.rigid_shapes.T @ c, e.columns]),
        )  # fmt: skip

    def __repr__(self) -> str:
        return f"FreeStructure({self.rigid_shapes.shape[1]} rigid-body modes, {self.elastic!r})"


def free_structure(
    K: Matrix, M: Matrix, *, dofs: Iterable[str], keep: Iterable[str], modes: int, loss_factor: Reals = 0.0,
    damping_ratio: Reals = 0.0,
) -> FreeStructure:  # fmt: skip
    """A body that is not held, reduced: its rigid-body modes, elastic modes and the static residual at kept dofs.

    Parameters
    ----------
    K, M
        Sparse or dense (n, n), symmetric; K singular by up to six rigid-body motions, M positive definite.
    dofs, keep
        Names of all dofs, and of those that are kept: loads, contacts, outputs.
    modes
        How many elastic modes.
    loss_factor, damping_ratio
        Of the elastic modes, see ``ss.ModalStructure``.

    Raises
    ------
    InputError
        For matrices at fault, names that are not there, and a body that is held: that is for ``ss.reduce``.

    Examples
    --------
    Two masses on a spring: in balance, a force between them stretches it by 1 / k.

    >>> pair = free_structure([[3.0, -3.0], [-3.0, 3.0]], np.eye(2), dofs=["a", "b"], keep=["a", "b"], modes=1)
    >>> pair.natural_frequencies.round(6), pair.project([[1.0], [-1.0]], [[1.0], [-1.0]]).static.round(9)
    (array([2.44949]), array([[0.33333333]]))
    """
    checks = Gathering()
    stiffness, mass = real_matrices(K, M)
    all_names = checks.take(names, "dofs", dofs, "the name of each dof, in order")
    kept = checks.take(names, "keep", keep, "names of dofs")
    count = checks.take(whole, "modes", modes, 1)
    checks.end()
    assert all_names is not None
    assert kept is not None
    assert count is not None
    faults = matrix_faults(stiffness, mass, all_names)
    if faults:
        raise InputError(faults)
    for name in kept:
        if name not in all_names:
            checks.faults.append(Fault("keep", f"there is no dof '{name}'", remedy=suggestion(name, all_names)))
    checks.end()
    n = len(all_names)
    B = np.zeros((n, len(kept)))
    B[[all_names.index(name) for name in kept], np.arange(len(kept))] = 1.0
    rigid, omega, shapes = _modes(stiffness, mass, min(count, n))
    U = _inertia_relief(stiffness, mass, rigid, B, omega[0])
    a, static = B.T @ shapes, B.T @ U
    second = U.T @ (mass @ U) - (a / omega**4) @ a.T
    elastic = ModalStructure(
        omega=omega, mode_shapes=a, dofs=kept, static_compliance=0.5 * (static + static.T),
        second_residual=0.5 * (second + second.T), loss_factor=loss_factor, damping_ratio=damping_ratio,
    )  # fmt: skip
    return FreeStructure(elastic=elastic, rigid_shapes=B.T @ rigid)


def _modes(K: Any, M: Any, count: int) -> tuple[Array, Array, Array]:
    """Rigid-body modes (n, r), frequencies (k,) and shapes (n, k) of the elastic ones."""
    n = K.shape[0]
    wanted = min(n, count + MOST_RIGID)
    if n <= _DENSE:
        from scipy.linalg import eigh

        values, shapes = eigh(K.toarray(), M.toarray(), subset_by_index=(0, wanted - 1))
    else:
        shift = -1e-6 * float(K.diagonal().sum() / M.diagonal().sum())
        try:
            found = BlockLanczos(K, M, shift=shift).modes(wanted)
        except SingularMatrixError as error:
            raise InputError(f"the stiffness matrix has negative eigenvalues: {error}") from error
        shapes = np.asarray(found.shapes)
        values = np.einsum("ik,ik->k", shapes, K @ shapes)
    size = np.maximum(np.abs(values), np.finfo(float).tiny)
    gaps = [r for r in range(1, min(MOST_RIGID, wanted - 1) + 1) if size[:r].max() < _GAP * values[r]]
    if not gaps:
        raise InputError(
            Fault(
                "K",
                "holds the body, or lets more than rigid-body motion go freely",
                remedy="of a body that is held use ss.reduce; look for mechanisms and parts that are not connected",
            )
        )
    r = gaps[-1]
    kept = slice(r, r + count)
    return shapes[:, :r], np.sqrt(values[kept]), shapes[:, kept]


def _inertia_relief(K: Any, M: Any, rigid: Array, B: Array, omega: float) -> Array:
    """Elastic displacements (n, k) by loads in equilibrium with inertia: ``K u = B - M R R^T B``, ``R^T M u = 0``.

    The stiffness is singular: it is solved for by iteration with a shift by the mass.
    """
    from slipstick.solve.linear.factorisation import factorise

    factors = factorise(sparse.csr_array(K + _SHIFT * omega**2 * M))
    for _ in range(3):  # rigid-body modes to rounding
        rigid = np.asarray(factors.solve(M @ rigid))
        values, vectors = np.linalg.eigh(rigid.T @ (M @ rigid))
        rigid = rigid @ (vectors / np.sqrt(values))
    load = B - (M @ rigid) @ (rigid.T @ B)
    U = np.zeros_like(B)
    for _ in range(_ROUNDS):
        change = np.asarray(factors.solve(load - K @ U))
        change -= rigid @ (rigid.T @ (M @ change))
        U += change
        if np.abs(change).max() <= 1e-14 * np.abs(U).max():
            break
    return U
