"""Runs killed at any moment: every point that was stored is there, and is the point of a run that nobody disturbs.

``python kills.py COUNT FOLDER``: children forked from one warm process, so that hundreds take a minute.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import time
from pathlib import Path

import numpy as np
import xarray

from slipstick.app.run import run_case
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore

CASE = """\
format = 1
harmonics = "0..5"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[load]]
dof = "x"
sin = 100.0
[[contact]]
name = "damper"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 800.0
rubbing = { velocity = 10.0 }
[response]
from = 4.0
to = 8.0
first_step = 1e-3
max_step = 1e-3
max_points = 150
"""


def _run(case: Path, out: Path, told: int) -> None:
    """A run that says each point it has stored by one byte."""
    whole = ResultStore.append

    def append(store: ResultStore, point: object) -> None:
        whole(store, point)  # type: ignore[arg-type]
        os.write(told, b".")

    ResultStore.append = append  # type: ignore[method-assign, assignment]
    run_case(case, out, figures=False, quiet=True)


def killed(case: Path, out: Path, delay: float) -> int:
    """Points that a run had stored when it was killed."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.close(read)
            _run(case, out, write)
        finally:
            os._exit(0)
    os.close(write)
    time.sleep(delay)
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    with os.fdopen(read, "rb") as stream:
        return len(stream.read())


def check(out: Path, stored: int, reference: xarray.Dataset) -> int:
    """Points found; an assertion fails where one is lost or altered."""
    if not (out / "results.nc").exists():
        assert stored == 0, "results.nc is missing"
        return 0
    with xarray.open_dataset(out / "results.nc", engine="h5netcdf"):
        pass
    found = load_dataset(out / "results.nc")
    count = found.sizes["point"]
    assert stored <= count <= stored + 1, (stored, count)
    for name in ("omega", "displacement", "friction_force"):
        np.testing.assert_array_equal(found[name].to_numpy(), reference[name].to_numpy()[:count])
    return count


def main(count: int, folder: Path) -> None:
    rng, case = random.Random(1), folder / "case.toml"
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    case.write_text(CASE)
    run_case(case, folder / "whole", figures=False, quiet=True)  # compiles the kernel where that is new
    begin = time.perf_counter()
    run_case(case, folder / "again", figures=False, quiet=True)
    length = time.perf_counter() - begin
    reference = load_dataset(folder / "whole" / "results.nc")
    found = []
    for number in range(count):
        out = folder / f"out{number}"
        found.append(check(out, killed(case, out, rng.uniform(0.0, length)), reference))
        if number == 0 and (out / "results.nc").exists():
            run_case(case, out, force=True, figures=False, quiet=True)  # the lock of the killed run holds nobody up
        shutil.rmtree(out, ignore_errors=True)
    print(f"{count} kills, {min(found)} to {max(found)} of {reference.sizes['point']} points", file=sys.__stdout__)


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]))
