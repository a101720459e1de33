"""Options of an import, and the role of each file: by option, by suffix, by the words in its name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from slipstick.errors import UNKNOWN_KEY, Fault, InputError, Place
from slipstick.faults import SMALLEST, Gathering, number, one, shown, suggestion, table, text, truth, whole
from slipstick.faults import names as text_list
from slipstick.faults import path as path_of
from slipstick.fem.materials import Material
from slipstick.importers.formats import holds, is_bulk

_MAPS = (".mapping", ".map", ".dof", ".dofs", ".txt", ".csv")
MODELS = (".h5", ".hdf5")


_UNREAD = {
    ".sub": "an Ansys substructure is not read; in Ansys, *DMAT,K,D,IMPORT,SUB,name.sub,STIFF and *EXPORT,K,MMF,k.mtx, "
    "likewise with MASS, then import the two .mtx with a map file",
    ".op2": "op2 is not read; have the superelement written with EXTSEOUT(MATOP4=unit) and give .op4 and .pch, or with "
    "EXTSEOUT(DMIGPCH) and give .pch",
    ".asm": "belongs to the run that assembles superelements; give the punch file (.pch) with the .op4 instead",
}
"""Files with wanted data that are not read, each with the remedy."""


@dataclass(frozen=True, kw_only=True)
class ImportOptions:
    """Options of an import: data that the files do not hold.

    All of it is checked here, for the command line, a case and Python alike.

    Attributes
    ----------
    mass, damping, dof_map, nodes
        Files with the mass matrix, the damping matrix, the map from rows to nodes and directions, and the positions
        (bulk data, or any mesh), where their names do not tell.
    names
        Names of the matrices in a Nastran file, as {"K": "KGG"}, where several would do.
    constraints
        Number of the Nastran SPC set in force.
    material
        Material for a mesh, instead of those in the file.
    conductivity
        Of every material, power/(length temperature), where the files have none.
    expansion, reference
        Coefficient of thermal expansion of every material, 1/temperature, a number or rows of a temperature and a
        number; the temperature from which it counts. As in :class:`slipstick.Material`.
    fixed
        Node sets or surfaces to hold; nodes ("n12"), dofs ("n12y").
    quadratic
        Put a node in the middle of every edge of a linear mesh.
    units
        Those of the numbers in the files, such as "N, mm, t, s"; kept with the model.
    scale
        New number over old number in the files, ``{"length": 25.4e-3}``: length, mass, force, time. Force and time stay
        where they are left out, mass follows. ``material`` and ``conductivity`` hold after scaling.
    to
        Units to come to from ``units``, "SI" or "N, mm, t, s", instead of ``scale``.

    Raises
    ------
    InputError
        For values of the wrong kind, all of them.

    Examples
    --------
    >>> import slipstick as ss
    >>> from slipstick.importers.roles import ImportOptions
    >>> options = ImportOptions(units="N, mm, t, s", to="SI", fixed=["ROOT"])
    >>> options.fixed, options.to
    (('ROOT',), 'SI')

    With a file of yours:

    >>> ss.import_model("blade.inp", options=options)  # doctest: +SKIP
    """

    mass: Path | None = None
    damping: Path | None = None
    dof_map: Path | None = None
    nodes: Path | None = None
    names: Mapping[str, str] = field(default_factory=dict)
    constraints: int | None = None
    material: Material | None = None
    conductivity: float | None = None
    expansion: Any = None
    reference: float | None = None
    fixed: Sequence[str] = ()
    quadratic: bool = False
    units: str | None = None
    scale: Mapping[str, float] | None = None
    to: str | None = None

    def __post_init__(self) -> None:
        found = Gathering()
        checks: dict[str, Callable[[Any], Any]] = {
            **{name: partial(path_of, name) for name in ("mass", "damping", "dof_map", "nodes")},
            "names": _names,
            "constraints": partial(whole, "constraints"),
            "material": lambda value: one("material", value, Material, "an ss.Material"),
            "conductivity": partial(number, "conductivity", expected="a conductivity >= 0", above=0.0),
            "expansion": _expansion,
            "reference": partial(number, "reference", expected="a temperature"),
            "fixed": partial(text_list, "fixed", expected="names of node sets or surfaces"),
            "quadratic": partial(truth, "quadratic"),
            "units": partial(text, "units"),
            "scale": _scale,
            "to": partial(text, "to", expected='units such as "SI" or "N, mm, t, s"'),
        }
        for name, check in checks.items():
            if (value := getattr(self, name)) is not None or name in ("names", "fixed", "quadratic"):
                object.__setattr__(self, name, found.take(check, value))
        found.end()


def _expansion(value: Any) -> Any:
    """As a material takes it."""
    try:
        Material(young=1.0, poisson=0.0, expansion=value)
        return value
    except InputError as error:
        raise InputError([fault.below("material") for fault in error.faults]) from None


@dataclass(frozen=True, kw_only=True)
class Roles:
    """Files by their role."""

    matrices: dict[str, Path]
    dof_map: Path | None
    nodes: Path | None

    @property
    def first(self) -> Path:
        """The file of the stiffness, or any."""
        return self.matrices.get("K") or next(iter(self.matrices.values()))

    @property
    def bulk(self) -> Path | None:
        """Bulk data given with the matrices."""
        return self.nodes if self.nodes and is_bulk(self.nodes) else None


def roles_of(paths: list[Path], options: ImportOptions) -> Roles:
    """Files by role: by the options, else by suffix and by the words in the name."""
    matrices: dict[str, Path] = {}
    dof_map, nodes = options.dof_map, options.nodes
    stated = {"M": options.mass, "C": options.damping}
    matrix_files = [path for path in paths if _holds_matrices(path, paths) and path not in stated.values()]
    for path in paths:
        suffix = path.suffix.lower()
        if path in matrix_files:
            role = _role(path)
            if role in matrices and suffix not in (".op4", ".pch"):
                raise InputError(
                    Fault(
                        statement=f"{matrices[role].name} and {path.name} both look like the matrix {role}",
                        remedy="say which is the mass",
                    )
                )
            matrices[role if role not in matrices else f"{role}{len(matrices)}"] = path
        elif suffix in _MAPS and path != dof_map:
            dof_map = path
        elif (is_bulk(path) or holds(path, "mesh")) and matrices_follow(paths):
            nodes = path
    matrices |= {role: Path(path) for role, path in stated.items() if path}
    return Roles(matrices=matrices, dof_map=Path(dof_map) if dof_map else None, nodes=Path(nodes) if nodes else None)


def _holds_matrices(path: Path, paths: Sequence[Path]) -> bool:
    """A punch file beside .op4 tells the rows of a superelement; alone it holds its matrices."""
    beside = path.suffix.lower() == ".pch" and any(p.suffix.lower() == ".op4" for p in paths)
    return holds(path, "matrices") and not beside


def matrices_follow(paths: Sequence[Path]) -> bool:
    """Whether matrix files are among these, so that a mesh among them is there for its positions."""
    return any(holds(path, "matrices") for path in paths)


def _role(path: Path) -> str:
    """K, M or C by the words in a file name.

    >>> [_role(Path(name)) for name in ("job_STIF1.mtx", "job_MASS1.mtx", "m.mtx", "blade_damping.npz")]
    ['K', 'M', 'M', 'C']
    """
    name = path.stem.lower()
    if re.search(r"mass|(^|[_\-.])m(gg|aa|ff)?\d*$", name):
        return "M"
    return "C" if re.search(r"damp|(^|[_\-.])c\d*$", name) else "K"


def refuse_unread(paths: Sequence[Path]) -> None:
    """Refuse files of known formats that are not read, with the remedy."""
    faults = [Fault(Place(path.name), _UNREAD[path.suffix.lower()]) for path in paths if path.suffix.lower() in _UNREAD]
    if faults:
        raise InputError(faults)


def refuse_unused(paths: Sequence[Path], roles: Roles, options: ImportOptions) -> None:
    """Refuse every file and every option without effect."""
    stated = (options.mass, options.damping, options.dof_map, options.nodes)
    used = {*roles.matrices.values(), roles.dof_map, roles.nodes, *(Path(path) for path in stated if path)}
    if not roles.matrices:
        used = {paths[0]}
    beside = {path.with_suffix(suffix) for path in roles.matrices.values() for suffix in (".mas", ".dof")}
    faults = [
        Fault(Place(path.name), "what it is for does not show", remedy="leave it out")
        for path in paths
        if path not in used | beside
    ]
    if not roles.matrices:
        faults += _without_effect(paths[0], options)
    if roles.matrices and options.quadratic:
        faults.append(
            Fault(
                "quadratic", "the matrices have elements already", remedy="import the mesh alone, or mesh it quadratic"
            )
        )
    if roles.matrices and options.material is not None and roles.nodes is None:
        faults.append(
            Fault("material", "matrices hold their material already", remedy="give it with a mesh, or leave it out")
        )
    if paths[0].suffix.lower() in MODELS and (options.material is not None or options.quadratic):
        faults.append(
            Fault(paths[0].name, "holds matrices", remedy="a material or quadratic has no effect on them: leave it out")
        )
    if faults:
        raise InputError(faults)


def _without_effect(path: Path, options: ImportOptions) -> Iterator[Fault]:
    """Options of matrices, given with a mesh or a model file."""
    of_matrices: dict[str, object] = {
        "dof_map": options.dof_map,
        "nodes": options.nodes,
        "names": options.names or None,
    }
    if not is_bulk(path):
        of_matrices["constraints"] = options.constraints
    for key, value in of_matrices.items():
        if value is not None:
            yield Fault(key, f"has no effect on {path.name}, which is no matrix", remedy="leave it out")


def _scale(value: Any) -> dict[str, float]:
    """Factors by dimension, each > 0."""
    known = ("length", "mass", "force", "time")
    factors = table("scale", value, 'factors such as {"length": 25.4e-3}')
    found = Gathering()
    found.faults += [
        Fault(("scale", key), UNKNOWN_KEY, remedy=suggestion(key, known)) for key in factors if key not in known
    ]
    for key in known:
        if key in factors:
            factors[key] = found.take(number, ("scale", key), factors[key], "a factor > 0", above=SMALLEST)
    found.end()
    return factors


def _names(value: Any) -> dict[str, str]:
    named = table("names", value, 'names of matrices such as {"K": "KGG"}')
    return {key: text(f"names, {shown(key)}", name) for key, name in named.items()}
