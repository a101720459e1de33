"""How the verification is cut, run and remembered, and the samples of large families."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from helpers.sampling import sample

RUNNER = Path(__file__).parents[1] / ".ci" / "verify.py"
FAMILY = range(100)


def drawn(monkeypatch: pytest.MonkeyPatch, seed: str, count: int = 10, family: Any = FAMILY) -> list[int]:
    monkeypatch.setenv("SLIPSTICK_SEED", seed)
    return sample(family, count)


def test_a_sample_is_found_again_by_its_seed_and_every_case_by_some_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    first = drawn(monkeypatch, "a")
    assert first == sorted(first) == drawn(monkeypatch, "a")
    assert len(first) == 10
    assert first != drawn(monkeypatch, "b")
    assert set().union(*(drawn(monkeypatch, str(seed)) for seed in range(100))) == set(FAMILY)
    assert {*first} & set(range(50)) <= {*drawn(monkeypatch, "a", family=range(50))}  # of a part those of the whole


def test_a_family_is_whole_without_a_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    assert drawn(monkeypatch, "all") == [*FAMILY]
    assert drawn(monkeypatch, "a", count=200) == [*FAMILY]
    monkeypatch.delenv("SLIPSTICK_SEED")
    assert sample(FAMILY, 10) == [*FAMILY]


@pytest.fixture
def runner(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    spec = importlib.util.spec_from_file_location("verify_runner", RUNNER)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, "verify_runner", module)  # dataclasses look for it
    spec.loader.exec_module(module)
    for name, value in {"ROOT": tmp_path, "FOLDER": tmp_path / ".verify", "RECORDS": tmp_path / ".verify/r"}.items():
        monkeypatch.setattr(module, name, value)
    monkeypatch.setattr(module, "state", lambda: "c0")
    monkeypatch.setattr(module, "COMPILE", "pass")
    monkeypatch.setattr(module, "files_with_long_tests", lambda commit, known: [])
    monkeypatch.setattr(sys, "argv", ["verify.py"])
    monkeypatch.delenv("SLIPSTICK_SEED", raising=False)
    return module


def piece(runner: ModuleType, name: str, code: str, after: str = "") -> Any:
    return runner.Piece(name=name, command=(sys.executable, "-c", code), after=after)


def test_what_has_passed_is_not_run_again(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    count = "open('count', 'a').write('.'); "
    cut = [
        piece(runner, "first", count + "print('done')"), piece(runner, "second", count, after="first"),
        piece(runner, "wrong", "print('what was wrong'); raise SystemExit(3)"),
        piece(runner, "third", "", after="wrong"),
    ]  # fmt: skip
    monkeypatch.setattr(runner, "pieces", lambda files: list(cut))
    assert runner.main() == 1
    said = capfd.readouterr().out
    assert "what was wrong" in said
    assert "not run: third, which waits for wrong" in said
    cut[2] = piece(runner, "wrong", "")
    assert runner.main() == 0
    assert "2 of 4 pieces" in capfd.readouterr().out
    assert (tmp_path / "count").read_text() == ".."
    assert runner.main() == 0
    assert "0 of 4 pieces" in capfd.readouterr().out
    monkeypatch.setenv("SLIPSTICK_SEED", "all")  # what has passed with a sample has not passed whole
    assert runner.main() == 0
    assert "4 of 4 pieces" in capfd.readouterr().out
    monkeypatch.delenv("SLIPSTICK_SEED")
    monkeypatch.setattr(sys, "argv", ["verify.py", "--report"])
    assert runner.main() == 0
    assert "| total | 4 of 4 passed |" in capfd.readouterr().out


def test_a_piece_that_exceeds_the_limit_is_killed(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(runner, "LIMIT", 0.2)
    sleeper = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'import time; time.sleep(1000)'])"
    monkeypatch.setattr(runner, "pieces", lambda files: [piece(runner, "slow", sleeper)])
    assert runner.main() == 1
    assert "killed slow: 0 s (more than 0.2 s)" in capfd.readouterr().out


def test_a_piece_that_cannot_be_started_has_failed(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(runner, "pieces", lambda files: [runner.Piece(name="none", command=("/nowhere/python",))])
    assert runner.main() == 1
    assert "No such file" in capfd.readouterr().out


def test_a_line_that_a_crash_cut_off_is_no_record(runner: ModuleType) -> None:
    runner.remember({"piece": "a"})
    with runner.RECORDS.open("a") as stream:
        stream.write('{"piece": "b"')
    runner.remember({"piece": "c"})
    assert [row["piece"] for row in runner.records()] == ["a", "c"]


def test_results_of_other_files_are_not_those_of_the_commit(
    runner: ModuleType, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    states = iter(["c0", "c1"])
    monkeypatch.setattr(runner, "state", lambda: next(states))
    monkeypatch.setattr(runner, "pieces", lambda files: [piece(runner, "one", "")])
    assert runner.main() == 1
    assert "files changed while it ran" in capfd.readouterr().out
    assert "one" not in runner.latest(runner.records(), "c0")


def test_tests_are_counted_and_skips_named(runner: ModuleType, tmp_path: Path) -> None:
    (tmp_path / "test_a.py").write_text(
        "import pytest\ndef test_good(): pass\ndef test_bad(): assert 0\ndef test_left(): pytest.skip('no tool')\n"
    )
    (made,) = runner._tests("a", ["test_a.py"], 1)
    found = runner.Run("c0", "s", [], set())._run(made)
    assert (found["passed"], found["failed"], found["skipped"], found["status"]) == (1, 1, 1, "failed")
    assert found["skips"] == ["test_a::test_left: no tool"]
    assert found["failures"] == ["test_a::test_bad"]


def test_names_are_those_of_pieces_files_or_folders(runner: ModuleType) -> None:
    every = [runner.Piece(name=name, command=()) for name in ("docs", "tests/a/test_b.py 1/2", "tests/ab/test_c.py")]
    assert [each.name for each in runner.named(every, ["tests/a", "docs"])] == ["docs", "tests/a/test_b.py 1/2"]
    assert runner.named(every, ["tests/a/test_b.py"]) == [every[1]]
    with pytest.raises(SystemExit, match="no such piece"):
        runner.named(every, ["doc"])
