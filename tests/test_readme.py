"""Every block of the README runs, and what it prints is what the README says."""

import contextlib
import io
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
BLOCKS = re.findall(r"```(\w+)\n(.*?)```", (ROOT / "README.md").read_text(), flags=re.DOTALL)


def blocks(language):
    return [text for name, text in BLOCKS if name == language]


@pytest.fixture(scope="module")
def session():
    """The Python blocks, run one after the other in one namespace: the namespace and what each printed."""
    names, printed = {}, []
    for text in blocks("python"):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(compile(text, "README.md", "exec"), names)
        printed.append(out.getvalue())
    return names, printed


def test_the_curve_prints_what_is_shown(session):
    _, printed = session
    assert printed[0] == blocks("text")[0]


def test_the_check_in_time_agrees(session):
    names, _ = session
    assert names["check"].relative_difference < 1e-3


def test_the_element_alone(session):
    names, printed = session
    f = names["f"]
    assert [state for _, _, state in f.states] == ["stick", "slip-", "stick", "slip+"]
    assert f.Fx[0] == pytest.approx(float(printed[2].splitlines()[-2].split()[0]))
    assert 0 < f.Fx[0] < 240
    assert f.power == pytest.approx(10.0 * f.Fx[0] + 4.25 * 0.5 * 6.0 * -f.Fx[2])
    assert printed[2].splitlines()[-1] == "(21, 21)"


def test_the_case_file_is_the_example():
    shown = tomllib.loads(blocks("toml")[0])
    assert shown == tomllib.loads((ROOT / "examples/oscillator/oscillator.toml").read_text())


def test_the_commands_run(tmp_path):
    import xarray

    commands = [line.partition("#")[0] for line in blocks("sh")[1].splitlines()]
    for command in commands:
        words = shlex.split(command)
        assert words[0] == "slipstick"
        subprocess.run([sys.executable, "-m", *words], cwd=tmp_path, check=True, capture_output=True, timeout=300)
    results = xarray.load_dataset(tmp_path / "first/results/results.nc", engine="h5netcdf")
    assert float(results.amplitude.max()) == pytest.approx(4.820, rel=1e-3)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#]+)\)", (ROOT / "README.md").read_text()):
        if not target.startswith("http"):
            assert (ROOT / target).exists(), target
