"""Runs killed at any moment and gone on with, perhaps killed again: nothing is lost, and what comes out at the end is
what a run finds that nobody disturbs, to the last bit.

``python kills.py COUNT FOLDER SEED``: children forked from one warm process, so that hundreds take minutes.
"""

from __future__ import annotations

import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray

sys.path.insert(0, str(Path(__file__).parents[1]))
from helpers.cases import oscillator

from slipstick.cli.options import RunOptions
from slipstick.cli.verbs.resume import resume_run
from slipstick.cli.verbs.run import run_case
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore

CASE = oscillator(
    head='harmonics = "0..5"\n',
    rubbing="velocity = 10.0",
    response="from = 4.0\nto = 8.0\nfirst_step = 4e-2\nmax_step = 4e-2\n",
)


QUIET = RunOptions(figures=False, report=False, quiet=True)
WORK = ("seconds",)
"""Attributes that tell of the time, not of the points."""


Stored = tuple[type, str]
RUN: Stored = (ResultStore, "append")
"""The method that stores what is not to be lost."""


def child(work: Callable[[], object], stored: Stored) -> tuple[int, int]:
    """A forked process at work, and a pipe that gets a byte for everything it has stored."""
    read, write = os.pipe()
    pid = os.fork()
    if pid:
        os.close(write)
        return pid, read
    whole = getattr(*stored)

    def store(self: object, *given: object) -> None:
        whole(self, *given)
        os.write(write, b".")

    try:
        os.close(read)
        setattr(*stored, store)
        work()
    finally:
        os._exit(0)


def killed(work: Callable[[], object], delay: float, stored: Stored = RUN) -> int:
    """How much was stored when it was killed."""
    pid, read = child(work, stored)
    time.sleep(delay)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
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


def same(found: xarray.Dataset, reference: xarray.Dataset) -> None:
    """Every variable and attribute."""
    assert {k: v for k, v in found.attrs.items() if k not in WORK} == {
        k: v for k, v in reference.attrs.items() if k not in WORK
    }
    for name, variable in reference.variables.items():
        assert found[name].to_numpy().tobytes() == variable.to_numpy().tobytes(), name


def gone_on(out: Path, rng: random.Random, length: float, reference: xarray.Dataset) -> None:
    """Gone on with, half of the time killed once more on the way."""
    if rng.random() < 0.5:
        killed(lambda: resume_run(out, QUIET), rng.uniform(0.0, length))
    assert resume_run(out, QUIET) == 0
    same(load_dataset(out / "results.nc"), reference)


def main(count: int, folder: Path, seed: int) -> None:
    rng, case = random.Random(seed), folder / "case.toml"
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    case.write_text(CASE)
    run_case(case, folder / "whole", options=QUIET)  # compiles the kernel where that is new
    begin = time.perf_counter()
    run_case(case, folder / "again", options=QUIET)
    length = time.perf_counter() - begin
    reference, found = load_dataset(folder / "whole" / "results.nc"), []
    same(load_dataset(folder / "again" / "results.nc"), reference)
    for number in range(count):
        out = folder / f"out{number}"
        stored = killed(lambda out=out: run_case(case, out, options=QUIET), rng.uniform(0.0, length))
        found.append(check(out, stored, reference))
        if (out / "results.nc").exists() or (out / "results.nc.journal").exists():
            gone_on(out, rng, length, reference)
        else:  # killed before there was anything to go on with; its lock holds nobody up
            assert run_case(case, out, options=QUIET) == 0
        shutil.rmtree(out, ignore_errors=True)
    print(f"{count} kills, {min(found)} to {max(found)} of {reference.sizes['point']} points", file=sys.__stdout__)


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
