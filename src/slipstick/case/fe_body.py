"""``[structure] kind = "fe"``: a table of the case file becomes calls of :mod:`slipstick.models`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.case.body import Body, Tell
from slipstick.case.fe_tables import FeTable
from slipstick.case.paths import inside
from slipstick.case.reducing import CACHE, NEEDED, material_of, reduced, reduction_folder
from slipstick.case.turning import turning
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel


def fe_body(table: FeTable, folder: Path, tell: Tell) -> Body:
    """The finite element model of ``kind = "fe"``.

    Raises
    ------
    InputError
        For files, materials, sets, surfaces and dofs that are not there, and models that are not held.
    """
    from slipstick.models.reduced_body import reduced_body

    path = _path(table.file, folder)
    tell(f"structure: reading {table.file} ...")
    model = turning(_imported(table, path), table.rotation, folder, tell)
    if table.surface is not None:
        tell(f"structure: contacts on the surface{', influence matrix' if table.films or table.cold else ''} ...")
    tell(f"structure: reducing {model.n_dofs} dofs, or reading it from {CACHE} ...")
    given = {} if table.contacts is None else {"contacts": table.contacts}
    return reduced(
        tell,
        lambda hear: reduced_body(
            model,
            surface=table.surface,
            **given,
            radius=table.radius,
            pressure=table.pressure,
            base=table.base,
            films=table.films,
            cold=table.cold,
            keep=table.keep,
            modes=table.modes,
            accuracy=table.accuracy,
            up_to=table.up_to,
            loss_factor=table.loss_factor,
            damping_ratio=table.damping_ratio,
            force=True,  # judged once range and harmonics are known
            cache=reduction_folder(folder),
            listener=hear,
        ),
        force=table.force,
    )


def _path(name: str, folder: Path) -> Path:
    try:
        return inside(folder, name)
    except InputError as error:
        raise InputError([fault.inside("file") for fault in error.faults]) from None


def _imported(table: FeTable, path: Path) -> ImportedModel:
    """A model made by the import, or a mesh assembled here."""
    from slipstick.importers.mesh_files import BULK_SUFFIXES, MESH_SUFFIXES
    from slipstick.importers.read_model import read_model
    from slipstick.importers.roles import ImportOptions

    if path.suffix.lower() in (*MESH_SUFFIXES, *BULK_SUFFIXES):
        material = None if table.material is None else material_of(table.material)
        return read_model(
            path, ImportOptions(material=material, fixed=table.fixed, quadratic=table.quadratic), quiet=True
        )
    faults = [
        Fault(
            ("material", name), f"{path.name} holds matrices with a material already", remedy="give conductivity alone"
        )
        for name in NEEDED
        if table.material is not None and getattr(table.material, name) is not None
    ]
    if table.quadratic:
        remedy = "give --quadratic to 'slipstick import'"
        faults.append(Fault("quadratic", f"{path.name} holds matrices already", remedy=remedy))
    if faults:
        raise InputError(faults)
    conductivity = table.material.conductivity if table.material is not None else None
    return read_model(path, ImportOptions(fixed=table.fixed, conductivity=conductivity), quiet=True)
