"""A finite element model reduced to contact points on a surface, loads and named dofs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np

from slipstick.errors import Fault, InputError
from slipstick.faults import (
    Gathering,
    names,
    number,
    number_or_numbers,
    one,
    one_or_listed,
    table,
    text,
    warn,
    whole,
    wrong,
)
from slipstick.fem.axis import Axis
from slipstick.fem.equations import COMPONENTS
from slipstick.fem.expansion import TemperatureFields
from slipstick.fem.mesh import Surface
from slipstick.fem.model import FiniteElementModel, ImportedModel
from slipstick.fem.moved_supports import MOVED, MovedSupports
from slipstick.fem.retained import Retained, retain, strain_rows
from slipstick.models.reduced import (
    ReducedModel,
    checked_fields,
    checked_options,
    damping_warnings,
    mode_faults,
    require_names,
)
from slipstick.models.surface_pair import SurfacePair
from slipstick.structure.reduction.reduce import StrainRows, receptance_error, reduce_model
from slipstick.structure.reduction.request import non_negative, residuals_kind
from slipstick.structure.strains import ELEMENTS, MOST_NUMBER, NODES
from slipstick.typing import Reals, Temperature

if TYPE_CHECKING:
    from slipstick.solve.linear.modes import StageListener
    from slipstick.structure.modal import ModalStructure


@dataclass(frozen=True, kw_only=True)
class ReducedBody(ReducedModel):
    """A reduced finite element model.

    Attributes
    ----------
    structure
        Modes and residuals at the kept dofs: "c1x", "c1y", "c1z", "c2x", ... of the contact points, then others.
    points
        The contact points; None without a surface.
    n_dofs, solver
        Size of the full model and the direct solver used.
    seconds, reused
        Time by stage, and whether the reduction was read from disk.
    source
        Where the model comes from and its units.
    notes, warnings
        Of the imported model: what was left out; what is approximated or suspicious.
    full
        Gives the full model, for comparison; that of a stored reduction may have to be made again.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (4, 1, 1), "hex20"), steel, ["x0"])
    >>> body = ss.reduced_body(beam, surface="z1", contacts=2, modes=6)
    >>> body.n_dofs, body.points.areas.round(6), body.modes_below(5e4)
    (144, array([0.001, 0.001]), 4)
    """

    structure: ModalStructure
    solver: str
    seconds: Mapping[str, float]
    reused: bool
    full: Callable[[], Retained] = field(repr=False)
    between: ClassVar[None] = None
    """None: only a sector has neighbours."""

    def modes_below(self, omega: float) -> int | None:
        """How many modes of the full model lie below a frequency, rad/s; one factorisation."""
        from slipstick.structure.reduction.compute import modes_below

        full = self.full()
        return modes_below(full.K, full.M, omega)

    def receptance_errors(self, frequencies: Reals) -> Iterator[tuple[float, float]]:
        """Frequency (rad/s) and relative error of the receptance between the kept dofs; one direct solution each.

        A frequency that is a resonance of the full model is left out.
        """
        full = self.full()
        for omega in np.atleast_1d(np.asarray(frequencies, dtype=float)).tolist():
            try:
                yield omega, receptance_error(self.structure, full.directions, full.K, full.M, omega)
            except InputError:
                continue


def reduced_body(
    model: ImportedModel,
    *,
    surface: str | Surface | Mapping[str, Any] | None = None,
    contacts: int | Reals = 8,
    radius: float | None = None,
    pressure: str | Mapping[str, str] | None = None,
    base: str | Sequence[str] = (),
    temperature: Mapping[str, Temperature] | None = None,
    initial_temperature: Temperature | None = None,
    displacement: Mapping[str, str | Mapping[str, Any]] | None = None,
    centrifugal: Axis | Mapping[str, Any] | None = None,
    films: Mapping[str, float] | None = None,
    cold: str | None = None,
    keep: Sequence[str] = (),
    pairs: SurfacePair | Sequence[SurfacePair] = (),
    modes: int | None = None,
    accuracy: float | None = None,
    up_to: float | None = None,
    loss_factor: float = 0.0,
    damping_ratio: float = 0.0,
    force: bool = False,
    residuals: str = "auto",
    stress: str | int | Sequence[str | int] | None = None,
    stress_at: Literal["elements", "nodes"] = "elements",
    cache: str | Path | None = None,
    listener: StageListener | None = None,
) -> ReducedBody:
    """Reduce an imported model to contact points on a surface and to named dofs.

    Parameters
    ----------
    surface
        Where contacts lie: a name, a surface of the mesh, or ``{"direction": (0, 1, 0), "angle": ..., "depth": ...}``
        for the part of the boundary that looks that way; None: no contacts on a surface.
    contacts
        How many points, spread uniformly; or node labels (n,), or positions (n, 3).
    radius
        Radius of their patches, by default that of half the area of each.
    pressure
        Load shapes ``{name: surface}``: unit pressure into the body; a surface alone is named "pressure".
    base
        Directions "x", "y", "z" in which the support may move: load shapes "base x" ... for ``ss.Load(base="x", ...)``.
        Inertia that couples held and free nodes is left out; it vanishes as the mesh is refined.
    temperature
        Temperature fields by name: load shapes "temperature NAME", one time the thermal strain of the field, for
        ``ss.LoadStep(temperature=NAME)``. Each is a temperature, temperatures by node set or surface such as
        ``{"all": 20.0, "FLANGE": 300.0}``, one for each node of the mesh, or the name of one of ``model.load_steps``
        that the file gives temperatures in. They need materials with ``expansion``.
    initial_temperature
        The field at which there is no stress; without it the initial temperatures of the file, or else the
        ``reference`` of each material.
    displacement
        Supports that can be moved in load steps, by name: load shapes "displacement NAME", for
        ``ss.LoadStep(displacement={NAME: 1e-4})``. Each is what moves for a unit displacement: node sets or surfaces
        with a direction, ``{"jaw": {"x1": [1, 0, 0]}}``, or held dofs, ``{"jaw": {"n12x": 1.0}}``; or the name of one
        of ``model.load_steps`` that prescribes displacements, times a factor. Motions are then absolute.
    centrifugal
        Axis of rotation, ``{"point": (0, 0, 0), "direction": (0, 0, 1)}``: load shape "centrifugal", the forces of
        rotation, for ``ss.LoadStep(speed="3000 rpm")``. The stiffness is that of the model: of ``at_speed`` with it.
    films, cold
        Convection coefficient by surface (or "boundary"), and what stays cold: they give the influence matrix.
    keep
        Further dofs of the full model to keep, such as "n123y"; "HEAD z" is the mean motion of the surface or node set
        HEAD along z.
    pairs
        Contacts between two surfaces of the model, from :func:`surface_pair`: their motions are kept.
    modes
        Number of modes. With neither ``modes`` nor ``accuracy`` as many as the estimate of the error asks for: 1e-7 up
        to ten times the first natural frequency, and up to ``up_to`` where it is set; 128 at most.
    accuracy
        Relative accuracy of the receptance up to ``up_to``, which sets the number of modes.
    up_to
        Highest frequency of use, rad/s.
    loss_factor, damping_ratio
        Hysteretic loss factor; ratio to critical damping.
    force
        Take a reduction that is too coarse for ``up_to``.
    residuals
        "written", "solved" or "auto": how what the modes leave out is applied, see ``reduce``.
    stress
        Elements whose strain and stress are wanted of the results (``branch.stress``): "all", or their numbers, names
        of element sets, or of surfaces they have a face on. They need the mesh and its materials.
    stress_at
        Places of strain and stress: the centroids of the "elements", or their "nodes".
    cache
        Folder in which reductions are kept; the same model and options are read from there.

    Raises
    ------
    InputError
        For names and labels that are not there, and models that are not held: one sentence for each.

    Warns
    -----
    SlipstickWarning
        A damping matrix, which real modes do not use; an error above 1e-4 up to ``up_to``.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = ss.Material(young=2.1e11, poisson=0.3, density=7850.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (4, 1, 1), "hex20"), steel, ["x0"])
    >>> body = ss.reduced_body(beam, surface="z1", contacts=2, base="z", modes=6, loss_factor=0.002)
    >>> body.structure.dofs
    ('c1x', 'c1y', 'c1z', 'c2x', 'c2y', 'c2z')
    """
    gathering = Gathering()
    gathering.take(one, "model", model, FiniteElementModel, "what ss.import_model returns")
    options = checked_options(
        gathering, surface=surface, contacts=contacts, radius=radius, pressure=pressure, keep=keep, pairs=pairs,
        modes=modes, accuracy=accuracy, up_to=up_to, force=force, cache=cache, listener=listener,
    ) | {
        "base": gathering.take(_axes, base) or (),
        "films": _films(gathering, films),
        "cold": gathering.optional(text, "cold", cold, "the name of a node set or surface"),
    }  # fmt: skip
    wanted = checked_fields(gathering, temperature, initial_temperature)
    supports = gathering.optional(table, "displacement", displacement, MOVED) or {}
    axis = gathering.optional(_axis, "centrifugal", centrifugal)
    gathering.take(non_negative, "loss_factor", loss_factor)
    gathering.take(number_or_numbers, "damping_ratio", damping_ratio, "a number, or one for each mode")
    gathering.take(residuals_kind, residuals)
    elements = gathering.take(wanted_elements, stress, stress_at)
    gathering.end()
    require_names(model, options, others=[*_request_faults(model, options)])
    number_of_modes, accuracy, highest = (options.pop(name) for name in ("modes", "accuracy", "up_to"))
    heat, moved = TemperatureFields.of(model, wanted, initial_temperature), MovedSupports.of(model, supports)
    strains = None if elements is None else _strains(model, elements, stress_at, heat, moved)
    joints = options.pop("pairs")
    facing = [joint.facing for joint in joints]
    body = retain(model, **options, pairs=facing, temperature=heat, displacement=moved, centrifugal=axis)
    within: dict[str, Any] = {} if accuracy is None else {"accuracy": accuracy, "frequency_range": (0.0, highest)}
    reduction = reduce_model(
        model.K,
        model.M,
        **body.request,
        **within,
        dofs=model.dofs,
        modes=number_of_modes,
        reach=highest or 0.0,
        loss_factor=loss_factor,
        damping_ratio=damping_ratio,
        force=force,
        cache=cache,
        listener=listener,
        residuals=residuals,
        strains=strains,
    )
    left_out = (
        *damping_warnings(model, otherwise=_CORIOLIS),
        *([] if strains is None else _stress_warnings(model)),
        *(() if heat is None else heat.warnings),
        *(() if moved is None else moved.warnings),
    )
    warn(left_out)
    reduction.structure.units = model.unit_names
    return ReducedBody(
        structure=reduction.structure,
        points=body.points,
        n_dofs=reduction.n_full,
        solver=reduction.solver,
        seconds=reduction.seconds,
        reused=reduction.reused,
        source=f"{model.source}; units: {model.units_told}",
        notes=(
            *model.notes,
            *(note for joint in joints for note in joint.notes),
            *(() if heat is None else heat.notes(model)),
        ),
        warnings=(*model.warnings, *(warning for joint in joints for warning in joint.warnings), *left_out),
        full=partial(replace, body),
    )


_CORIOLIS = (
    "; for these make an ss.MatrixStructure of its matrices and reduce it with ss.models.craig_bampton (in a case file "
    'kind = "matrices" with keep and modes)'
)


def _axis(name: str, axis: object) -> Axis:
    try:
        return Axis.of(axis)
    except InputError as error:
        raise InputError([replace(fault, where=(name, *fault.where[1:])) for fault in error.faults]) from None


def _films(gathering: Gathering, films: object) -> dict[str, float]:
    coefficients = gathering.optional(table, "films", films, "convection coefficients by surface") or {}
    for name, film in coefficients.items():
        gathering.take(number, ("films", name), film, "a convection coefficient >= 0", above=0.0)
    return coefficients


def _axes(axes: object) -> tuple[str, ...]:
    """Directions of a support's motion, each once."""
    directions = names("base", axes, 'a direction "x", "y" or "z", or a list of them')
    for axis in directions:
        if axis not in COMPONENTS[:3]:
            raise wrong("base", axis, 'a direction "x", "y" or "z"')
    return tuple(dict.fromkeys(directions))


def _request_faults(model: FiniteElementModel, options: Mapping[str, Any]) -> Iterator[Fault]:
    if model.symmetry is not None and model.symmetry.alone is None:
        what = f"{model.source} is one of {model.symmetry.sectors} sectors of a disc, and its faces are free"
        yield Fault("model", what, remedy="reduce it with ss.reduced_sector")
    if options["surface"] is None:
        if not options["keep"] and not options["pairs"]:
            remedy = 'give surface = "NAME" for contacts on a surface, or keep = ["n123y"]'
            yield Fault("surface", "nothing is kept", remedy=remedy)
        for key in ("radius", "pressure", "films", "cold"):
            if options[key] and not (key == "pressure" and options["pairs"]):
                yield Fault(key, "is given without surface", remedy="give the surface the contacts lie on")
    yield from mode_faults(options)


def wanted_elements(stress: Any, at: Any) -> Any:
    """What ``chosen_elements`` takes, or None."""
    if not isinstance(at, str) or at not in (ELEMENTS, NODES):
        raise wrong("stress_at", at, f'"{ELEMENTS}" or "{NODES}"')
    if stress is None:
        return None
    expected = '"all", or numbers of elements, names of element sets or surfaces'
    items = one_or_listed("stress", stress, expected)
    if not items:
        raise wrong("stress", stress, expected)
    return [item if isinstance(item, str) else whole("stress, element number", item, 0, MOST_NUMBER) for item in items]


def _strains(
    model: FiniteElementModel, elements: Any, at: str, heat: TemperatureFields | None, moved: MovedSupports | None
) -> StrainRows:
    """Strains of a model that brought a mesh with materials."""
    missing = "no mesh" if model.mesh is None else "a mesh without materials" if not model.materials else ""
    if missing:
        what = f"{model.source} has {missing}, and stress comes from elements and their material"
        raise InputError(Fault("stress", what, remedy="import the mesh too, with its materials, or leave stress out"))
    return strain_rows(model, elements, at, heat, moved)


def _stress_warnings(model: FiniteElementModel) -> Iterator[str]:
    if model.speed:
        yield (
            f"{model.source}: the stress is that of vibration, from the mesh at rest: add the stress of rotation to "
            "the mean stress"
        )
