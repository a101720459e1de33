"""Killed runs lose nothing, and end as if nothing had happened when they are gone on with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize("count", [1, pytest.param(40, marks=pytest.mark.verify)])
@pytest.mark.parametrize("what", ["kills.py", "study_kills.py"])
def test_kills(tmp_path: Path, what: str, count: int) -> None:
    found = subprocess.run(
        [sys.executable, str(Path(__file__).parent / what), str(count), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=1200,
    )
    assert found.stdout.startswith(f"{count} kills"), found.stderr[-3000:]
