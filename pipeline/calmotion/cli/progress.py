"""Progress of a run on stderr: bars on a terminal, one line for each operator in a log.

A program that runs calmotion reads lines `progress<tab>stage<tab>fraction<tab>message` (`--progress`).
"""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING

from calmotion.cli.output import notice
from calmotion.cli.tables import filled
from calmotion.host import OperatorResult, Outcome
from calmotion.workflow.run import Progress as Stage

if TYPE_CHECKING:
    from rich.progress import TaskID

    from calmotion.cli.bars import Bars

QUIET_S = 10.0  # after which a log says what a stage does


class ProgressDisplay:
    """Shows stages as they come; use as a context, call as the workflow's progress callback.

    Args:
        quiet: Show nothing.
        machine: Show lines for a program.
        openjd: Print lines of Open Job Description to stdout.
        verbose: Show details as well.
    """

    def __init__(self, quiet: bool, machine: bool = False, openjd: bool = False, verbose: bool = False):
        self._quiet, self._machine, self._verbose = quiet, machine, verbose
        self._farm = FarmProgress() if openjd else None
        self._bars: Bars | None = None
        self._tasks: dict[str, TaskID] = {}
        self._stage, self._since, self._logged = "", 0.0, ""

    def __enter__(self) -> ProgressDisplay:
        if not self._quiet and not self._machine and sys.stderr.isatty():
            from calmotion.cli.bars import Bars

            self._bars = Bars()
            self._bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bars:
            self._bars.stop()
        if self._farm:
            self._farm.end(error)

    def __call__(self, state: Stage) -> None:
        """Show how far a stage is."""
        stage, fraction, message = state.stage, state.fraction, state.message
        if self._farm:
            self._farm.show(state)
        if self._machine:
            line = "\t".join(("progress", stage, f"{fraction:.4f}", message or stage)).replace("\n", " ")
            print(line, file=sys.stderr, flush=True)
        if self._bars is None:
            self._log(stage, message)
            return
        from calmotion.cli.bars import time_left

        self._bars.message = message
        left = time_left(state.time_left_s)
        if stage not in self._tasks:
            self._tasks[stage] = self._bars.add_task(stage, total=1.0, left=left)
        self._bars.update(self._tasks[stage], completed=fraction, left=left)

    def _log(self, stage: str, message: str) -> None:
        """In a log, tell what takes long: a message that begins with an estimate (`about 20 s`), or after `QUIET_S`."""
        now = time.monotonic()
        if stage != self._stage:
            self._stage, self._since, self._logged = stage, now, ""
        told = message.startswith("about ") or (message not in ("", self._logged) and now - self._since > QUIET_S)
        if told and not self._quiet and not self._machine:
            self._tell(f"{stage}: {message}")
            self._since, self._logged = now, message

    def done(self, result: OperatorResult) -> None:
        """Show the outcome of an operator, and its messages."""
        if self._quiet:
            return
        if self._bars is None and result.outcome in (Outcome.DONE, Outcome.FAILED):
            self._tell(f"{result.label}: {result.outcome} in {result.duration:.2f} s")
        for record in result.records:
            if record.level == "detail" and not self._verbose:
                continue
            self._tell(f"{'warning' if record.level == 'warning' else 'note'}: {record.text}")

    def _tell(self, line: str) -> None:
        if self._bars:
            self._bars.console.print(filled(line, sys.stderr), markup=False, highlight=False, soft_wrap=True)
        else:
            notice(line)


class FarmProgress:
    """Progress in the words of Open Job Description, on stdout.

    How many stages there are is not known: each takes half of what is left, so that the percentage never falls.
    """

    def __init__(self) -> None:
        self._before, self._shown, self._told = 0.0, 0.0, ""

    def show(self, state: Stage) -> None:
        """How far a stage is."""
        percent = 100.0 * (self._before + 0.5 * (1.0 - self._before) * state.fraction)
        if state.fraction >= 1.0:
            self._before += 0.5 * (1.0 - self._before)
        if percent >= self._shown + 1.0:
            self._shown = percent
            self._say("progress", f"{percent:.1f}")
        told = f"{state.stage}: {state.message}" if state.message else state.stage
        if told != self._told:
            self._told = told
            self._say("status", told)

    def end(self, error: BaseException | None) -> None:
        """The command ends."""
        if error is None:
            self._say("progress", "100.0")
        else:
            self._say("fail", str(error) or type(error).__name__)

    @staticmethod
    def _say(word: str, text: str) -> None:
        print(f"openjd_{word}: {' '.join(text.split())}", file=sys.stdout, flush=True)
