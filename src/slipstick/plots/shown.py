"""Whether new figures are made by pyplot, for notebooks and ``plt.show()``, or for files alone."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

_BY_PYPLOT = ContextVar("_BY_PYPLOT", default=True)


def by_pyplot() -> bool:
    """Whether a new figure is to be made by pyplot."""
    return _BY_PYPLOT.get()


@contextmanager
def for_files() -> Iterator[None]:
    """Figures made inside are for files alone: no window, no notebook shows them, and nothing keeps them."""
    token = _BY_PYPLOT.set(False)
    try:
        yield
    finally:
        _BY_PYPLOT.reset(token)
