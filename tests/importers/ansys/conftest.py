"""Files that the readers' packages ship."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def shipped() -> Path:
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    return Path(os.path.dirname(examples.__file__))


@pytest.fixture(scope="module")
def archives() -> Path:
    examples = pytest.importorskip("mapdl_archive.examples")
    return Path(os.path.dirname(examples.__file__))
