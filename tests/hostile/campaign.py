"""All hostile cases: `python tests/hostile/campaign.py [--group NAME] [--only TEXT] [--show]`.

Cases run one after another in a process that reads the kernels once; the case that does not end in ten times its stated
time, or ends the process, is a fault, and a new process goes on with the next one.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "helpers" / "processes")]

import every  # noqa: E402
import hostile  # noqa: E402
from stuck import Watch  # noqa: E402


def worker(pipe: Connection) -> None:
    """Run the cases whose names come through a pipe; their endings and faults go back."""
    if hasattr(os, "setsid"):
        os.setsid()  # its own processor time is measured
    while (name := pipe.recv()) is not None:
        with tempfile.TemporaryDirectory(prefix="hostile-") as folder:
            try:
                ending, faults = hostile.run(every.CASES[name], Path(folder))
                pipe.send((ending, faults + hostile.faults_of_time(every.CASES[name], ending)))
            except BaseException as error:
                pipe.send((hostile.Ending(-1, "", "", 0.0), [f"raises {type(error).__name__}: {error}"]))


class Worker:
    """A process that runs cases, started anew after one that hangs or ends it."""

    def __init__(self) -> None:
        self._context = multiprocessing.get_context("spawn")
        self._begin()

    def _begin(self) -> None:
        self._pipe, other = self._context.Pipe()
        self._process = self._context.Process(target=worker, args=(other,), daemon=True)
        self._process.start()
        other.close()

    def run(self, name: str) -> tuple[hostile.Ending, list[str]]:
        """The ending and the faults of a case."""
        assert self._process.pid is not None
        limit = 10.0 * every.CASES[name].seconds
        watch = Watch(self._process.pid, limit)
        self._pipe.send(name)
        try:
            while not watch.stuck():
                if self._pipe.poll(1.0):
                    ending, faults = self._pipe.recv()
                    return ending, faults
            fault = f"does not end in {limit:.0f} s of processor time, or waits"
        except EOFError:
            self._process.join()
            fault = f"ends the process ({self._process.exitcode})"
        self._process.kill()
        self._process.join()
        self._begin()
        return hostile.Ending(-1, "", "", limit), [fault]

    def end(self) -> None:
        """End the process."""
        self._pipe.send(None)
        self._process.join()


def campaign(names: list[str], show: bool = False) -> tuple[Counter[str], list[str]]:
    """Run cases; how they ended, and their faults."""
    counts: Counter[str] = Counter()
    found = []
    runs = Worker()
    for name in names:
        begin = time.monotonic()
        ending, faults = runs.run(name)
        counts[{0: "done", 1: "refused", 2: "wrong usage", 130: "interrupted"}.get(ending.status, "fault")] += 1
        found += [f"{name}: {fault}" for fault in faults]
        mark = "FAULT" if faults else "ok"
        print(
            f"{mark:5} {ending.status:3} {ending.seconds:6.1f} s {time.monotonic() - begin:6.1f} s  {name}", flush=True
        )
        if show or faults:
            print("\n".join(f"      {line}" for line in (*faults, *_excerpt(ending))), flush=True)
    runs.end()
    return counts, found


def _excerpt(ending: hostile.Ending) -> list[str]:
    import json

    try:
        report = json.loads(ending.out)
    except ValueError:
        return [*ending.out.splitlines()[-12:], *ending.err.splitlines()[-12:]]
    errors = report.get("errors") or [report["error"]] if report.get("error") else []
    lines = [" / ".join(f"{key}={value}" for key, value in error.items() if value) for error in errors]
    if "max_error_m" in report:
        lines.append(
            f"error {report['max_error_m']:.4g} m, simulated to {report['simulation_error_m']}, "
            f"kept {report['tolerance_kept']}, step {report['step_s']}, stopped {report.get('stopped')}"
        )
        lines += [f"note: {note}" for note in report["notes"]]
    return lines[:12] + [line for line in ending.err.splitlines() if line.startswith(("warning", "note"))][:6]


def main() -> int:
    """The command; exit status 1 when a case has a fault."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--group", choices=tuple(every.GROUPS), action="append")
    parser.add_argument("--only", help="cases whose name contains this", default="")
    parser.add_argument("--but", help="not cases whose name contains this", action="append", default=[])
    parser.add_argument("--show", action="store_true", help="print the messages of all cases")
    options = parser.parse_args()
    names = [
        name for group, cases in every.GROUPS.items() if not options.group or group in options.group
        for name in cases if options.only in name and not any(text in name for text in options.but)
    ]  # fmt: skip
    counts, faults = campaign(names, options.show)
    print(f"{len(names)} cases: {dict(counts)}, {len(faults)} faults")
    print("\n".join(f"- {fault}" for fault in faults))
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
