"""A campaign against faults: `make torture`, or `python tests/torture/campaign.py [--runs N] [--seed N] [--only KIND]`.

Every run of the program on a tiny shot is disturbed: killed, short of disk, with damaged caches, or among
others. It must end with the same result as an undisturbed run, with a clear refusal, or with exit
status 130, and the next run must end with the result and leave no file that nothing uses.
"""

import argparse
import os
import random
import shutil
import signal
import sys
import tempfile
from pathlib import Path

import kills
import processes
import runs
import storage
import verdicts
from workspace import Workspace

# Kinds of fault, and their share of the runs.
KINDS = {
    "kills": 1.0, "full disks": 0.15, "folders": 0.1, "damaged files": 0.3, "together": 0.01,
}  # fmt: skip
PIECE = 20  # runs of one kind in a row, so that a campaign that is stopped has something of each
_CAMPAIGNS = {
    "full disks": storage.full_disks, "folders": storage.folders, "damaged files": storage.damaged_files,
    "together": processes.together,
}  # fmt: skip


def main() -> int:
    """The command: exit status 1 when anything was lost, different, stuck or left, or ended in a traceback."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=1000, help="number of kills; other faults in proportion")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=tuple(KINDS), action="append", help="kinds of fault (default: all)")
    parser.add_argument("--folder", type=Path, help="where to run (default: a temporary folder)")
    options = parser.parse_args()
    # no TemporaryDirectory: the exit of a forked run would remove it
    folder = options.folder or Path(tempfile.mkdtemp(prefix="torture-"))
    try:
        tallies = disturbed(Workspace(folder.resolve()), options)
    finally:
        if options.folder is None:
            shutil.rmtree(folder, ignore_errors=True)
    for kind, tally in tallies.items():
        print(f"{kind}: {tally.runs} runs, {tally.counts}, {len(tally.faults)} faults", *tally.faults, sep="\n- ")
    return int(any(tally.faults for tally in tallies.values()))


def disturbed(space: Workspace, options: argparse.Namespace) -> dict[str, verdicts.Tally]:
    """Run a campaign; counts by the kind of fault."""
    wanted = {kind: max(1, round(KINDS[kind] * options.runs)) for kind in options.only or KINDS}
    tallies = {kind: verdicts.Tally() for kind in wanted}
    os.environ.update(space.environment())  # before the program is loaded, which reads them
    runs.load_program()
    space.prepare(keep_caches=options.folder is not None)
    seconds = undisturbed(space)
    print(f"an undisturbed run takes {seconds:.1f} s of processor time", flush=True)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # ends the campaign with the counts so far
    try:
        while any(tallies[kind].runs < wanted[kind] for kind in wanted):
            kind = min(wanted, key=lambda kind: tallies[kind].runs / wanted[kind])  # that is furthest behind
            tally, before = tallies[kind], tallies[kind].runs
            count = min(max(1, round(PIECE * KINDS[kind])), wanted[kind] - before)
            rng = random.Random(f"{options.seed} {kind} {before}")
            if kind == "kills":
                kills.campaign(space, rng, count, tally, seconds)
            else:
                _CAMPAIGNS[kind](space, rng, count, tally)
            print(f"{kind}: {tally.runs} of {wanted[kind]}, {len(tally.faults)} faults", flush=True)
    except KeyboardInterrupt:
        pass
    return tallies


def undisturbed(space: Workspace) -> float:
    """Run with empty and with warm caches, and keep the result; the processor time of a warm run [s]."""
    modules = space.root / "modules"
    for figures in (True, True, False):  # the first one compiles for minutes
        ending = runs.start(space, space.arguments(figures), runs.list_modules(modules)).wait(3600.0)
        if ending.status != 0:
            raise SystemExit(f"an undisturbed run fails: {ending.err}\n{ending.out}")
        if figures:
            space.keep()
            runs.load_modules(modules)
    faults = verdicts.result_faults(space, True) + verdicts.leftovers(space)
    if faults:
        raise SystemExit(f"two undisturbed runs differ: {faults}")
    return ending.seconds


if __name__ == "__main__":
    sys.exit(main())
