"""File formats by the ending of the name: what a file holds, and the function that reads it, loaded on use.

A reader of a mesh takes the path and returns a ``Deck``; a reader of matrices takes the files by role and the options
of the import (both of ``roles``). A reader of a user's own is handed to ``register``. Packages that a reader needs are
imported by ``require`` of fem/extras.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from slipstick.errors import Fault, InputError

if TYPE_CHECKING:
    from slipstick.importers.deck import Deck


@dataclass(frozen=True, kw_only=True)
class Format:
    """One format.

    Attributes
    ----------
    suffixes
        Endings of names, such as ".inp".
    holds
        "mesh" or "matrices".
    read
        The reader, or "module:function" within ``slipstick.importers``.
    whole
        Whether one file brings all matrices.
    rows
        Along which directions the rows of matrices go where nodes have their own: "global", those of the "nodes", or
        not known.
    supports
        Whether it may hold several sets of supports, of which ``constraints`` chooses one.
    """

    suffixes: tuple[str, ...]
    holds: Literal["mesh", "matrices"]
    read: str | Callable[..., Deck]
    whole: bool = False
    rows: Literal["global", "nodes", ""] = ""
    supports: bool = False

    @property
    def reader(self) -> Callable[..., Deck]:
        """The function that reads it."""
        if not isinstance(self.read, str):
            return self.read
        module, _, name = self.read.partition(":")
        function: Callable[..., Deck] = getattr(import_module(f"slipstick.importers.{module}"), name)
        return function


FORMATS = [
    Format(suffixes=(".cdb",), holds="mesh", read="ansys.archive:read_archive"),
    Format(suffixes=(".inp", ".msh"), holds="mesh", read="import_model:read_by_content"),
    Format(suffixes=(".bdf", ".nas", ".dat", ".blk"), holds="mesh", read="nastran.mesh:read_bulk_mesh", supports=True),
    Format(suffixes=(".vtu", ".vtk", ".med", ".xdmf", ".exo", ".e"), holds="mesh", read="import_model:read_by_meshio"),
    Format(suffixes=(".full",), holds="matrices", read="ansys.matrices:read_full_file", whole=True, rows="nodes"),
    Format(
        suffixes=(".matrix", ".hb", ".rsa", ".rua"),
        holds="matrices",
        read="ansys.matrices:read_hbmat_files",
        rows="nodes",
    ),
    Format(suffixes=(".op4", ".pch"), holds="matrices", read="nastran.matrices:read_matrices"),
    Format(suffixes=(".sti",), holds="matrices", read="abaqus.calculix:read_matrices", whole=True, rows="global"),
    Format(suffixes=(".mtx", ".npz"), holds="matrices", read="plain.matrices:read_matrices"),
]


def register(new: Format) -> None:
    """Add a format.

    Raises
    ------
    InputError
        If one of its endings is known already.
    """
    known = [suffix for suffix in new.suffixes if format_of(Path(f"x{suffix}")) is not None]
    if known:
        raise InputError(
            Fault("suffixes", f"files of type '{known[0]}' are read already", remedy="take another ending")
        )
    FORMATS.append(new)


def format_of(path: Path) -> Format | None:
    """The format of a file by its name; None where it is not known."""
    return next((known for known in FORMATS if path.suffix.lower() in known.suffixes), None)


def holds(path: Path, what: Literal["mesh", "matrices"]) -> bool:
    """Whether a file is one of a mesh, or of matrices, by its name."""
    known = format_of(path)
    return known is not None and known.holds == what


def is_bulk(path: Path) -> bool:
    """Whether a file is Nastran bulk data, or a punch file that may hold it."""
    known = format_of(path)
    return path.suffix.lower() == ".pch" or (known is not None and known.supports)
