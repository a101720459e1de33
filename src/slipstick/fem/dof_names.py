"""Names that users give nodes, degrees of freedom and directions by: "n12", "n12y", "xyz"."""

from __future__ import annotations

import re

from slipstick.fem.equations import COMPONENTS
from slipstick.typing import BoolArray, IntArray

_SINGLE = re.compile(r"n(\d{1,18})(x|y|z|rx|ry|rz|s)?$")
"""A node or a degree of freedom by name."""


def directions_in(components: str) -> set[str]:
    """Directions in a text such as "xyz", "x ry" or "x,y".

    >>> sorted(directions_in("xz")), sorted(directions_in("x, ry"))
    (['x', 'z'], ['ry', 'x'])
    """
    words = components.replace(",", " ").split()
    return {part for word in words for part in ([word] if word in COMPONENTS else list(word))}


def rows_named(name: str, labels: IntArray, components: IntArray) -> BoolArray:
    """Where "n12" or "n12y" stands among degrees of freedom."""
    node, component = _SINGLE.match(name).groups()  # type: ignore[union-attr]
    here = labels == int(node)
    return here & (components == COMPONENTS.index(component)) if component else here


def names_dofs(name: str) -> bool:
    """Whether a name is that of a node or of one of its degrees of freedom.

    >>> [names_dofs(name) for name in ("n12", "n12ry", "NOZZLE", "n12w")]
    [True, True, False, False]
    """
    return _SINGLE.match(name) is not None
