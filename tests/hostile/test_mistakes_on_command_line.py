"""What users type wrong: refused with exit code 2 in words that name it, every file left as it was."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.command import slipstick
from helpers.gmsh import beam, write_inp, write_msh
from helpers.study_case import CASE
from typer.testing import Result

MATERIAL = ("--young", "2e11", "--poisson", "0.3", "--density", "7800")

# name: (call, fragments of what is said)
MISTAKES: dict[str, tuple[tuple[object, ...], tuple[str, ...]]] = {
    # verbs
    "a verb misspelt": (("runn", "case.toml"), ("'runn'", "'run'")),
    "a verb that other programs have": (("solve", "case.toml"), ("No such command 'solve'",)),
    "the case without a verb": (("case.toml",), ("No such command 'case.toml'",)),
    "an option of all verbs misspelt": (("--versoin",), ("--versoin", "--version")),
    # run and check
    "no case": (("run",), ("Missing argument 'CASE.toml'",)),
    "a case that is not there": (("run", "nowhere.toml"), ("nowhere.toml: there is no such file",)),
    "two cases": (("run", "case.toml", "case.toml"), ("unexpected extra argument", "case.toml")),
    "a folder as case": (("run", "empty"), ("empty: found a folder; expected a case file",)),
    "results as case": (("check", "out/results.nc"), ("out/results.nc: not a text file; expected a case in TOML",)),
    "an option misspelt": (("run", "case.toml", "--ouput", "x"), ("--ouput", "--output")),
    "an option of another verb": (("run", "case.toml", "--workers", 2), ("No such option: --workers",)),
    "check does not write": (("check", "case.toml", "-o", "x"), ("No such option: -o",)),
    "an option without its value": (("run", "case.toml", "-o"), ("-o", "requires an argument")),
    "one option twice": (("run", "case.toml", "-o", "x", "--output=y"), ("--output is given 2 times", "keep one")),
    "results are there": (("run", "case.toml", "-o", "out"), ("out already holds results.nc", "--force")),
    "a file as folder": (
        ("run", "case.toml", "-o", "afile"),
        ("afile: cannot be written (found a file; expected a fo",),
    ),
    "a folder below a file": (("run", "case.toml", "-o", "afile/x"), ("afile/x: cannot be written (not a directory)",)),
    "time in words": (("run", "case.toml", "--time-limit", "fast"), ("--time-limit: found 'fast'", '"90 s"')),
    "time in another unit": (("run", "case.toml", "--time-limit", "5 parsec"), ("--time-limit: found '5 parsec'",)),
    "no time at all": (
        ("run", "case.toml", "--time-limit", "0 s"),
        ("--time-limit: found '0 s'; expected a time > 0",),
    ),
    "the unit is not in the value": (
        ("run", "case.toml", "--time-limit", "90", "s"),
        ("unexpected extra argument", "s"),
    ),
    "a figure misspelt": (("run", "case.toml", "--figures", "respons"), ("--figures: found 'respons'", "response")),
    "a format that is none": (
        ("run", "case.toml", "--figures", "all", "--format", "gif"),
        ("--format: found 'gif'; expected png, svg, pdf",),
    ),
    "a format of no figure": (("run", "case.toml", "--format", "svg"), ("--format: found no figures to draw",)),
    "figures and none": (("run", "case.toml", "--figures", "all", "--no-figures"), ("--figures is given too",)),
    # studies and what has its own table
    "a study of a case without [study]": (("study", "case.toml"), ("[study] is missing", "damper.velocity")),
    "the study is there": (("study", "study.toml", "-o", "st"), ("st already holds study.nc", "--force")),
    "a file as folder of a study": (
        ("study", "study.toml", "-o", "afile"),
        ("afile: cannot be written (found a file",),
    ),
    "no workers": (("study", "study.toml", "-o", "x", "--workers", 0), ("--workers", "greater than or equal to 1")),
    "workers in words": (("study", "study.toml", "--workers", "all"), ("--workers", "integer")),
    "a share of nothing": (("study", "study.toml", "--index", 3), ("--index and --of go together",)),
    "a share beyond the last": (
        ("study", "study.toml", "--index", 3, "--of", 2),
        ("--index: found 3 of 2 shares; expected a number from 0 to 1",),
    ),
    "workers of a cluster": (
        ("study", "study.toml", "--scheduler", "tcp://host:1", "--workers", 2),
        ("--workers and --scheduler are both",),
    ),
    "a cluster without address": (
        ("study", "study.toml", "-o", "x", "--scheduler", "nonsense"),
        ("--scheduler: no Dask scheduler", "tcp://host"),
    ),
    "[track] is missing": (("track", "case.toml"), ("case.toml: [track] is missing", "parameter")),
    "[optimal] is missing": (("optimal", "case.toml"), ("case.toml: [optimal] is missing",)),
    "[modes] is missing": (("modes", "case.toml"), ("case.toml: [modes] is missing",)),
    "[limit_cycles] is missing": (("limit-cycles", "case.toml"), ("case.toml: [limit_cycles] is missing",)),
    # resume
    "resume of nothing": (("resume", "nowhere"), ("nowhere: there is no such folder", "slipstick study")),
    "resume of an empty folder": (("resume", "empty"), ("empty: there is no run or study in it",)),
    "resume of a file": (("resume", "out/results.nc"), ("out/results.nc: found a file; expected a folder",)),
    "workers of a run": (("resume", "out", "--workers", 2), ("--workers: out holds a run, which is one process",)),
    "a journal cut in its header": (("resume", "cut"), ("results.nc.journal: the journal is cut short in its header",)),
    "a study's journal cut in its header": (
        ("resume", "cutstudy"),
        ("study.journal: the journal is cut short in its",),
    ),
    "a study whose journal is gone": (("resume", "lost"), ("lost: the study in it did not end", "study.journal")),
    # report and verify
    "report of nothing": (("report",), ("Missing argument 'RESULTS.nc...'",)),
    "report of an empty folder": (
        ("report", "empty"),
        ("empty: found a folder without results.nc, study.nc,", "identify.nc"),
    ),
    "report of a picture": (("report", "picture.nc"), ("picture.nc: not a results file: it is a picture (PNG)",)),
    "report of a case": (("report", "case.toml"), ("case.toml: not a results file: it is text, such as a case file",)),
    "report of an empty file": (("report", "empty.nc"), ("empty.nc: not a results file: it is empty",)),
    "report of a page": (("report", "page.html"), ("page.html: not a results file: it is a page for a browser",)),
    "report of old netCDF": (("report", "old.nc"), ("old.nc: not a results file: it is netCDF-3",)),
    "report of a stranger's netCDF": (
        ("report", "foreign.nc"),
        ("foreign.nc: is netCDF, but holds no results of slipstick", "found depth"),
    ),
    "report of curves": (("report", "st/curves.nc"), ("st/curves.nc: holds the curves of a study; give its study.nc",)),
    "a report into a PDF": (("report", "out", "-o", "r.pdf"), ("-o r.pdf: found '.pdf'; a report is a page",)),
    "a report over results": (
        ("report", "out", "-o", "out/results.nc"),
        ("out/results.nc: there is a file that is no",),
    ),
    "a report into no folder": (
        ("report", "out", "-o", "nowhere/r.html"),
        ("nowhere/r.html: cannot be written (there is ",),
    ),
    "fewer contacts than none": (
        ("report", "out", "--contacts", -1),
        ("contacts: found -1; expected a whole number >= 0",),
    ),
    "no dofs": (("report", "out", "--dofs", 0), ("dofs: found 0; expected a whole number >= 1",)),
    "a case of a run": (("report", "out", "--case", 1), ("--case is a case of a study",)),
    "a case that the study has not": (("report", "st", "--case", 9), ("--case: found 9", "from 0 to 1")),
    "a study beside a run": (("report", "st", "out"), ("a report holds one study, or results of runs",)),
    "verify of a study": (("verify", "st"), ("st/study.nc: holds a study, not the motion of one run",)),
    "report of a model": (("report", "model.h5"), ("model.h5: not a results file: it is a model",)),
    "verify of a picture": (("verify", "picture.nc"), ("picture.nc: not a results file: it is a picture",)),
    "--at in words": (("verify", "out", "--at", "abc"), ("--at: found 'abc'", '"50 Hz"')),
    "--at with a comma": (("verify", "out", "--at", "6,3"), ("--at: found '6,3'; expected a frequency such as 6.3",)),
    "--at in another unit": (("verify", "out", "--at", "2 furlong"), ("--at: found '2 furlong'",)),
    "--at with its unit apart": (("verify", "out", "--at", 1, "Hz"), ("unexpected extra argument", "Hz")),
    "half a point": (("verify", "out", "--point", 1.5), ("--point", "integer")),
    "a point beyond the last": (("verify", "out", "--point", 9999), ("--point: found 9999; expected a whole number",)),
    "a negative tolerance": (("verify", "out", "--tolerance", -1), ("--tolerance", "greater than or equal to 0")),
    "points of nothing": (("verify", "--point", 3), ("--point, --at: found no RESULTS",)),
    "rows of a results file": (
        ("verify", "out", "--only", "CF1"),
        ("--only: chooses rows of the installation's table",),
    ),
    "a row that is not there": (("verify", "--only", "CF99"), ("no check is called CF99", "CF1")),
    "a table into no folder": (
        ("verify", "--markdown", "no/t.md"),
        ("--markdown no/t.md: cannot be written (there is no",),
    ),
    # init and info
    "an example that is not there": (("init", "brake_squeel"), ("'brake_squeel'; did you mean 'brake_squeal'?",)),
    "an example into a file": (("init", "blade", "afile"), ("afile: found a file; expected a folder",)),
    "an example over another": (("init", "blade", "ini"), ("ini/blade.toml: is there already",)),
    "a case is no example": (("init", "case.toml"), ("case.toml: is a file, no example", "--python")),
    "a script elsewhere": (("init", "case.toml", "--python", "x"), ("x: the script of a case is written beside",)),
    "info of something": (("info", "case.toml"), ("unexpected extra argument", "case.toml")),
    # import
    "import of nothing": (("import", "-o", "m.h5"), ("Missing argument 'FILES...'",)),
    "import to nowhere": (("import", "m.inp"), ("Missing option '-o'",)),
    "a mesh that is not there": (("import", "mm.inp", "-o", "m.h5", *MATERIAL), ("mm.inp: there is no such file",)),
    "a folder as mesh": (("import", "empty", "-o", "m.h5", *MATERIAL), ("empty: found a folder; give its files",)),
    "a format that is not known": (("import", "case.toml", "-o", "m.h5"), ("type '.toml' are not known", ".inp")),
    "output that is no model": (
        ("import", "m.inp", "-o", "m.nc", *MATERIAL),
        ("-o m.nc: expected a name that ends in .h5",),
    ),
    "output that is there": (
        ("import", "m.inp", "-o", "there.h5", *MATERIAL),
        ("there.h5: is there already", "--force"),
    ),
    "output into no folder": (
        ("import", "m.inp", "-o", "no/m.h5", *MATERIAL),
        ("-o no/m.h5: the folder no is not there",),
    ),
    "half a material": (
        ("import", "m.inp", "-o", "m.h5", "--young", 2e11),
        ("--poisson is missing", "--density is missing"),
    ),
    "a material with its unit": (("import", "m.inp", "-o", "m.h5", "--young", "210 GPa"), ("--young", "number")),
    "Poisson's ratio of a liquid": (
        ("import", "m.inp", "-o", "m.h5", "--young", 2e11, "--poisson", 0.7, "--density", 7800),
        ("poisson: found 0.7",),
    ),
    "a set in small letters": (
        ("import", "m.inp", "-o", "m.h5", *MATERIAL, "--fix", "root"),
        ("node set 'root' is not in the mesh", "'ROOT'?"),
    ),
    "a set misspelt": (
        ("import", "m.msh", "-o", "m.h5", *MATERIAL, "--fix", "tipface"),
        ("'tipface' is not in the mesh", "'tip face'?"),
    ),
    "a volume is no set of nodes": (
        ("import", "m.msh", "-o", "m.h5", *MATERIAL, "--fix", "body"),
        ("'body' is a set of solid elements",),
    ),
    "a node that is not there": (
        ("import", "m.msh", "-o", "m.h5", *MATERIAL, "--fix", "n999"),
        ("there is no free dof 'n999' in the model",),
    ),
    "a name of no matrix": (("import", "m.inp", "-o", "m.h5", "--name", "KGG"), ("--name KGG: expected K=NAME",)),
    "scale without number": (("import", "m.inp", "-o", "m.h5", "--scale", "mm"), ("--scale mm: expected a factor",)),
    "scale of another thing": (("import", "m.inp", "-o", "m.h5", "--scale", "lenght=1e-3"), ("lenght", "'length'?")),
    "scale and units": (
        ("import", "m.inp", "-o", "m.h5", *MATERIAL, "--scale", "length=1e-3", "--to", "SI"),
        ("together with scale",),
    ),
    "units to come to without own": (
        ("import", "m.inp", "-o", "m.h5", *MATERIAL, "--to", "SI"),
        ("to: the units of the files are not stated",),
    ),
    "units that are none": (
        ("import", "m.inp", "-o", "m.h5", *MATERIAL, "--units", "mm", "--to", "SI"),
        ("units: found 'mm'",),
    ),
    "a map that is not there": (
        ("import", "m.inp", "-o", "m.h5", "--map", "no.txt"),
        ("no.txt: there is no such file",),
    ),
    "a mesh with a map": (
        ("import", "m.inp", "afile.map", "-o", "m.h5", *MATERIAL),
        ("afile.map: what it is for does not show",),
    ),
}


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run, a study, and files of many kinds."""
    import xarray
    from scipy.io import netcdf_file

    folder = tmp_path_factory.mktemp("workshop")
    whole = CASE.replace("[20, 30, 40]", "[20, 30]")
    (folder / "study.toml").write_text(whole)
    (folder / "case.toml").write_text(whole[: whole.index("[study]")])
    bare = ("-q", "--no-figures", "--no-report")
    assert slipstick("run", folder / "case.toml", "-o", folder / "out", *bare).exit_code == 0
    assert slipstick("study", folder / "study.toml", "-o", folder / "st", "--workers", 1, *bare).exit_code == 0
    stopped(folder, "lost")
    shutil.copytree(folder / "lost", folder / "cutstudy")
    (folder / "lost" / "study.journal").unlink()
    journal = folder / "cutstudy" / "study.journal"
    journal.write_bytes(journal.read_bytes()[:200])
    (folder / "cut").mkdir()
    (folder / "cut" / "results.nc.journal").write_bytes(b'12345678 {"magic": "slipstick journal 4", "labels": {"dof"')
    (folder / "empty").mkdir()
    assert slipstick("init", "blade", folder / "ini").exit_code == 0
    for name in ("afile", "afile.map", "there.h5"):
        (folder / name).write_text("1 x\n")
    (folder / "empty.nc").write_bytes(b"")
    (folder / "picture.nc").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(100))
    (folder / "page.html").write_text("<!doctype html><html></html>")
    with netcdf_file(folder / "old.nc", "w") as old:
        old.createDimension("x", 2)
    xarray.Dataset({"depth": ("x", [1.0, 2.0])}).to_netcdf(folder / "foreign.nc", engine="h5netcdf")
    points, groups = beam()
    write_inp(folder / "m.inp", points, groups)
    write_msh(folder / "m.msh", points, groups)
    assert slipstick("import", folder / "m.msh", "-o", folder / "model.h5", *MATERIAL).exit_code == 0
    return folder


def stopped(folder: Path, name: str) -> None:
    """A study that ended before its second case."""
    from slipstick.studies.folder import StudyFolder

    add = StudyFolder.add

    def interrupted(self: StudyFolder, solved: object) -> None:
        if self.cases:
            raise KeyboardInterrupt
        add(self, solved)  # type: ignore[arg-type]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(StudyFolder, "add", interrupted)
        bare = ("-q", "--no-figures", "--no-report", "--workers", 1)
        assert slipstick("study", folder / "study.toml", "-o", folder / name, *bare).exit_code == 1


def content(folder: Path) -> dict[str, bytes | None]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def said_of(result: Result) -> str:
    """Everything that was said, without the frames and line ends of the terminal."""
    return " ".join(result.output.translate(dict.fromkeys(map(ord, "│╭╮╰╯─"), " ")).split())


def refused(
    folder: Path,
    call: tuple[object, ...],
    fragments: tuple[str, ...],
    prepare: Callable[[pytest.MonkeyPatch], None] | None = None,
) -> None:
    before = content(folder)
    with pytest.MonkeyPatch.context() as patch:
        if prepare is not None:
            prepare(patch)
        result = slipstick(*call)
    said = said_of(result)
    assert result.exit_code == 2, said
    assert "Traceback" not in said
    assert "a fault of slipstick itself" not in said
    for fragment in fragments:
        assert fragment in said
    assert content(folder) == before


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_and_nothing_is_lost(workshop: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(workshop)
    refused(workshop, *MISTAKES[name])


def test_the_table_is_long() -> None:
    assert len(MISTAKES) >= 90


def denied(monkeypatch: pytest.MonkeyPatch) -> None:
    """As for a file of somebody else: root may read everything, so that the system has to be asked in its place."""
    opened = Path.open

    def no(self: Path, *arguments: object, **named: object) -> object:
        if self.name == "results.nc":
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(self))
        return opened(self, *arguments, **named)  # type: ignore[call-overload]

    monkeypatch.setattr(Path, "open", no)


def full(monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that is full when a file is to be kept."""

    def no_space(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("slipstick.replacing._sync", no_space)


SYSTEM: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], tuple[object, ...], str]] = {
    "report of what cannot be read": (denied, ("report", "out"), "out/results.nc: cannot be read (permission denied)"),
    "verify of what cannot be read": (denied, ("verify", "out"), "out/results.nc: cannot be read (permission denied)"),
    "a report on a full disk": (full, ("report", "out", "-o", "new.html"), "no space left on device"),
    "a run on a full disk": (full, ("run", "case.toml", "-o", "new", "-q"), "the disk is full; free some space"),
    "a study on a full disk": (full, ("study", "study.toml", "-o", "new", "-q"), "the disk is full; free some space"),
    "a model on a full disk": (
        full,
        ("import", "m.msh", "-o", "new.h5", *MATERIAL),
        "new.h5: cannot be written (no space left",
    ),
}


@pytest.mark.parametrize("name", SYSTEM)
def test_what_the_system_refuses_is_a_sentence(workshop: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    monkeypatch.chdir(workshop)
    prepare, call, said = SYSTEM[name]
    refused(workshop, call, (said,), prepare)


def test_a_study_killed_before_its_first_case_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It had no journal until then: what was resumed was called complete."""
    from slipstick.runs.study import StudyRun

    path = tmp_path / "case.toml"
    path.write_text(CASE.replace("[20, 30, 40]", "[20]"))
    bare = ("-q", "--no-figures", "--no-report", "--workers", 1)

    def killed(*_: object) -> None:
        raise SystemExit(137)

    with monkeypatch.context() as patch:
        patch.setattr(StudyRun, "_solve", killed)
        assert slipstick("study", path, "-o", tmp_path / "out", *bare).exit_code == 137
    assert not (tmp_path / "out" / "study.nc").exists()
    result = slipstick("resume", tmp_path / "out", *bare)
    assert (result.exit_code, "1 of 1 cases are computed" in said_of(result)) == (0, True)
