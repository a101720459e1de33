"""Files and folders that cannot be written: one sentence of all writers, and the file that was there stays."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import blocks, reports
from helpers.command import slipstick

import slipstick as ss
from slipstick.cli.verbs.init import write_files
from slipstick.errors import InputError
from slipstick.fem.box import box
from slipstick.importers.mesh_model import MeshModel, assemble_mesh
from slipstick.io.model_file import save_model
from slipstick.io.store import save_dataset
from slipstick.structure.reduction import store
from slipstick.studies.folder import StudyFolder
from slipstick.studies.plan import make_plan
from slipstick.studies.solving import Job

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
DENIED = PermissionError(errno.EACCES, os.strerror(errno.EACCES))


NOT_A_FOLDER = os.strerror(errno.ENOTDIR).lower()
"""Some writers say so before they begin, as of a path that means nothing."""


@cache
def result() -> ss.Branch:
    return reports.branch()


@cache
def one_force() -> ss.Branch:
    """Response functions need a single force."""
    return ss.steady_response(block(), omega=[5.0, 6.0])


def block() -> ss.Problem:
    structure = ss.MatrixStructure(M=[[1.0]], C=[[0.4]], K=[[40.0]], dofs=["x"])
    law = ss.FrictionContact(kt=100.0, mu=0.3, normal_load=10.0)
    foot = ss.ContactPair(name="foot", contact=law, tangential="x")
    return ss.Problem(structure, contacts=foot, loads=ss.Load(dof="x", sin=1.0), harmonics=3)


@cache
def preloaded() -> Any:
    return ss.preload(block(), ss.LoadStep(loads=ss.Load(dof="x", harmonic=0, cos=5.0)))


@cache
def model() -> Any:
    steel = ss.Material(young=2e11, poisson=0.3, density=7800.0)
    mesh = box((1.0, 1.0, 1.0), (1, 1, 1), "hex8")
    return assemble_mesh(MeshModel(mesh=mesh), source="box", material=steel, fixed=["x0"], quadratic=True)


@cache
def figure() -> Any:
    return result().plot.response("a")


WRITERS: dict[str, Callable[[Path], object]] = {
    "results.nc": lambda path: result().save(path),
    "dataset.nc": lambda path: save_dataset(preloaded().dataset, path),
    "preload.nc": lambda path: preloaded().save(path),
    "report.html": lambda path: result().report(path),
    "table.csv": lambda path: result().save_table(path),
    "table.mat": lambda path: result().save_table(path),
    "table.xlsx": lambda path: result().save_table(path),
    "functions.uff": lambda path: one_force().save_table(path),
    "shape.xdmf": lambda path: blocks.branch().save_shape(path, 0, frames=2),
    "model.h5": lambda path: save_model(model(), path),
    "figure.png": lambda path: ss.plots.save_figure(figure(), path.with_suffix(""), formats=("png",)),
}
"""Each writes one file, whose folder has to be there."""

MAKERS: dict[str, Callable[[Path], object]] = {
    "reduction.npz": lambda path: store.write(path, {"a": np.zeros(10_000)}),
    "example.toml": lambda path: write_files(path.parent, {path.name: b"x" * 10_000}) if not path.exists() else None,
}
"""They make the folder too."""


def sentence(path: Path, reason: str) -> str:
    return f"{path}: cannot be written ({reason}); choose another place"


def refused(write: Callable[[Path], object], path: Path) -> str:
    with pytest.raises(InputError) as raised:
        write(path)
    (said,) = raised.value.sentences
    return said


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("failure", [FULL, DENIED], ids=["full", "denied"])
def test_a_failure_is_told_and_leaves_the_old_file(name, failure, tmp_path, monkeypatch):
    path, write = tmp_path / name, WRITERS[name]
    write(path)
    before = path.read_bytes()

    def broken(*_: object) -> None:
        raise failure

    monkeypatch.setattr("slipstick.replacing._sync", broken)
    assert refused(write, path) == sentence(path, failure.strerror.lower())
    assert path.read_bytes() == before
    assert [file.name for file in tmp_path.iterdir()] == [name]


@contextmanager
def short_files(size: int) -> Iterator[None]:
    """The system itself refuses to write further than this, as on a full disk."""
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows limits no files")
@pytest.mark.parametrize("name", sorted({*WRITERS, *MAKERS} - {"table.xlsx"}))  # openpyxl writes temporary files
def test_the_system_refuses_to_write(name, tmp_path):
    path, write = tmp_path / name, {**WRITERS, **MAKERS}[name]
    with short_files(100):
        assert refused(write, path) == sentence(path, os.strerror(errno.EFBIG).lower())
    assert not list(tmp_path.iterdir())
    write(path)
    assert path.stat().st_size > 100


@pytest.mark.parametrize("name", sorted({*WRITERS} - {"table.csv"}))  # a table in text is known by its name alone
def test_a_file_of_another_kind_is_never_replaced(name, tmp_path):
    path, write = tmp_path / name, WRITERS[name]
    path.write_text(CASE)
    said = refused(write, path)
    assert said.startswith(f"{path}: there is a file that is no ")
    assert said.endswith("; choose another name")
    assert path.read_text() == CASE
    assert [file.name for file in tmp_path.iterdir()] == [name]
    path.write_bytes(b"")
    for _ in range(2):  # an empty file, and one of the kind
        write(path)
    assert path.stat().st_size > 100


@pytest.mark.parametrize("name", WRITERS)
def test_places_that_are_none(name, tmp_path):
    write, folder = WRITERS[name], tmp_path / "none"
    assert refused(write, folder / name) == sentence(folder / name, f"there is no folder {folder}")
    (tmp_path / name).mkdir()
    (tmp_path / name / "kept").touch()
    assert refused(write, tmp_path / name) == sentence(tmp_path / name, os.strerror(errno.EISDIR).lower())
    assert sorted(file.name for file in tmp_path.rglob("*")) == sorted([name, "kept"])
    (tmp_path / "file").touch()
    assert NOT_A_FOLDER in refused(write, tmp_path / "file" / name).lower()


def study(folder: Path) -> StudyFolder:
    job = Job(problem=block(), span=(5.0, 7.0))
    return StudyFolder(folder, job, make_plan(job.problem, {"foot.mu": [0.1, 0.2]}), about={})


FOLDERS: dict[str, Callable[[Path], object]] = {
    "run-up": lambda path: ss.runs.run_up(block(), 5.0, periods=1, folder=path),
    "study": study,
    "reduction": lambda path: store.write(path / "r.npz", {"a": np.zeros(3)}),
    "example": lambda path: write_files(path, {"case.toml": b""}),
}


@pytest.mark.parametrize("name", FOLDERS)
def test_folders_below_a_file(name, tmp_path):
    (tmp_path / "file").touch()
    assert NOT_A_FOLDER in refused(FOLDERS[name], tmp_path / "file" / "folder").lower()


COMMANDS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "a report": (("report", "r.nc", "-o", "none/r.html"), "none/r.html", "there is no folder none"),
    "a table": (("table", "r.nc", "none/t.csv"), "none/t.csv", "there is no folder none"),
    "the checks": (("verify", "--markdown", "none/t.md"), "--markdown none/t.md", "there is no folder none"),
    "a run": (("run", "case.toml", "-o", "file/x", "-q"), "file/x", "not a directory"),
    "a run over a file": (("run", "case.toml", "-o", "file", "-q"), "file", "found a file; expected a folder"),
    "a run-up": (("run-up", "case.toml", "-o", "file/x", "-q"), "file/x", "not a directory"),
    "load steps": (("preload", "case.toml", "-o", "file/x"), "file/x", "not a directory"),
    "an example": (("init", "oscillator", "file/x"), "file/x", "not a directory"),
}

CASE = """
format = 1
harmonics = "0..3"
[structure]
kind = "matrices"
dofs = ["x"]
mass = [[1.0]]
damping = [[0.4]]
stiffness = [[40.0]]
[[contact]]
name = "foot"
tangential = "x"
kt = 100.0
mu = 0.3
normal_load = 10.0
[[preload]]
loads = [{ dof = "x", cos = 1.0 }]
[[load]]
dof = "x"
cos = 0.05
[response]
from = 8.0
to = 14.0
[run_up]
from = 8.0
periods = 2
"""


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_say_it_and_end_with_2(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("case.toml").write_text(CASE)
    result().save("r.nc")
    arguments, place, reason = COMMANDS[name]
    done = slipstick(*arguments)
    assert done.exit_code == 2
    assert sentence(Path(place), reason) in " ".join(done.output.split())
    assert "Traceback" not in done.output


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a named pipe")
def test_what_is_no_file_is_not_replaced(tmp_path: Path) -> None:
    """A device or a pipe that is there stays."""
    pipe = tmp_path / "r.nc"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match=r"r\.nc: cannot be written \(found a device; expected a file\)"):
        result().save(pipe)
    assert pipe.is_fifo()
    assert list(tmp_path.iterdir()) == [pipe]
