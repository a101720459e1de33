"""Interfaces that the file of a model names and its matrices leave out: surfaces that touch, sections of bolts."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class SurfacePair:
    """Two surfaces (or node sets) of the mesh that are meant to touch; nothing in the matrices joins them.

    Attributes
    ----------
    dependent, independent
        Their names, in the order of the file; the same one of a surface that touches itself.
    mu
        Coefficient of friction of the file; None: it gives none, which other codes take for no friction.
    interaction
        Name of the properties in the file.
    """

    dependent: str
    independent: str
    mu: float | None = None
    interaction: str = ""


@dataclass(frozen=True, kw_only=True)
class PretensionSection:
    """A section across a bolt; in the matrices the bolt is whole there.

    Attributes
    ----------
    node
        Label of the node that carries the load or the shortening of the bolt in the file; 0: Nastran has none.
    normal
        Direction of the load, where the file gives one.
    """

    node: int
    normal: tuple[float, float, float] | None = None
