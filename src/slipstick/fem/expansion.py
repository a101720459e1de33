"""Temperature fields of a body: thermal strain as nodal forces and at places of stress, stiffness at a temperature.

The free strain of an isotropic solid is ``e = expansion(T) (T - reference)`` along all directions, less that of the
temperature at which it has no stress. Held back it is the stress ``(3 lambda + 2 mu) e``, so that

    K u = f,    f[a i] = int (3 lambda + 2 mu) e dN_i/dx_a dV,    stress = D (strain(u) - e).

The moduli are those of the stiffness: of the model, whatever the field.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from slipstick.errors import Fault, InputError, Place, Where
from slipstick.faults import Gathering, number, numbers, one, suggestion, table, wrong
from slipstick.fem.assembly import assemble, stress_load
from slipstick.fem.geometry import solid_gradients
from slipstick.fem.load_steps import INITIAL, LoadStep, acting, curve_warnings, nodes_of
from slipstick.fem.materials import EVERY, Material, Materials, element_values, of_materials, told_of
from slipstick.fem.mesh import Mesh, user_names
from slipstick.fem.model import FiniteElementModel, ImportedModel
from slipstick.fem.strains import strain_values
from slipstick.structure.protocol import TEMPERATURE
from slipstick.typing import Array, IntArray, Temperature

FIELD = 'a temperature, temperatures by node set such as {"all": 20.0, "FLANGE": 300.0}, or one for each node'


def temperature_field(
    mesh: Mesh, field: Any, name: Where = ("temperature",), steps: Mapping[str, LoadStep] | None = None
) -> Array:
    """Temperature of the nodes (n_nodes,).

    Sets are taken in their order, so that a later one holds where two meet. "all" is every node. A text is the name of
    one of the load ``steps`` of the file that the mesh comes from.

    Raises
    ------
    InputError
        For sets that are not there, nodes of elements without a temperature, and numbers that are not finite.
    """
    if isinstance(field, Mapping):
        return _by_set(mesh, field, name)
    if isinstance(field, str) and steps:
        return step_temperature(mesh, steps, field, name)
    values = numbers(name, field, FIELD)
    if values.ndim == 0:
        return np.full(mesh.n_nodes, float(values))
    if values.shape != (mesh.n_nodes,):
        raise wrong(name, field, f"{FIELD} ({mesh.n_nodes} nodes)")
    return values


def _by_set(mesh: Mesh, field: Mapping[str, float], name: Where) -> Array:
    values, gathering = np.full(mesh.n_nodes, np.nan), Gathering()
    for at, value in table(name, field, FIELD).items():
        known = at == EVERY or at in mesh.all_sets
        nodes = slice(None) if at == EVERY else mesh.all_sets.get(at, np.empty(0, dtype=np.int64))
        if not known:
            what, close = f"there is no node set '{at}' in the model", suggestion(at, user_names(mesh.all_sets))
            gathering.faults.append(Fault((*name, at), what, remedy=close))
        values[nodes] = gathering.take(number, (*name, at), value, "a temperature") or 0.0
    gathering.end()
    missing = mesh.used_nodes[np.isnan(values[mesh.used_nodes])]
    if len(missing):
        what = f"{len(missing)} nodes have no temperature, the first of them {mesh.labels[missing[0]]}"
        raise InputError(Fault(name, what, remedy='give that of the rest as "all"'))
    return np.nan_to_num(values)


def step_temperature(mesh: Mesh, steps: Mapping[str, LoadStep], step: str, name: Where = ("temperature",)) -> Array:
    """Temperature of the nodes (n_nodes,) at the end of a load step of a file.

    Nodes that it does not name have that of "INITIAL"; nodes in the middle of an edge have the mean of its ends.

    Raises
    ------
    InputError
        For steps without temperatures, and nodes of elements that have none.
    """
    values = np.full(mesh.n_nodes, np.nan)
    try:
        loads = list(steps[INITIAL].loads) if INITIAL in steps and step != INITIAL else []
        for load in [load for load in loads if load.kind == TEMPERATURE] + acting(steps, step, TEMPERATURE):
            values[nodes_of(load, mesh)] = load.value
    except InputError as error:
        raise InputError([fault.inside(*name) for fault in error.faults]) from None
    for element, block in mesh.items():
        for k, (first, last) in enumerate(element.edges[: element.n_nodes - element.n_corners]):
            middle, mean = block[:, element.n_corners + k], (values[block[:, first]] + values[block[:, last]]) / 2.0
            missing = np.isnan(values[middle])
            values[middle[missing]] = mean[missing]
    missing = mesh.used_nodes[np.isnan(values[mesh.used_nodes])]
    if len(missing):
        what = f"{len(missing)} nodes have no temperature in the load step '{step}' of the file, the first of them "
        remedy = "give the temperatures of nodes here: by node set, or one for each node"
        raise InputError(Fault(name, f"{what}{mesh.labels[missing[0]]}", remedy=remedy))
    return np.nan_to_num(values)


def initial_temperature(steps: Mapping[str, LoadStep]) -> str | None:
    """ "INITIAL" where the file of a model states temperatures before its first step."""
    stated = INITIAL in steps and any(load.kind == TEMPERATURE for load in steps[INITIAL].loads)
    return INITIAL if stated else None


def tabulated(materials: Materials) -> list[str]:
    """Names of the materials whose elasticity changes with temperature."""
    every = {EVERY: materials} if isinstance(materials, Material) else materials
    return [name for name, material in every.items() if {"young", "poisson"} & material.tables.keys()]


def free_strain(mesh: Mesh, materials: Materials, field: Array, initial: Array | None = None) -> dict[str, Array]:
    """Thermal strain (n_elements, n_points) at the points of the stiffness rule, by element type.

    ``field``, ``initial`` (n_nodes,); None: the reference of each material. The strain of the nodes goes by the shape
    functions, so that tables are read at temperatures of nodes alone. An element of mean
    strain has its mean at all points.

    Raises
    ------
    InputError
        For a material without coefficient of expansion or reference, or with a table that does not cover a temperature.
    """
    found = {element.name: np.zeros((len(block), len(element.rule.weights))) for element, block in mesh.items()}
    blocks = {element.name: (element, block) for element, block in mesh.items()}
    for name, material, members in of_materials(mesh, materials):
        for kind, rows in members.items():
            if kind not in blocks or not len(rows):
                continue
            element, block = blocks[kind]
            shapes, nodes = element.at_rule[0], block[rows]
            start = None if initial is None else initial[nodes]
            with told_of(name):
                found[kind][rows] = material.free_strain(field[nodes], start) @ shapes.T
    for element, block in mesh.items():
        if element.mean_strain:
            _, weights = solid_gradients(mesh, element, 0, block, mean=False)
            mean = (weights * found[element.name]).sum(axis=1) / weights.sum(axis=1)
            found[element.name][:] = mean[:, None]
    return found


def expansion_load(mesh: Mesh, materials: Materials, field: Array, initial: Array | None = None) -> Array:
    """Nodal forces (3 n_nodes,) of a temperature field; raises InputError as ``free_strain``.

    Examples
    --------
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.materials import Material
    >>> solid = Material(young=2.0, poisson=0.25, expansion=0.1, reference=20.0)
    >>> mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    >>> force = expansion_load(mesh, solid, np.full(8, 30.0)).reshape(-1, 3)
    >>> float(force[mesh.surface("x1").nodes, 0].sum().round(12))  # E strain / (1 - 2 nu) times the area
    4.0
    """
    return held_back(mesh, materials, free_strain(mesh, materials, field, initial))


def held_back(mesh: Mesh, materials: Materials, strain: Mapping[str, Array]) -> Array:
    """Nodal forces (3 n_nodes,) of a thermal strain, (n_elements, n_points) by element type."""
    bulk = element_values(mesh, materials, lambda m: 3.0 * m.lame + 2.0 * m.shear_modulus)
    return stress_load(mesh, materials, {kind: bulk[kind][:, None] * values for kind, values in strain.items()})


@dataclass(frozen=True, kw_only=True)
class TemperatureFields:
    """Temperature fields of a model by name, (n_nodes,), with their thermal strain; see ``free_strain``.

    Each is a load shape, "temperature NAME": the nodal forces of its thermal strain.
    """

    fields: Mapping[str, Array]
    strains: Mapping[str, Mapping[str, Array]] = field(repr=False)
    told: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @classmethod
    def of(cls, model: FiniteElementModel, fields: Mapping[str, Any], initial: Any = None) -> TemperatureFields | None:
        """From what a user gives, see ``temperature_field``; None without any.

        ``initial`` is the field at which there is no stress; None: that of the file of the model, or else the reference
        of each material.

        Raises
        ------
        InputError
            For sets that are not there, and materials as ``free_strain``.
        """
        if not fields:
            return None
        mesh, gathering, steps = meshed(model, "temperatures"), Gathering(), model.load_steps
        told = []
        if initial is None and initial_temperature(steps):
            initial = INITIAL
            told.append("thermal strain counts from the initial temperatures of the file of the model")
        start = None
        if initial is not None:
            start = gathering.take(temperature_field, mesh, initial, (INITIAL_TEMPERATURE,), steps)
        made, strains = dict[str, Array](), dict[str, Mapping[str, Array]]()
        for name, given in fields.items():
            values = gathering.take(temperature_field, mesh, given, (TEMPERATURE, name), steps)
            if values is not None:
                made[name] = values
                strain = gathering.inside((TEMPERATURE, name), free_strain, mesh, model.materials, values, start)
                strains[name] = strain or {}
                if strain and not any(np.any(part) for part in strain.values()):
                    what = "has no thermal strain anywhere: it is the temperature without stress"
                    remedy = "leave it out: a load step with temperature={} brings the body back to it"
                    gathering.faults.append(Fault((TEMPERATURE, name), what, remedy=remedy))
        gathering.end()
        named = [given for given in fields.values() if isinstance(given, str)]
        warnings = [*curve_warnings(model.source, steps, named, TEMPERATURE)]
        return cls(fields=made, strains=strains, told=tuple(told), warnings=tuple(warnings))

    def loads(self, model: FiniteElementModel) -> dict[str, Array]:
        """Forces on the rows of the model (n,) by load shape."""
        mesh, parts = model.in_mesh("temperatures"), model.materials
        return {
            f"{TEMPERATURE} {name}": np.asarray(model.restrict(held_back(mesh, parts, strain)))
            for name, strain in self.strains.items()
        }

    def free_strains(self, model: FiniteElementModel, chosen: dict[str, IntArray], at: str) -> dict[str, Array]:
        """Thermal strains at places of stress, (6 n_places,), by load shape; see ``strain_values``."""
        mesh, parts = model.in_mesh("temperatures"), model.materials
        return {
            f"{TEMPERATURE} {name}": strain_values(mesh, parts, chosen, at, strain)
            for name, strain in self.strains.items()
        }

    def notes(self, model: FiniteElementModel) -> Iterator[str]:
        """Where thermal strain begins, and which fields meet moduli of another temperature."""
        yield from self.told
        mesh = model.in_mesh("temperatures")
        if not tabulated(model.materials):
            return
        others = [
            name for name, values in self.fields.items()
            if mesh.temperature is None or np.any((values != mesh.temperature)[mesh.used_nodes])
        ]  # fmt: skip
        if others:
            at = "the reference of each material" if mesh.temperature is None else "the temperature of the model"
            yield (
                f"Young's modulus changes with temperature, and the stiffness is one for all steps, that at {at}: "
                f"others are those of {', '.join(others)}; ss.models.at_temperature (at_temperature of a case file) "
                "takes it at one of them"
            )


INITIAL_TEMPERATURE = "initial_temperature"


def at_temperature(model: ImportedModel, temperature: Temperature) -> ImportedModel:
    """The model with the stiffness of its materials at a temperature field: tables of ``young`` and ``poisson``.

    Each element has the moduli of its mean temperature. Thermal strain is no part of it: see ``temperature`` of
    :func:`slipstick.reduced_body`. The stiffness by thermal stress is left out.

    Parameters
    ----------
    model
        With its mesh and materials, at rest.
    temperature
        A temperature, temperatures by node set or surface such as ``{"all": 20.0, "FLANGE": 300.0}``, or one for each
        node of the mesh.

    Returns
    -------
    ImportedModel
        With another ``K``; its last note says what was done.

    Raises
    ------
    InputError
        Without mesh or materials, for a model at speed, sets that are not there, tables that do not cover a
        temperature, and where no material has a table.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.fem.box import box
    >>> from slipstick.fem.model import elastic_model
    >>> steel = ss.Material(young=[(20, 2.1e11), (600, 1.7e11)], poisson=0.3, density=7850.0)
    >>> beam = elastic_model(box((0.1, 0.02, 0.01), (4, 1, 1), "hex20"), steel, ["x0"])
    >>> hot = ss.models.at_temperature(beam, 310.0)
    >>> round(float(hot.K[0, 0] / beam.K[0, 0]), 9)
    0.904761905
    """
    checks = Gathering()
    checks.take(one, "model", model, ImportedModel, "what ss.import_model returns")
    checks.end()
    mesh = meshed(model, "temperatures")
    if model.speed:
        remedy = "take the temperature first, then ss.at_speed"
        raise InputError(Fault("model", f"is a model at {model.speed:g} rad/s already", remedy=remedy))
    if not tabulated(model.materials):
        what = f"no material of {model.source or 'the model'} changes with temperature"
        remedy = "give young as a table: [(20.0, 2.1e11), (600.0, 1.7e11)]"
        raise InputError(Fault("materials", what, remedy=remedy))
    values = temperature_field(mesh, temperature, steps=model.load_steps)
    hot = replace(mesh, temperature=values)
    change = assemble(hot, model.materials).stiffness - assemble(mesh, model.materials).stiffness
    heated = _with_stiffness(model, hot, change)
    symmetry = model.symmetry
    if symmetry is None or symmetry.alone is None:
        return heated
    return replace(heated, symmetry=replace(symmetry, alone=_with_stiffness(symmetry.alone, hot, change)))


def _with_stiffness(model: ImportedModel, hot: Mesh, change: csr_array) -> ImportedModel:
    """The model with a mesh at a temperature, and what that adds to the stiffness of all nodes."""
    K = csr_array(model.K + model.motion.T @ change @ model.motion)
    return replace(model, K=K, mesh=hot, notes=(*model.notes, stiffness_note(hot)))


def stiffness_note(mesh: Mesh) -> str:
    """The temperature at which a mesh has its stiffness."""
    assert mesh.temperature is not None
    values = mesh.temperature[mesh.used_nodes]
    low, high = float(values.min()), float(values.max())
    spread = f"{low:g}" if low == high else f"{low:g} to {high:g}"
    return f"stiffness at a temperature of {spread}; that of thermal stress is left out"


def meshed(model: FiniteElementModel, what: str) -> Mesh:
    """The mesh of a model with materials; InputError where one of them is missing."""
    mesh = model.in_mesh(what)
    if not model.materials:
        remedy = "import the mesh with its materials"
        raise InputError(Fault(Place(model.source), f"{what} need the materials of the mesh", remedy=remedy))
    return mesh
