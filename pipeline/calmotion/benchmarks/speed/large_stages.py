"""Large stages: `calmotion bench reading --prims N` reads a shot alone and with a set of N prims around it."""

from __future__ import annotations

import json
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
from pathlib import Path

from calmotion.benchmarks.common.tables import markdown
from calmotion.usd.writing.still_set import write_large_stage

_READ = (
    "import json, sys, time\n"
    "import calmotion.usd.reading.shot as reading\n"
    "def peak():  # of this program: what is counted for the process includes the one that started it\n"
    "    with open('/proc/self/status') as status:\n"
    "        return next(int(line.split()[1]) for line in status if line.startswith('VmHWM')) / 1e3\n"
    "begin, cpu = time.perf_counter(), time.process_time()\n"
    "character = reading.read_shot(sys.argv[1])[0]\n"
    "used = time.perf_counter() - begin, time.process_time() - cpu\n"
    "print(json.dumps([*used, peak(), len(character.bodies)]))\n"
)


def measured(path: Path) -> tuple[float, float, float, int]:
    """Time [s], processor time [s] and peak memory [MB] of reading a shot in a process of its own, and its bodies."""
    done = subprocess.run([sys.executable, "-c", _READ, str(path)], capture_output=True, text=True, check=True)  # nosec B603  # no shell
    wall, used, memory, bodies = json.loads(done.stdout)
    return wall, used, memory, bodies


def compare(shot: Path, prims: int) -> str:
    """A table of reading a shot alone and with a set."""
    with tempfile.TemporaryDirectory() as temporary:
        large = write_large_stage(shot, prims, Path(temporary))
        rows = [("alone", *measured(shot)), (f"with {prims} prims", *measured(large))]
    more = [after - before for before, after in zip(rows[0][1:4], rows[1][1:4], strict=True)]
    cells = [[name, f"{wall:.2f} s", f"{used:.2f} s", f"{memory:.0f} MB"] for name, wall, used, memory, _ in rows]
    cells.append(["more", f"{more[0]:.2f} s", f"{more[1]:.2f} s", f"{more[2]:.0f} MB"])
    return markdown([shot.name, "time", "processor time", "peak memory"], cells)
