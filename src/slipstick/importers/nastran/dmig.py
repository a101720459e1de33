"""DMIG matrices of bulk data and punch files: entries by node and direction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from slipstick.importers.text_numbers import whole_number
from slipstick.typing import Sparse


@dataclass(kw_only=True)
class DirectMatrix:
    """A DMIG matrix: entries by (node, direction), one half when ``symmetric``."""

    name: str
    symmetric: bool
    rows: list[tuple[int, int]] = field(default_factory=list)
    columns: list[tuple[int, int]] = field(default_factory=list)
    values: list[float] = field(default_factory=list)


def pair(node: str, direction: str) -> tuple[int, int]:
    """Label and direction 0..6 of a DMIG entry; direction 0 or nothing is a scalar point."""
    component = whole_number(direction or "0")
    if not 0 <= component <= 6:
        raise ValueError(f"direction {component}; expected 0 to 6")
    return whole_number(node), (component - 1) % 7


def sparse(matrix: DirectMatrix, keys: list[tuple[int, int]]) -> Sparse:
    """Rows and columns in the order of ``keys``."""
    from scipy.sparse import coo_array

    place = {key: i for i, key in enumerate(keys)}
    rows = [place[key] for key in matrix.rows]
    columns = [place[key] for key in matrix.columns]
    return coo_array((np.array(matrix.values, dtype=float), (rows, columns)), shape=(len(keys),) * 2)
