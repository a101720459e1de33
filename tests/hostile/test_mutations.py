"""Damaged and malicious files: taken or refused with a sentence, in little memory; never a traceback, never a hang."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import child
import pytest
import samples

LIMIT_MEGABYTES = 500


@pytest.mark.parametrize("kind", ["case", "named", "model", "results"])
def test_a_few(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(child, "_groups", [])
    samples.write_files(tmp_path)
    if kind == "results":
        samples.write_results(tmp_path)
    faults = {seed: fault for seed in range(9000, 9008) if (fault := child.KINDS[kind](tmp_path, seed))}
    assert not faults


@pytest.mark.verify(sample=5)
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs the memory figures of Linux")
@pytest.mark.parametrize(
    "kind, first",
    [
        (kind, first)
        for kind, count in (("case", 1700), ("named", 300), ("model", 400), ("results", 300))
        for first in range(0, count, 100)
    ],
)
def test_a_hundred(tmp_path: Path, kind: str, first: int) -> None:
    """1700 cases by `check` and `run`, 1000 files of models, results and journals, in processes with limits."""
    count = 100
    script = str(Path(child.__file__))
    found = subprocess.run(
        [sys.executable, script, kind, str(first), str(count), str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=1200,
        env={**os.environ, "OMP_NUM_THREADS": "1"},
    )
    rows = [json.loads(line) for line in found.stdout.splitlines() if line.startswith("{")]
    assert len(rows) == count, f"the process ended at {rows[-1:]}: {found.stderr[-2000:]}"
    bad = [r for r in rows if r["fault"] or r["megabytes"] > LIMIT_MEGABYTES]
    assert not bad
