"""Killed runs lose nothing, and end as if nothing had happened when they are gone on with."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
@pytest.mark.parametrize(
    "count, seed", [(1, 0), *(pytest.param(8, seed, marks=pytest.mark.verify(sample=4)) for seed in range(1, 6))]
)
@pytest.mark.parametrize("what", ["kills.py", "study_kills.py"])
def test_kills(tmp_path: Path, what: str, count: int, seed: int) -> None:
    found = subprocess.run(
        [sys.executable, str(Path(__file__).parent / what), str(count), str(tmp_path), str(seed)],
        capture_output=True,
        text=True,
        timeout=1200,
    )
    assert found.stdout.startswith(f"{count} kills"), found.stderr[-3000:]
