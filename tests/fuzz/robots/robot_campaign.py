"""Random robots against Calmotion: `make fuzz`, or `robot_campaign.py [--runs N] [--seed N] [--only KIND]`.

`commands`: a wild robot, told in any way, ends in numbers or is refused with a place and a remedy, and nothing is half
written. `tellings`: a robot has the same errors, curves, efforts and frequencies however it is told. `written`: what
optimize writes performs as it was told. `mujoco`: ideal motors of a rigid open chain need the torques of MuJoCo's
inverse dynamics, and compliant ones leave the targets where its simulation has them.
"""

import argparse
import contextlib
import io
import shutil
import signal
import sys
import traceback
import warnings
from collections import Counter
from pathlib import Path

from mujoco_robots import against_mujoco
from oracles import tellings, written
from wild_commands import LONGEST, commands


class Slow(BaseException):
    """A run takes too long."""


CAMPAIGNS = {"commands": commands, "tellings": tellings, "written": written, "mujoco": against_mujoco}


def judged(kind: str, seed: int, folder: Path) -> tuple[str, list[str]]:
    """One run, with a limit of time; warnings of numbers are faults."""

    def stop(*_):
        raise Slow

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, LONGEST)
    from calmotion import ShotError

    try:
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            with contextlib.redirect_stderr(io.StringIO()):
                where, found = CAMPAIGNS[kind](seed, folder)
    except Slow:
        return "slow", [f"takes more than {LONGEST} s"]
    except ShotError as error:
        return "refused", [] if "maintainer" not in str(error) else [str(error)[:400]]
    except Exception:
        return "raises", [traceback.format_exc()[-1500:]]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    numeric = [
        f"{w.filename}:{w.lineno}: {w.message}"
        for w in heard
        if issubclass(w.category, RuntimeWarning) and "calmotion" in w.filename
    ]
    return where, found + sorted(set(numeric))


def main() -> int:
    """The command: exit status 1 after a finding; its shot stays in the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=tuple(CAMPAIGNS), action="append")
    parser.add_argument("--folder", type=Path, default=Path("build/fuzz/robots"))
    options = parser.parse_args()
    tally, faults = Counter(), 0
    kinds = options.only or list(CAMPAIGNS)
    for k in range(options.runs):
        kind, seed = kinds[k % len(kinds)], options.seed + k
        folder = options.folder.resolve() / f"{kind}{seed}"
        where, found = judged(kind, seed, folder)
        tally[f"{kind}, {where.split(':')[0].split(',')[0]}"] += 1
        print(f"{kind} {seed}: {where}", *(f"  FAULT {fault}" for fault in found), sep="\n", flush=True)
        faults += bool(found)
        if not found:
            shutil.rmtree(folder, ignore_errors=True)
    print(*(f"{name}: {count}" for name, count in sorted(tally.items())), f"{faults} faults", sep="\n")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
