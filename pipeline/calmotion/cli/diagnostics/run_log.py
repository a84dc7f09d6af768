"""The log of a run (`--log FILE`): JSON lines, each on the disk before the run goes on, so that a crash leaves all."""

from __future__ import annotations

import json
import os
import time
from datetime import UTC, datetime
from typing import Any

from calmotion.host import OperatorResult, SettingError
from calmotion.support.files import try_writing
from calmotion.support.memory import peak_memory, resident_memory
from calmotion.version import __version__
from calmotion.workflow.run import Progress

_LONGEST = 65536  # bytes of a line
_INTERVAL = 0.1  # least time between two lines of progress of a stage [s]


def _is_log(path: str) -> bool:
    """Whether lines may be added to a file: it does not exist, is empty, or has JSON lines already.

    Raises:
        OSError: It cannot be read.
    """
    if not os.path.isfile(path):
        return True
    with open(path, "rb") as file:
        line = file.readline(_LONGEST)
    try:
        return not line or isinstance(json.loads(line), dict)
    except ValueError:
        return False


class RunLog:
    """Writes a line for the begin and the end of a run, for progress, and for each operator and its notes.

    Every line has `time` (UTC, ISO 8601), `elapsed_s`, `event`, `memory_bytes` and `peak_memory_bytes`; progress also
    has `stage`, `fraction`, `message` and `time_left_s`.

    Args:
        path: The file; lines are added to one that exists.

    Raises:
        SettingError: It cannot be written.
    """

    def __init__(self, path: str):
        self._begin = self._last = time.perf_counter()
        self._shown = ("", "", 0.0)
        try:
            try_writing(path)
            if not _is_log(path):
                raise OSError(0, "it is a file of another kind, which is never changed")
            self._file = open(path, "a", encoding="utf-8")  # closed by `end`
        except OSError as error:
            raise SettingError(
                "the log cannot be written", path="--log", found=f"{path}: {error.strerror}", remedy="Choose another."
            ) from error
        self._write("begin", version=__version__, process=os.getpid())

    def progress(self, state: Progress) -> None:
        """How far a stage is; what follows the last line at once and says nothing new is left out."""
        now = time.perf_counter()
        ends = state.fraction in (0.0, 1.0)
        if (state.stage, state.message, state.fraction) == self._shown or (
            not ends and state.stage == self._shown[0] and now - self._last < _INTERVAL
        ):
            return
        self._shown, self._last = (state.stage, state.message, state.fraction), now
        self._write(
            "progress", stage=state.stage, fraction=round(state.fraction, 6), message=state.message,
            time_left_s=state.time_left_s,
        )  # fmt: skip

    def operator(self, result: OperatorResult) -> None:
        """The outcome of an operator, and its notes."""
        self._write(
            "operator", stage=result.label, operator=result.idname, outcome=str(result.outcome),
            fraction=result.progress, message=result.reason, duration_s=round(result.duration, 6),
        )  # fmt: skip
        for record in result.records:
            self._write(record.level, stage=result.label, message=record.text)

    def end(self, outcome: str) -> None:
        """The end of the run: `done`, `interrupted` or the type of an error."""
        self._write("end", message=outcome)
        self._file.close()

    def _write(self, event: str, **fields: Any) -> None:
        memory, peak = resident_memory(), peak_memory()  # the second one may lag behind the first
        line = {
            "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
            "elapsed_s": round(time.perf_counter() - self._begin, 3),
            "event": event,
            **fields,
            "memory_bytes": memory,
            "peak_memory_bytes": max(round(1e9 * peak), memory or 0) if peak == peak else None,
        }
        try:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()
        except (OSError, ValueError):  # a full disk ends the log, not the run
            pass
