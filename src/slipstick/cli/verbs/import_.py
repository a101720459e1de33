"""The verb ``import``: files of another finite element code become one model.h5."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.terminal.guard import complain, say, warn_user
from slipstick.cli.verb import verb
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.materials import Material

_ROLES = ("K", "M", "C")
_SUFFIXES = (".h5", ".hdf5")


@verb
def import_(
    files: Annotated[list[Path], typer.Argument(metavar="FILES...", help="Matrices, maps and meshes of one model.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The model to write, such as model.h5.")],
    mass: Annotated[Path | None, typer.Option(help="The mass matrix, where its name does not show it.")] = None,
    damping: Annotated[Path | None, typer.Option(help="The damping matrix.")] = None,
    dof_map: Annotated[Path | None, typer.Option("--map", help="Node and direction of every row.")] = None,
    nodes: Annotated[Path | None, typer.Option(help="Positions: bulk data or a mesh.")] = None,
    name: Annotated[list[str] | None, typer.Option(help="Name of a matrix in a Nastran file: K=KGG.")] = None,
    spc: Annotated[int | None, typer.Option(help="Number of the Nastran SPC set in force.")] = None,
    young: Annotated[float | None, typer.Option(help="Material of a mesh: Young's modulus.")] = None,
    poisson: Annotated[float | None, typer.Option(help="Poisson's ratio.")] = None,
    density: Annotated[float | None, typer.Option(help="Density.")] = None,
    conductivity: Annotated[float | None, typer.Option(help="Thermal conductivity.")] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(help="Node set, surface, node (n12) or dof (n12y) to constrain; may be repeated."),
    ] = None,
    quadratic: Annotated[bool, typer.Option(help="Put a node in the middle of every edge of a linear mesh.")] = False,
    units: Annotated[str | None, typer.Option(help='Units of the numbers, kept with them: "N, mm, t, s".')] = None,
    scale: Annotated[
        list[str] | None, typer.Option(help="Multiply the numbers of the files: length=25.4e-3; mass, force, time too.")
    ] = None,
    to: Annotated[str | None, typer.Option(help='Convert from --units to these: SI, or "N, mm, t, s".')] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an earlier model of that name.")] = False,
) -> None:
    """Bring a finite element model of another code into one file, model.h5."""
    import_files(
        ImportRequest(
            files=files,
            output=output,
            mass=mass,
            damping=damping,
            dof_map=dof_map,
            nodes=nodes,
            names=name or (),
            constraints=spc,
            young=young,
            poisson=poisson,
            density=density,
            conductivity=conductivity,
            fixed=fix or (),
            quadratic=quadratic,
            units=units,
            scale=scale or (),
            to=to,
            force=force,
        )
    )


@dataclass(frozen=True, kw_only=True)
class ImportRequest:
    """What the command line says; see :class:`slipstick.importers.roles.ImportOptions`.

    ``names`` are texts such as "K=KGG", ``scale`` such as "length=25.4e-3"; ``force`` allows an existing output to be
    replaced.
    """

    files: Sequence[Path]
    output: Path
    mass: Path | None = None
    damping: Path | None = None
    dof_map: Path | None = None
    nodes: Path | None = None
    names: Sequence[str] = ()
    constraints: int | None = None
    young: float | None = None
    poisson: float | None = None
    density: float | None = None
    conductivity: float | None = None
    fixed: Sequence[str] = ()
    quadratic: bool = False
    units: str | None = None
    scale: Sequence[str] = ()
    to: str | None = None
    force: bool = False


def import_files(request: ImportRequest) -> None:
    """Import and print what came in, one line each; notes that need attention are part of it.

    Raises
    ------
    InputError
        With all faults; the output is then as it was before.
    """
    from slipstick.importers.import_model import summary
    from slipstick.importers.read_model import read_model
    from slipstick.importers.roles import ImportOptions
    from slipstick.io.model_file import save_model

    material, faults = _material(request)
    names, more = _names(request.names)
    scale, wrong = _scale(request.scale)
    faults += [*more, *wrong, *_file_faults(request)]
    if faults:
        raise InputError(faults)
    options = ImportOptions(
        mass=request.mass,
        damping=request.damping,
        dof_map=request.dof_map,
        nodes=request.nodes,
        names=names,
        constraints=request.constraints,
        material=material,
        fixed=tuple(request.fixed),
        quadratic=request.quadratic,
        units=request.units,
        scale=scale,
        to=request.to,
    )
    say(f"reading {', '.join(path.name for path in request.files)} ...")
    model = read_model(list(request.files), options, quiet=True)
    save_model(model, request.output)
    notes = summary(model)
    for line in notes:
        say(line)
    for warning in model.warnings:
        warn_user(warning)
    kinds = 'kind = "fe"' if model.mesh is not None else 'kind = "matrices" or "fe"'
    say(f'wrote {request.output}: name it in a case as [structure] {kinds}, file = "{request.output.name}"')
    if request.units is None and "units: not stated" in " ".join(notes):
        complain('warning: the units of the model are not stated; give them with --units "N, mm, t, s"')


def _material(request: ImportRequest) -> tuple[Material | None, list[str | Fault]]:
    from slipstick.fem.materials import Material

    given = {name: getattr(request, name) for name in ("young", "poisson", "density", "conductivity")}
    if all(value is None for value in given.values()):
        return None, []
    missing: list[str | Fault] = [
        f"--{name} is missing; a material needs --young, --poisson and --density" for name in _needed(given)
    ]
    if missing:
        return None, missing
    try:
        return Material(**{name: value for name, value in given.items() if value is not None}), []
    except InputError as error:
        return None, [fault.below("material") for fault in error.faults]


def _needed(given: dict[str, float | None]) -> Iterable[str]:
    return (name for name in ("young", "poisson", "density") if given[name] is None)


def _names(texts: Sequence[str]) -> tuple[dict[str, str], list[str]]:
    """``["K=KGG", "M=MGG"]`` as a table."""
    names, faults = {}, []
    for text in texts:
        role, equals, name = text.partition("=")
        if role.upper() not in _ROLES or not equals or not name:
            faults.append(f"--name {text}: expected K=NAME, M=NAME or C=NAME, such as K=KGG")
        else:
            names[role.upper()] = name
    return names, faults


def _scale(texts: Sequence[str]) -> tuple[dict[str, float] | None, list[str | Fault]]:
    """``["length=25.4e-3"]`` as a table."""
    from slipstick.importers.import_model import scale_factors

    if not texts:
        return None, []
    given: dict[str, Any] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            given[name] = float(value)
        except ValueError:
            return None, [f"--scale {text}: expected a factor such as length=25.4e-3"]
    try:
        return scale_factors(given), []
    except InputError as error:
        return None, [*error.faults]


def _file_faults(request: ImportRequest) -> list[str]:
    out = request.output
    faults = []
    told = [request.mass, request.damping, request.dof_map, request.nodes]
    for path in [path for path in (*request.files, *told) if path is not None and not path.is_file()]:
        faults.append(f"{path}: {'found a folder; give its files' if path.is_dir() else 'there is no such file'}")
    if out.suffix.lower() not in _SUFFIXES:
        faults.append(f"-o {out}: expected a name that ends in .h5")
    if out.is_dir():
        faults.append(f"-o {out}: found a folder; expected a file such as model.h5")
    elif not out.parent.is_dir():
        faults.append(f"-o {out}: the folder {out.parent} is not there; make it first")
    elif out.exists() and not request.force:
        faults.append(f"{out}: is there already; choose another name with -o, or --force to replace it")
    return faults
