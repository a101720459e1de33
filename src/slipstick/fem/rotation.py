"""Models at speed: by centrifugal stress of their mesh, or between matrices given at several speeds.

In the frame that turns with the structure, at speed s about a unit axis a through a point o, the static displacement u
and the stiffness of small motions about it are those of

    f(u) = Mp (x + u - o),    K = df/du - Mp,    Mp = s^2 int rho N' (1 - a a') N,

with the elastic forces f of large displacements: K holds the centrifugal stress, the change of geometry
and spin softening, and at small strain it is ``K0 + s^2 K1``. Coriolis forces are those of the velocities,
``2 s int rho N' [a x] N u'``, a skew-symmetric matrix that is left out unless it is asked for.

Large displacements (total Lagrangian): with F = 1 + du/dx, the strain is ``E = (F'F - 1) / 2`` and the stress
``S = lambda tr(E) 1 + 2 mu E``. Nodal forces are ``int F S g_i`` with g_i the gradients of the shape functions, and the
stiffness is their derivative:

    K[a i, b j] = int lambda f_ia f_jb + mu ((F F')_ab g_i . g_j + f_ja f_ib) + delta_ab g_i . S . g_j,    f = F g.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csr_array

from slipstick.errors import Fault, InputError, Place
from slipstick.faults import SMALLEST, Gathering, in_radians, number, one, truth, warn, wrong
from slipstick.fem.assembly import Pattern, add_values, chunks, mass_values, pattern_of
from slipstick.fem.axis import Axis
from slipstick.fem.cyclic import Joined
from slipstick.fem.elements import Element
from slipstick.fem.geometry import solid_gradients
from slipstick.fem.materials import Materials, element_values
from slipstick.fem.mesh import Mesh
from slipstick.fem.model import ImportedModel
from slipstick.solve.linear.factorisation import SingularMatrixError, factorise
from slipstick.structure.reduction.store import Store
from slipstick.typing import Array, Frequency, IntArray, Sparse

_LARGE_STRAIN = 1e-2
"""Strain of the static state above which linear elasticity is doubtful: most metals yield below it."""

_MISSING_MASS = 1e-2
"""Share of the mass of the matrices that the mesh may lack without a warning."""

_PARTS = ("data", "indices", "indptr")
_STATE = ("displacement", "strain", "mass")

_CONVERGED_STEP = 1e-7
"""Last step over the displacement: Newton's method converges quadratically, so that the next step is below rounding."""
_MOST_ITERATIONS = 12
_SPEED_STEPS = (1, 4, 16)
"""Parts in which the square of the speed is brought up, one after another until a way succeeds."""


def at_speed(
    model: ImportedModel,
    speed: Frequency,
    *,
    axis: Axis | Mapping[str, Any] | None = None,
    others: Mapping[float, ImportedModel] | None = None,
    coriolis: bool = False,
) -> ImportedModel:
    """The model in a frame that turns with it: stiffness about its static state under centrifugal forces.

    Parameters
    ----------
    model
        At rest; with its mesh and materials, or with ``others``.
    speed
        rad/s, fixed for whatever is computed with the model.
    axis
        Of rotation, ``{"point": (0, 0, 0), "direction": (0, 0, 1)}``; not with ``others``, whose matrices hold it.
    others
        The same model by its other speeds, rad/s: then the stiffness is interpolated between the two nearest ones,
        linear in the square of the speed; else it is computed from the mesh.
    coriolis
        Whether ``C`` holds the Coriolis forces too, from the mesh: a skew-symmetric part that a ``MatrixStructure``
        uses, and a reduction to real modes names as left out.

    Returns
    -------
    ImportedModel
        With another ``K`` and with ``speed``; its last note says what was done.

    Raises
    ------
    InputError
        If it has no mesh or material, is not held, turns already, or the others are of another model.

    Warns
    -----
    SlipstickWarning
        A strain that no metal bears; mass that is not in the mesh.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (4, 1, 1), "hex20"), steel, ["x0"])
    >>> turning = ss.at_speed(beam, 1000.0, axis={"point": (0, 0, 0), "direction": (0, 1, 0)})
    >>> turning.speed
    1000.0
    """
    moving = turned_model(model, speed, axis=axis, others=others, coriolis=coriolis)
    warn(moving.warnings[len(model.warnings) :])
    return moving


def turned_model(
    model: Any, speed: Any, *, axis: Any = None, others: Any = None, cache: Path | None = None, coriolis: Any = False
) -> ImportedModel:
    """The same, stored in a folder; warnings are those of the model alone, not raised."""
    checks = Gathering()
    checks.take(one, "model", model, ImportedModel, "what ss.import_model returns")
    wanted = checks.take(_speed, speed)
    about = None if axis is None and others is not None else checks.take(Axis.of, axis)
    if axis is not None and others is not None:
        checks.faults.append(Fault("axis", "is given together with others", remedy="they hold it: leave it out"))
    by_speed = None if others is None else checks.take(_by_speed, others)
    coriolis = checks.take(truth, "coriolis", coriolis)
    if coriolis and others is not None:
        checks.faults.append(Fault("coriolis", "comes from a mesh, not from matrices", remedy="leave others out"))
    checks.end()
    assert wanted is not None
    if model.speed:
        raise InputError(Fault("speed", f"{model.source} is a model at {model.speed:g} rad/s already"))
    if model.loose_bolts:
        what = f"has bolts that are cut ({', '.join(model.loose_bolts)}), which nothing holds while it begins to turn"
        raise InputError(Fault("model", what, remedy="cut them afterwards: pretension_bolts(ss.at_speed(...))"))
    if by_speed is not None:
        return _between(model, by_speed, wanted)
    assert about is not None
    turning = kept_centrifugal(model, wanted, about, cache)
    moved = np.linalg.norm(turning.displacement, axis=1).max()
    velocities = model.C
    if coriolis:
        turned = wanted * coriolis_matrix(model, about)
        velocities = csr_array(turned if model.C is None else model.C + turned)
    forces = "are in C, unsymmetric" if coriolis else "are left out"
    return replace(
        model,
        C=velocities,
        K=csr_array(model.K + turning.stiffness),
        speed=wanted,
        notes=(
            *model.notes,
            f"at {wanted:g} rad/s about {_shown(about.direction)} through {_shown(about.point)}: largest static "
            f"displacement {moved:.4g}, strain {turning.strain:.3g}; Coriolis forces {forces}",
        ),
        warnings=(*model.warnings, *_mesh_warnings(model, turning)),
    )


def coriolis_matrix(model: ImportedModel, axis: Axis) -> csr_array:
    """``2 int rho N' [a x] N``, skew-symmetric (n, n) of the rows of a model: its Coriolis matrix for unit speed.

    The force on what moves at velocity v in a frame that turns at speed s about a is ``-2 rho s a x v``
    [M. Geradin and D. J. Rixen, Mechanical Vibrations, 2015]. InputError without a mesh or material.
    """
    mesh, materials = _meshed(model)
    pattern, motion = pattern_of(mesh), model.motion
    x, y, z = np.asarray(axis.direction, dtype=float).tolist()
    turned = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    blocks = 2.0 * mass_values(mesh, materials, pattern)[:, None, None] * turned
    return csr_array(motion.T @ pattern.vector_matrix(blocks) @ motion)


def _speed(speed: Any) -> float:
    return number("speed", in_radians("speed", speed), "a speed >= 0, rad/s", above=0.0)


def _by_speed(others: Any) -> dict[float, ImportedModel]:
    expected = "models by their speed > 0, rad/s"
    is_table = isinstance(others, Mapping) and bool(others)
    if not is_table or not all(isinstance(model, ImportedModel) for model in others.values()):
        raise wrong("others", others, expected)
    speeds = [number("others", in_radians("others", speed), expected, above=SMALLEST) for speed in others]
    return dict(zip(speeds, others.values(), strict=True))


def _shown(vector: ArrayLike) -> str:
    return f"({', '.join(f'{x:g}' for x in np.asarray(vector))})"


def _mesh_warnings(model: ImportedModel, turning: Centrifugal) -> Iterator[str]:
    if turning.strain > _LARGE_STRAIN:
        yield (
            f"{model.source}: the strain at speed is {turning.strain:.2g}, beyond what metals bear: check speed, axis "
            "and units"
        )
    along = (model.dof_components == np.arange(3)[:, None]).astype(float)
    mass = float(np.mean([e @ (model.M @ e) for e in along]))
    if abs(mass - turning.mass) > _MISSING_MASS * mass:
        yield (
            f"{model.source}: the mass is {mass:.4g}, that of the mesh {turning.mass:.4g}: centrifugal forces are "
            "those of the mesh"
        )


def _between(model: ImportedModel, others: Mapping[float, ImportedModel], speed: float) -> ImportedModel:
    """Matrices at a speed between those at which they are given, linear in its square."""
    known = {0.0: model, **others}
    speeds = sorted(known)
    if speed > speeds[-1]:
        raise InputError(
            Fault("speed", found=f"{speed:g}", expected=f"at most {speeds[-1]:g}, the highest speed with matrices")
        )
    low, high = next(pair for pair in pairwise(speeds) if speed <= pair[1])
    share = (speed**2 - low**2) / (high**2 - low**2)
    first, last = _stiffness_like(model, known[low]), _stiffness_like(model, known[high])
    note = f"at {speed:g} rad/s: stiffness between {low:g} and {high:g} rad/s, linear in the square of the speed"
    return replace(model, K=csr_array((1.0 - share) * first + share * last), speed=speed, notes=(*model.notes, note))


def _stiffness_like(model: ImportedModel, other: ImportedModel) -> Sparse:
    """The stiffness of another model in the order of rows of this one."""
    both, one_model = Place(f"{model.source} and {other.source}"), "matrices at speeds are of one model"
    order = np.argsort(_keys(other))
    place = order[np.searchsorted(_keys(other), _keys(model), sorter=order).clip(max=len(order) - 1)]
    if other.n_dofs != model.n_dofs or np.any(_keys(other)[place] != _keys(model)):
        raise InputError(Fault(both, "have different dofs", remedy=one_model))
    mass = other.M[place][:, place]
    if abs(mass - model.M).max() > 1e-6 * abs(model.M).max():
        raise InputError(Fault(both, "have different mass", remedy=one_model))
    return other.K[place][:, place]


def _keys(model: ImportedModel) -> IntArray:
    return model.dof_nodes * 8 + model.dof_components


@dataclass(frozen=True, kw_only=True)
class Centrifugal:
    """The static state of a turning body.

    Attributes
    ----------
    stiffness
        To be added to that at rest, sparse (n, n), of the rows of the model.
    displacement
        Static, of the nodes of the mesh, (n_nodes, 3).
    strain
        The largest static strain, without sign.
    mass
        Mass of the mesh that moves with the rows, mean over the three directions.
    """

    stiffness: csr_array
    displacement: Array
    strain: float
    mass: float

    def arrays(self) -> dict[str, Any]:
        """Arrays for the store, by name."""
        return {name: getattr(self.stiffness, name) for name in _PARTS} | {name: getattr(self, name) for name in _STATE}


def centrifugal(model: ImportedModel, speed: float, axis: Axis) -> Centrifugal:
    """The static state of a body that turns at a speed, rad/s, about an axis.

    Raises
    ------
    InputError
        If the model has no mesh or no material, is not held, or finds no static state at this speed.
    """
    mesh, materials = _meshed(model)
    return _state(_turning(model, mesh, materials, axis, model.K, model.motion, model.motion), speed)


def centrifugal_forces(model: ImportedModel, axis: Axis) -> Array:
    """Forces on the rows (n,) of a body that turns at one radian per time: ``int rho N r dV``, r from the axis.

    Of the mesh as it is, without its displacement: what that adds is in the stiffness of a model at speed.

    Raises
    ------
    InputError
        If the model has no mesh or no material.
    """
    mesh, materials = _meshed(model)
    pattern, along = pattern_of(mesh), np.asarray(axis.direction)
    arm = mesh.nodes - np.asarray(axis.point)
    arm -= np.outer(arm @ along, along)
    forces = pattern.scalar_matrix(mass_values(mesh, materials, pattern)) @ arm
    return np.asarray(model.restrict(forces.ravel()))


def _turning(
    model: ImportedModel,
    mesh: Mesh,
    materials: Materials,
    axis: Axis,
    K: csr_array,
    motion: csr_array,
    whole: csr_array,
) -> _Turning:
    pattern, along = pattern_of(mesh), np.asarray(axis.direction)
    return _Turning(
        model=model,
        K=K,
        mesh=mesh,
        materials=materials,
        pattern=pattern,
        motion=motion,
        whole=whole,
        mass=mass_values(mesh, materials, pattern),
        across=np.eye(3) - np.outer(along, along),
        origin=np.asarray(axis.point),
    )


def _state(turning: _Turning, speed: float) -> Centrifugal:
    linear = turning.linear(speed)
    for steps in _SPEED_STEPS:
        followed = turning.followed(linear, speed, steps)
        if followed is not None:
            return followed
    place, what = Place(turning.model.source), f"finds no static state at {speed:g} rad/s"
    raise InputError(Fault(place, what, remedy="check speed, axis and units"))


def sector_at_speed(model: ImportedModel, joined: Joined, speed: float) -> tuple[csr_array, str]:
    """Stiffness (n, n) of a sector alone about the state in which all sectors stand alike at a speed, rad/s.

    Returned with a note that says so.

    Raises
    ------
    InputError
        As ``centrifugal``.

    Warns
    -----
    SlipstickWarning
        A strain that no metal bears; mass that is not in the mesh.
    """
    mesh, materials = _meshed(model)
    alike, motion = joined.motion(0), model.motion
    K = csr_array(alike.T @ model.K @ alike)
    turning = _turning(model, mesh, materials, joined.axis, K, csr_array(motion @ alike), motion)
    state = _state(turning, speed)
    change = deformed(mesh, materials, turning.pattern, state.displacement)
    blocks = change.stiffness - speed**2 * turning.mass[:, None, None] * turning.across
    found = csr_array(model.K + motion.T @ turning.pattern.vector_matrix(blocks) @ motion)
    warn([*_mesh_warnings(model, state)])
    moved = np.linalg.norm(state.displacement, axis=1).max()
    return found, (
        f"at {speed:g} rad/s: largest static displacement {moved:.4g}, strain {state.strain:.3g}; Coriolis forces are "
        "left out"
    )


def _meshed(model: ImportedModel) -> tuple[Mesh, Materials]:
    if model.mesh is None or not model.materials:
        what = "mesh" if model.mesh is None else "material of its mesh"
        remedy = "import it too, or give matrices at two speeds"
        raise InputError(Fault(Place(model.source), f"forces of rotation need the {what}", remedy=remedy))
    return model.in_mesh("forces of rotation"), model.materials


@dataclass(frozen=True, kw_only=True)
class _Turning:
    """The parts of the equations; ``mass`` of every coupling (n_couplings,), ``across`` takes the axis out.

    ``motion`` is that of all nodes by the rows of K, ``whole`` by those of the model, whose faces may not be joined.
    """

    model: ImportedModel
    K: csr_array
    mesh: Mesh
    materials: Materials
    pattern: Pattern
    motion: csr_array
    whole: csr_array
    mass: Array
    across: Array
    origin: Array

    def linear(self, speed: float) -> Array:
        """The displacement (n,) by the stiffness at rest; InputError where that is singular."""
        residual, _, _ = self._at(np.zeros(self.K.shape[0]), speed**2)
        try:
            return -_solved(self.K, residual)
        except SingularMatrixError:
            what = "has rigid-body motion, nothing balances centrifugal forces"
            raise InputError(Fault(Place(self.model.source), what, remedy="constrain it")) from None

    def followed(self, linear: Array, speed: float, steps: int) -> Centrifugal | None:
        """The state at a speed, its square brought up in equal steps; None where Newton's method does not converge."""
        q = linear / steps
        for step in range(1, steps + 1):
            squared = speed**2 * step / steps
            for _ in range(_MOST_ITERATIONS):
                residual, stiffness, _ = self._at(q, squared)
                try:
                    change = _solved(csr_array(self.K + stiffness), residual)
                except SingularMatrixError:
                    return None
                q = q - change
                if not np.all(np.isfinite(q)):
                    return None
                if np.abs(change).max() <= _CONVERGED_STEP * np.abs(q).max():
                    break
            else:
                return None
        _, stiffness, strain = self._at(q, squared)
        return Centrifugal(
            stiffness=stiffness, displacement=self._displacement(q), strain=strain, mass=self._moving_mass()
        )

    def _displacement(self, q: Array) -> Array:
        return np.asarray(self.motion @ q).reshape(-1, 3)

    def _at(self, q: Array, squared: float) -> tuple[Array, csr_array, float]:
        """Residual (n,), stiffness beyond that at rest, and the largest strain."""
        u = self._displacement(q)
        change = deformed(self.mesh, self.materials, self.pattern, u)
        turned = (self.mesh.nodes + u - self.origin) @ self.across
        load = squared * (self.pattern.scalar_matrix(self.mass) @ turned)
        blocks = change.stiffness - squared * self.mass[:, None, None] * self.across
        stiffness = self.motion.T @ self.pattern.vector_matrix(blocks) @ self.motion
        residual = self.K @ q + self.motion.T @ (change.force - load).ravel()
        return np.asarray(residual), stiffness, change.strain

    def _moving_mass(self) -> float:
        along = np.asarray(self.whole @ (self.model.dof_components[:, None] == np.arange(3)).astype(float))
        along = along.reshape(-1, 9)
        return float((along * (self.pattern.scalar_matrix(self.mass) @ along)).sum()) / 3.0


def _solved(matrix: csr_array, right: Array) -> Array:
    if not (np.all(np.isfinite(matrix.data)) and np.all(np.isfinite(right))):
        raise SingularMatrixError("the matrix is not finite")
    return np.asarray(factorise(matrix).solve(right))


def kept_centrifugal(model: ImportedModel, speed: float, axis: Axis, folder: Path | None) -> Centrifugal:
    """``centrifugal``, read from the folder where it was computed before: found again by the content of its origin."""
    if folder is None or model.mesh is None or not model.materials:
        return centrifugal(model, speed, axis)
    about = [speed, *(np.asarray(vector).tolist() for vector in (axis.point, axis.direction)), list(model.mesh.blocks)]
    store = Store(folder, "speed", _origin(model), about, ("solve", "fem"))
    return store.kept(partial(centrifugal, model, speed, axis), partial(_stored, model))[0]


def _stored(model: ImportedModel, arrays: Mapping[str, Any]) -> Centrifugal | None:
    """None where the arrays are those of another model."""
    size = model.n_dofs
    stiffness = csr_array(tuple(arrays[name] for name in _PARTS), shape=(size, size))
    stiffness.check_format(full_check=True)
    displacement, strain, mass = (arrays[name] for name in _STATE)
    assert model.mesh is not None
    if displacement.shape != model.mesh.nodes.shape:
        return None
    return Centrifugal(stiffness=stiffness, displacement=displacement, strain=float(strain), mass=float(mass))


def _origin(model: ImportedModel) -> Iterator[Any]:
    """Matrices that tell the model, its mesh and its materials."""
    assert model.mesh is not None
    yield from (model.K, np.stack([model.dof_nodes, model.dof_components]), model.mesh.labels, model.mesh.nodes)
    if model.dependence is not None:
        yield from (model.dependence, model.dependent)
    yield from model.mesh.blocks.values()
    for of in (lambda m: m.lame, lambda m: m.shear_modulus, lambda m: m.density):
        yield from filter(len, element_values(model.mesh, model.materials, of).values())


Blocks = dict[tuple[int, int], Array]


@dataclass(frozen=True, kw_only=True)
class Deformed:
    """Changes by a displacement.

    Attributes
    ----------
    stiffness
        Beyond that without displacement, of every coupling, (n_couplings, 3, 3).
    force
        Nodal forces beyond ``K0 u``, (n_nodes, 3).
    strain
        The largest strain, without sign.
    """

    stiffness: Array
    force: Array
    strain: float


def deformed(mesh: Mesh, materials: Materials, pattern: Pattern, displacement: Array) -> Deformed:
    """Changes of the stiffness and forces of a mesh by a displacement (n_nodes, 3)."""
    lame = element_values(mesh, materials, lambda m: m.lame)
    shear = element_values(mesh, materials, lambda m: m.shear_modulus)
    blocks, force, largest = np.zeros((3, 3, pattern.n_couplings)), np.zeros((mesh.n_nodes, 3)), 0.0
    for element, part in chunks(mesh, 36):
        lam, mu = lame[element.name][part, None], shear[element.name][part, None]
        slots = pattern.slots[element.name][part].ravel()
        changes, forces, strain = _elements(mesh, element, part, displacement, lam, mu)
        for (a, b), values in changes.items():
            add_values(blocks[a, b], slots, values)
            if a != b:
                add_values(blocks[b, a], slots, values.transpose(0, 2, 1))
        nodes = mesh.blocks[element.name][part].ravel()
        for axis in range(3):
            force[:, axis] += np.bincount(nodes, forces[..., axis].ravel(), minlength=mesh.n_nodes)
        largest = max(largest, strain)
    return Deformed(stiffness=np.ascontiguousarray(blocks.transpose(2, 0, 1)), force=force, strain=largest)


def _elements(
    mesh: Mesh, element: Element, part: slice, displacement: Array, lam: Array, mu: Array
) -> tuple[Blocks, Array, float]:
    """Changes of the stiffness (n_elements, n, n) for axes a <= b, of the forces (n_elements, n, 3), largest strain."""
    nodes = mesh.blocks[element.name][part]
    gradients, weights = solid_gradients(mesh, element, part.start, nodes)
    slope = np.matmul(displacement[nodes].transpose(0, 2, 1)[:, None], gradients)  # du_a/dx_b, (e, q, 3, 3)
    linear = (slope + _transposed(slope)) / 2.0
    strain = linear + np.matmul(_transposed(slope), slope) / 2.0
    F, lam, mu = np.eye(3) + slope, weights * lam, weights * mu
    stress = _stress(strain, lam, mu)
    excess = np.matmul(F, stress) - _stress(linear, lam, mu)
    forces = np.matmul(gradients, _transposed(excess)).sum(axis=1)
    moved, still = (_elastic(gradients, deformation, lam, mu) for deformation in (F, np.eye(3) + 0.0 * slope))
    tension = _tension(gradients, stress)
    changes = {(a, b): moved[a, b] - still[a, b] + (tension if a == b else 0.0) for a, b in moved}
    return changes, forces, float(np.abs(strain).max())


def _transposed(matrices: Array) -> Array:
    return matrices.transpose(0, 1, 3, 2)


def _stress(strain: Array, lam: Array, mu: Array) -> Array:
    volume = np.trace(strain, axis1=2, axis2=3)
    return 2.0 * mu[..., None, None] * strain + (lam * volume)[..., None, None] * np.eye(3)


def _tension(gradients: Array, stress: Array) -> Array:
    """``g_i . S . g_j`` summed over the points; the stress holds their weights."""
    pulled = np.matmul(gradients, stress)
    total = sum(np.matmul(pulled[..., c].transpose(0, 2, 1), gradients[..., c]) for c in range(3))
    return (total + total.transpose(0, 2, 1)) / 2.0


def _elastic(gradients: Array, F: Array, lam: Array, mu: Array) -> Blocks:
    """Blocks of the elastic stiffness at a deformation F, for axes a <= b; moduli hold the weights of the points."""
    g, f = (values.transpose(3, 0, 2, 1) for values in (gradients, np.matmul(gradients, _transposed(F))))
    squared = np.matmul(F, _transposed(F))
    blocks = {}
    for a in range(3):
        for b in range(a, 3):
            scale = (mu * squared[:, :, a, b])[:, None, :]
            values = sum(np.matmul(g[c] * scale, g[c].transpose(0, 2, 1)) for c in range(3))
            values = values + np.matmul(f[a] * lam[:, None, :], f[b].transpose(0, 2, 1))
            values += np.matmul(f[b] * mu[:, None, :], f[a].transpose(0, 2, 1))
            blocks[a, b] = (values + values.transpose(0, 2, 1)) / 2.0 if a == b else values
    return blocks
