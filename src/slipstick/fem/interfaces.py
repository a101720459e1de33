"""Interfaces that the file of a model names and its matrices leave out: surfaces that touch, sections of bolts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from slipstick.errors import Place


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
    card
        What gives the coefficient there, such as "*FRICTION"; empty: the interaction itself does.
    """

    dependent: str
    independent: str
    mu: float | None = None
    interaction: str = ""
    card: str = ""

    @property
    def stated(self) -> str:
        """The coefficient and where it stands, in words."""
        if self.mu is None:
            return "the deck gives no coefficient of friction for them"
        names = [name for name in (self.card, self.interaction) if name] or ["contact pair"]
        return f"mu = {self.mu:g} of the deck's {names[0]}" + "".join(f" ({name})" for name in names[1:])


def pair_of(pairs: Mapping[str, SurfacePair], first: object, second: object) -> SurfacePair | None:
    """The pair of two surfaces by their names, in either order; one with a coefficient comes first."""
    names = [(first, second), (second, first)]
    found = [pair for one in names for pair in pairs.values() if (pair.dependent, pair.independent) == one]
    return min(found, key=lambda pair: pair.mu is None, default=None)


WHOLE = (
    "is kept as model.pretension_sections: the bolt stays whole there, and its load and shortening have no effect "
    "until it is cut ([[bolt]] section of a case, ss.models.pretension_bolts)"
)
"""What is said of sections on import."""


@dataclass(frozen=True, kw_only=True)
class PretensionSection:
    """A section across a bolt; in the matrices the bolt is whole there until ``ss.models.pretension_bolts`` cuts it.

    Attributes
    ----------
    node
        Label of the node that carries the load or the shortening of the bolt in the file; 0: Nastran has none.
    normal
        Direction of the load, where the file gives one: out of the elements whose faces are the section.
    card
        What states it in the file, such as "line 32: *PRE-TENSION SECTION".
    """

    node: int
    normal: tuple[float, float, float] | None = None
    card: str = field(default="", compare=False)

    def place(self, source: str, name: str) -> Place:
        """Where it stands, for messages."""
        return Place(source, *(self.card or f"pretension section {name}").split(": "))
