"""What a first run compiles: number of kernels, and the time it adds.

`calmotion bench compilation [SHOT]` optimises a shot three times in an empty cache folder: with nothing in it, again
without compiled kernels, and with everything. The difference of the last two is the time of compiling.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from calmotion.benchmarks.common.fresh_cache import fresh_cache
from calmotion.support.caching.cache_folder import KERNELS, cache_folder

DEFAULT = "samples/bartender/bartender.usda"


@dataclass(frozen=True)
class Compilation:
    """What a command compiles in its first run.

    Attributes:
        kernels: Number of compiled functions.
        first_s: The first run, in which meshes and reductions are made as well [s].
        compile_s, compile_cpu_s: What compiling adds to a run, and its processor time [s].
        warm_s: A run that finds everything in the cache [s].
    """

    kernels: int
    first_s: float
    compile_s: float
    compile_cpu_s: float
    warm_s: float


def measure(command: Sequence[str]) -> Compilation:
    """Run a command three times in a cache folder of its own.

    Raises:
        subprocess.CalledProcessError: The command failed.
    """
    with fresh_cache():
        first, _ = _run(command)
        shutil.rmtree(cache_folder() / KERNELS, ignore_errors=True)
        cold, cold_cpu = _run(command)
        kernels = sum(1 for _ in (cache_folder() / KERNELS).rglob("*.nbc"))
        warm, warm_cpu = _run(command)
    return Compilation(kernels, first, cold - warm, cold_cpu - warm_cpu, warm)


def _run(command: Sequence[str]) -> tuple[float, float]:
    """Wall and processor time of a command [s]."""
    begin, before = time.perf_counter(), os.times()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    used = after.children_user + after.children_system - before.children_user - before.children_system
    return time.perf_counter() - begin, used


def main(argv: Sequence[str] | None = None) -> int:
    """Measure a shot and print the result."""
    parser = argparse.ArgumentParser(prog="calmotion bench compilation", description="What a first run compiles.")
    parser.add_argument("shot", nargs="?", default=DEFAULT, help=f"a shot that is optimised (default: {DEFAULT})")
    args = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        layer = str(Path(folder) / "result.usda")
        command = [sys.executable, "-m", "calmotion", "optimize", args.shot, "-o", layer, "--quiet"]
        try:
            result = measure(command)
        except subprocess.CalledProcessError as error:
            return int(error.returncode)
    cpu = f"{result.compile_cpu_s:.1f} s of processor time"
    print(f"{result.kernels} kernels are compiled in {result.compile_s:.1f} s ({cpu})")
    print(f"first run {result.first_s:.1f} s, with everything in the cache {result.warm_s:.1f} s")
    return 0
