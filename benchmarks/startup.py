"""Seconds to import, to show the help, and to compile the kernel on a machine that has never run it."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

KERNEL = """
import time
import numpy as np
from slipstick.contact.forces import element_forces
from slipstick.trig.harmonics import Harmonics
h, one = Harmonics(range(6)), np.ones(1)
start = time.perf_counter()
element_forces(h, np.ones((1, h.size)), np.ones((1, h.size)), v=one, kt=one, mu=one, kn=one, gap=-9 * one)
print(time.perf_counter() - start)
"""


def seconds(command, repeats=5, **options):
    """Best wall time of a command."""
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True, **options)
        times.append(time.perf_counter() - start)
    return min(times)


def first_call(environment):
    """Seconds of the first evaluation in a fresh process."""
    done = subprocess.run([sys.executable, "-c", KERNEL], check=True, capture_output=True, text=True, env=environment)
    return float(done.stdout.split()[-1])


def measure():
    program = Path(sys.executable).parent / "slipstick"
    out = {
        "python_s": seconds([sys.executable, "-c", "pass"]),
        "import_s": seconds([sys.executable, "-c", "import slipstick"]),
        "help_s": seconds([str(program), "--help"]),
    }
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"NUMBA_CACHE_DIR": folder, "SLIPSTICK_CACHE_DIR": folder, "XDG_CACHE_HOME": folder}
        out["first_compilation_s"] = first_call(environment)
        out["compiled_before_s"] = first_call(environment)
    return out


if __name__ == "__main__":
    for key, value in measure().items():
        print(f"{key:24s} {value:.3g}")
