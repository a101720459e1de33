"""Studies killed at any moment and gone on with, perhaps killed again: no case that was stored is lost, and the results
are those of a study that nobody disturbs, to the last bit.

``python study_kills.py COUNT FOLDER SEED``, as ``kills.py``.
"""

from __future__ import annotations

import os
import random
import shutil
import sys
import time
from pathlib import Path

import xarray
from kills import CASE, QUIET, killed, same

from slipstick.cli.verbs.resume import resume_run
from slipstick.cli.verbs.study import run_study
from slipstick.io.journal import read_journal
from slipstick.io.loading import load_dataset
from slipstick.runs.folder import analysis_in
from slipstick.runs.study import Spread
from slipstick.studies.folder import CURVES_FILE, STUDY_FILE, StudyFolder

STUDY = (
    CASE
    + """
[study]
"damper.velocity" = [1, 5, 10, 20, 50, 100]
"""
)
HERE = Spread(workers=1)
STORED = (StudyFolder, "add")


def results(out: Path) -> tuple[xarray.Dataset, xarray.Dataset]:
    return load_dataset(out / STUDY_FILE).drop_vars("seconds"), load_dataset(out / CURVES_FILE)


def main(count: int, folder: Path, seed: int) -> None:
    rng, case = random.Random(seed), folder / "case.toml"
    sys.stdout = open(os.devnull, "w")  # noqa: SIM115
    case.write_text(STUDY)
    run_study(case, folder / "whole", spread=HERE, options=QUIET)  # compiles the kernel where that is new
    begin = time.perf_counter()
    run_study(case, folder / "again", spread=HERE, options=QUIET)
    length, reference, found = time.perf_counter() - begin, results(folder / "whole"), []
    for number in range(count):
        out = folder / f"out{number}"
        work = lambda out=out: run_study(case, out, spread=HERE, options=QUIET)  # noqa: E731
        stored = killed(work, rng.uniform(0.0, length), STORED)
        journal = out / "study.journal"
        kept = len(read_journal(journal).rows) if journal.exists() else stored
        assert stored <= kept <= stored + 1, (stored, kept)
        found.append(stored)
        if not (out.exists() and analysis_in(out) == "study"):
            # killed before there was anything; its lock holds nobody up
            work()
        elif rng.random() < 0.5:
            killed(lambda out=out: resume_run(out, QUIET), rng.uniform(0.0, length), STORED)
        assert resume_run(out, QUIET) == 0
        for own, other in zip(results(out), reference, strict=True):
            same(own, other)
        shutil.rmtree(out, ignore_errors=True)
    print(f"{count} kills, {min(found)} to {max(found)} of 6 cases", file=sys.__stdout__)


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]))
