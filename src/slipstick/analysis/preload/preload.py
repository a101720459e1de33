"""Pressures, tractions and displacements by load steps, and the state from which the vibration begins."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

import numpy as np

from slipstick.analysis.preload.march import March, State, unmarched
from slipstick.analysis.preload.steps import LoadStep, Target, of_problem, targets
from slipstick.balance.contacts import ContactPair
from slipstick.balance.loads import Load
from slipstick.balance.problem import Problem
from slipstick.contact.names import block_of
from slipstick.contact.rest import REST, SECOND_REST
from slipstick.errors import Fault, InputError
from slipstick.faults import Gathering, one, several, warn, whole, wrong
from slipstick.faults import path as path_of
from slipstick.fem.contact_points import ContactPoints
from slipstick.html import some
from slipstick.replacing import HDF5, writing
from slipstick.typing import Array

if TYPE_CHECKING:
    import xarray

OPEN, STICK, SLIP, CLOSED = "open", "stick", "slip", "closed"
"""States of a contact at the end of a step; "closed": it has no friction, as a bolt."""

DIRECTIONS = ("tangential", "second")


@runtime_checkable
class Joint(Protocol):
    """Contacts whose areas are known, such as ``ss.surface_pair`` makes: a list with a name and a point for each."""

    name: str

    @property
    def points(self) -> ContactPoints:
        """Positions, normals and areas."""


@dataclass(frozen=True, kw_only=True)
class Preload:
    """Load steps that have been computed; made by :func:`slipstick.preload`.

    Attributes
    ----------
    problem
        The problem that was loaded.
    dataset
        Over ``step``, ``contact``, ``direction`` ("tangential", "second"), ``joint`` and ``dof``: ``normal_force``,
        ``friction_force``, ``gap``, ``slip``, ``state``, ``displacement``; of joints ``normal_resultant``,
        ``friction_resultant``, ``open_share``; where areas are known ``pressure``, ``traction``, ``largest_pressure``.
    loads
        The static loads at the end of the last step, without the factor on all loads of the problem.
    notes
        What holds, and what does not, for the vibration that begins from this state.

    Examples
    --------
    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    >>> law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    >>> foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    >>> push = ss.LoadStep(name="push", loads=ss.Load(dof="x", harmonic=0, cos=5.0))
    >>> state = ss.preload(ss.Problem(structure, contacts=foot), push)
    >>> print(state.table())
    after push:
      foot: normal 10, friction 3, open 0 %
    >>> problem = ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=1.0), preload=state)
    >>> round(problem.contacts[0].contact.rest, 9)
    0.02
    """

    problem: Problem = field(repr=False)
    dataset: xarray.Dataset = field(repr=False)
    loads: Sequence[Load]
    notes: Sequence[str]
    gaps: Array = field(repr=False)
    """Gap of each contact as its law has it after the last step, (n_contacts,): bolts keep the length they have."""
    rests: Array = field(repr=False)
    """Motion of each contact at which its spring has no friction force, (n_contacts, 2)."""

    def applied(self, contacts: Sequence[ContactPair], loads: Sequence[Load]) -> tuple[list[ContactPair], list[Load]]:
        """Contacts and loads of the vibration that begins from this state.

        The static loads are those of the last step; bolts have the length they were given, and friction contacts the
        ``rest`` that their friction force goes with.
        """
        loaded, given = ([(pair.name, len(pair)) for pair in pairs] for pairs in (self.problem.contacts, contacts))
        if given != loaded:
            remedy = "give the contacts of the problem that was preloaded"
            raise InputError(Fault("preload", "is that of a problem with other contacts", remedy=remedy))
        out, at, changed = [], 0, list[str]()
        for before, pair in zip(self.problem.contacts, contacts, strict=True):
            here = slice(at, at + len(pair))
            at += len(pair)
            changed += _changed(before, pair)
            own = {"gap": self.gaps[here], **dict(zip((REST, SECOND_REST), self.rests[here].T, strict=True))}
            if "second" not in pair.contact.ports:
                del own[SECOND_REST]
            if np.array_equal(own["gap"], pair.values("gap")):
                del own["gap"]
            one = {name: float(value[0]) if len(pair) == 1 else value for name, value in own.items()}
            out.append(replace(pair, contact=pair.contact.changed(**one)))
        if changed:
            warn([f"load steps were computed with other values of {some(changed, 5)}, and are not computed again"])
        return out, [*(load for load in loads if load.harmonic), *self.loads]

    def table(self, step: int = -1) -> str:
        """The joints and bolts after a step, as a text; steps count from 0, negative numbers from the end.

        Raises
        ------
        InputError
            For a step that is not there.
        """
        count = len(self.dataset.step)
        step = whole("step", step, -count, count - 1)
        data, units = self.dataset.isel(step=step), self.problem.units
        lines = [f"after {data.step.item()}:"]
        for joint in data.joint.values.tolist():
            row = data.sel(joint=joint)
            words = [f"normal {row.normal_resultant.item():.6g}{units.after('force')}"]
            if row.friction_resultant.item():
                words.append(f"friction {row.friction_resultant.item():.6g}{units.after('force')}")
            words.append(f"open {100.0 * row.open_share.item():.3g} %")
            if "largest_pressure" in row and np.isfinite(row.largest_pressure.item()):
                words.append(f"largest pressure {row.largest_pressure.item():.5g}{units.after('force/length^2')}")
            lines.append(f"  {joint}: {', '.join(words)}")
        return "\n".join(lines)

    def save(self, path: str | Path) -> Path:
        """Write the dataset as netCDF, which xarray opens, and return the path.

        Raises
        ------
        InputError
            If the file cannot be written, or there is one that is no netCDF.
        """
        import h5netcdf
        from xarray.backends import H5NetCDFStore

        target = path_of("save", path, "the path of a file such as preload.nc")
        content = BytesIO()  # HDF5 crashes where it cannot write to a file, as on a full disk
        with h5netcdf.File(content, "w") as file:
            self.dataset.dump_to_store(H5NetCDFStore(file))
        with writing(target, HDF5) as temporary:
            temporary.write_bytes(content.getbuffer())
        return target

    def __repr__(self) -> str:
        return f"Preload({len(self.dataset.step)} steps, {len(self.dataset.contact)} contacts)\n{self.table()}"


def preload(
    problem: Problem,
    steps: LoadStep | Sequence[LoadStep] | None = None,
    *,
    pairs: Joint | Sequence[Joint] = (),
) -> Preload:
    """Load steps before the vibration: bolts are tightened, loads come on, contacts open, close, stick and slip.

    Steps are taken in their order, and friction keeps its history through them. Each is cut into increments, which are
    solved by Newton's method on the relative motion of the contacts, with stick and slip by return mapping. The problem
    of the vibration is ``ss.Problem(..., preload=result)``, or ``problem.preloaded(result)``.

    Parameters
    ----------
    problem
        Structure, contacts and loads. Overlaps (negative gaps) come in with the first step, and so do static loads of
        the problem whose place no step names. Loads of other harmonics and rubbing motions are left out.
    steps
        One or several :class:`LoadStep`; None: one, with the static loads of the problem.
    pairs
        Results of ``ss.surface_pair``: with their areas pressures and tractions are known.

    Returns
    -------
    Preload
        Forces, gaps, slip and displacements after each step.

    Raises
    ------
    InputError
        For bolts, dofs and shapes that are not there; laws other than the friction contacts; a structure that neither
        its supports nor its contacts hold. Where no equilibrium is found: in which step, how far in it, which contacts
        change there, what to try.

    Notes
    -----
    The structure is linear: sliding is small beside its size, and nothing yields. Along straight loading of one
    friction direction increments are exact; elsewhere the result depends on their number, and halving them shows how
    much.

    Examples
    --------
    A block on a spring, pressed with 10 and pushed with 5: friction of 0.3 x 10 is not enough to hold it.

    >>> import slipstick as ss
    >>> structure = ss.MatrixStructure(M=[[1.0]], K=[[40.0]], dofs=["x"])
    >>> foot = ss.ContactPair(
    ...     name="foot", contact=ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0), tangential="x"
    ... )
    >>> problem = ss.Problem(structure, contacts=foot)
    >>> state = ss.preload(problem, ss.LoadStep(loads=ss.Load(dof="x", harmonic=0, cos=5.0)))
    >>> [round(float(value), 9) for value in state.dataset.friction_force[0, 0]], str(state.dataset.state.item())
    ([3.0, nan], 'slip')
    >>> round(float(state.dataset.displacement[0, 0]), 9)
    0.05
    """
    gathering = Gathering()
    gathering.take(one, "problem", problem, Problem, "an ss.Problem")
    wanted = (LoadStep(),) if steps is None else gathering.take(several, "steps", steps, LoadStep, "an ss.LoadStep")
    joints = gathering.take(_joints, pairs)
    gathering.end()
    assert wanted is not None
    assert joints is not None
    if not wanted:
        raise wrong("steps", steps, "at least one ss.LoadStep, or None for the static loads of the problem")
    gathering.faults += unmarched(problem)
    if not problem.contacts:
        gathering.faults.append(Fault("contacts", "there are none", remedy="give the contacts that are loaded"))
    gathering.end()
    ends = targets(problem, wanted)
    warn(_warnings(problem, wanted))
    every = {place: load for end in ends for place, load in end.loads.items()}
    march = March(replace(problem, loads=list(every.values()), load=1.0, told=None))
    state, states = march.start(), list[State]()
    for k, end in enumerate(ends):
        state = march.step(state, end, first=k == 0)
        states.append(state)
    if march.unsettled:
        warn([UNSETTLED.format(some(march.unsettled, 3))])
    gaps = _by_element(problem, [contacts.gap for contacts in state.contacts])
    rests = np.nan_to_num(_friction(problem, march.rests(state)))
    return Preload(
        problem=problem, dataset=_dataset(march, problem, ends, states, joints),
        loads=tuple(of_problem(problem, load) for load in ends[-1].loads.values() if load.cos),
        notes=tuple(_notes(states[-1])), gaps=gaps, rests=rests,
    )  # fmt: skip


def _joints(pairs: Any) -> tuple[Joint, ...]:
    expected = "what ss.surface_pair returns"
    if isinstance(pairs, Joint):
        return (pairs,)
    return several("pairs", pairs, Joint, expected)  # type: ignore[type-abstract]


def _warnings(problem: Problem, steps: Sequence[LoadStep]) -> Iterator[str]:
    """What is left out of load steps."""
    rubbing = [pair.name for pair in problem.contacts if pair.rubbing.moves]
    if rubbing:
        yield f"load steps leave out the rubbing motion of {some(rubbing, 5)}"
    if problem.thermal is not None or problem.states:
        yield "load steps leave out heat and wear: contacts keep the parameters they were given"
    remembering = [pair.name for pair in problem.contacts if REST in pair.contact.values and not pair.is_spring]
    if remembering:
        yield (
            f"load steps begin without friction forces: what an earlier preload left in {some(remembering, 5)} is "
            "left out; give all steps to one ss.preload"
        )


UNSETTLED = (
    "Newton's method stalled in load steps {} with a last correction below 1e-6 of the motion: forces are that "
    "accurate, but displacements of parts on very soft springs are not; use stiffer springs"
)


def _notes(last: State) -> Iterator[str]:
    """What the vibration takes of the preload."""
    friction = max((float(np.max(np.abs(contacts.force[:-1]), initial=0.0)) for contacts in last.contacts), default=0.0)
    yield "the vibration keeps the static loads and the lengths of bolts; normal forces are solved together with it"
    if friction:
        yield (
            "contacts that stick all period keep the friction force of the preload, up to the friction limit; "
            "contacts that slip lose it"
        )


def _changed(before: ContactPair, pair: ContactPair) -> list[str]:
    """Parameters of a contact that are not those of the load steps; what these give themselves does not count."""
    given = {"gap", REST, SECOND_REST}
    if type(before.contact) is not type(pair.contact):
        return [f"'{pair.name}', whose law is another"]
    names = [name for name in pair.contact.values if name not in given]
    return [f"{pair.name}.{name}" for name in names if not np.array_equal(pair.values(name), before.values(name))]


def _by_element(problem: Problem, parts: Sequence[Array]) -> Array:
    """Numbers by batch (..., n) in the order of the problem's elements, (..., n_elements)."""
    lead = parts[0].shape[:-1] if parts else ()
    out = np.full((*lead, len(problem.elements)), np.nan)
    for batch, part in zip(problem.batches, parts, strict=True):
        out[..., batch.elements] = part
    return out


def _owners(problem: Problem, friction: Array) -> list[str]:
    """The joint that each contact belongs to: of "flange 3" it is flange; a bolt is one by itself."""
    slides = ~np.isnan(friction[0]).all(axis=1)
    return [block_of(name) if along else name for name, along in zip(problem.elements, slides, strict=True)]


def _friction(problem: Problem, parts: Sequence[Array]) -> Array:
    """Along both directions (n_elements, 2) of those by batch (1 or 2, n); nan where a contact does not slide so."""
    out = np.full((len(problem.elements), 2), np.nan)
    for batch, part in zip(problem.batches, parts, strict=True):
        for i, port in enumerate(batch.ports[:-1]):
            members = np.arange(batch.count)[port.members]
            out[np.array(batch.numbers)[members], i] = part[i][members]
    return out


def _states(problem: Problem, state: State) -> Array:
    out = np.full(len(problem.elements), CLOSED, dtype="U6")
    for batch, contacts in zip(problem.batches, state.contacts, strict=True):
        numbers = np.array(batch.numbers)
        slides = np.zeros(batch.count, dtype=bool)
        for port in batch.ports[:-1]:
            slides[port.members] = True
        out[numbers[slides]] = np.where(contacts.slipping, SLIP, STICK)[slides]
        out[numbers[~contacts.closed]] = OPEN
    return out


def _dataset(
    march: March, problem: Problem, ends: Sequence[Target], states: Sequence[State], joints: Sequence[Joint]
) -> xarray.Dataset:
    """All results over the steps."""
    import xarray

    outputs = list(problem.outputs or ())
    normal = np.stack([_by_element(problem, [c.force[-1] for c in s.contacts]) for s in states])
    friction = np.stack([_friction(problem, [c.force[:-1] for c in s.contacts]) for s in states])
    slip = np.stack([_friction(problem, [c.slip for c in s.contacts]) for s in states])
    opened = np.stack(
        [_by_element(problem, [np.maximum(c.gap - c.before[-1], 0.0) for c in s.contacts]) for s in states]
    )
    kinds = np.stack([_states(problem, s) for s in states])
    moved = np.stack([march.displacement(s, outputs) for s in states])
    position, normal_of = np.full((2, len(problem.elements), 3), np.nan)
    area, owner = np.full(len(problem.elements), np.nan), _owners(problem, friction)
    of_joint = {
        name: (joint, k)
        for joint in joints
        for k, name in enumerate(name for pair in joint for name in pair.elements)  # type: ignore[attr-defined]
    }
    for e, name in enumerate(problem.elements):
        if name in of_joint:
            joint, k = of_joint[name]
            area[e], owner[e] = joint.points.areas[k], joint.name
            position[e], normal_of[e] = joint.points.positions[k], joint.points.normals[k]
    blocks = list(dict.fromkeys(owner))
    place, share = np.array([blocks.index(name) for name in owner]), np.where(np.isnan(area), 1.0, area)
    size = np.sqrt(np.nansum(friction**2, axis=-1))
    totals = [np.zeros((len(states), len(blocks))) for _ in range(3)]
    for k in range(len(states)):
        for total, of_one in zip(totals, (normal[k], size[k], share * (kinds[k] == OPEN)), strict=True):
            np.add.at(total[k], place, of_one)
    units = problem.units
    length, force, pressure = (units.label(name) for name in ("length", "force", "force/length^2"))
    by_contact, by_direction = ("step", "contact"), ("step", "contact", "direction")

    def variable(dims: tuple[str, ...], values: Any, unit: str, about: str) -> Any:
        return dims, values, {"units": unit, "long_name": about}

    variables = {
        "normal_force": variable(by_contact, normal, force, "normal force"),
        "friction_force": variable(by_direction, friction, force, "friction force on the structure's left-hand side"),
        "gap": variable(by_contact, opened, length, "distance between the surfaces"),
        "slip": variable(by_direction, slip, length, "slip since the beginning of the first step"),
        "state": variable(by_contact, kinds, "1", "state at the end of the step"),
        "normal_resultant": variable(("step", "joint"), totals[0], force, "sum of the normal forces"),
        "friction_resultant": variable(("step", "joint"), totals[1], force, "sum of the sizes of the friction forces"),
        "open_share": variable(
            ("step", "joint"), totals[2] / np.bincount(place, share, len(blocks)), "1", "share that is open"
        ),
        "displacement": variable(("step", "dof"), moved, length, "displacement"),
        "increments": variable(("step",), np.diff([0, *(s.increments for s in states)]), "1", "increments taken"),
        "iterations": variable(("step",), np.diff([0, *(s.iterations for s in states)]), "1", "Newton iterations"),
    }
    if np.isfinite(area).any():
        largest = np.full((len(states), len(blocks)), np.nan)
        for b in range(len(blocks)):
            known = (place == b) & np.isfinite(area)
            if known.any():
                largest[:, b] = (normal / area)[:, known].max(axis=1)
        variables |= {
            "pressure": variable(by_contact, normal / area, pressure, "normal pressure"),
            "traction": variable(by_direction, friction / area[:, None], pressure, "friction traction"),
            "largest_pressure": variable(("step", "joint"), largest, pressure, "largest normal pressure"),
            "area": variable(("contact",), area, units.label("length^2"), "area of the contact"),
            "position": variable(("contact", "axis"), position, length, "position of the contact"),
            "normal": variable(("contact", "axis"), normal_of, "1", "normal out of the first surface"),
        }
    coordinates = {
        "step": [end.name for end in ends], "contact": list(problem.elements), "direction": list(DIRECTIONS),
        "joint": blocks, "dof": outputs, "axis": ["x", "y", "z"], "joint_of": ("contact", owner),
    }  # fmt: skip
    attributes = {"analysis": "preload", "title": problem.title, "notes": "\n".join(_notes(states[-1]))}
    return xarray.Dataset(variables, coordinates, attributes)
