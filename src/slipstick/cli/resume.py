"""``ss.resume``: what the verb of that name does, from Python."""

from __future__ import annotations

from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from slipstick.cli.output import RESULTS, work_of
from slipstick.cli.run_options import RunOptions
from slipstick.cli.verbs.resume import resume_run
from slipstick.cli.verbs.study import holds_study
from slipstick.faults import path as path_of

if TYPE_CHECKING:
    import xarray

    from slipstick.branch import Branch


def resume(folder: str | Path) -> Branch | xarray.Dataset:
    """Go on with a run of ``slipstick run``, or a study, that was killed or interrupted: the command of that name.

    Parameters
    ----------
    folder
        Where it was written. A study that was begun in Python goes on by ``ss.study`` with the same arguments.

    Returns
    -------
    Branch or xarray.Dataset
        The branch of a run, with everything found: look at its ``outcome``. The dataset of a study.

    Raises
    ------
    InputError
        If there is nothing to go on with, its case has changed, or it was begun by another version.
    """
    from slipstick.io.loading import load, load_dataset
    from slipstick.studies.folder import STUDY_FILE

    place = path_of("resume, folder", folder, "the folder of a run or a study")
    with redirect_stdout(StringIO()):
        resume_run(place, RunOptions(figures=False, report=False, quiet=True))
    if holds_study(place):
        return load_dataset(place / STUDY_FILE)
    return load(work_of(place) / RESULTS)
