"""Tables whose rows belong together: points, segments and brackets of many branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy import ndarray


class Table:
    """A dataclass of arrays of equal length, and of other things with rows: tables, metrics."""

    def at(self, which: Any) -> Self:
        """Some of the rows."""
        columns = vars(self).items()
        return type(self)(
            **{name: part[which] if isinstance(part, ndarray) else part.at(which) for name, part in columns}
        )

    def put(self, which: Any, those: Self) -> None:
        """Replace some of the rows, in place."""
        for name, part in vars(self).items():
            new = getattr(those, name)
            if isinstance(part, ndarray):
                part[which] = new
            else:
                part.put(which, new)

    @classmethod
    def joined(cls, tables: Sequence[Self]) -> Self:
        """The rows of several, one after the other."""
        return cls(**{name: _joined([vars(table)[name] for table in tables]) for name in vars(tables[0])})


def _joined(parts: Sequence[Any]) -> Any:
    return np.concatenate(parts) if isinstance(parts[0], ndarray) else type(parts[0]).joined(parts)
