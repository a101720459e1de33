"""The verb ``run``: compute a case with everything kept as it is found."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from slipstick.cli.options import CasePath, Figures, Force, Formats, NoFigures, Quiet, Report, TimeLimit, folder_option
from slipstick.cli.output import REPORT, OutputFolder
from slipstick.cli.run_options import PLAIN, UNFINISHED, RunOptions, run_options
from slipstick.cli.terminal.answers import Answer, case_answer, files_in, results_answer
from slipstick.cli.terminal.guard import (
    BAD_INPUT,
    DONE,
    STOPPED,
    complain,
    fault_sentence,
    os_sentence,
    say,
    termination_as_interrupt,
)
from slipstick.cli.terminal.prepare import prepare_kernel
from slipstick.cli.verb import verb
from slipstick.cli.verbs.check import print_warnings
from slipstick.errors import InputError, Outcome, SlipstickWarning
from slipstick.units import Units, after_number

if TYPE_CHECKING:
    from slipstick.analysis.curve.resume import Checkpoint
    from slipstick.case.case import Case
    from slipstick.cli.terminal.progress import Progress
    from slipstick.io.journal import Recorded
    from slipstick.results.schema import Layout
    from slipstick.results.table import ResultTable


@verb
def run(
    answer: Answer,
    case: CasePath,
    output: Annotated[Path | None, folder_option("CASE-results")] = None,
    force: Force = False,
    figures: Figures = None,
    formats: Formats = None,
    no_figures: NoFigures = False,
    report: Report = True,
    quiet: Quiet = False,
    time_limit: TimeLimit = None,
) -> int:
    """Compute a case: results.nc, written point by point, and report.html."""
    options = run_options(
        time_limit, (figures, formats), figures=not no_figures, report=report, quiet=quiet, answer=answer
    )
    return run_case(case, output, force=force, options=options)


def run_case(path: Path, output: Path | None, *, force: bool = False, options: RunOptions = PLAIN) -> int:
    """Compute a case into a folder; the exit code.

    Raises
    ------
    InputError
        If the case has faults or its results cannot be written, before anything is computed.
    """
    from slipstick.case.case import Case

    case = Case.from_file(path, options.tell)
    told = print_warnings(case)
    folder = OutputFolder(
        output if output is not None else Path(f"{case.name}-results"),
        case_path=path,
        case_text=case.text,
        force=force,
    )
    try:
        return Run(case, folder, options, told).whole()
    except BaseException:
        folder.abandon()
        raise
    finally:
        folder.release()


@dataclass(frozen=True)
class Begun:
    """A run that ended before it was done: its journal, and the checkpoints of the points that are kept."""

    recorded: Recorded
    checkpoints: Sequence[Checkpoint]


@dataclass
class Run:
    """One run from its start to its summary; what it found survives however it ends."""

    case: Case
    folder: OutputFolder
    options: RunOptions
    told: Sequence[str] = ()
    begun: Begun | None = None
    doubts: Sequence[str] = ()
    """What could not be computed about the points, and what is suspicious in their values."""
    outcome: Outcome = Outcome.INTERRUPTED
    message: str = ""
    failures: list[str] = field(default_factory=list)
    seconds: float = 0.0
    found: Mapping[str, Any] = field(default_factory=dict)
    """Attributes of the branch."""
    doubled: Sequence[Answer] = ()
    """Branches of twice the period."""
    until: float = math.inf
    """When its time is up, of the monotonic clock."""

    def whole(self) -> int:
        """From its first point to its summary; the exit code."""
        self.compute()
        code = self.finish()
        if self.options.answer is not None:
            self.options.answer.update(self.answer)
        return code

    def compute(self) -> None:
        """Follow the branch; every point goes to the store at once."""
        from slipstick.cli.terminal.progress import progress
        from slipstick.results.record import Recorder

        self.options.tell(f"{self.case.title}: {self.case.request}")
        if self.case.plan is not None:
            self.options.tell("[study] is for 'slipstick study'; this computes the case itself")
        for name in self.case.further:
            self.options.tell(f"[{name}] is for 'slipstick {name}'; this computes [response]")
        begin = time.monotonic()
        prepare_kernel(self.options.tell)
        recorder = Recorder(
            self.case.balance, parameter=self.case.parameter or "", stability=bool(self.case.response.judged)
        )
        self._open(replace(recorder.layout, attributes=self._attributes()))
        factor, unit = self.case.shown_in
        start, stop = (value / factor for value in self.case.span)
        with termination_as_interrupt(), progress(start, stop, unit, quiet=self.options.quiet) as shown:
            if self.options.time_limit is not None:
                self.until = begin + self.options.time_limit
            self._follow(shown)
        self._close()

    def _open(self, layout: Layout) -> None:
        from slipstick.io.problem import fingerprint
        from slipstick.io.store import ResultStore

        problem = self.case.problem()
        if self.begun is not None:
            recorded, keep = self.begun.recorded, len(self.begun.checkpoints)
            self.store = ResultStore(self.folder.results, recorded.layout, problem, recorded=recorded, keep=keep)
            return
        about = {"case_path": str(self.case.path.resolve()), "problem": fingerprint(problem)}
        self.store = ResultStore(self.folder.results, layout, problem, about=about)
        self.folder.copy_case()

    def _follow(self, shown: Progress) -> None:
        from slipstick.analysis.curve.record import undisturbed
        from slipstick.cli.stored import Clock, Stored

        checkpoints = () if self.begun is None else self.begun.checkpoints
        sink: Stored | None = None
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", SlipstickWarning)  # said before, or in the summary
                run = replace(self.case.curve(), checkpoints=checkpoints).run()
                sink = Stored(run, self.store, shown, self.case)
                with undisturbed():
                    for _ in run.follow(sink, Clock(self.until), guard=nullcontext):
                        pass
        except KeyboardInterrupt:
            self.outcome = Outcome.INTERRUPTED
        except Exception as error:
            self._fail(error)
        if sink is not None and sink.end is not None:
            self.found = {**sink.end.attributes, **self.case.names}
            self.doubts = sink.said()
            if sink.end.error is not None:
                self._fail(sink.end.error)
            if not self.failures:
                self.outcome, self.message = sink.end.outcome, sink.end.message

    def _fail(self, error: Exception) -> None:
        """Take note of what ended the run."""
        self.failures += error.sentences if isinstance(error, InputError) else [fault_sentence(error)]

    def _close(self) -> None:
        ended = {**self.found, "outcome": self.outcome.name, "outcome_text": self.text}
        ended["warnings"] = "\n".join([*self.told, *self.doubts])
        self.seconds = float(self.found.get("seconds", 0.0))
        unfinished = self.failures or self.outcome in UNFINISHED
        try:
            self.store.close(ended, finished=not unfinished)
        except OSError as error:
            kept = f"every point is kept in {self.store.path}.journal, which slipstick reads"
            said = os_sentence(error)
            self.failures = [*(f for f in self.failures if f != said), f"{said}; {kept}"]

    @cached_property
    def _data(self) -> ResultTable:
        """The results as they were written, or as they stand in the journal."""
        return self.store.table()

    @property
    def answer(self) -> Answer:
        """What a program is told of the run."""
        data = self._data if len(self.store) else None
        ended = {"outcome": self.outcome.name, "message": self.text, "seconds": self.seconds, "errors": self.failures}
        said = {"warnings": list(dict.fromkeys([*self.told, *self.doubts]))}
        results = {"points": 0, "peaks": []} if data is None else results_answer(data)
        doubled = {} if self.case.response.follow is None else {"subharmonics": self.doubled}
        return {**case_answer(self.case), **ended, **said, **results, **doubled, **files_in(self.folder.work)}

    @property
    def complete(self) -> bool:
        """Whether all that was asked for is there."""
        return self.outcome.ok and not self.failures

    @property
    def text(self) -> str:
        """How it ended, in words."""
        return "stopped: " + "; ".join(self.failures) if self.failures else self.message or self.outcome.text

    def _attributes(self) -> Mapping[str, Any]:
        """What an unfinished file says."""
        from slipstick.results.schema import attributes_of

        unfinished = "unfinished: the run ended before it could say why; every point found is kept"
        made = attributes_of(
            self.case.problem(), Outcome.INTERRUPTED, unfinished, self.told, parameter=self.case.parameter or ""
        )
        return {**made, **self.case.names}

    def finish(self) -> int:
        """Figures, report and summary; the exit code."""
        found = len(self.store)
        if self.options.figures and self.options.wanted.names and found > 1 and not self.failures:
            self._draw()
        if self.options.report and found:
            self._report()
        if self.case.response.follow is not None and self.complete and found:
            self._follow_doubled()
        if self.complete:
            self.folder.complete()
        self._summary(found)
        for failure in self.failures:
            complain(f"error: {failure}")
        if self.complete:
            return DONE
        return BAD_INPUT if self.failures and not found else STOPPED

    def _draw(self) -> None:
        from slipstick.cli.figures import draw_figures

        try:
            for name in draw_figures(self._data.to_dataset(), self.case, self.folder.work, self.options.wanted):
                complain(f"warning: figures: there is nothing in these results to draw of '{name}'")
        except Exception as error:
            self.failures.append(f"figures: {fault_sentence(error)}")

    def _follow_doubled(self) -> None:
        from slipstick.cli.doubled import follow_doubled

        try:
            self.doubled = follow_doubled(self.case, self.folder.results, self.until)
        except Exception as error:
            self.failures.append(f"twice the period: {fault_sentence(error)}")

    def _report(self) -> None:
        """A run whose report cannot be written has its results all the same."""
        from slipstick.branch import Branch
        from slipstick.report.writing import write_report

        try:
            branch = Branch.from_dataset(self._data, self.case.problem())
            branch.balance = self.case.balance  # made once for a run
            write_report(branch, self.folder.work / REPORT)
        except InputError as error:
            complain(f"warning: {error}")
        except Exception as error:
            complain(f"warning: report: {fault_sentence(error)}")

    def _summary(self, found: int) -> None:
        from slipstick.progress import duration

        if found:
            data = self._data
            iterations = int(data["newton_iterations"].to_numpy().sum())
            for line in peak_lines(data):
                self.options.tell(line)
            if "coordinates_of_motion" in data.attrs:
                self.options.tell(f"all motion is {data.attrs['coordinates_of_motion']}")
            for sentence in self.doubts:
                complain(f"warning: {sentence}")
            self.options.tell(f"{found} points, {iterations} Newton iterations, {duration(self.seconds)}")
        if not self.failures:
            say(self.text)
        say(f"results in {self.folder.work}{'/' if found else ': no point was found'}")
        if self.failures or self.outcome in UNFINISHED:
            say(f"go on with: slipstick resume {self.folder.folder}")
        if self.folder.replaces:
            complain(f"the earlier results in {self.folder.folder} are untouched; the new ones are not complete")


def peak_lines(data: ResultTable, most: int = 12) -> list[str]:
    """One line for each located peak, the largest of each dof first."""
    kind, of = data["kind"].to_numpy(), data["peak_dof"].to_numpy()
    axis, units = "parameter" if data.attrs.get("parameter") else "omega", Units.of_results(data.attrs)
    at, amplitude = data[axis].to_numpy(), data["amplitude"].to_numpy()
    lines = []
    for i in (kind == "peak").nonzero()[0]:
        dof = str(data["dof"].to_numpy()[of[i]]) if of[i] >= 0 else ""
        value, size = float(at[i]), float(amplitude[i, max(of[i], 0)])
        if axis == "omega":
            where = units.frequency_text(value, str(data.attrs.get("frequency_unit", units.angular)))
        else:
            where = f"{value:.6g}{after_number(data[axis].attrs['units'])}"
        lines.append(
            (size, f"peak of {dof}: amplitude {size:.6g}{after_number(data['amplitude'].attrs['units'])} at {where}")
        )
    lines.sort(key=lambda pair: -pair[0])
    return [line for _, line in lines[:most]]
