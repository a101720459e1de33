"""The verb ``import``: files of another finite element code become one model.h5."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipstick.cli.options import ForceFile, refuse_file
from slipstick.cli.terminal.answers import Answer
from slipstick.cli.terminal.guard import say, warn_user
from slipstick.cli.verb import verb
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.materials import Material
    from slipstick.importers.roles import ImportOptions

_ROLES = ("K", "M", "C")
_SUFFIXES = (".h5", ".hdf5")


@verb
def import_(
    answer: Answer,
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
    expansion: Annotated[float | None, typer.Option(help="Coefficient of thermal expansion, 1/temperature.")] = None,
    reference: Annotated[float | None, typer.Option(help="Temperature from which the expansion counts.")] = None,
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
    force: ForceFile = False,
) -> None:
    """Bring a finite element model of another code into one file, model.h5."""
    from slipstick.faults import Gathering
    from slipstick.importers.roles import ImportOptions

    constants = {
        "young": young, "poisson": poisson, "density": density, "conductivity": conductivity, "expansion": expansion,
        "reference": reference,
    }  # fmt: skip
    material, faults = _material({key: value for key, value in constants.items() if value is not None})
    names, wrong_names = _names(name or ())
    factors, wrong_factors = _scale(scale or ())
    paths = [*files, *(path for path in (mass, damping, dof_map, nodes) if path is not None)]
    gathering = Gathering()
    options = gathering.take(
        ImportOptions, mass=mass, damping=damping, dof_map=dof_map, nodes=nodes, names=names, constraints=spc,
        material=material, fixed=tuple(fix or ()), quadratic=quadratic, units=units, scale=factors, to=to,
    )  # fmt: skip
    faults += [*wrong_names, *wrong_factors, *gathering.faults, *_file_faults(paths, output, force)]
    if options is None or faults:
        raise InputError(faults)
    answer |= _import(files, output, options)


def _import(files: list[Path], output: Path, options: ImportOptions) -> Answer:
    """Import and print what came in, one line each; notes that need attention are part of it."""
    from slipstick.importers.import_model import read_model, summary
    from slipstick.io.model_file import save_model

    say(f"reading {', '.join(path.name for path in files)} ...")
    model = read_model(files, options, quiet=True)
    save_model(model, output)
    notes = summary(model)
    for line in notes:
        say(line)
    warned = list(model.warnings)
    kinds = 'kind = "fe"' if model.mesh is not None else 'kind = "matrices" or "fe"'
    say(f'wrote {output}: name it in a case as [structure] {kinds}, file = "{output.name}"')
    if options.units is None and "units: not stated" in " ".join(notes):
        warned.append('the units of the model are not stated; give them with --units "N, mm, t, s"')
    for warning in warned:
        warn_user(warning)
    return {"model": output, "notes": list(notes), "warnings": warned}


def _material(constants: dict[str, Any]) -> tuple[Material | None, list[str | Fault]]:
    from slipstick.fem.materials import REQUIRED, Material

    missing: list[str | Fault] = [
        f"--{name} is missing; a material needs --young, --poisson and --density"
        for name in REQUIRED
        if constants and name not in constants
    ]
    if missing or not constants:
        return None, missing
    try:
        return Material(**constants), []
    except InputError as error:
        return None, [fault.below("material") for fault in error.faults]


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


def _scale(texts: Sequence[str]) -> tuple[dict[str, float] | None, list[str]]:
    """``["length=25.4e-3"]`` as a table."""
    factors: dict[str, float] = {}
    for text in texts:
        name, _, value = text.partition("=")
        try:
            factors[name] = float(value)
        except ValueError:
            return None, [f"--scale {text}: expected a factor such as length=25.4e-3"]
    return factors or None, []


def _file_faults(files: Sequence[Path], output: Path, force: bool) -> list[str | Fault]:
    from slipstick.faults import Gathering, unreached

    def missing(path: Path) -> str:
        reason = unreached(path)
        return f"cannot be reached ({reason}); give the file itself" if reason else "there is no such file"

    faults: list[str | Fault] = [
        f"{path}: {'found a folder; give its files' if path.is_dir() else missing(path)}"
        for path in files
        if not path.is_file()
    ]
    if output.suffix.lower() not in _SUFFIXES:
        faults.append(f"-o {output}: expected a name that ends in .h5")
    if output.is_dir():
        faults.append(f"-o {output}: found a folder; expected a file such as model.h5")
    elif not output.parent.is_dir():
        faults.append(f"-o {output}: the folder {output.parent} is not there; make it first")
    else:
        gathering = Gathering()
        gathering.take(refuse_file, output, force=force)
        faults += gathering.faults
    return faults
