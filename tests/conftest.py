"""Makes what several rooms' tests share importable, ``from helpers.cases import ...``; the kernel is compiled once."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))


def pytest_configure(config: pytest.Config) -> None:
    """Compile the kernel before there are workers, each of which would do so for itself."""
    if getattr(config.option, "numprocesses", None) and not config.option.collectonly:
        from slipstick.contact.kernel.compilation import compile_kernel, is_compiled

        if not is_compiled():
            compile_kernel()
