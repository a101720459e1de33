"""A finite element sector reduced to contact points, loads and named dofs, phase by phase."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_array, csr_array, hstack

from slipstick.errors import Fault, InputError
from slipstick.faults import (
    SMALLEST,
    Gathering,
    names,
    number,
    one,
    suggestion,
    warn,
    whole,
)
from slipstick.fem.assembly import assemble
from slipstick.fem.axis import Axis
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.cyclic import ON_FACE, CyclicSymmetry, Joined, Pairing, face_nodes, joined, paired
from slipstick.fem.expansion import TemperatureFields
from slipstick.fem.mesh import Surface, part_of, user_names
from slipstick.fem.model import ImportedModel
from slipstick.fem.retained import Neighbours, Retained, retain
from slipstick.fem.rotation import sector_at_speed
from slipstick.models.reduced import (
    ReducedModel,
    checked_fields,
    checked_options,
    damping_warnings,
    mode_faults,
    require_names,
    two_surfaces,
)
from slipstick.models.surface_pair import SurfacePair
from slipstick.solve.linear.cyclic import PhaseFactors, SectorFactors
from slipstick.structure.reduction.data import Columns, ReducedData
from slipstick.structure.reduction.reduce import judge_served
from slipstick.structure.reduction.request import Accuracy
from slipstick.structure.reduction.sector import SectorModes, reduce_phase
from slipstick.structure.reduction.store import Store
from slipstick.typing import Array, ComplexArray, Frequency, IntArray, Reals, Sparse, Temperature

if TYPE_CHECKING:
    from slipstick.solve.linear.modes import StageListener
    from slipstick.structure.cyclic import TravellingWave
    from slipstick.structure.disc import Disc


@dataclass(frozen=True, kw_only=True)
class Between:
    """Contact points between a sector and the next one.

    Attributes
    ----------
    high
        Points "h1", "h2", ... on the face towards the next sector, with its normals.
    turn
        Rotation (3, 3) from a sector to the next one: the points "l1", "l2", ... of the next one lie opposite.
    """

    high: ContactPoints
    turn: Array

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the degrees of freedom of both sides."""
        return (*self.high.dofs, *replace(self.high, side="l").dofs)


@dataclass(frozen=True, kw_only=True)
class ReducedSector(ReducedModel):
    """A reduced finite element sector of a disc.

    Attributes
    ----------
    structure
        Modes and residuals of its phases at the kept dofs: "c1x", "c1y", ... of the contact points, "h1x", ... and
        "l1x", ... of those between neighbours, then others, and the load shapes. Phases are computed when asked for.
    points
        The contact points on ``surface``; None without.
    between
        Those between neighbours; None without.
    axis, turn
        Of the disc; rotation (3, 3) from a sector to the next one.
    n_dofs
        Size of the sector, without its high face.
    distance
        The largest distance of two paired nodes of the faces, or of a node from the other face.
    source, notes, warnings
        Of the imported model, with what was done here.

    Examples
    --------
    >>> import slipstick as ss
    >>> sector = ss.reduced_sector(ss.models.bladed_sector("coarse"), surface="tip", contacts=2, modes=6)
    >>> sector.sectors, sector.points.dofs, len(sector.natural_frequencies(3))
    (24, ('c1x', 'c1y', 'c1z', 'c2x', 'c2y', 'c2z'), 6)
    """

    structure: SectorModes
    between: Between | None = field(repr=False)
    axis: Axis
    turn: Array = field(repr=False)
    distance: float
    phases: Phases = field(repr=False)
    model: ImportedModel = field(repr=False)

    @property
    def sides(self) -> dict[str, ContactPoints]:
        """Contact points by the letter of their names: "c" on the surface, "h" towards the next sector."""
        return super().sides | ({} if self.between is None else {"h": self.between.high})

    def cosines(self, side: str, vectors: Array) -> list[dict[str, float]]:
        """Motion at the points of a side along unit vectors (n, 3), by dof: of "h" less that of the next sector."""
        found = super().cosines(side, vectors)
        if side == "h":
            low = replace(self.sides[side], side="l").cosines(np.array([self.turn.T @ vector for vector in vectors]))
            for own, opposite in zip(found, low, strict=True):
                own |= {f"{name}@next": -value for name, value in opposite.items()}
        return found

    @property
    def sectors(self) -> int:
        """Number of sectors N."""
        return self.structure.sectors

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of the kept dofs."""
        return self.structure.dofs

    @property
    def seconds(self) -> Mapping[str, float]:
        """Time by nodal diameter, of those computed by now."""
        return self.phases.seconds

    @property
    def solver(self) -> str:
        """How phases were factorised; empty where everything was read from disk."""
        return self.phases.solver

    def travelling_wave(self, engine_order: int) -> TravellingWave:
        """The sector in a wave, see ``CyclicStructure.travelling_wave``."""
        return self.structure.travelling_wave(engine_order)

    def mistuned(
        self,
        stiffness: ArrayLike | None = None,
        blade: str | Sequence[str] | None = None,
        families: int | None = None,
        *,
        spread: float | None = None,
        seed: int = 0,
    ) -> Disc:
        """The whole disc with blades that differ in stiffness: see ``CyclicStructure.mistuned``.

        All phases are computed for it, which are not kept on disk.

        Parameters
        ----------
        blade
            Element sets that make the blade, whose stiffness (at rest) varies; needed where blades differ.
        """
        if blade is None:
            return self.structure.mistuned(stiffness, None, families, spread=spread, seed=seed)
        rows, share = _blade_share(self.model, blade)
        made, motion = {}, {}
        for k in range(self.sectors // 2 + 1):
            made[k], motion[k] = self.phases.with_motion(k, rows)
        sector = self.structure.with_blades(made, _by_stiffness(share, motion))
        return sector.mistuned(stiffness, None, families, spread=spread, seed=seed)

    def natural_frequencies(self, nodal_diameter: int) -> Array:
        """Undamped natural frequencies of the modes kept of a nodal diameter, rad/s, ascending."""
        return self.structure.natural_frequencies(nodal_diameter)

    def complete(self, nodal_diameter: int) -> bool | None:
        """Whether the inertia proved that no mode below the last is missing; None: the solver does not tell."""
        self.structure.phase_modes(nodal_diameter)
        return self.phases.complete.get(nodal_diameter)

    def modes_below(self, nodal_diameter: int, omega: float) -> int | None:
        """How many modes of a nodal diameter lie below a frequency, rad/s; one factorisation of the full sector."""
        return self.phases.modes_below(nodal_diameter, omega)

    def receptance_error(self, nodal_diameter: int, omega: float) -> float:
        """Relative error of the undamped receptance between the kept dofs against the full sector; one solution."""
        modes = self.structure.phase_modes(nodal_diameter)
        exact = self.phases.direct(nodal_diameter, omega)
        assert modes.second is not None
        a, w2 = modes.shapes, modes.omega**2
        found = (a * (1.0 / (w2 - omega**2) - 1.0 / w2)) @ a.conj().T + modes.static + omega**2 * modes.second
        return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))


class Phases:
    """The full sector, whose phases are reduced on demand.

    Parameters
    ----------
    joined
        How its faces are.
    K, M
        Of the sector alone, sparse (n, n).
    directions
        What is kept, sparse (n, n_keep).
    want
        How many modes.
    n_loads
        How many of the directions, the last ones, are load shapes: the response to each has the accuracy of ``want``.
    force
        Take a phase whose modes do not serve what is wanted.
    """

    def __init__(
        self, joined: Joined, K: Sparse, M: Sparse, directions: Sparse, want: Accuracy, *,
        n_loads: int = 0, cache: Path | None, listener: StageListener | None, force: bool = False,
    ) -> None:  # fmt: skip
        self.joined, self.directions, self.want = joined, csc_array(directions), want
        self.K, self.M = joined.coupled(K), joined.coupled(M)
        self._factors = SectorFactors(self.K, self.M, np.unique(joined.axial[joined.axial >= 0]))
        self._listener, self._force = listener, force
        # the estimate scales directions, and has loads among them; a measured error does not
        self._n_loads = 0 if want.highest is None else n_loads
        parts = (*self.K, *self.M, self.directions, joined.axial, joined.turn)
        self._store = Store(
            cache, "sector", parts, [joined.sectors, want, self._n_loads], ("solve", "structure", "fem")
        )
        self.seconds: dict[str, float] = {}
        self.complete: dict[int, bool | None] = {}
        self.solver = ""

    def matrices(self, k: int) -> tuple[Any, Any, Any]:
        """Stiffness, mass and kept directions of the phase ``2 pi k / N``: Hermitian, real where they are."""
        phase, left = self.joined.phase(k), self.joined.left(k)
        found = []
        for A0, A1 in (self.K, self.M):
            coupling = csr_array(phase * A1)
            A = csr_array(A0 + coupling + coupling.conj().T)
            if left is not None:
                A = csr_array(left.conj().T @ A @ left)
                A = csr_array((A + A.conj().T) * 0.5)
            found.append(_real(A))
        return found[0], found[1], _real(csc_array(self.joined.motion(k).conj().T @ self.directions))

    def __call__(self, k: int) -> ReducedData:
        """The reduction of the phase ``2 pi k / N``, computed or read."""
        began = perf_counter()
        of = partial(ReducedData.of, n_keep=self.directions.shape[1], n_loads=0)
        made, _ = self._store.kept(partial(self._reduced, k), of, f"-{k}")
        self._judge(k, made)
        self.seconds[f"nodal diameter {k}"] = perf_counter() - began
        return made

    def _reduced(self, k: int, rows: IntArray | None = None) -> ReducedData:
        """With the motion of some degrees of freedom of the sector by the modes, (n_rows, n_modes)."""
        K, M, B = self.matrices(k)
        observed = None if rows is None else csr_array(self.joined.motion(k)[rows].conj().T)
        n = B.shape[1] - self._n_loads
        columns = Columns(B[:, :n], B[:, n:].toarray(), observed)
        where = f"nodal diameter {k}"
        made = reduce_phase(K, M, columns, self.want, self._phase_factors(k), listener=self._listener, where=where)
        self.solver = made.solver
        return made

    def _judge(self, k: int, made: ReducedData) -> None:
        """The error of what was made or read, by the rule of bodies."""
        self.complete[k] = made.complete
        left_out = made.left_out(self.directions.shape[1])
        below, where = partial(self.modes_below, k), f"nodal diameter {k}"
        judge_served((left_out,), made.omega, self.want, self._force, below, where, made.error_estimate)

    def _phase_factors(self, k: int) -> PhaseFactors:
        return PhaseFactors(self._factors, self.joined.phase(k), self.joined.left(k))

    def with_motion(self, k: int, rows: IntArray) -> tuple[ReducedData, ComplexArray]:
        """The reduction of a phase, and the modes at some degrees of freedom of the sector, (n_rows, n_modes)."""
        made = self._reduced(k, rows)
        self._judge(k, made)
        return made, np.asarray(made.seen_modes, dtype=complex)

    def modes_below(self, k: int, omega: float) -> int | None:
        """How many modes lie below a frequency."""
        inertia = self._phase_factors(k).at(omega**2, solve=False).inertia
        return None if inertia is None else inertia.negative

    def direct(self, k: int, omega: float) -> Array:
        """The receptance between the kept dofs of the full sector, undamped."""
        B = self.matrices(k)[2]
        return np.asarray(B.conj().T @ self._phase_factors(k).at(omega**2).solve(B.toarray()))


def _real(A: Any) -> Any:
    """Without an imaginary part that is zero."""
    if np.iscomplexobj(A.data) and not A.data.imag.any():
        A = A.copy()
        A.data = np.ascontiguousarray(A.data.real)
    return A


def reduced_sector(
    model: ImportedModel,
    *,
    sectors: int | None = None,
    low: str | Sequence[str] | Sequence[int] | None = None,
    high: str | Sequence[str] | Sequence[int] | None = None,
    axis: Axis | Mapping[str, Reals] | None = None,
    tolerance: float | None = None,
    surface: str | Surface | Mapping[str, Any] | None = None,
    contacts: int | Reals = 8,
    radius: float | None = None,
    between: tuple[str, str] | None = None,
    between_contacts: int | Reals = 4,
    pressure: str | Mapping[str, str] | None = None,
    temperature: Mapping[str, Temperature] | None = None,
    initial_temperature: Temperature | None = None,
    keep: Sequence[str] = (),
    pairs: SurfacePair | Sequence[SurfacePair] = (),
    speed: Frequency = 0.0,
    modes: int | None = None,
    accuracy: float | None = None,
    up_to: Frequency | None = None,
    loss_factor: float = 0.0,
    damping_ratio: float = 0.0,
    force: bool = False,
    cache: str | Path | None = None,
    listener: StageListener | None = None,
) -> ReducedSector:
    """Reduce a finite element sector of a disc to contact points, loads and named dofs, for each nodal diameter.

    The nodes of the two faces are paired by rotation about the axis; where they are meshed differently, the nodes of
    the finer one follow the faces of the other one by its shape functions. The high face is that towards the next
    sector, whichever way round that is. Modes of a nodal diameter are computed when a wave, or a whole disc, needs
    them.

    Parameters
    ----------
    model
        What ``ss.import_model`` or ``ss.models.bladed_sector`` returns: the sector alone, held where the disc is.
    sectors
        Number of sectors N; left out where the model says it, as ``low``, ``high`` and ``axis`` then may be.
    low, high
        Faces towards the sector before and the next one: node sets or surfaces by name, one or several, or node labels.
    axis
        Of the disc, ``{"point": (0, 0, 0), "direction": (0, 0, 1)}``; by default z through the origin.
    tolerance
        Largest distance of paired nodes, length; by default a thousandth of the distance of neighbouring nodes. Where
        faces are meshed differently, that of a node from the other face; by default a twentieth of an edge.
    surface, contacts, radius
        Contact points "c1", "c2", ...: see :func:`slipstick.reduced_body`.
    between
        Surfaces (low, high) that touch those of the neighbours, as of shrouds: points "h1", ... on the high one and
        "l1", ... on the low one, opposite each other from sector to sector.
    between_contacts
        How many such points, or node labels or positions on the high surface.
    pressure
        Load shapes ``{name: surface}``: unit pressure into the body; a surface alone is named "pressure".
    temperature, initial_temperature
        Temperature fields of a sector by name, and the one without stress, as of :func:`slipstick.reduced_body`: load
        shapes "temperature NAME".
    keep
        Further dofs of the full model to keep, such as "n123y"; "HEAD z" is the mean motion of the surface or node set
        HEAD along z.
    pairs
        Contacts between two surfaces of the sector, from :func:`surface_pair`: their motions are kept.
    speed
        Of rotation about the axis, rad/s: the stiffness is that about the static state under centrifugal forces, with
        stress stiffening and spin softening (Coriolis forces are left out).
    modes
        Number of modes for each nodal diameter. With neither ``modes`` nor ``accuracy`` as many as the estimate of the
        error asks for: 1e-7 up to ten times the first natural frequency, and up to ``up_to``; 128 at most.
    accuracy
        Relative accuracy of the receptance up to ``up_to``, load shapes included, which sets the number of modes;
        measured against one solution of the full sector there.
    up_to
        Highest frequency of use, rad/s.
    loss_factor, damping_ratio
        Hysteretic loss factor; ratio to critical damping.
    force
        Take phases whose modes are too few for ``up_to``.
    cache
        Folder in which phases are kept and found again by content.

    Raises
    ------
    InputError
        For names that are not there, faces that do not meet (with the worst node and its distance), nodes held on one
        face alone, and a sector that is not held; when a phase is asked for, an error above 1e-2 up to ``up_to``,
        unless forced, and an ``up_to`` that is a natural frequency.
    EigenError
        When a phase is asked for, an ``accuracy`` that 512 modes do not reach.

    Warns
    -----
    SlipstickWarning
        A damping matrix, which is not used; faces that are meshed differently and lie more than a thousandth of an edge
        apart; a load shape without force. When a phase is asked for, computed or read: an error above 1e-4 that
        ``accuracy``, or 128 modes, leave.

    Examples
    --------
    >>> from slipstick.models import bladed_sector
    >>> sector = reduced_sector(bladed_sector("coarse"), surface="tip", contacts=2, modes=6)
    >>> sector.sectors, sector.dofs[:3], sector.natural_frequencies(3).size
    (24, ('c1x', 'c1y', 'c1z'), 6)
    """
    options, touching = _checked(
        model, sectors=sectors, axis=axis, tolerance=tolerance, between=between, speed=speed, loss_factor=loss_factor,
        damping_ratio=damping_ratio, surface=surface, contacts=contacts, radius=radius, pressure=pressure, keep=keep,
        pairs=pairs, modes=modes, accuracy=accuracy, up_to=up_to, force=force, cache=cache, listener=listener,
        temperature=temperature, initial_temperature=initial_temperature,
    )  # fmt: skip
    symmetry = _symmetry(model, options.pop("sectors"), low, high, options.pop("axis"))
    alone: ImportedModel = model if symmetry.alone is None else symmetry.alone
    if alone.speed or model.speed:
        raise InputError(Fault("model", "is a model at speed already", remedy="give speed here instead"))
    pairing, how = _joined(alone, symmetry, options.pop("tolerance"))
    notes = [_paired_note(pairing, symmetry)]
    K = alone.K
    if turning := options.pop("speed"):
        K, note = sector_at_speed(alone, how, turning)
        notes.append(note)
    number_of_modes, accuracy, highest = (options.pop(name) for name in ("modes", "accuracy", "up_to"))
    if accuracy is None:
        want = Accuracy(modes=number_of_modes, reach=highest or 0.0)
    else:
        want = Accuracy(relative=accuracy, highest=highest)
    require_names(alone, options, between=touching)
    sides = None
    if touching:
        low_face, high_face = touching
        sides = Neighbours(
            low=low_face, high=high_face, contacts=between_contacts, axis=symmetry.axis, turn=pairing.turn
        )
    joints = options.pop("pairs")
    heat = TemperatureFields.of(alone, options.pop("temperature"), initial_temperature)
    facing = [joint.facing for joint in joints]
    found = retain(alone, **options, between=sides, pairs=facing, temperature=heat)
    directions, names_kept = _with_loads(found, options["pressure"])
    warnings = [*damping_warnings(alone, "modes"), *_face_warnings(pairing), *(() if heat is None else heat.warnings)]
    warn(warnings)
    notes += [note for joint in joints for note in joint.notes] + ([] if heat is None else [*heat.notes(alone)])
    warnings += [warning for joint in joints for warning in joint.warnings]
    phases = Phases(
        how, K, alone.M, directions, want, n_loads=len(found.loads) if found.names else 0,
        cache=None if cache is None else Path(cache), listener=listener, force=force,
    )  # fmt: skip
    structure = SectorModes(
        dofs=names_kept, sectors=symmetry.sectors, load_shapes=tuple(found.loads), loss_factor=loss_factor,
        damping_ratio=damping_ratio, compute=phases,
    )  # fmt: skip
    structure.units = model.unit_names
    return ReducedSector(
        structure=structure, points=found.points, axis=symmetry.axis,
        between=Between(high=found.sides["h"], turn=pairing.turn) if touching else None, turn=pairing.turn,
        n_dofs=how.n, distance=pairing.distance, source=f"{alone.source}; units: {alone.units_told}",
        notes=(*alone.notes, *notes), warnings=(*alone.warnings, *warnings), phases=phases, model=alone,
    )  # fmt: skip


def _checked(model: Any, **given: Any) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Checked arguments of numbers and tables, and the surfaces that touch the neighbours."""
    gathering = Gathering()
    gathering.take(one, "model", model, ImportedModel, "what ss.import_model or ss.models.bladed_sector returns")
    options = {
        "sectors": gathering.optional(whole, "sectors", given["sectors"], 2, 1000),
        "axis": None if given["axis"] is None else gathering.take(Axis.of, given["axis"]),
        "speed": gathering.take(_speed, given["speed"]),
        "tolerance": gathering.optional(number, "tolerance", given["tolerance"], "a length > 0", above=SMALLEST),
        **checked_options(gathering, **given),
        "temperature": checked_fields(gathering, given["temperature"], given["initial_temperature"]),
    }
    gathering.take(number, "loss_factor", given["loss_factor"], "a number >= 0", above=0.0)
    gathering.take(number, "damping_ratio", given["damping_ratio"], "a number")
    gathering.faults += mode_faults(given)
    between = gathering.take(two_surfaces, "between", given["between"])
    gathering.end()
    return options, between or ()


def _speed(given: Any) -> float:
    from slipstick.faults import in_radians

    return number("speed", in_radians("speed", given), "a speed >= 0, rad/s", above=0.0)


def _symmetry(model: ImportedModel, sectors: int | None, low: Any, high: Any, axis: Axis | None) -> CyclicSymmetry:
    """The symmetry as given, completed by that of the model."""
    known = model.symmetry
    given: dict[str, Any] = {"sectors": sectors, "axis": axis, "low": low, "high": high}
    if known is None:
        given["axis"] = axis or Axis()
        missing = [
            Fault(name, f"is not given, and {model.source or 'the model'} does not say it", remedy=remedy)
            for name, remedy in (
                ("sectors", "give how many sectors make the ring"),
                ("low", "give the face towards the sector before, a node set or surface"),
                ("high", "give the face towards the next sector, a node set or surface"),
            )
            if given[name] is None
        ]
        if missing:
            raise InputError(missing)
        return CyclicSymmetry(**given)
    return replace(known, **{name: value for name, value in given.items() if value is not None})


def _joined(model: ImportedModel, symmetry: CyclicSymmetry, tolerance: float | None) -> tuple[Pairing, Joined]:
    known = np.unique(np.concatenate([model.dof_nodes, model.constrained[:, 0], model.dependent[:, 0]]))
    gathering = Gathering()
    low = gathering.take(face_nodes, symmetry.low, model.nodes_of, known, "low")
    high = gathering.take(face_nodes, symmetry.high, model.nodes_of, known, "high")
    gathering.end()
    assert low is not None
    assert high is not None
    pairing = paired(symmetry, low, high, (model.positions(low), model.positions(high)), tolerance, model.mesh)
    return pairing, joined(model.dof_nodes, model.dof_components, pairing, symmetry, model.dependent[:, 0])


def _paired_note(pairing: Pairing, symmetry: CyclicSymmetry) -> str:
    along = np.asarray(symmetry.axis.direction)
    spin = float(along @ [pairing.turn[2, 1] - pairing.turn[1, 2], pairing.turn[0, 2] - pairing.turn[2, 0],
                          pairing.turn[1, 0] - pairing.turn[0, 1]])  # fmt: skip
    way = "with" if spin > 0.0 else "against"
    axis = f" and {len(pairing.on_axis)} on the axis" if len(pairing.on_axis) else ""
    numbered = f"sectors are numbered {way} the turning sense of the axis"
    if not pairing.between:
        return (
            f"{len(pairing.low)} nodes of the faces paired{axis}, {pairing.distance:.2g} apart at most (up to "
            f"{ON_FACE:g} of an edge is taken); {numbered}"
        )
    (lead, _), (follow, nodes) = pairing.leading, pairing.following
    return (
        f"the faces are meshed differently: {len(nodes)} nodes of {follow} follow the faces of {lead} by shape "
        f"functions{axis}, {pairing.between} of them between its nodes, {_distance(pairing)} at most; {numbered}"
    )


def _distance(pairing: Pairing) -> str:
    return f"{pairing.distance:.2g}, {pairing.distance / pairing.edge:.2g} of an edge, apart"


def _face_warnings(pairing: Pairing) -> Iterator[str]:
    """Faces that are meshed differently and do not lie on each other."""
    if pairing.between and pairing.distance > ON_FACE * pairing.edge:
        lie = f"the faces lie up to {_distance(pairing)} when turned onto each other"
        yield f"{lie}: a rigid rotation strains the joint"


def _with_loads(found: Retained, pressure: Mapping[str, str]) -> tuple[csc_array, tuple[str, ...]]:
    """Retained directions with a column for each load shape, and the names of all; phases treat both alike."""
    if not found.names and not found.loads:
        remedy = 'give surface = "NAME" for contacts on a surface, between, or keep = ["n123y"]'
        raise InputError(Fault("surface", "nothing is kept", remedy=remedy))
    for name, load in found.loads.items():
        if not load.any():
            on = f"the nodes of '{pressure[name]}' are held" if name in pressure else "all nodes are held"
            raise InputError(Fault(("pressure", name), f"does no work: {on}"))
    twice = {*found.loads} & {*found.names}
    if twice:
        raise InputError(Fault("pressure", f"'{min(twice)}' is the name of a dof too", remedy="choose another"))
    columns = [found.directions, *(load[:, None] for load in found.loads.values())]
    return csc_array(hstack([csc_array(part) for part in columns])), (*found.names, *found.loads)


def _blade_share(model: ImportedModel, blade: Any) -> tuple[IntArray, Any]:
    """Rows of the model that some element sets move, (n,), and the stiffness of these between them, sparse (n, n)."""
    sets = names("blade", blade)
    mesh, materials = model.mesh, model.materials
    if mesh is None or not materials:
        raise InputError(Fault("blade", f"{model.source} has no mesh with material", remedy="import it too"))
    unknown = [name for name in sets if name not in mesh.element_sets]
    if unknown or not sets:
        known = suggestion(unknown[0] if unknown else "", user_names(mesh.element_sets))
        raise InputError(Fault("blade", f"there is no element set '{unknown[0] if unknown else ''}'", remedy=known))
    chosen = {
        kind: np.unique(np.concatenate([mesh.element_sets[name].get(kind, np.zeros(0, np.int64)) for name in sets]))
        for kind in mesh.blocks
    }
    model.in_mesh("blades that differ")
    K = csr_array(model.motion.T @ assemble(part_of(mesh, chosen), materials).stiffness @ model.motion)
    rows = np.flatnonzero(np.diff(K.indptr))
    return rows, K[rows][:, rows]


_STRAINED = 1e-14
"""Strain energy of a motion of the blade, over the largest one, below which it is rounding of no energy."""


def _by_stiffness(share: Any, motion: Mapping[int, ComplexArray]) -> dict[int, ComplexArray]:
    """Motions (n, n_modes) by phase in fewer coordinates, in which the stiffness is 1: ``F`` with ``W' K W = F' F``."""
    ends = np.cumsum([0, *(W.shape[1] for W in motion.values())])
    every = np.hstack([*(W.real for W in motion.values()), *(W.imag for W in motion.values())])
    values, vectors = np.linalg.eigh(every.T @ (share @ every))
    strained = values > _STRAINED * values[-1]
    F = np.sqrt(values[strained])[:, None] * vectors[:, strained].T
    half = F.shape[1] // 2
    return {k: F[:, a:b] + 1j * F[:, half + a : half + b] for k, a, b in zip(motion, ends[:-1], ends[1:], strict=True)}
