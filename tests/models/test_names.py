"""Names of ``ss.models``."""

from importlib import import_module
from pathlib import Path

import slipstick as ss


def test_no_file_hides_a_name() -> None:
    """A file called like a function would stand in its place as soon as it is imported."""
    for file in Path(ss.models.__file__).parent.glob("[!_]*.py"):
        import_module(f"slipstick.models.{file.stem}")
    assert [name for name in ss.models.__all__ if not callable(getattr(ss.models, name))] == []
