"""What a ``[structure]`` table makes: the structure, and for finite element models what lies behind it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from slipstick.fem.imported import ImportedModel
    from slipstick.models.reduced_body import ReducedBody
    from slipstick.structure.protocol import Structure

Tell = Callable[[str], None]


def silent(_text: str) -> None:
    """A listener that says nothing."""


@dataclass(frozen=True, kw_only=True)
class Body:
    """The structure of a case, and the finite element model behind it where there is one.

    ``model``: an imported model that is the structure itself. ``force``: a reduction that is too coarse is taken all
    the same. ``seconds``: what it took to make or to read it.
    """

    structure: Structure
    reduced: ReducedBody | None = None
    model: ImportedModel | None = None
    force: bool = False
    seconds: float = 0.0

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is approximated or is suspicious in the model, one sentence each."""
        behind = self.reduced or self.model
        return () if behind is None else behind.warnings
