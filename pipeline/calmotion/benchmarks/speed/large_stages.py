"""Large stages: `calmotion bench reading --prims N` reads a shot alone and with a set of N prims around it.

USD itself is also asked to open both and to do nothing else: nobody who reads a stage takes less.
"""

from __future__ import annotations

import json
import subprocess  # nosec B404  # runs this program
import sys
import tempfile
from pathlib import Path

import numpy as np

from calmotion.benchmarks.common.tables import markdown
from calmotion.shot.character import Array
from calmotion.usd.writing.still_set import write_large_stage

_MEASURE = """
import json, sys, time
def peak():  # of this program: what is counted for the process includes the one that started it
    with open('/proc/self/status') as status:
        return next(int(line.split()[1]) for line in status if line.startswith('VmHWM')) / 1e3
{prepared}
begin, cpu = time.perf_counter(), time.process_time()
{work}
print(json.dumps([time.perf_counter() - begin, time.process_time() - cpu, peak()]))
"""
_READ = _MEASURE.format(prepared="import calmotion.usd.reading.shot as reading", work="reading.read_shot(sys.argv[1])")
_OPEN = _MEASURE.format(prepared="from pxr import Usd", work="stage = Usd.Stage.Open(sys.argv[1])")


def measured(path: Path, program: str = _READ) -> Array:
    """Time [s], processor time [s] and peak memory [MB] of reading a shot in a process of its own, shape [3]."""
    done = subprocess.run([sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True)  # nosec B603  # no shell
    return np.array(json.loads(done.stdout))


def compare(shot: Path, prims: int) -> str:
    """A table of reading a shot alone and with a set, and of what USD's opening takes of it."""
    with tempfile.TemporaryDirectory() as temporary:
        large = write_large_stage(shot, prims, Path(temporary))
        alone, together = measured(shot), measured(large)
        opened = measured(large, _OPEN) - measured(shot, _OPEN)
    rows = [("alone", alone), (f"with {prims} prims", together), ("more", together - alone)]
    rows.append(("of which USD's opening", opened))
    cells = [[name, f"{wall:.2f} s", f"{used:.2f} s", f"{memory:.0f} MB"] for name, (wall, used, memory) in rows]
    return markdown([shot.name, "time", "processor time", "peak memory"], cells)
