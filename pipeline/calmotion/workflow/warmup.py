"""Compiles the kernels ahead of the first shot: a small robot is simulated and optimised, and thrown away.

A first run without it lets another process do so meanwhile. The two agree on who compiles which kernel
(`Compilation.claimed`), so that both processors compile.
"""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from calmotion.errors import ShotError
from calmotion.model.run import OutputPaths
from calmotion.support.operating_system import end_with_parent, processors
from calmotion.workflow.commands import optimize, simulate
from calmotion.workflow.run import Progress

HELPER = "CALMOTION_COMPILES_FOR"  # in the environment: the process that a warmup belongs to
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

    Shots with closed chains, cyclic shots, compliant motors, steps that are divided, and searches that take long
    (`response_gram`) need a few more, which their first run compiles.

    Args:
        progress: Called with a `Progress`.

    Raises:
        ShotError: The compiled kernels cannot be kept.
    """
    folder, begin = _folder(), time.perf_counter()
    if os.environ.get(HELPER) == str(os.getppid()):
        _share()
        end_with_parent()
        _begin_at_the_end()
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


@contextlib.contextmanager
def first_run(tell: Callable[[str], None]) -> Iterator[None]:
    """While a run goes on: where no kernels are compiled yet, that is told, and another process compiles some of them.

    None does with one processor, and without the private interfaces of numba, by which the two agree.

    Args:
        tell: Called with a line for the user.
    """
    from calmotion.support.compilation import is_plain

    if _count(_folder()) or _bundled() or not _can_be_kept() or HELPER in os.environ:
        yield
        return
    plain = is_plain()
    tell(f"kernels are compiled, once after an installation, which takes about {'4 min' if plain else '30 s'}")
    if plain or len(processors()) < 2:
        yield
        return
    _share()
    helper = subprocess.Popen(
        [sys.executable, "-m", "calmotion", "warmup", "--quiet"],
        env=os.environ | {HELPER: str(os.getpid())},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        yield
    finally:
        helper.kill()
        helper.wait()


def _begin_at_the_end() -> None:
    """Compile the last of the kernels of a first simulation, while the other process begins at the first."""
    from calmotion.multibody import compile_joint_rows, compile_model, span_tree
    from calmotion.simulation import rigid_bodies
    from calmotion.workflow.shot import open_shot

    character = open_shot(SHOT).character
    some_mass = character.bodies[0].mass  # its bodies' own are not read
    character = replace(character, bodies=tuple(replace(body, mass=some_mass) for body in character.bodies))
    tree = span_tree(character)
    compile_joint_rows(compile_model(character, tree, rigid_bodies(character, tree, None)).system)


def _share() -> None:
    from calmotion.support.compilation import compiling

    compiling.processes = 2


def _folder() -> Path:
    from calmotion.support.compilation import cache_place

    return cache_place()


def _can_be_kept() -> bool:
    """Whether the folder of the compiled kernels is there, or was made now."""
    try:
        _folder().mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(_folder(), os.W_OK)


def _count(folder: Path) -> int:
    from calmotion.support.compilation import kernels_in

    return kernels_in(folder)


def _bundled() -> bool:
    """Whether the installation brings compiled kernels."""
    from calmotion.support.caching.bundled_kernels import FOLDER

    return FOLDER.is_dir()
