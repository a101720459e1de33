"""Friction contacts between two surfaces of a finite element model whose meshes need not match."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from slipstick.analysis.preload.preload import Preload
from slipstick.balance.contacts import ContactPair, Direction
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.contact.friction import FrictionContact
from slipstick.contact.names import block_of
from slipstick.errors import Fault, InputError
from slipstick.faults import (
    MOST_ITEMS,
    SMALLEST,
    Gathering,
    Name,
    number,
    one,
    path,
    shown,
    table,
    text,
    warn,
    whole,
    wrong,
)
from slipstick.fem.contact_points import ContactPoints
from slipstick.fem.interfaces import pair_of
from slipstick.fem.loads import area, area_vector
from slipstick.fem.mesh import Mesh, Surface
from slipstick.fem.model import FiniteElementModel, ImportedModel
from slipstick.fem.surface_pairs import Facing, facing_nodes, facing_points, patches_of, thinned
from slipstick.fem.ties import face_size, project
from slipstick.fem.unit_systems import other_units
from slipstick.models.mapped_pressure import NAMES, MappedPressure, mapped_pressure
from slipstick.typing import Array, IntArray, Real, Reals

GEOMETRY, TOUCHING = "geometry", "touching"
PRESSED = "pressed"
"""What becomes of the gaps of surfaces whose pressures a file gives."""

FACES, NODES = "faces", "nodes"

MOST_CONTACTS = 20_000
"""Each keeps three dofs, of which the reduction is a full matrix."""

_COLUMNS = 'names of columns by what they are, such as {"pressure": "CPRESS"}'

_UNMATCHED = 0.01
"""Share of both surfaces that may lie beside the other one without a warning: the smaller one should be covered."""

_TWICE = 0.05
"""Share of a surface that may count twice without a warning: curved ones across a gap have no area that is exact."""

_ROUNDING = 1e-9
"""Gaps of this share of a face are rounding."""

_SOFTER = 0.5
"""Share of the resistance to a rotation that patches may lose without a warning."""


_LEAST_PRESSED = 1e-4
"""Share of the mean pressure from which ``kt`` grows: what is open has some stiffness where it closes."""


class SurfacePair(list[ContactPair]):
    """Contacts between two surfaces, a list of ``ContactPair``; made by :func:`slipstick.surface_pair`.

    Attributes
    ----------
    name
        Of the pair: its contacts are "NAME 1", "NAME 2", ...
    points
        Positions midway, normals out of the first surface, and areas of the contacts.
    gaps
        Distance between the surfaces at each contact, (n,), as the contacts have it, without the gap of the law;
        negative where they overlap.
    softer
        Share of the resistance of the joint's springs to a rigid rotation that patches lose, over all axes the most;
        0 without ``points``.
    mapped
        Pressures of a file at the contacts; None without one.
    friction
        The coefficient that the model's file states, and whether it is used; empty where there is nothing to tell.
    notes, warnings
        What was found of the two surfaces; what is suspicious.

    Examples
    --------
    Two blocks with a gap of 1 mm between them.

    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.mesh import together
    >>> from slipstick.fem.model import elastic_model
    >>> low, high = box((1.0, 1.0, 0.2), (2, 2, 1)), box((1.0, 1.0, 0.2), (2, 2, 1), at=(0.0, 0.0, 0.201))
    >>> steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    >>> model = elastic_model(together({"low": low, "high": high}), steel, ["low.z0", "high.z1"])
    >>> law = ss.PlanarFrictionContact(kt=1e12, kn=1e12, mu=0.3, gap=0.0)
    >>> joint = ss.surface_pair(model, "low.z1", "high.z0", contact=law, points=4)
    >>> len(joint), joint.points.areas.round(9).tolist(), joint.gaps.round(9).tolist()
    (4, [0.25, 0.25, 0.25, 0.25], [0.001, 0.001, 0.001, 0.001])
    """

    def __init__(
        self, contacts: Sequence[ContactPair], *, name: str, facing: Facing, gaps: Array, softer: float,
        notes: Sequence[str], warnings: Sequence[str], mapped: MappedPressure | None = None, friction: str = "",
        order: IntArray | None = None,
    ) -> None:  # fmt: skip
        super().__init__(contacts)
        self._order = order
        self.mapped, self.friction = mapped, friction
        self.name, self.facing, self.gaps, self.softer = name, facing, gaps, softer
        self.notes, self.warnings = tuple(notes), tuple(warnings)

    @property
    def points(self) -> ContactPoints:
        """The contact points, one for each contact."""
        points = self.facing.points
        if self._order is None:
            return points
        parts = {name: getattr(points, name)[self._order] for name in ("positions", "normals", "areas")}
        return replace(points, **parts)

    def replaced_in(self, problem: Problem) -> Problem:
        """The problem with these contacts in the place of those that have the name of this joint.

        Raises InputError where there are none.
        """
        others = [pair for pair in problem.contacts if block_of(pair.name) != self.name]
        if len(others) == len(problem.contacts):
            what = f"has no contacts '{self.name}'"
            raise InputError(Fault("problem", what, remedy="give a problem with the contacts of this joint"))
        first = next(k for k, pair in enumerate(problem.contacts) if block_of(pair.name) == self.name)
        return replace(problem, contacts=[*others[:first], *self, *others[first:]], told=None)

    def gathered(self, patches: int, state: Preload, *, exponent: Real = 0.0) -> SurfacePair:
        """The contacts in fewer patches that move as one, each contact with its own pressure after load steps.

        A patch has the unknowns of one contact, and begins to slip point by point, the least pressed ones first. It
        moves as the mean of its points by area. The shape of the surfaces within it stays that of the load steps: the
        gap of each point is set to the difference. Contacts of the result are called "NAME k.j"; they move on what the
        reduction kept for these ones, so they belong to problems with the same structure.

        Parameters
        ----------
        patches
            How many.
        state
            Load steps of a problem with these contacts; the last one counts.
        exponent
            Power of the pressure with which ``kt`` grows: that of the law holds at the mean pressure of the surface.
            0: it is the same everywhere; 1/3: as of round summits that all touch (``hertz_mindlin``).

        Returns
        -------
        SurfacePair
            To be loaded by the same steps, and to vibrate.

        Raises
        ------
        InputError
            For more patches than contacts, and for contacts that are gathered already, that the load steps do not have,
            or that none presses.
        """
        gathering = Gathering()
        count = gathering.take(whole, "patches", patches, 1, MOST_ITEMS)
        power = gathering.take(number, "exponent", exponent, "a power >= 0, such as 1/3", above=0.0)
        gathering.take(one, "state", state, Preload, "what ss.preload(...) returns")
        if self._order is not None:
            gathering.faults.append(
                Fault("patches", "the contacts are gathered already", remedy="gather the first ones")
            )
        gathering.end()
        assert count is not None
        assert power is not None
        if count > len(self):
            expected = f"at most {len(self)}, the number of contacts"
            raise InputError(Fault("patches", found=str(count), expected=expected))
        last = state.dataset.isel(step=-1)
        names = [pair.name for pair in self]
        if not set(names) <= set(last["contact"].to_numpy().tolist()):
            what = f"has no contacts '{names[0]}'"
            raise InputError(Fault("state", what, remedy="compute the load steps of a problem with these contacts"))
        last, areas = last.sel(contact=names), self.facing.points.areas
        force, opened = last["normal_force"].to_numpy(), last["gap"].to_numpy()
        if not force.any():
            raise InputError(
                Fault("state", f"nothing presses contacts '{self.name}'", remedy="tighten the bolts first")
            )
        values = {
            key: np.array([pair.contact.values[key] for pair in self], dtype=float) for key in self[0].contact.values
        }
        moved = force / values["kn"] - opened + values["gap"]
        if "kt" in values:
            values["kt"] *= np.maximum(force / areas * areas.sum() / force.sum(), _LEAST_PRESSED) ** power
        owner, contacts = patches_of(self.facing.points, count), list[ContactPair]()
        members = [np.flatnonzero(owner == k) for k in range(int(owner.max()) + 1)]
        for k, own in enumerate(members, 1):
            shares = areas[own] / areas[own].sum()
            gap = values["gap"][own] + shares @ moved[own] - moved[own]
            law = self[own[0]].contact.changed(**{key: value[own] for key, value in values.items()} | {"gap": gap})
            ways = {port: _mean([self[e].given[port][0] for e in own], shares) for port in self[own[0]].given}
            along, across = ways.pop("tangential", None), ways.pop("normal")
            contacts.append(
                ContactPair(
                    name=f"{self.name} {k}", contact=law, tangential=along, normal=across, ports=ways or None,
                    area=areas[own],
                )
            )  # fmt: skip
        told = f"{len(contacts)} patches move as one each, of {len(areas)} contacts with their own pressure"
        return SurfacePair(
            contacts, name=self.name, facing=self.facing, gaps=self.gaps, softer=self.softer,
            notes=[*self.notes, f"contacts '{self.name}': {told}"], warnings=self.warnings, friction=self.friction,
            order=np.concatenate(members),
        )  # fmt: skip

    @property
    def loads(self) -> list[Load]:
        """Static loads that hold the pressures of a file: forces on both sides that press them together.

        With them the contacts carry these pressures at rest, and the bodies stay as they are. None without a file.
        """
        if self.mapped is None:
            return []
        forces = self.mapped.pressures * self.points.areas
        return [
            Load(dof=dof, harmonic=0, cos=float(force) * cosine)
            for normal, force in zip(self.points.normal, forces, strict=True)
            if force > 0.0
            for dof, cosine in normal.items()
        ]


def surface_pair(
    model: ImportedModel,
    first: str | Surface,
    second: str | Surface,
    *,
    contact: FrictionContact,
    name: str = "joint",
    points: int | None = None,
    gap: Literal["geometry", "touching"] = "geometry",
    method: Literal["faces", "nodes"] = "faces",
    direction: Reals | None = None,
    within: float | None = None,
    pressure: str | Path | None = None,
    columns: Mapping[str, str] | None = None,
) -> SurfacePair:
    """Contacts "NAME 1", "NAME 2", ... between two surfaces of a model, whose meshes need not match.

    Every point moves as the difference of the two surfaces there, each by the shape functions of its face. Give the
    list as ``pairs`` to :func:`reduced_body` or :func:`reduced_sector`, which keeps these motions,
    "NAME_1x", "NAME_1y", "NAME_1z", ..., and as ``contacts`` to :class:`Problem`.

    Parameters
    ----------
    model
        With the mesh of both bodies; what :func:`import_model` returns.
    first, second
        Two surfaces, by name or as surfaces of the mesh. Normals are those of the first one. The order does not matter.
    contact
        The law, with ``kt`` and ``kn`` per area (force/length^3), and either ``gap``, which is added to that of the
        geometry, or ``normal_load`` per area, the pressure that interference gives on top of it. A
        ``PlanarFrictionContact`` slides along the surface in any direction. Without ``mu`` it has that of
        ``model.contact_pairs`` for these two surfaces.
    name
        In names of parameters it stands for all of the contacts: "NAME.mu".
    points
        How many patches of points stand for all of them, each with its area, its centroid and the mean of its motion
        and gap; None: every point of integration. A few dozen are enough for most joints; ``softer`` of the result
        estimates what they lose.
    gap
        "geometry": as meshed, an overlap presses; "touching": zero everywhere, as ``ADJUST`` of Abaqus makes it.
    method
        "faces": points of integration on the common refinement of both surfaces, which transmit a constant pressure
        exactly where faces are flat triangles or parallelograms. "nodes": the nodes of the first surface with their
        shares of its area against the second one, which is simpler and transmits it approximately.
    direction
        The first sliding direction (3,), projected on the surface; needed for a law with one alone.
    within
        Largest distance or overlap of places that face each other, a length; by default the mean edge of the faces,
        that of the coarser surface.
    pressure
        File with the pressures of another code at rest: a table (.csv, .dat or .rpt of Abaqus) or a mesh (.vtu). They
        become the normal loads of the contacts, with the resultant force and moment of the file where it says areas or
        labels of this model; ``loads`` of the result belong to the problem then, and hold them. Where nothing presses,
        the gap is that of the file, or of the geometry.
    columns
        With ``pressure``: names of columns or fields by what they are, ``{"pressure": "CPRESS", "node": "Node"}``;
        x, y, z or node or element, pressure, gap, area. Without it they are found by their usual names.

    Raises
    ------
    InputError
        For surfaces that are not there, share nodes, are too far apart, overlap too deeply, or do not face each other;
        for laws that are no friction contacts, or have no ``kn``; for more than 20 000 contacts.

    Warns
    -----
    SlipstickWarning
        Surfaces of which both are covered in part alone; an overlap, which presses; patches that lose more than a
        half of the joint's resistance to a rotation; places that were counted twice.

    Notes
    -----
    The force on one surface is the opposite of that on the other one, and so are the moments of the normal forces.
    Across a gap a friction force leaves a moment with the gap as its arm.

    M. A. Puso and T. A. Laursen (2004), Comput. Methods Appl. Mech. Engrg. 193, 601-629, for the segments.

    Examples
    --------
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.mesh import together
    >>> from slipstick.fem.model import elastic_model
    >>> from slipstick.fem.materials import Material
    >>> low, high = box((1.0, 1.0, 0.2), (3, 3, 1)), box((1.0, 1.0, 0.2), (2, 4, 1), at=(0.0, 0.0, 0.2))
    >>> mesh = together({"low": low, "high": high})
    >>> model = elastic_model(mesh, Material(young=2e11, poisson=0.3, density=7800.0), ["low.z0", "high.x0"])
    >>> from slipstick.contact.planar import PlanarFrictionContact
    >>> law = PlanarFrictionContact(kt=1e12, kn=1e12, mu=0.3, normal_load=1e6)
    >>> joint = surface_pair(model, "low.z1", "high.z0", contact=law, points=9)
    >>> len(joint), float(joint.points.areas.sum().round(12)), joint[0].name
    (9, 1.0, 'joint 1')
    """
    gathering = Gathering()
    gathering.take(one, "model", model, FiniteElementModel, "what ss.import_model returns")
    for what, surface in (("first", first), ("second", second)):
        gathering.take(one, what, surface, (str, Surface), "the name of a surface")
    gathering.take(text, "name", name)
    stated = ""
    if isinstance(model, FiniteElementModel) and isinstance(contact, FrictionContact):
        contact, stated = _rubbing_as_stated(model, first, second, contact)
    gathering.faults += _law_faults(contact, direction)
    for what, column in (gathering.optional(table, "columns", columns, _COLUMNS) or {}).items():
        gathering.take(_one_of, ("columns", "a key"), what, tuple(NAMES))
        gathering.take(text, ("columns", str(what)), column, _COLUMNS)
    if columns is not None and pressure is None:
        gathering.faults.append(Fault("columns", "belongs to a file of pressures", remedy="give pressure too"))
    if pressure is not None and isinstance(contact, FrictionContact) and np.any(np.asarray(contact.values["gap"])):
        what = "is given together with a gap or normal load of the contact"
        gathering.faults.append(Fault("pressure", what, remedy="give the contact gap=0.0: the file has the pressures"))
    count = gathering.optional(whole, "points", points, 1, MOST_ITEMS)
    gathering.take(_one_of, "gap", gap, (GEOMETRY, TOUCHING))
    gathering.take(_one_of, "method", method, (FACES, NODES))
    reach = gathering.optional(number, "within", within, "a length > 0", above=SMALLEST)
    file = gathering.optional(path, "pressure", pressure)
    gathering.end()
    mesh = model.in_mesh("contacts between surfaces")
    surfaces = _surfaces(mesh, first, second)
    called = [
        f"surface '{given}'" if isinstance(given, str) else f"the {which} surface"
        for given, which in ((first, "first"), (second, "second"))
    ]
    size = max(face_size(mesh, surface) for surface in surfaces)
    ends = _Ends(mesh=mesh, surfaces=surfaces, called=called, size=size, within=size if reach is None else reach)
    found = _Found()
    facing = _moving(model, _faced(ends, method, found), ends, found)
    _gaps_reported(facing.gaps, gap if pressure is None else PRESSED, ends, found)
    found.notes += [stated] * bool(stated)
    facing, softer = _patches(facing, count, contact, gap == GEOMETRY, ends, found)
    facing = replace(facing, points=replace(facing.points, side=f"{name}_"))
    gaps = facing.gaps if gap == GEOMETRY else np.zeros_like(facing.gaps)
    mapped = None
    if file is not None:
        mapped = _pressed(model, ends, facing.points, file, columns)
        gaps = _gaps_below(mapped, gaps, contact)
        found.notes += mapped.notes
        found.warnings += mapped.warnings
    contacts = list(_contacts(name, contact, facing.points, gaps, direction))
    notes, warnings = ([f"contacts '{name}': {each}" for each in part] for part in (found.notes, found.warnings))
    warn(warnings)
    return SurfacePair(
        contacts, name=name, facing=facing, gaps=gaps, softer=softer, notes=notes, warnings=warnings, mapped=mapped,
        friction=stated,
    )  # fmt: skip


def _mean(directions: Sequence[Direction | None], shares: Array) -> Direction:
    """Direction cosines of the mean motion along several directions."""
    out: dict[str, float] = {}
    for direction, share in zip(directions, shares, strict=True):
        for dof, cosine in (direction or {}).items():
            out[dof] = out.get(dof, 0.0) + float(share) * cosine
    return out


def _rubbing_as_stated(
    model: FiniteElementModel, first: object, second: object, contact: FrictionContact
) -> tuple[FrictionContact, str]:
    """The law with the coefficient of the model's file where it has none of its own, and what to tell of it."""
    pair = pair_of(model.contact_pairs, first, second)
    if pair is None or pair.mu is None:
        return contact, ""
    if contact.lacks_mu:
        return contact.changed(mu=pair.mu), pair.stated
    own = np.asarray(contact.mu)
    differs = not _frictionless(contact) and own.ndim == 0 and own != pair.mu
    return contact, f"mu = {own:g} is used, not {pair.stated}" if differs else ""


def _pressed(
    model: ImportedModel, ends: _Ends, points: ContactPoints, file: Path, columns: Mapping[str, str] | None
) -> MappedPressure:
    try:
        return mapped_pressure(model, ends.surfaces, points, file, columns=columns, within=ends.within)
    except InputError as error:
        raise InputError([_of_file(fault, file) for fault in error.faults]) from None


def _of_file(fault: Fault, file: Path) -> Fault:
    """A fault of a file at the argument that names it, or those of its columns at theirs."""
    where = tuple(part for part in fault.where if str(part) not in (str(file), file.name))
    if where[:1] == ("columns",):
        return replace(fault, where=where)
    if not fault.statement:
        return replace(fault, where=("pressure", file.name, *where))
    return replace(fault, where=("pressure", *where), statement=" ".join([file.name, *fault.statement.split()]))


def _gaps_below(mapped: MappedPressure, gaps: Array, contact: FrictionContact) -> Array:
    """Interference that gives the pressures of a file; elsewhere its gaps, or those of the geometry."""
    kn = float(np.asarray(contact.values["kn"]))
    open_ = np.maximum(gaps if mapped.gaps is None else mapped.gaps, 0.0)
    return np.where(mapped.pressures > 0.0, -mapped.pressures / kn, open_)


@dataclass
class _Found:
    """What is reported of two surfaces, sentence by sentence."""

    notes: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


@dataclass(frozen=True, kw_only=True)
class _Ends:
    """Two surfaces, how they are called, their mean edge, and how far apart places may be that face each other."""

    mesh: Mesh
    surfaces: tuple[Surface, Surface]
    called: Sequence[str]
    size: float
    within: float

    @property
    def both(self) -> str:
        """Both names."""
        return " and ".join(self.called)

    @property
    def spans(self) -> tuple[float, float]:
        """Largest dimension of each surface."""
        one, other = (float(np.ptp(self.mesh.nodes[surface.nodes], axis=0).max()) for surface in self.surfaces)
        return one, other

    def shares(self, covered: Sequence[float]) -> list[float]:
        """Areas over those of the surfaces."""
        return [part / area(self.mesh, surface) for part, surface in zip(covered, self.surfaces, strict=True)]


def _faced(ends: _Ends, method: str, found: _Found) -> Facing:
    """The points where the surfaces face each other, with gaps that rounding made set to zero."""
    find = facing_points if method == FACES else facing_nodes
    facing = find(ends.mesh, *ends.surfaces, ends.within)
    if facing is None:
        raise InputError(_apart(ends))
    shares = ends.shares(facing.covered)
    covered = " and ".join(f"{100.0 * share:.4g} % of {name}" for share, name in zip(shares, ends.called, strict=True))
    total = facing.points.areas.sum()
    if units := other_units(*ends.spans):
        found.warnings.append(f"{ends.both} differ in size{units}")
    found.notes.append(f"{facing.points.count} points on an area of {total:.6g}, {covered}, within {ends.within:.3g}")
    if max(shares) < 1.0 - _UNMATCHED:
        found.warnings.append(
            f"{100.0 * (1.0 - shares[0]):.3g} % of {ends.called[0]} and {100.0 * (1.0 - shares[1]):.3g} % of "
            f"{ends.called[1]} have nothing of the other within {ends.within:.3g}, and carry no contact"
        )
    if max(shares) > 1.0 + _TWICE:
        which = int(np.argmax(shares))
        much = f"{100.0 * (shares[which] - 1.0):.3g} % of {ends.called[which]}"
        found.warnings.append(f"{much} faces the other surface in two places and counts twice")
    return replace(facing, gaps=np.where(np.abs(facing.gaps) <= _ROUNDING * ends.size, 0.0, facing.gaps))


def _moving(model: FiniteElementModel, facing: Facing, ends: _Ends, found: _Found) -> Facing:
    """The points that have a node that moves."""
    free = (np.diff(model.motion.indptr) > 0).reshape(-1, 3).any(axis=1)
    moves = np.asarray(abs(facing.weights).T @ free.astype(float) > 0.0)
    if moves.all():
        return facing
    if not moves.any():
        what = f"every node of {ends.both} where they meet is held"
        raise InputError(Fault("first", what, remedy="hold fewer nodes: there is nothing to slide"))
    found.notes.append(f"{(~moves).sum()} points lie between nodes that are held, and carry no contact")
    return facing.among(moves)


def _gaps_reported(gaps: Array, wanted: str, ends: _Ends, found: _Found) -> None:
    low, high = float(gaps.min()), float(gaps.max())
    if low == high == 0.0:
        found.notes.append("the surfaces touch")
        return
    parts = [f"gaps up to {high:.3g}"] * (high > 0.0) + [f"overlaps up to {-low:.3g}"] * (low < 0.0)
    done = {TOUCHING: "are set to zero", PRESSED: "are kept where the pressure is 0"}.get(wanted, "are kept")
    arm = f"the friction forces of the two sides act up to {max(high, -low):.3g} apart, which leaves a moment"
    found.notes.append(f"{' and '.join(parts)} {done}; {arm}")
    if wanted == GEOMETRY and low < 0.0:
        found.warnings.append(
            f"{ends.both} overlap by up to {-low:.3g}, which presses as an interference fit does; "
            'gap="touching" closes gaps and overlaps'
        )


def _patches(
    facing: Facing, count: int | None, contact: FrictionContact, geometry: bool, ends: _Ends, found: _Found
) -> tuple[Facing, float]:
    """As many patches as asked, and the share of the resistance to a rotation that they lose."""
    if count is None or count >= facing.points.count:
        fewer, softer = facing, 0.0
    else:
        kt, kn = (float(np.asarray(contact.values[name])) for name in ("kt", "kn"))
        fewer, softer, uneven = thinned(facing, count, kt, kn)
        few = f"{fewer.points.count} patch{'es' * (fewer.points.count > 1)}"
        lost = f"the resistance to a rotation of the joint as a whole falls by up to {100.0 * softer:.0f} %"
        stand = "stand" if fewer.points.count > 1 else "stands"
        found.notes.append(f"{few} {stand} for {facing.points.count} points: {lost}")
        if geometry and uneven > _ROUNDING * ends.size:
            found.notes.append(f"gaps of points differ from those of their patches by up to {uneven:.3g}")
        if softer > _SOFTER:
            found.warnings.append(f"{few} for both surfaces: {lost}; give more points")
    if fewer.points.count > MOST_CONTACTS:
        number = f"{fewer.points.count} points, and each keeps three dofs"
        remedy = "a few dozen patches are enough for most joints: give points=50"
        raise InputError(Fault("points", found=number, expected=f"at most {MOST_CONTACTS}", remedy=remedy))
    return fewer, softer


def _one_of(name: Name, value: object, known: Sequence[str]) -> None:
    if not isinstance(value, str) or value not in known:
        raise wrong(name, value, " or ".join(f'"{each}"' for each in known))


def _law_faults(contact: Any, direction: Any) -> Iterator[Fault]:
    if not isinstance(contact, FrictionContact):
        yield Fault(
            "contact", found=shown(contact), expected="ss.PlanarFrictionContact(...) or ss.FrictionContact(...)"
        )
        return
    for name, value in contact.values.items():
        if np.ndim(value):
            yield Fault(("contact", name), found=f"{np.size(value)} values", expected="one, per area, for all points")
    missing = {"normal"} if _frictionless(contact) else {"tangential", "normal"}
    for fault in contact.missing(missing):
        if contact.lacks_mu and fault.where == ("mu",):
            fault = replace(fault, remedy="give the friction coefficient: the model has none for these surfaces")
        yield fault.inside("contact")
    if direction is None and "second" not in contact.ports and not _frictionless(contact):
        remedy = "give one, or a PlanarFrictionContact, which slides in any"
        yield Fault("direction", "is missing: a FrictionContact slides along one direction", remedy=remedy)


def _frictionless(contact: FrictionContact) -> bool:
    return "tangential" in contact.optional_ports


def _surfaces(mesh: Mesh, first: str | Surface, second: str | Surface) -> tuple[Surface, Surface]:
    """Both surfaces, which share no node."""
    gathering, pair = Gathering(), list[Surface]()
    for what, given in (("first", first), ("second", second)):
        surface = given if isinstance(given, Surface) else gathering.inside((what,), mesh.surface, given)
        if surface is not None and not surface.n_faces:
            gathering.faults.append(Fault(what, "has no faces", found=shown(given)))
        pair += [] if surface is None else [surface]
    gathering.end()
    shared = np.intersect1d(pair[0].nodes, pair[1].nodes)
    if len(shared):
        what = f"has {len(shared)} nodes of the first surface, as node {mesh.labels[shared[0]]}"
        raise InputError(
            Fault("second", what, remedy="give two bodies nodes of their own where they touch: common ones are glued")
        )
    return pair[0], pair[1]


def _apart(ends: _Ends) -> Fault:
    """Why two surfaces do not meet: their distances, or where they look."""
    places = ends.mesh.nodes[ends.surfaces[0].nodes]
    feet = project(ends.mesh, ends.surfaces[1], places)
    assert feet.normals is not None
    nearest, farthest = float(feet.distances.min()), float(feet.distances.max())
    ahead = np.einsum("na,na->n", places - feet.places, feet.normals)
    if nearest > ends.within:
        how = "overlap" if ahead[int(feet.distances.argmin())] < -0.9 * nearest else "are apart"
        what = f"{ends.both} {how} by {nearest:.3g} to {farthest:.3g}, more than {ends.within:.3g}"
        what += other_units(*ends.spans)
        return Fault("within", what, remedy="give surfaces that face each other, or a larger within")
    looks = [area_vector(ends.mesh, surface) for surface in ends.surfaces]
    sizes = [float(np.linalg.norm(look)) for look in looks]
    angle = ""
    if min(sizes) > 0.0:
        degrees = np.degrees(np.arccos(np.clip(looks[0] @ looks[1] / (sizes[0] * sizes[1]), -1.0, 1.0)))
        angle = f": their outward normals are {degrees:.0f} degrees apart on average, not near 180"
    what = f"{ends.both} lie {nearest:.3g} to {farthest:.3g} apart, but do not face each other{angle}"
    return Fault("second", what, remedy="give the two sides that touch")


def _contacts(
    name: str, contact: FrictionContact, points: ContactPoints, gaps: Array, direction: Reals | None
) -> Iterator[ContactPair]:
    """One contact a point: stiffness by area, the gap of the law on top of that of the geometry."""
    normal = points.normal
    along: list[Any] = [None] * points.count
    if not _frictionless(contact):
        tangents = _across(points.normals) if direction is None else points.tangents(direction)
        along = list(points.cosines(tangents))
        if "second" in contact.ports:
            along = list(zip(along, points.cosines(np.cross(points.normals, tangents)), strict=True))
    values = {key: float(np.asarray(value)) for key, value in contact.values.items()}
    for k in range(points.count):
        area_here = float(points.areas[k])
        own = {"kn": values["kn"] * area_here, "gap": values["gap"] + float(gaps[k])}
        if not _frictionless(contact):
            own["kt"] = values["kt"] * area_here
        yield ContactPair(
            name=f"{name} {k + 1}", contact=contact.changed(**own), tangential=along[k], normal=normal[k],
            area=area_here,
        )  # fmt: skip


def _across(normals: Array) -> Array:
    """Unit vectors along the surface (n, 3), near an axis of the model."""
    axis = np.eye(3)[np.abs(normals).round(6).argmin(axis=1)]
    flat = axis - np.einsum("na,na->n", axis, normals)[:, None] * normals
    return np.asarray(flat / np.linalg.norm(flat, axis=1)[:, None])
