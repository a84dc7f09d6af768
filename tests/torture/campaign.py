"""A campaign against faults: `make torture`, or `python tests/torture/campaign.py [--runs N] [--seed N] [--only KIND]`.

Every run of the program on a tiny shot is disturbed: killed, short of disk or memory, with damaged caches, among others
or with a clock that jumps. It must end with the same result as an undisturbed run, with a clear refusal, or with exit
status 130, and the next run must end with the result and leave no file that nothing uses.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import kills
import machine
import report
import runs
import storage
import verdicts
from workspace import REPOSITORY, Workspace

# Kinds of fault, and their share of the runs.
KINDS = {
    "kills": 1.0, "full disks": 0.15, "folders": 0.1, "damaged files": 0.3, "together": 0.01, "clocks": 0.05,
    "memory": 0.1,
}  # fmt: skip
_CAMPAIGNS = {
    "full disks": storage.full_disks, "folders": storage.folders, "damaged files": storage.damaged_files,
    "together": machine.together, "clocks": machine.clocks, "memory": machine.memory,
}  # fmt: skip


def main() -> int:
    """The command: exit status 1 when anything was lost, different, stuck or left, or ended in a traceback."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="number of kills; other faults in proportion")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=tuple(KINDS), action="append", help="kinds of fault (default: all)")
    parser.add_argument("--folder", type=Path, help="where to run (default: a temporary folder)")
    parser.add_argument("--write", action="store_true", help="write the counts into docs/reliability.md")
    options = parser.parse_args()
    # no TemporaryDirectory: the exit of a forked run would remove it
    folder = options.folder or Path(tempfile.mkdtemp(prefix="torture-"))
    try:
        tallies, where = disturbed(Workspace(folder.resolve()), options)
    finally:
        if options.folder is None:
            shutil.rmtree(folder, ignore_errors=True)
    table = report.text(tallies, where, options.seed)
    if options.write:
        report.insert(REPOSITORY / "docs" / "reliability.md", table)
    print(table)
    return int(any(tally.faults for tally in tallies.values()))


def disturbed(space: Workspace, options: argparse.Namespace) -> tuple[dict[str, verdicts.Tally], Counter[str]]:
    """Run the campaign; its counts by the kind of fault, and the kills by where they were."""
    chosen = options.only or list(KINDS)
    os.environ.update(space.environment())  # before the program is loaded, which reads them
    runs.load_program()
    space.prepare(keep_caches=options.folder is not None)
    seconds = undisturbed(space)
    print(f"an undisturbed run takes {seconds:.1f} s", flush=True)
    tallies = {}
    where: Counter[str] = Counter()
    stopped = False
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the campaign with the counts so far
    for kind in chosen:
        begin, count = time.monotonic(), max(1, round(KINDS[kind] * options.runs))
        rng, tally = random.Random(f"{options.seed} {kind}"), verdicts.Tally()
        tallies[kind] = tally
        try:
            if kind == "kills":
                kills.campaign(space, rng, count, tally, seconds, where)
            else:
                _CAMPAIGNS[kind](space, rng, count, tally)
        except KeyboardInterrupt:
            stopped = True
        print(f"{kind}: {tally.counts}, {len(tally.faults)} faults, {time.monotonic() - begin:.0f} s", flush=True)
        if stopped:
            break
    return tallies, where


def undisturbed(space: Workspace) -> float:
    """Run twice, with empty and with warm caches, and keep the result; the duration of a warm run [s]."""
    for figures in (True, True, False):  # the first one compiles for minutes
        ending = runs.start(space, space.arguments(figures)).wait(3600.0)
        if ending.status != 0:
            raise SystemExit(f"an undisturbed run fails: {ending.err}\n{ending.out}")
        if figures:
            space.keep()
    faults = verdicts.result_faults(space, True) + verdicts.leftovers(space)
    if faults:
        raise SystemExit(f"two undisturbed runs differ: {faults}")
    return ending.seconds


if __name__ == "__main__":
    sys.exit(main())
