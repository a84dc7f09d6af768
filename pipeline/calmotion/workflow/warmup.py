"""Compiles the kernels ahead of the first shot: a small robot is simulated and optimised, and thrown away."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.model.run import OutputPaths
from calmotion.workflow.commands import optimize, simulate
from calmotion.workflow.run import Progress

SHOT = Path(__file__).with_name("warmup.usda")


@dataclass(frozen=True)
class Warmup:
    """What compiling ahead did.

    Attributes:
        kernels: Number of compiled kernels in the cache now.
        compiled: Number of those that this call added.
        wall_s: Time that it took [s].
        folder: The folder of the compiled kernels.
    """

    kernels: int
    compiled: int
    wall_s: float
    folder: str


def warmup(progress: Callable[[Progress], None] | None = None) -> Warmup:
    """Compile the kernels that `simulate` and `optimize` need, so that the first shot does not wait for them.

    Shots with closed chains, cyclic shots, compliant motors, and searches that take long (`response_gram`) need a few
    more, which their first run compiles.

    Args:
        progress: Called with a `Progress`.

    Raises:
        ShotError: The compiled kernels cannot be kept.
    """
    folder, begin = _folder(), time.perf_counter()
    before = _count(folder)
    with tempfile.TemporaryDirectory() as temporary:
        simulate(SHOT, progress=progress)
        optimize(SHOT, outputs=OutputPaths(layer=os.path.join(temporary, "layer.usda")), progress=progress)
    kernels = _count(folder)
    if not kernels and not _bundled():
        raise ShotError(
            "compiled kernels cannot be kept: their folder cannot be written",
            path=str(folder),
            remedy="Make the folder writable, or name another with the environment variable CALMOTION_CACHE.",
        )
    return Warmup(kernels, kernels - before, time.perf_counter() - begin, str(folder))


def _folder() -> Path:
    from calmotion.support.compilation import cache_place

    return cache_place()


def _count(folder: Path) -> int:
    return sum(1 for _ in folder.rglob("*.nbc"))


def _bundled() -> bool:
    """Whether the installation brings compiled kernels."""
    from calmotion.support.caching.bundled_kernels import FOLDER

    return FOLDER.is_dir()
