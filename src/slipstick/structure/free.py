"""Free bodies: rigid-body modes, and elastic modes with their static residual.

With the mass-normalised rigid-body modes ``R`` the receptance is ``-R R^T / w^2`` and that of the elastic modes. At
rest a load that is in equilibrium by itself, ``R^T p = 0``, gives the elastic displacement without rigid part (inertia
relief); any other load has no static response [M. Geradin and D. J. Rixen, Mechanical Vibrations, 2015].
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from slipstick.errors import Fault, InputError
from slipstick.faults import whole
from slipstick.solve.linear.factorisation import Factorisation, SingularMatrixError, factorise, shifted
from slipstick.solve.linear.lanczos import BlockLanczos
from slipstick.structure.checks import directions
from slipstick.structure.matrix_checks import matrix_faults
from slipstick.structure.modal import ModalStructure
from slipstick.structure.protocol import Structure, TimeEquations
from slipstick.structure.receptance import ModalReceptance
from slipstick.structure.reduction.compute import reduced_data
from slipstick.structure.reduction.data import Columns
from slipstick.structure.reduction.reduce import modal_structure
from slipstick.structure.reduction.request import Accuracy, checked_request, real_matrices
from slipstick.structure.truncation import Truncation
from slipstick.typing import AnyArray, Array, Matrix, Reals
from slipstick.units import Units

MOST_RIGID = 6
_GAP = 1e-6
"""Squared frequency of a rigid-body mode over that of the first elastic one, at most."""
_BALANCED = 1e-8
"""Resultant of forces in equilibrium, over their size: the rounding of stored modes."""


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

    Examples
    --------
    Two masses of 1 on a spring of 3, free to move together.

    >>> import numpy as np
    >>> import slipstick as ss
    >>> pair = ss.models.free_structure([[3, -3], [-3, 3]], np.eye(2), dofs=["a", "b"], keep=["a", "b"], modes=1)
    >>> pair.n_rigid, pair.natural_frequencies.round(4), abs(pair.rigid_shapes[:, 0]).round(4)
    (1, array([2.4495]), array([0.7071, 0.7071]))
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
    K: Matrix, M: Matrix, *, dofs: Iterable[str], keep: Iterable[str] | Any, modes: int,
    names: Iterable[str] | None = None, loss_factor: Reals = 0.0, damping_ratio: Reals = 0.0,
) -> FreeStructure:  # fmt: skip
    """A body that is not held, reduced: its rigid-body modes, elastic modes and the static residual at kept dofs.

    Parameters
    ----------
    K, M
        Sparse or dense (n, n), symmetric; K singular by up to six rigid-body motions, M positive definite.
    dofs
        Names of all dofs.
    keep
        Names of those that are kept: loads, contacts, outputs. Or a matrix (n, n_keep) of directions, see
        :func:`slipstick.reduce`.
    modes
        How many elastic modes.
    names
        Of the columns of ``keep`` when that is a matrix.
    loss_factor, damping_ratio
        Of the elastic modes, see ``ss.ModalStructure``.

    Raises
    ------
    InputError
        For matrices at fault, names that are not there, and a body that is held: that is for ``ss.reduce``.

    Examples
    --------
    Two masses on a spring: in balance, a force between them stretches it by 1 / k.

    >>> import numpy as np
    >>> pair = free_structure([[3.0, -3.0], [-3.0, 3.0]], np.eye(2), dofs=["a", "b"], keep=["a", "b"], modes=1)
    >>> pair.natural_frequencies.round(6), pair.project([[1.0], [-1.0]], [[1.0], [-1.0]]).static.round(9)
    (array([2.44949]), array([[0.33333333]]))
    """
    stiffness, mass = real_matrices(K, M)
    n = stiffness.shape[0]
    request = checked_request(
        n, keep=keep, dofs=dofs, names=names, loss_factor=loss_factor, damping_ratio=damping_ratio
    )  # fmt: skip
    count = whole("modes", modes, 1)
    faults = matrix_faults(stiffness, mass, request.dofs)
    if faults:
        raise InputError(faults)
    body = _Elastic(stiffness, mass)
    want = Accuracy(modes=min(count, n - body.rigid.shape[1]))
    iteration = BlockLanczos(stiffness, mass, factors=body)
    data = reduced_data(iteration, mass, Columns(request.directions, request.loads), want)
    elastic = modal_structure(data, request.kept, (), request.damping)
    return FreeStructure(elastic=elastic, rigid_shapes=request.directions.T @ body.rigid)


class _Elastic:
    """Factors of a stiffness that nothing holds, for its elastic motions alone; ``rigid`` are the others, (n, r).

    A body on r supports, as many as it has rigid-body motions, moves under forces in balance as if it were free: their
    reactions are zero. Its motion less the rigid part is ``K^+ b``, that of inertia relief, from one solution.
    """

    counted = None
    """No shift for which eigenvalues have been counted before."""

    def __init__(self, K: Any, M: Any) -> None:
        from scipy.linalg import qr

        self.K, self.M = K, M
        free, ordering = _rigid_motions(K, M)
        picks = qr(free.T, mode="r", pivoting=True)[1][: free.shape[1]]
        springs = np.zeros(K.shape[0])
        springs[picks] = K.diagonal()[picks]
        self.held = factorise(sparse.csr_array(K + sparse.diags_array(springs)), ordering=ordering)
        pushes = np.zeros_like(free)
        pushes[picks, np.arange(len(picks))] = springs[picks]
        rigid = self.held.solve(pushes)  # the motions that move one support by 1 each, to rounding
        for _ in range(2):
            values, vectors = np.linalg.eigh(rigid.T @ (M @ rigid))
            rigid = rigid @ (vectors / np.sqrt(values))
        self.rigid, self._momenta = rigid, M @ rigid

    def at(self, shift: float, solve: bool = True) -> Factorisation:
        """Those of ``K - shift M`` on elastic motions; other shifts than 0 only tell the inertia."""
        if solve:
            return replace(self.held, solver=self._elastic)
        made = factorise(shifted(self.K, self.M, shift), check=False, ordering=self.held.ordering)
        if made.inertia is None:
            return made
        inertia = made.inertia._replace(negative=made.inertia.negative - self.rigid.shape[1])
        return replace(made, inertia=inertia)

    def _elastic(self, forces: AnyArray) -> Array:
        """Elastic displacements (n, k) by forces less the inertia of the rigid motion that they cause."""
        balanced = forces - self._momenta @ (self.rigid.T @ forces)
        moved = self.held.solve(balanced)
        moved -= self.rigid @ (self._momenta.T @ moved)
        return np.asarray(moved)


def _rigid_motions(K: Any, M: Any) -> tuple[Array, Any]:
    """Motions (n, r) that K does not resist, nearly, and the ordering of its factors."""
    n = K.shape[0]
    shift = -1e-6 * float(K.diagonal().sum() / M.diagonal().sum())
    try:
        iteration = BlockLanczos(K, M, shift=shift)
        shapes = iteration.modes(min(n, MOST_RIGID + 1), count=False, last=True).shapes
    except SingularMatrixError as error:
        raise InputError(f"the stiffness matrix has negative eigenvalues: {error}") from error
    values = np.einsum("ik,ik->k", shapes, K @ shapes)
    if iteration.inertia is not None and iteration.inertia.negative:
        what = "has negative eigenvalues, so the body is unstable at rest"
        raise InputError(Fault("K", what, remedy="check signs, material data and any prestress"))
    size = np.maximum(np.abs(values), np.finfo(float).tiny)
    gaps = [r for r in range(1, len(values)) if size[:r].max() < _GAP * values[r]]
    if not gaps:
        raise InputError(
            Fault(
                "K",
                "holds the body, or leaves more than rigid-body motion without stiffness",
                remedy="of a body that is held use ss.reduce; look for mechanisms and parts that are not connected",
            )
        )
    return shapes[:, : gaps[-1]], iteration.ordering
