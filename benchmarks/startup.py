"""Processor seconds of starting: to import, to show the help, to run and check the oscillator, to compile the kernel on
a machine that has never run it.

    OMP_NUM_THREADS=1 python benchmarks/startup.py
"""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

INSTALLED = {key: value for key, value in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
"""Environment in which Python keeps what it has compiled of the sources, as an installed package has it."""
KERNEL = """
from slipstick.balance.kernel.compilation import compile_all
compile_all()
"""


def seconds(command: list[str], repeats: int = 5, **options: Any) -> list[float]:
    """Processor seconds of a command and what it starts."""
    options = {"env": INSTALLED, **options}
    times = []
    for _ in range(repeats):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, check=True, capture_output=True, **options)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        times.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return times


def measure() -> list[dict[str, Any]]:
    """Rows of the table."""
    program = [sys.executable, "-m", "slipstick"]
    found = {
        "python alone": seconds([sys.executable, "-c", "pass"]),
        "import slipstick": seconds([sys.executable, "-c", "import slipstick"]),
        "slipstick --help": seconds([*program, "--help"]),
    }
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([*program, "init", "oscillator", folder], check=True, capture_output=True)
        case, out = str(Path(folder) / "oscillator.toml"), Path(folder) / "out"
        found["slipstick check, oscillator"] = seconds([*program, "check", case])
        runs = []
        for _ in range(5):
            runs += seconds([*program, "run", case, "-o", str(out)], 1)
            shutil.rmtree(out)
        found["slipstick run, oscillator"] = runs
    with tempfile.TemporaryDirectory() as folder:
        empty = os.environ | {"NUMBA_CACHE_DIR": folder, "SLIPSTICK_CACHE_DIR": folder, "XDG_CACHE_HOME": folder}
        found["first compilation"] = seconds([sys.executable, "-c", KERNEL], 1, env=empty)
    return [
        {"start": name, "s": min(t), "s, median": float(np.median(t)), "times": len(t)} for name, t in found.items()
    ]


if __name__ == "__main__":
    for line in measure():
        print(line)
