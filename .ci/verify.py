"""The whole verification in pieces, each in a process of its own with a time limit, remembered by commit.

    make verify                                   whatever has not passed yet on this commit
    make verify TESTS="docs tests/consistency"    the pieces of these names, files or folders, passed or not
    python .ci/verify.py --report [COMMIT]        what is remembered, as a markdown table
    python .ci/verify.py --list                   the pieces, the longest first

Variables: JOBS, how many pieces run at a time (2); LIMIT, seconds after which one is killed (600); SLIPSTICK_SEED,
which samples of the large families of cases are taken ("all": the families whole; without it the commit decides).
What is remembered stands in .verify/records.jsonl, what the pieces printed in .verify/logs.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / ".verify"
RECORDS = FOLDER / "records.jsonl"
JOBS = int(os.environ.get("JOBS", "2"))
LIMIT = float(os.environ.get("LIMIT", "600"))
VENV = os.environ.get("VENV", ".venv")
LOWEST = os.environ.get("LOWEST", ".venv-lowest")
SCRIPTS = "Scripts" if os.name == "nt" else "bin"

PARTS = {
    "tests/consistency/test_every_point.py": 2,
    "tests/consistency/test_many_contacts.py": 3,
    "tests/consistency/test_peaks_found.py": 3,
    "tests/consistency/test_random_systems.py": 4,
    "tests/consistency/test_report_in_browser.py": 2,
    "tests/hostile/test_mutations.py": 3,
    "tests/test_wrong_values.py": 3,
}
"""Files whose long tests take more than about three minutes of a processor, and in how many pieces they run."""

AFTER = {"tests/consistency/test_site_in_browser.py": "docs"}
"""Files that look at what another piece makes."""

FAST = {"analysis": 6, "consistency": 6, "tests": 4, "structure": 2, "contact": 2, "fem": 2}
"""Folders of tests, "tests" for the files beside them, whose fast tests run in several pieces."""


LONG_ALONE = {"type_checks"}
"""Folders whose tests are all long: among the fast ones there is nothing to run."""


@dataclass(frozen=True, kw_only=True)
class Piece:
    """A share of the verification, run by one command."""

    name: str
    command: tuple[str, ...]
    environment: dict[str, str] = field(default_factory=dict)
    after: str = ""
    """The piece that has to pass before this one."""


NO_COMMIT = "no commit"
"""Where there is no repository: nothing is known to be as it was."""

COMPILE = "from slipstick.balance.kernel.compilation import compile_all; compile_all()"
"""Once, before there are several processes that would each do it."""


# --- the pieces ---


def pieces(files: Iterable[str]) -> list[Piece]:
    """All of them, with a piece or several for each of the files that have long tests."""
    make = ("make", f"VENV={VENV}", f"LOWEST={LOWEST}")
    made = [
        # nothing is installed for it while tests run
        Piece(name="docs", command=(*make, "docs", "-o", f"{VENV}/.ready", "-o", f"{VENV}/.docs")),
        Piece(name="table", command=(sys.executable, "-m", "slipstick", "verify")),
        Piece(name="lowest: install", command=(*make, f"{LOWEST}/.ready")),
    ]
    for file in files:
        made += _tests(file, [file], PARTS.get(file, 1), "-m", "verify", after=AFTER.get(file, ""))
    old = str(ROOT / LOWEST / SCRIPTS / "python")
    for place, paths in _folders().items():
        parts = FAST.get(place, 1)
        made += _tests(f"fast: {place}", paths, parts)
        made += _tests(f"lowest: {place}", paths, parts, python=old, after="lowest: install")
    return made


def _tests(
    name: str, paths: Iterable[str], parts: int, *options: str, python: str = sys.executable, after: str = ""
) -> Iterator[Piece]:
    command = (python, "-m", "pytest", "-p", "no:cacheprovider", *options, *paths)
    for i in range(parts):
        part = f"{i + 1}/{parts}"
        yield Piece(
            name=name if parts == 1 else f"{name} {part}",
            command=command, environment={"SLIPSTICK_PART": part}, after=after,
        )  # fmt: skip


def files_with_long_tests(commit: str, known: list[dict]) -> list[str]:
    """As pytest has found them on this commit, or finds them now: marks stand in lists of parameters too."""
    for row in known:
        if row.get("commit") == commit != NO_COMMIT and "files" in row:
            return list(row["files"])
    command = (sys.executable, "-m", "pytest", "-q", "--collect-only", "-m", "verify", "tests", "src")
    found = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, env=os.environ | {"SLIPSTICK_SEED": "all"}
    )
    files = {line.split("::")[0] for line in found.stdout.splitlines() if "::" in line}
    if found.returncode or not files:
        raise SystemExit(f"the tests cannot be collected:\n{found.stdout[-3000:]}{found.stderr[-3000:]}")
    remember({"commit": commit, "files": sorted(files)})
    return sorted(files)


def _folders() -> dict[str, list[str]]:
    files = sorted(path for path in (ROOT / "tests").rglob("test_*.py"))
    found: dict[str, list[str]] = {"src": ["src"]}
    for file in files:
        way = file.relative_to(ROOT / "tests").parts
        if len(way) == 1:
            found.setdefault("tests", []).append(f"tests/{way[0]}")
        elif way[0] not in LONG_ALONE:
            found[way[0]] = [f"tests/{way[0]}"]
    return found


# --- what is remembered ---


def state() -> str:
    """The commit; where files were changed, with a hash of the changes."""
    commit, changes = _git("rev-parse", "HEAD").decode().strip(), hashlib.sha256()
    if not commit:
        return NO_COMMIT
    if not (new := _git("status", "--porcelain", "-z", "--untracked-files=all")):
        return commit
    changes.update(_git("diff", "HEAD", "--binary"))
    for entry in new.decode(errors="surrogateescape").split("\0"):
        if entry.startswith("?? ") and (file := ROOT / entry[3:]).is_file():
            changes.update(entry.encode(errors="surrogateescape") + file.read_bytes())
    return f"{commit}+{changes.hexdigest()[:12]}"


def _git(*words: str) -> bytes:
    found = subprocess.run(("git", *words), cwd=ROOT, capture_output=True)
    return b"" if found.returncode else found.stdout


def records() -> list[dict[str, object]]:
    """Every line; one that was cut off by a crash is none."""
    found = []
    for line in RECORDS.read_text(encoding="utf-8").splitlines() if RECORDS.exists() else ():
        try:
            found.append(json.loads(line))
        except ValueError:
            continue
    return found


def remember(record: dict[str, object]) -> None:
    """Append one line by one call, which neither another runner nor a crash mixes with others."""
    FOLDER.mkdir(exist_ok=True)
    handle = os.open(RECORDS, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        size = os.fstat(handle).st_size
        cut = size > 0 and (os.lseek(handle, size - 1, os.SEEK_SET), os.read(handle, 1))[1] != b"\n"
        os.write(handle, ("\n" * cut + json.dumps(record) + "\n").encode())
        os.fsync(handle)
    finally:
        os.close(handle)


def latest(known: list[dict], commit: str) -> dict[str, dict]:
    """The last record of each piece."""
    return {row["piece"]: row for row in known if row.get("commit") == commit and "piece" in row}


# --- running ---


class Run:
    """Pieces that wait, those that run, and what became of them."""

    def __init__(self, commit: str, seed: str, todo: list[Piece], passed: set[str]) -> None:
        self.commit, self.seed, self.todo, self.passed = commit, seed, todo, passed
        self.count, self.done, self.bad = len(todo), 0, 0
        self.changed = threading.Condition()
        self.taken: set[str] = set()
        self.running: dict[str, subprocess.Popen[bytes]] = {}
        self.stopped = False

    def all(self) -> None:
        """Run them; what runs is killed where this is interrupted."""
        threads = [threading.Thread(target=self._work) for _ in range(JOBS)]
        for thread in threads:
            thread.start()
        try:
            for thread in threads:
                while thread.is_alive():
                    thread.join(0.5)
        except KeyboardInterrupt:
            with self.changed:
                self.stopped = True
                self.changed.notify_all()
                for process in self.running.values():
                    kill(process)
            for thread in threads:
                thread.join()
            raise

    def _work(self) -> None:
        while piece := self._next():
            record = self._run(piece)
            with self.changed:
                self.running.pop(piece.name, None)
                self.taken.discard(piece.name)
                if not self.stopped:
                    self._end(piece, record)
                self.changed.notify_all()

    def _next(self) -> Piece | None:
        """The first that waits for nothing; None where there is none and none will come."""
        with self.changed:
            while not self.stopped:
                for piece in self.todo:
                    if not piece.after or piece.after in self.passed:
                        self.todo.remove(piece)
                        self.taken.add(piece.name)
                        return piece
                if not any(piece.after in self.taken for piece in self.todo):
                    return None
                self.changed.wait()
        return None

    def _run(self, piece: Piece) -> dict[str, object]:
        stem = re.sub(r"[^\w.]+", "-", piece.name)
        log, results = FOLDER / "logs" / f"{stem}.txt", FOLDER / "logs" / f"{stem}.xml"
        log.parent.mkdir(parents=True, exist_ok=True)
        results.unlink(missing_ok=True)
        tests = "pytest" in piece.command
        command = [*piece.command, f"--junit-xml={results}"] if tests else piece.command
        environment = {"OMP_NUM_THREADS": "1"} | os.environ | {"SLIPSTICK_SEED": self.seed} | piece.environment
        begin, when = time.monotonic(), datetime.now(UTC).isoformat(timespec="seconds")
        with log.open("wb") as stream:
            try:
                process = subprocess.Popen(
                    command, cwd=ROOT, env=environment, stdin=subprocess.DEVNULL, stdout=stream,
                    stderr=subprocess.STDOUT, start_new_session=True,
                )  # fmt: skip
            except OSError as error:
                stream.write(str(error).encode())
                code, cpu = 127, None
            else:
                with self.changed:
                    self.running[piece.name] = process
                    if self.stopped:
                        kill(process)
                code, cpu = wait(process)
        record = {
            "commit": self.commit, "piece": piece.name, "seed": self.seed, "status": "failed" if code else "passed",
            "seconds": round(time.monotonic() - begin, 1), "cpu": cpu, "when": when,
            "log": str(log.relative_to(ROOT)),
        }  # fmt: skip
        if code is None:
            record |= {"status": "killed", "why": f"more than {LIMIT:g} s"}
        if tests:
            record |= counted(results)
            if not code and code is not None and not record.get("tests"):
                record |= {"status": "failed", "why": "no test was run"}
        return record

    def _end(self, piece: Piece, record: dict) -> None:
        if state() != self.commit:
            record |= {"commit": f"{self.commit} and others", "status": "failed", "why": "files changed while it ran"}
        remember(record)
        self.done += 1
        print(f"[{self.done}/{self.count}] {line(record)}", flush=True)
        for skip in record.get("skips", ()):
            print(f"    skipped: {skip}", flush=True)
        if record["status"] == "passed":
            self.passed.add(piece.name)
            return
        self.bad += 1
        tail = (ROOT / record["log"]).read_text(encoding="utf-8", errors="replace").splitlines()[-30:]
        print(*(f"    {text}" for text in tail), sep="\n", flush=True)


def wait(process: subprocess.Popen[bytes]) -> tuple[int | None, float | None]:
    """Exit code, None for one that was killed at the limit; seconds of the processor, where the system tells."""
    end = time.monotonic() + LIMIT
    if not hasattr(os, "wait4"):
        try:
            return process.wait(LIMIT), None
        except subprocess.TimeoutExpired:
            kill(process)
            process.wait()
            return None, None
    late = False
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return None if late else process.returncode, round(usage.ru_utime + usage.ru_stime, 1)
        if time.monotonic() > end and not late:
            late = True
            kill(process)
        time.sleep(0.1)


def kill(process: subprocess.Popen[bytes]) -> None:
    """With everything it has started."""
    if hasattr(os, "killpg"):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    else:
        process.kill()


def counted(results: Path) -> dict[str, object]:
    """Tests passed, failed and skipped as pytest has written them; of the last two also which."""
    try:
        cases = list(ElementTree.parse(results).getroot().iter("testcase"))
    except (OSError, ElementTree.ParseError):  # it was ended before
        return {"tests": 0}
    bad, skips, slow = [], [], []
    for case in cases:
        name = f"{case.get('classname')}::{case.get('name')}"
        slow.append((round(float(case.get("time", 0.0)), 1), name))
        if case.find("failure") is not None or case.find("error") is not None:
            bad.append(name)
        elif (skip := case.find("skipped")) is not None:
            skips.append(f"{name}: {skip.get('message')}")
    return {
        "tests": len(cases), "passed": len(cases) - len(bad) - len(skips), "failed": len(bad), "skipped": len(skips),
        "failures": bad, "skips": skips, "slowest": sorted(slow, reverse=True)[:5],
    }  # fmt: skip


# --- what is shown ---


def line(record: dict) -> str:
    """One record in one line."""
    told = f"{record['status']} {record['piece']}: {record['seconds']:.0f} s"
    if "passed" in record:
        told += f", {record['passed']} passed, {record['failed']} failed, {record['skipped']} skipped"
    return told + (f" ({record['why']})" if record.get("why") else "")


def report(commit: str, known: list[dict]) -> str:
    """A markdown table of what is remembered of a commit, with totals and what was skipped or failed."""
    found = latest(known, commit)
    planned = [name for row in known if row.get("commit") == commit for name in row.get("plan", ())]
    head = ("piece", "state", "passed", "failed", "skipped", "seconds", "of the processor", "when")
    rows = [f"# Verification of {commit}", "", "| " + " | ".join(head) + " |", "|---" * len(head) + "|"]
    for name in dict.fromkeys([*planned, *found]):
        row = found.get(name, {"status": "not run"})
        told = [row.get(key, "") for key in ("passed", "failed", "skipped", "seconds", "cpu", "when")]
        rows.append(
            "| " + " | ".join([name, row["status"], *("" if value is None else str(value) for value in told)]) + " |"
        )
    counts = [
        sum(row.get(key) or 0 for row in found.values()) for key in ("passed", "failed", "skipped", "seconds", "cpu")
    ]
    good = sum(row["status"] == "passed" for row in found.values())
    total = len(dict.fromkeys([*planned, *found]))
    rows.append(f"| total | {good} of {total} passed | " + " | ".join(f"{count:.0f}" for count in counts) + " | |")
    rows += [
        "",
        "Seeds of the samples: " + (", ".join(sorted({str(row["seed"]) for row in found.values()})) or "none") + ".",
    ]
    for title, key in (("Failed", "failures"), ("Skipped", "skips")):
        if told := [f"- {each}" for row in found.values() for each in row.get(key, ())]:
            rows += ["", f"{title}:", "", *told]
    return "\n".join(rows)


def main() -> int:
    """Exit code 1 where anything failed or was not run."""
    parser = argparse.ArgumentParser(description="The whole verification in pieces, remembered by commit.")
    parser.add_argument(
        "names", nargs="*", help="pieces, files or folders; all that has not passed where none is named"
    )
    parser.add_argument("--list", action="store_true", help="name the pieces, with their last seconds")
    parser.add_argument("--report", nargs="?", const="", metavar="COMMIT", help="print what is remembered of a commit")
    asked = parser.parse_args()
    commit, known = state(), records()
    if asked.report is not None:
        commits = dict.fromkeys(str(row["commit"]) for row in known if "commit" in row)
        chosen = [name for name in commits if name.startswith(asked.report)] if asked.report else [commit]
        print("\n\n".join(report(name, known) for name in chosen) or f"nothing is remembered of {asked.report}")
        return 0
    every = pieces(files_with_long_tests(commit, known))
    lasted = {row["piece"]: float(row["seconds"]) for row in known if "piece" in row}
    every.sort(key=lambda piece: -lasted.get(piece.name, LIMIT))
    every.sort(key=lambda piece: piece.name != "lowest: install")  # others wait for it
    if asked.list:
        print(*(f"{lasted.get(piece.name, float('nan')):6.0f} s  {piece.name}" for piece in every), sep="\n")
        return 0
    seed = os.environ.get("SLIPSTICK_SEED") or commit[:12]
    good = {
        name for name, row in latest(known, commit).items()
        if row["status"] == "passed" and commit != NO_COMMIT
        and (row["seed"] in (seed, "all") or "SLIPSTICK_SEED" not in os.environ)
    }  # fmt: skip
    todo = [piece for piece in every if piece.name not in good]
    if asked.names:
        todo = named(every, asked.names)
        todo += [piece for piece in every if piece.name in {each.after for each in todo} - good]
    else:
        remember({"commit": commit, "plan": [piece.name for piece in every]})
    print(f"{commit}: {len(todo)} of {len(every)} pieces, {JOBS} at a time, SLIPSTICK_SEED={seed}", flush=True)
    compiled = subprocess.run((sys.executable, "-c", COMPILE), cwd=ROOT)
    run = Run(commit, seed, todo, good)
    for number in (signal.SIGINT, signal.SIGTERM):  # also where it was started in the background
        signal.signal(number, signal.default_int_handler)
    try:
        run.all()
    except KeyboardInterrupt:
        print("interrupted: what has ended is remembered", flush=True)
        return 130
    for piece in run.todo:
        print(f"not run: {piece.name}, which waits for {piece.after}", flush=True)
    bad = run.count - (run.done - run.bad)
    print(f"{run.done - run.bad} passed, {run.bad} failed, {len(run.todo)} not run; --report shows more")
    return 1 if bad or compiled.returncode else 0


def named(every: list[Piece], names: list[str]) -> list[Piece]:
    """Pieces of these names, or of tests in these files or folders."""
    patterns = [re.compile(re.escape(name.rstrip("/")) + "($|[/ :])") for name in names]
    for name, pattern in zip(names, patterns, strict=True):
        if not any(pattern.match(piece.name) for piece in every):
            raise SystemExit(f"{name}: no such piece; python .ci/verify.py --list names them")
    return [piece for piece in every if any(pattern.match(piece.name) for pattern in patterns)]


if __name__ == "__main__":
    sys.exit(main())
