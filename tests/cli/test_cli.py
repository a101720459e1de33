"""The command line as a user meets it: exit codes, sentences, files, and nothing lost."""

from __future__ import annotations

import errno
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray
from helpers.cases import oscillator
from helpers.command import slipstick
from typer.main import get_command
from typer.testing import Result

from slipstick import __main__
from slipstick.balance.kernel.compilation import compile_all
from slipstick.case import RENAMED
from slipstick.case.sections import REQUESTS as TABLES
from slipstick.cli import main
from slipstick.cli.examples import examples
from slipstick.cli.main import app
from slipstick.cli.names import OF_TABLES, VERBS
from slipstick.cli.verbs.requests import OLD_NAMES, REQUESTS
from slipstick.io.loading import load_dataset
from slipstick.io.store import ResultStore

GOOD = "\n" + oscillator(
    head='title = "oscillator"\nharmonics = "0..5"\n',
    rubbing="velocity = 100.0",
    response="output_step = 1.0\nfrom = 4.0\nto = 8.0\n",
)
SLOW = GOOD.replace("to = 8.0", "to = 8.0\nmax_step = 1e-5\nfirst_step = 1e-5\nmax_points = 1000000")


def case(folder: Path, text: str = GOOD, name: str = "case.toml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def told(result: Result) -> str:
    assert "Traceback" not in result.output
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result.output


def files_of(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_figures_are_drawn_that_are_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, out = case(tmp_path), tmp_path / "out"
    always = {"results.nc", "report.html", "case.toml"}
    result = slipstick("run", path, "-o", out, "--figures", "loop, temperature", "--format", "svg,pdf")
    assert result.exit_code == 0, result.output
    assert files_of(out) == always | {"loop.svg", "loop.pdf"}
    assert "warning: figures: there is nothing in these results to draw of 'temperature'" in told(result)
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", lambda _, at, **given: at.touch())  # in plots/ they are
    assert slipstick("run", path, "-o", out, "--figures", "all", "--force").exit_code == 0
    drawn = ("response", "phase", "mean", "power", "fractions", "loop", "states", "history", "spectrum")
    assert files_of(out) == always | {f"{name}.png" for name in drawn}
    assert slipstick("run", path, "-o", out, "--force").exit_code == 0
    assert files_of(out) == always


@pytest.mark.parametrize(
    "options, said",
    [
        (("--figures", "loops"), "--figures: found 'loops'; expected response, mean,"),
        (("--figures", ","), "--figures: found nothing; expected response,"),
        (("--figures", "all", "--format", "jpg"), "--format: found 'jpg'; expected png, svg, pdf"),
        (("--format", "svg"), "--format: found no figures to draw; choose with --figures"),
        (("--figures", "all", "--no-figures"), "--no-figures: --figures is given too"),
    ],
)
def test_wrong_figures_are_told_before_anything_is_computed(tmp_path: Path, options: tuple, said: str) -> None:
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out", *options)
    assert result.exit_code == 2
    assert said in told(result)
    assert not (tmp_path / "out").exists()


def test_run_loads_nothing_that_it_does_not_need(tmp_path: Path) -> None:
    """Each of them takes longer to import than a curve takes to compute."""
    code = (
        "import sys, json; from slipstick.cli.main import app\n"
        "for words in json.loads(sys.argv[1]):\n"
        "    try:\n        app(words)\n    except SystemExit as ended:\n        assert not ended.code\n"
        "    print(*sys.modules)"
    )
    late = {"xarray", "pandas", "matplotlib", "dask", "h5netcdf", "slipstick.fem.mesh", "scipy.optimize"}
    late |= {"slipstick.importers.matrix_model"}
    unasked = {
        "slipstick.analysis.stability.floquet",
        "slipstick.analysis.sensitivity.sensitivity",
        "slipstick.studies.plan",
    }
    path, out = str(case(tmp_path)), str(tmp_path / "out")
    words = json.dumps([["check", path], ["run", path, "-o", out, "-q"]])
    done = subprocess.run([sys.executable, "-c", code, words], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    told = [set(line.split()) for line in done.stdout.splitlines() if " slipstick.cli.main " in line]
    for loaded, others in zip(told, ({"numba", "h5py"}, set()), strict=True):
        assert "numpy" in loaded
        assert not loaded & (late | unasked | others)


def test_run_writes_results_and_the_case(tmp_path: Path) -> None:
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out")
    assert result.exit_code == 0, result.output
    assert files_of(tmp_path / "out") == {"results.nc", "report.html", "case.toml"}
    assert (tmp_path / "out" / "case.toml").read_text() == GOOD
    data = xarray.load_dataset(tmp_path / "out" / "results.nc", engine="h5netcdf")
    assert data.attrs["case"] == GOOD
    assert data.attrs["outcome"] == "COMPLETED"
    assert data.attrs["slipstick_version"]
    assert data["amplitude"].dims == ("point", "dof")
    assert data["displacement"].dims == ("point", "dof", "coefficient")
    assert list(data["coefficient"].values[:3]) == ["0", "c1", "s1"]
    for name in ("dissipated_power", "friction_coefficient", "temperature", "stick_fraction", "slip_fraction"):
        assert data[name].dims == ("point", "contact")
    assert data["separation_fraction"].dims == ("point", "contact")
    assert data["residual"].dims == data["newton_iterations"].dims == ("point",)
    assert all({"units", "long_name"} <= data[name].attrs.keys() for name in data.variables)
    assert (float(data["omega"][0]), float(data["omega"][-1])) == (4.0, 8.0)
    peak = float(data["amplitude"].max())
    assert peak == pytest.approx(18.249, rel=5e-3)  # 5 harmonics instead of 10
    for words in (f"amplitude {peak:.6g} at 6.1", "Newton iterations", f"{data.sizes['point']} points", "completed"):
        assert words in told(result)


def test_what_run_stores_is_what_python_computes(tmp_path: Path) -> None:
    from slipstick.case.case import Case

    path = case(tmp_path)
    assert slipstick("run", path, "-o", tmp_path / "out", "--no-figures", "-q").exit_code == 0
    stored, computed = load_dataset(tmp_path / "out" / "results.nc"), Case.from_file(path).run().dataset
    for name in ("omega", "displacement", "amplitude", "dissipated_power", "friction_force"):
        xarray.testing.assert_allclose(stored[name], computed[name], rtol=1e-12)


def test_missing_harmonics_are_warned_of_once(tmp_path: Path) -> None:
    """Odd harmonics alone under rubbing; the words are those of Python."""
    text = GOOD.replace('harmonics = "0..5"', "harmonics = [0, 1, 3]")
    assert text != GOOD
    result = slipstick("run", case(tmp_path, text), "-o", tmp_path / "out", "--no-figures")
    stored = load_dataset(tmp_path / "out" / "results.nc").attrs["warnings"].splitlines()
    (said,) = [sentence for sentence in stored if "the harmonics left out" in sentence]
    assert told(result).count(" ".join(said.split())) == 1


def test_the_default_folder_is_named_after_the_case(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case(tmp_path, name="blade.toml")
    monkeypatch.chdir(tmp_path)
    assert slipstick("run", "blade.toml", "--no-figures").exit_code == 0
    assert (tmp_path / "blade-results" / "results.nc").exists()


def test_a_parameter_is_followed(tmp_path: Path) -> None:
    text = GOOD.replace(
        "from = 4.0\nto = 8.0", 'parameter = "damper.velocity"\nfrom = 100\nto = 200\nomega = "1 Hz"\nat = [150]'
    )
    result = slipstick("run", case(tmp_path, text), "-o", tmp_path / "out")
    assert result.exit_code == 0, told(result)
    data = load_dataset(tmp_path / "out" / "results.nc")
    assert (float(data["parameter"][0]), float(data["parameter"][-1])) == (100.0, 200.0)
    assert 150.0 in data["parameter"].values
    assert data["parameter"].attrs["units"] == "length/time"


def test_a_point_limit_stops_early_with_everything_saved(tmp_path: Path) -> None:
    result = slipstick("run", case(tmp_path, GOOD + "max_points = 12\n"), "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "raise max_points" in told(result)
    data = load_dataset(tmp_path / "out" / "results.nc")
    assert data.attrs["outcome"] == "POINT_LIMIT"
    assert 10 <= data.sizes["point"] <= 14


BAD = {
    "key": ("stiffness", "stifness", "did you mean 'stiffness'?"),
    "kt": ("kt = 100.0", "kt = -1.0", "kt: found -1.0; expected a number >= 0"),
    "nan": ("kt = 100.0", "kt = nan", "kt: found nan"),
    "dof": ('dof = "x"', 'dof = "z"', "there is no dof 'z'"),
    "harmonics": ("0..5", "0..100000000", "harmonic 100000000 is above the largest allowed"),
    "range": ("to = 8.0", "to = 4.0", "give a range that is not empty"),
    "toml": ("to = 8.0", "to = ", "not valid TOML"),
    "no contact": ("[[contact]]", "[[contact_]]", "unknown key 'contact_'"),
}


@pytest.mark.parametrize("verb", ["run", "check"])
@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_exit_2_in_one_sentence(tmp_path: Path, name: str, verb: str) -> None:
    old, new, words = BAD[name]
    options = ["-o", tmp_path / "out"] if verb == "run" else []
    result = slipstick(verb, case(tmp_path, GOOD.replace(old, new)), *options)
    assert result.exit_code == 2
    assert words in told(result)
    assert sum(line.startswith("error: ") for line in told(result).splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_all_faults_are_counted(tmp_path: Path) -> None:
    text = GOOD.replace("kt = 100.0", "kt = -1.0").replace("mu = 0.3", "mu = -1").replace('dof = "x"', 'dof = "z"')
    lines = told(slipstick("run", case(tmp_path, text))).splitlines()
    assert sum(line.startswith("error: ") for line in lines) == 3
    assert "3 faults; nothing was computed" in lines


def test_files_that_are_no_cases(tmp_path: Path) -> None:
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)) * 10)
    for path, words in (
        (tmp_path / "none.toml", "there is no such file"),
        (tmp_path, "found a folder"),
        (tmp_path / "binary.toml", "not a text file"),
    ):
        for verb in ("run", "check"):
            result = slipstick(verb, path)
            assert result.exit_code == 2
            assert words in told(result)


@pytest.mark.parametrize("verb", ["fly", "run", "--nothing"])
def test_usage_errors_are_exit_2(verb: str) -> None:
    assert slipstick(verb).exit_code == 2


def test_no_contact_at_all(tmp_path: Path) -> None:
    text = GOOD[: GOOD.index("[[contact]]")] + GOOD[GOOD.index("[response]") :]
    result = slipstick("run", case(tmp_path, text), "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "[[contact]] is missing; give at least one contact" in told(result)


def test_unwritable_output_is_told_before_computing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = case(tmp_path)
    (tmp_path / "file").write_text("precious")

    def never(*_: object, **__: object) -> None:
        raise AssertionError("computed although the results cannot be written")

    monkeypatch.setattr("slipstick.case.case.Case.run", never)
    places = [tmp_path / "file", tmp_path / "file" / "below", Path("/proc/none")]
    if os.name == "posix" and os.geteuid() != 0:
        (tmp_path / "locked").mkdir(mode=0o500)
        places.append(tmp_path / "locked" / "out")
    for place in places:
        result = slipstick("run", path, "-o", place)
        assert result.exit_code == 2, place
        assert "cannot be written" in told(result)
    assert (tmp_path / "file").read_text() == "precious"


def test_earlier_results_are_not_overwritten_unasked(tmp_path: Path) -> None:
    path, out = case(tmp_path), tmp_path / "out"
    assert slipstick("run", path, "-o", out, "--no-figures").exit_code == 0
    before = (out / "results.nc").read_bytes()
    result = slipstick("run", path, "-o", out)
    assert result.exit_code == 2
    assert "already holds results.nc; choose another folder with -o, or --force" in told(result)
    assert (out / "results.nc").read_bytes() == before


def test_force_replaces_earlier_results_once_complete(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert slipstick("run", case(tmp_path), "-o", out).exit_code == 0
    (out / "notes.txt").write_text("mine")
    (out / "friction.png").write_bytes(b"stale")
    path = case(tmp_path, GOOD.replace("to = 8.0", "to = 7.0"))
    assert slipstick("run", path, "-o", out, "--force").exit_code == 0
    assert float(load_dataset(out / "results.nc")["omega"][-1]) == 7.0
    assert "to = 7.0" in (out / "case.toml").read_text()
    assert (out / "notes.txt").read_text() == "mine"
    assert not (out / "friction.png").exists()
    assert not (out / "unfinished").exists()


def test_force_keeps_earlier_results_when_the_new_ones_stop_early(tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert slipstick("run", case(tmp_path), "-o", out, "--no-figures").exit_code == 0
    before = (out / "results.nc").read_bytes()
    result = slipstick("run", case(tmp_path, GOOD + "max_points = 5\n"), "-o", out, "--force", "--no-figures")
    assert result.exit_code == 1
    assert "untouched" in told(result)
    assert (out / "results.nc").read_bytes() == before
    assert load_dataset(out / "unfinished" / "results.nc").attrs["outcome"] == "POINT_LIMIT"


def interrupting(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


@pytest.mark.parametrize("where", ["slipstick.case.case.Case.from_file", "slipstick.cli.verbs.run.run_options"])
def test_an_interrupt_with_nothing_to_keep_says_so(where: str, tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(where, interrupting)
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out")
    assert (result.exit_code, told(result).split()) == (130, ["interrupted"])


def test_an_interrupt_before_the_verb_begins_says_so(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr("slipstick.cli.verb.answering", interrupting)
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out")
    assert (result.exit_code, told(result).split()) == (130, ["interrupted"])
    monkeypatch.setattr("slipstick.cli.main.main", interrupting)
    with pytest.raises(SystemExit) as ended:
        __main__.main()
    assert (ended.value.code, capsys.readouterr().err) == (130, "interrupted\n")


def test_an_interrupt_while_the_report_is_written_leaves_the_results_and_says_where(
    tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setattr("slipstick.report.writing.write_report", interrupting)
    out = tmp_path / "out"
    result = slipstick("run", case(tmp_path), "-o", out)
    assert (result.exit_code, f"results in {out}" in told(result)) == (0, True)
    assert "interrupted: the report is not written" in told(result)
    monkeypatch.setattr("slipstick.cli.verbs.run._drawings", lambda run: {"response": interrupting})
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "drawn", "--figures", "response", "--no-report")
    assert (result.exit_code, f"results in {tmp_path / 'drawn'}" in told(result)) == (1, True)
    assert "figures: interrupted; all points are kept" in told(result)


def test_results_beside_the_case_leave_the_case_alone(tmp_path: Path) -> None:
    path = case(tmp_path)
    assert slipstick("run", path, "-o", tmp_path, "--no-figures").exit_code == 0
    assert path.read_text() == GOOD


def test_a_disk_that_fills_up_keeps_what_was_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    append = ResultStore.append

    def full(self: ResultStore, point: object, note: object) -> None:
        if len(self) == 7:
            raise OSError(errno.ENOSPC, "No space left on device")
        append(self, point, note)  # type: ignore[arg-type]

    monkeypatch.setattr(ResultStore, "append", full)
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out")
    assert result.exit_code == 1
    assert "the disk is full; free some space or choose another folder" in told(result)
    assert load_dataset(tmp_path / "out" / "results.nc").sizes["point"] == 7


def test_a_fault_of_the_program_is_a_sentence_and_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("oops")

    monkeypatch.setattr("slipstick.analysis.curve.follow.CurveRequest.run", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    result = slipstick("run", case(tmp_path), "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "a fault of slipstick itself (ZeroDivisionError: oops); please report it" in told(result)
    (log,) = tmp_path.glob("slipstick-*.log")
    assert "Traceback" in log.read_text()


def heard() -> None:
    """A job started in the background ignores SIGINT, and so would its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(path: Path, out: Path) -> subprocess.Popen[str]:
    compile_all()
    command = [sys.executable, "-m", "slipstick", "run", str(path), "-o", str(out), "--no-figures"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, preexec_fn=heard)
    file, end = out / "results.nc.journal", time.monotonic() + 600
    while time.monotonic() < end and child.poll() is None:
        if file.exists() and file.stat().st_size > 60_000:  # some thirty points
            return child
        time.sleep(0.02)
    child.kill()
    raise AssertionError(child.communicate()[0])


@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.verify)])
def test_an_interrupt_keeps_the_points(tmp_path: Path, number: signal.Signals) -> None:
    child = started(case(tmp_path, SLOW), tmp_path / "out")
    child.send_signal(number)
    output = child.communicate(timeout=600)[0]
    assert child.returncode == 1, output
    assert "interrupted by the user; every point found is kept" in output
    assert "Traceback" not in output
    data = xarray.load_dataset(tmp_path / "out" / "results.nc", engine="h5netcdf")
    assert data.attrs["outcome"] == "INTERRUPTED"
    assert data.sizes["point"] > 10
    assert (tmp_path / "out" / "results.nc.journal").exists()


@pytest.mark.verify
@pytest.mark.skipif(os.name != "posix", reason="POSIX signals")
def test_a_kill_leaves_a_file_that_opens(tmp_path: Path) -> None:
    """From outside; children that kill themselves are in hostile/test_kills.py and io/test_store.py."""
    child = started(case(tmp_path, SLOW), tmp_path / "out")
    child.kill()
    child.communicate(timeout=600)
    data = xarray.load_dataset(tmp_path / "out" / "results.nc", engine="h5netcdf")
    whole = load_dataset(tmp_path / "out" / "results.nc")
    assert 0 < data.sizes["point"] <= whole.sizes["point"]
    assert whole.sizes["point"] > 10
    assert whole["omega"].to_numpy()[0] == 4.0
    assert "unfinished" in data.attrs["outcome_text"]
    result = slipstick("run", tmp_path / "case.toml", "-o", tmp_path / "out")
    assert result.exit_code == 2
    assert "--force" in told(result)


def test_check_tells_what_the_case_means(tmp_path: Path) -> None:
    result = slipstick("check", case(tmp_path))
    assert result.exit_code == 0
    for words in ("1 dof (x)", "6.32456 rad/s (1.0066 Hz)", "harmonics: 0, 1, 2, 3, 4, 5", "'damper'", "39.5", "ok:"):
        assert words in told(result)


def test_check_names_the_rubbing_motion(tmp_path: Path) -> None:
    moving = 'velocity = 3.0, sin = { "1" = 2.0 }, normal_cos = { "2" = 1.0, "4" = 0.0 }'
    found = told(
        slipstick("check", case(tmp_path, GOOD.replace("velocity = 100.0", moving).replace("mu =", "kn = 9.0\nmu =")))
    )
    assert "rubbing at 3 and periodic part of order 1 and moving along the normal with order 2\n" in found


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("from = 4.0\nto = 8.0", "from = 0.8\nto = 1.2", "were they meant in Hz?"),
        ('"0..5"', "[0, 1, 3, 5]", "even harmonics"),
        ("mu = 0.3", "mu = 0.0", "no friction force"),
    ],
)
@pytest.mark.parametrize("verb", ["run", "check"])
def test_what_looks_wrong_is_a_warning(tmp_path: Path, old: str, new: str, words: str, verb: str) -> None:
    options = ["-o", tmp_path / "out", "--no-figures"] if verb == "run" else []
    result = slipstick(verb, case(tmp_path, GOOD.replace(old, new)), *options)
    assert result.exit_code == 0, result.output
    assert any(line.startswith("warning: ") and words in line for line in told(result).splitlines())


@pytest.mark.parametrize("verb", ["run", "check"])
def test_hertz_that_were_said_are_not_asked_about(tmp_path: Path, verb: str) -> None:
    options = ["-o", tmp_path / "out", "--no-figures"] if verb == "run" else []
    stated = 'from = "0.127 Hz"\nto = "0.19 Hz"'
    result = slipstick(verb, case(tmp_path, GOOD.replace("from = 4.0\nto = 8.0", stated)), *options)
    assert result.exit_code == 0, result.output
    assert "meant in Hz" not in result.output


def test_warnings_are_kept_in_the_results(tmp_path: Path) -> None:
    path = case(tmp_path, GOOD.replace("mu = 0.3", "mu = 3.0").replace("to = 8.0", "to = 8.0\nmax_points = 2"))
    result = slipstick("run", path, "-o", tmp_path / "out", "--no-figures")
    (sentence,) = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert load_dataset(tmp_path / "out" / "results.nc").attrs["warnings"] == sentence.removeprefix("warning: ")
    assert sentence in slipstick("check", path).stderr


def test_info() -> None:
    result = slipstick("info")
    assert result.exit_code == 0
    for words in ("slipstick", "numba", "platform", "threads", "kernel"):
        assert words in told(result)


def test_version() -> None:
    assert told(slipstick("--version")).startswith("slipstick ")


def test_examples_are_listed_and_written(tmp_path: Path) -> None:
    listed = told(slipstick("init", "--list"))
    assert listed == told(slipstick("init"))
    assert {"blade", "blade_reduced", "oscillator", "shaken", "lobed_casing/lobed_casing"} <= set(examples())
    for name, example in examples().items():
        assert any(line.strip().startswith(f"{name} ") for line in listed.splitlines())
        assert example.about
        assert not example.is_case or len(f"  {name:<23}{example.about}") < 80


@pytest.mark.parametrize("name", [name for name, example in examples().items() if example.is_case])
def test_a_written_example_is_a_case_without_warning(tmp_path: Path, name: str) -> None:
    assert slipstick("init", name, tmp_path / name).exit_code == 0
    checked = slipstick("check", tmp_path / name / f"{name}.toml")
    assert checked.exit_code == 0, told(checked)
    assert "warning" not in told(checked)


def test_listed_examples_fit_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    for columns in (40, 80):
        monkeypatch.setenv("COLUMNS", str(columns))
        lines = told(slipstick("init")).splitlines()
        assert max(map(len, lines[1:])) <= max(columns, 54)


def test_scripts_are_written_with_what_they_import(tmp_path: Path) -> None:
    slipstick("init", "blade/study", tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"study.py", "shrouded_blade.py", "blade_figures.py"}
    slipstick("init", "blade_reduced/blade", tmp_path)
    assert (tmp_path / "blade_reduced.npz").stat().st_size > 10_000


def test_init_python(tmp_path: Path) -> None:
    """Of an example, and of a case of one's own, whose faults are told as by check."""
    result = slipstick("init", "blade_reduced", tmp_path, "--python")
    assert result.exit_code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"blade_reduced.py", "blade_reduced.npz"}
    assert f"next: python {tmp_path / 'blade_reduced.py'}" in told(result)
    own = case(tmp_path)
    assert slipstick("init", own, "--python").exit_code == 0
    assert "ss.MatrixStructure(" in (tmp_path / "case.py").read_text()
    assert slipstick("init", own, "--python").exit_code == 2
    assert "beside the case" in told(slipstick("init", own, tmp_path / "there", "--python"))
    wrong = case(tmp_path, GOOD.replace("mu =", "mue ="), "wrong.toml")
    refused = slipstick("init", wrong, "--python")
    assert refused.exit_code == 2
    assert "did you mean 'mu'" in told(refused)
    assert not (tmp_path / "wrong.py").exists()


def test_a_moving_support_is_told(tmp_path: Path) -> None:
    slipstick("init", "shaken", tmp_path)
    assert "all motion, in results and figures too, is relative to it" in told(
        slipstick("check", tmp_path / "shaken.toml")
    )
    ran = slipstick("run", tmp_path / "shaken.toml", "-o", tmp_path / "out", "--no-figures")
    assert "all motion is relative to the moving support" in told(ran)


def test_examples_never_overwrite(tmp_path: Path) -> None:
    path = tmp_path / "oscillator.toml"
    path.write_text("mine")
    result = slipstick("init", "oscillator", tmp_path)
    assert result.exit_code == 2
    assert "is there already" in told(result)
    assert path.read_text() == "mine"
    assert "did you mean 'oscillator'?" in told(slipstick("init", "oscilator", tmp_path))
    assert slipstick("init", "oscillator", path).exit_code == 2


def test_examples_share_a_folder_and_the_files_they_need(tmp_path: Path) -> None:
    assert slipstick("init", "blade_reduced", tmp_path).exit_code == 0
    second = slipstick("init", "blade_reduced_no_rub", tmp_path)
    assert (second.exit_code, f"kept {tmp_path / 'blade_reduced.npz'}, the same" in told(second)) == (0, True)
    (tmp_path / "blade_reduced.npz").write_bytes(b"mine")
    refused = slipstick("init", "blade_reduced_hot_rub", tmp_path)
    assert (refused.exit_code, (tmp_path / "blade_reduced.npz").read_bytes()) == (2, b"mine")
    assert f"{tmp_path / 'blade_reduced.npz'}: is there already" in told(refused)
    assert not (tmp_path / "blade_reduced_hot_rub.toml").exists()


def test_an_example_that_cannot_be_written_leaves_no_part_of_it(tmp_path: Path, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("slipstick.replacing._sync", full)
    refused = slipstick("init", "blade_reduced", tmp_path)
    assert (refused.exit_code, list(tmp_path.iterdir())) == (2, [])
    assert "cannot be written (no space left on device)" in told(refused)


@pytest.mark.parametrize(
    "example, verb", [("oscillator", "run"), ("brake_squeal", "limit-cycles"), ("worn_shroud", "wear")]
)  # fmt: skip
def test_what_comes_next_is_the_verb_that_an_example_is_for(example: str, verb: str, tmp_path: Path) -> None:
    assert f"next: slipstick {verb} {tmp_path / example}.toml" in told(slipstick("init", example, tmp_path))


def test_the_verb_of_a_table_is_one_that_there_is(tmp_path: Path) -> None:
    table = "\n[run_up]\nfrom = 4.0\nto = 15.0\nrate = 0.05\n"
    path = case(tmp_path, GOOD + table)
    said = [told(slipstick("check", path)), told(slipstick("run", path, "-o", tmp_path / "out", "--no-report"))]
    for text in said:
        verb = text.split("[run_up]")[1].split("'slipstick ")[1].split()[0].strip("';")
        assert slipstick(verb, "--help").exit_code == 0, verb


@pytest.mark.parametrize(
    "name", ["periodic_rub", *(pytest.param(n, marks=pytest.mark.verify) for n in ("oscillator", "opening_contact"))]
)
def test_examples_run(tmp_path: Path, name: str) -> None:
    """Each of them is run by Python in case/test_script.py."""
    slipstick("init", name, tmp_path)
    result = slipstick("run", tmp_path / f"{name}.toml", "-o", tmp_path / "out", "--no-figures")
    assert result.exit_code == 0, told(result)


def test_help_is_fast_because_nothing_heavy_is_imported() -> None:
    code = (
        "import sys, json\nfrom slipstick.cli.main import app\n"
        "try:\n    app(['--help'])\nexcept SystemExit:\n    pass\n"
        "print(json.dumps(sorted(sys.modules)), file=sys.stderr)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    modules = set(json.loads(found.stderr))
    assert not modules & {"numpy", "scipy", "numba", "xarray", "h5py", "matplotlib", "pydantic"}
    assert "verify" in found.stdout


def test_help_shows_every_word_of_the_verbs() -> None:
    """What looks like markup, such as a table's name in square brackets, would vanish from the terminal."""
    commands = get_command(app).commands  # type: ignore[attr-defined]
    assert len(commands) > 15
    for name, command in commands.items():
        shown = " ".join(slipstick(name, "--help").stdout.split())
        sentence = " ".join(command.callback.__doc__.split("\n\n")[0].split())
        assert sentence
        assert sentence in shown


def test_every_verb_has_a_name_and_every_name_a_verb() -> None:
    files = {path.stem for path in (Path(main.__file__).parent / "verbs").glob("[a-z]*.py")}
    names = [name for group in VERBS.values() for name in group]
    assert len(names) == len(set(names))
    assert set(names) == files - {"requests"} | set(OF_TABLES)
    assert tuple(REQUESTS) == OF_TABLES
    assert REQUESTS.keys() <= TABLES.keys()
    assert OLD_NAMES.keys() == RENAMED.keys()


@pytest.mark.parametrize("words", [["--version"], ["info", "--help"]])
def test_a_call_imports_its_own_verb_alone(words: list[str]) -> None:
    code = (
        "import sys\nfrom slipstick.cli.main import app\n"
        f"try:\n    app({words})\nexcept SystemExit:\n    pass\nprint(*sys.modules)"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    verbs = {name for name in found.stdout.splitlines()[-1].split() if name.startswith("slipstick.cli.verbs.")}
    assert verbs == ({"slipstick.cli.verbs.info"} if "info" in words else set())


def test_a_misspelt_verb_is_answered_with_those_like_it() -> None:
    result = slipstick("limit-cycle")
    assert result.exit_code == 2
    assert "Did you mean 'limit-cycles'" in told(result)


def test_a_fault_of_a_verb_is_not_told_as_a_misspelt_verb(tmp_path: Path, monkeypatch, capsys) -> None:
    def broken(name: str) -> object:
        return {}[name]

    monkeypatch.setattr("slipstick.cli.main._verb", broken)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.raises(SystemExit) as ended:
        get_command(app)(["info"])  # a group that has made no verb yet
    assert ended.value.code == 1
    assert capsys.readouterr().err.startswith("error: a fault of slipstick itself (KeyError: 'info')")


def test_verify_prints_a_table_and_fails_when_a_row_does(monkeypatch: pytest.MonkeyPatch) -> None:
    from slipstick.verify.table import Check

    good = Check(name="A1", what="two is two", compute=lambda: (2.0, 2.0), tolerance=1e-9)
    bad = Check(name="A2", what="two is three", compute=lambda: (3.0, 2.0), tolerance=1e-9)
    for checks, code, words in (((good,), 0, "1 of 1 checks pass"), ((good, bad), 1, "failed: A2 two is three")):
        monkeypatch.setattr("slipstick.verify.table.all_checks", lambda checks=checks: checks)
        result = slipstick("verify")
        assert result.exit_code == code
        assert words in told(result)
    assert slipstick("verify", "--only", "nothing").exit_code == 2


def test_verify_writes_its_table_as_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from slipstick.verify.table import Check

    checks = (Check(name="C1", what="holds", compute=lambda: (1.0, 1.0)),)
    monkeypatch.setattr("slipstick.verify.table.all_checks", lambda: checks)
    page = tmp_path / "page.md"
    assert slipstick("verify", "--markdown", str(page)).exit_code == 0
    assert "| C1 | holds | 1 | 1 |  | ok |" in page.read_text(encoding="utf-8")
    page.write_text("of the user")
    refused = slipstick("verify", "--markdown", str(page))
    assert refused.exit_code == 2
    assert told(refused).strip() == f"error: {page}: is there already; choose another name, or --force to replace it"
    assert page.read_text() == "of the user"
    assert slipstick("verify", "--markdown", str(page), "--force").exit_code == 0
    assert "| C1 | holds" in page.read_text(encoding="utf-8")
    refused = slipstick("verify", "--markdown", str(tmp_path / "no" / "page.md"))
    assert refused.exit_code == 2
    assert "cannot be written" in refused.output
    assert slipstick("verify", "results.nc", "--markdown", str(page)).exit_code == 2


def test_python_ends_without_a_last_look_for_cycles() -> None:
    code = (
        "import atexit, gc, sys; atexit.register(lambda: print(gc.get_freeze_count() > 1000)); "
        "sys.argv = ['slipstick', '--version']; from slipstick.cli.main import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "True"


def test_compilation_is_announced(monkeypatch: pytest.MonkeyPatch) -> None:
    from slipstick.cli.terminal.guard import prepare_kernel

    monkeypatch.setattr("slipstick.contact.kernel.compilation.is_compiled", lambda: False)
    monkeypatch.setattr("slipstick.balance.kernel.compilation.compile_all", lambda: 12.3)
    lines: list[str] = []
    prepare_kernel(lines.append)
    assert lines[0].startswith("compiling the contact kernel, once on this machine, 10 to 30 s ...")
    assert "12 s" in lines[1]


def test_states_are_averaged_over_the_contacts() -> None:
    record = {"stick_fraction": [0.5, 0.0], "slip_fraction": [0.5, 0.5], "separation_fraction": [0.0, 0.5]}
    from slipstick.cli.terminal.display import states_text

    assert states_text(record) == "stick 25 % slip 50 % separation 25 %"
    assert states_text({name: [float("nan")] for name in record}) == ""
