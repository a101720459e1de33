"""The ``import`` command: files of another finite element code become one model.h5."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipstick.cli.terminal.guard import complain, say
from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.fem.materials import Material

_ROLES = ("K", "M", "C")
_SUFFIXES = (".h5", ".hdf5")


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
        complain(f"warning: {warning}")
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
