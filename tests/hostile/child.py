"""Runs a batch of damaged files in one process and prints a line of JSON for each: what came of it, time and memory.

``python child.py KIND FIRST COUNT FOLDER``; the number is the seed, so one line can be run again by itself.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import sys
import traceback
import unicodedata
import warnings
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import samples
from mutations import mutated_bytes, mutated_text
from typer.testing import CliRunner

from slipstick.cli.main import app
from slipstick.errors import InputError
from slipstick.io.loading import load

MEGABYTE = 1 << 20
HANGS = 300
"""Seconds, which guard against a hang alone: a machine may be busy."""
_MEMORY = ("VmHWM", "VmRSS")


class Hang(BaseException):
    """Raised by the alarm; nothing catches it on the way."""


def _alarm(*_: object) -> None:
    raise Hang


def _status() -> dict[str, int]:
    lines = Path("/proc/self/status").read_text().splitlines()
    return {k: int(v.split()[0]) // 1024 for k, _, v in (line.partition(":") for line in lines) if k.startswith("Vm")}


def _command(*arguments: object) -> str:
    """A fault of the command in words, or nothing."""
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    out = result.output
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        if isinstance(result.exception, Hang):
            raise result.exception
        return "foreign: " + "".join(traceback.format_exception(result.exception))[-600:]
    if "fault of slipstick itself" in out or "Traceback" in out:
        return "itself: " + next(line for line in out.splitlines() if "itself" in line or "Traceback" in line)[:600]
    if result.exit_code not in (0, 1, 2):
        return f"exit code {result.exit_code}"
    if "not enough memory" in out:
        return "memory"
    if result.exit_code == 2 and not out.strip():
        return "no sentence"
    strange = {c for c in out if not (c.isprintable() or c == "\n" or unicodedata.category(c) == "Zs")}
    return f"control characters {strange}" if strange else ""


def case_fault(folder: Path, seed: int) -> str:
    path = folder / "case.toml"
    path.write_bytes(mutated_text(samples.CASES[seed % len(samples.CASES)], seed))
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    return _command("check", path) or _command(
        "run", path, "-o", out, *([] if seed % 7 else ["--figures", "all"]), "-q"
    )


def named_fault(folder: Path, seed: int) -> str:
    """A damaged file that a sound case names."""
    name, text = [("K.npz", 1), ("K.mtx", 1), ("modes.npz", 2), ("model.h5", 3)][seed % 4]
    sound = (folder / name).read_bytes()
    (folder / "case.toml").write_text(samples.CASES[text])
    try:
        (folder / name).write_bytes(mutated_bytes(sound, seed))
        return _command("check", folder / "case.toml")
    finally:
        (folder / name).write_bytes(sound)


def model_fault(folder: Path, seed: int) -> str:
    groups = write_once(folder)
    names = groups[seed % len(groups)]
    sound = (folder / names[0]).read_bytes()
    try:
        (folder / names[0]).write_bytes(mutated_bytes(sound, seed))
        return _command(
            "import", *(folder / name for name in names), "-o", folder / "out.h5", "--force", *_material(names)
        )
    finally:
        (folder / names[0]).write_bytes(sound)


def _material(names: tuple[str, ...]) -> tuple[str, ...]:
    return ("--young", "2e11", "--poisson", "0.3", "--density", "7800") if names == ("beam.msh",) else ()


def results_fault(folder: Path, seed: int) -> str:
    """A damaged results file or journal: loaded or refused; and a sound results file is never lost by its journal."""
    path = folder / "results.nc"
    journal = folder / "results.nc.journal"
    if not path.exists():
        samples.write_results(folder)
    damaged = (path, journal)[seed % 2]
    sound = damaged.read_bytes()
    try:
        damaged.write_bytes(mutated_bytes(sound, seed))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            branch = load(path)
        if damaged == path:
            _used(branch)
        elif len(branch) < _points:
            return f"only {len(branch)} points of {_points}"
    except InputError:
        return (
            ""
            if damaged == path
            else "a sound results file was refused for its journal: " + traceback.format_exc()[-300:]
        )
    except Exception:
        return "foreign: " + traceback.format_exc()[-900:]
    finally:
        damaged.write_bytes(sound)
    return ""


_points = 0
_groups: list[tuple[str, ...]] = []


def write_once(folder: Path) -> list[tuple[str, ...]]:
    if not _groups:
        _groups.extend(samples.write_models(folder))
    return _groups


def _used(branch: object) -> None:
    """What reads every part of a results file."""
    try:
        repr(branch)
        branch.harmonics  # type: ignore[attr-defined]  # noqa: B018
        branch.peaks()  # type: ignore[attr-defined]
        if len(branch):  # type: ignore[arg-type]
            branch.states(0)  # type: ignore[attr-defined]
            branch.loop(0)  # type: ignore[attr-defined]
            branch.guess(0)  # type: ignore[attr-defined]
    except InputError:
        pass


KINDS: dict[str, Callable[[Path, int], str]] = {
    "case": case_fault, "named": named_fault, "model": model_fault, "results": results_fault,
}  # fmt: skip


def examine(kind: str, folder: Path, seed: int) -> dict[str, object]:
    """One damaged file: the fault in words, megabytes at most above those before."""
    Path("/proc/self/clear_refs").write_text("5")
    before = _status()["VmRSS"]
    signal.alarm(HANGS)
    try:
        fault = KINDS[kind](folder, seed)
    except Hang:
        fault = "hangs: " + traceback.format_exc()[-900:]
    finally:
        signal.alarm(0)
    return {
        "seed": seed, "fault": fault,
        "megabytes": _status()["VmHWM"] - before,
    }  # fmt: skip


def main(kind: str, first: int, count: int, folder: Path) -> None:
    global _points
    os.environ["TMPDIR"] = str(folder)
    os.chdir(folder)
    signal.signal(signal.SIGALRM, _alarm)
    samples.write_files(folder)
    if kind == "results":
        _points = len(load(samples.write_results(folder))) - 1
    for text in samples.CASES:  # everything is loaded and compiled before it is measured
        (folder / "case.toml").write_text(text)
        assert not _command("run", folder / "case.toml", "-o", folder / "out", "--force"), _command(
            "check", folder / "case.toml"
        )
    if kind == "model":
        for names in write_once(folder):
            fault = _command(
                "import", *(folder / name for name in names), "-o", folder / "sound.h5", "--force", *_material(names)
            )
            assert not fault, (names, fault)
    resource.setrlimit(resource.RLIMIT_AS, ((_status()["VmSize"] + 3000) * MEGABYTE,) * 2)
    for seed in range(first, first + count):
        print(json.dumps(examine(kind, folder, seed)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
