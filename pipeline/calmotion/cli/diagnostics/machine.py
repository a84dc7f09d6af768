"""What the doctor looks at: versions, caches, processor, threads, memory, disk, viewers."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from calmotion.support.caching.cache_folder import CACHES, cache_folder
from calmotion.support.files import system_temporary, try_writing
from calmotion.version import __version__

OK, NOTE, WRONG = "ok", "note", "wrong"
_MEMORY, _DISK = 2e9, 2e9  # what a shot of ordinary size needs [bytes]


@dataclass(frozen=True)
class Finding:
    """One thing that the doctor looked at.

    Attributes:
        name: What it is.
        state: `ok`; `note` for what limits some uses; `wrong` for what keeps the program from its work.
        found: What was found.
        remedy: What to do; empty where nothing is to be done.
    """

    name: str
    state: str
    found: str
    remedy: str = ""


def examine() -> list[Finding]:
    """Look at everything; a look that fails is a finding itself."""
    looks: tuple[Callable[[], Iterator[Finding]], ...] = (
        _versions, _plugins, _caches, _processor, _threads, _memory, _disk, _kernels, _viewer, _blender,
    )  # fmt: skip
    findings: list[Finding] = []
    for look in looks:
        try:
            findings += look()
        except Exception as error:  # whatever is wrong, the other looks go on
            findings.append(Finding(look.__name__.strip("_"), WRONG, f"{type(error).__name__}: {error}"))
    return findings


def _versions() -> Iterator[Finding]:
    from packaging.requirements import Requirement

    yield Finding("calmotion", OK, __version__)
    version = platform.python_version()
    right = (3, 11) <= sys.version_info[:2] < (3, 15)
    yield Finding("Python", OK if right else WRONG, version, "" if right else "Use Python 3.11 to 3.14")
    try:
        wanted = metadata.requires("calmotion") or []
    except metadata.PackageNotFoundError:
        yield Finding("libraries", NOTE, "calmotion is not installed but run from a folder", "pip install --editable .")
        return
    for requirement in map(Requirement, wanted):
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            found = metadata.version(requirement.name)
        except metadata.PackageNotFoundError:
            yield Finding(requirement.name, WRONG, "is not installed", f"pip install '{requirement}'")
            continue
        fits = requirement.specifier.contains(found, prereleases=True)
        yield Finding(
            requirement.name, OK if fits else WRONG, found,
            "" if fits else f"It must be {requirement.specifier}: pip install '{requirement}'",
        )  # fmt: skip


def _plugins() -> Iterator[Finding]:
    from calmotion.host import open_host

    host = open_host([])
    failed = host.failures()
    for plugin in failed:
        yield Finding(
            f"plugin {plugin.id}", WRONG, str(plugin.error), f"Repair it, or `calmotion plugins disable {plugin.id}`"
        )
    if not failed:
        yield Finding("plugins", OK, f"{len(host.operators)} operators")


def _caches() -> Iterator[Finding]:
    from calmotion.support.caching.caches import entries

    folder = cache_folder()
    reason = _unwritable(folder)
    yield Finding(
        "cache folder", WRONG if reason else OK, f"{folder}{f': {reason}' if reason else ''}",
        "Kernels compile anew in every run, for minutes: make it writable, or set CALMOTION_CACHE" if reason else "",
    )  # fmt: skip
    for name, (content, limit) in CACHES.items():
        found = entries(name)
        size = sum(entry.size for entry in found)
        over = size > limit
        yield Finding(
            f"cache of {content}", NOTE if over else OK, f"{len(found)}, {size / 1e6:.1f} of {limit / 1e6:.0f} MB",
            f"calmotion cache prune {name}" if over else "",
        )  # fmt: skip


def _unwritable(folder: Path) -> str:
    """Why a folder cannot be written; empty where it can."""
    try:
        try_writing(folder / "file")
    except OSError as error:
        return error.strerror or type(error).__name__
    return ""


def _processor() -> Iterator[Finding]:
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    usual = [name for name in ("avx2", "fma", "avx512f", "neon") if features.get(name)]
    fast = "avx2" in usual or "neon" in usual
    yield Finding(
        "processor", OK if fast else NOTE,
        f"{binding.get_host_cpu_name()}, {platform.machine()}, {', '.join(usual) or 'no vector units'}",
        "" if fast else "Runs take several times as long without AVX2; use another machine, or wait",
    )  # fmt: skip


def _threads() -> Iterator[Finding]:
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    given = {name: os.environ[name] for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")
             if name in os.environ}  # fmt: skip
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    busy = load > 2.0 * cores
    text = ", ".join(f"{name}={value}" for name, value in given.items())
    yield Finding(
        "threads", NOTE if busy else OK, f"{cores} cores, load {load:.1f}{f', {text}' if text else ''}",
        "Other programs take most of the processor; runs take longer" if busy else "",
    )  # fmt: skip


def _memory() -> Iterator[Finding]:
    from calmotion.support.memory import available_memory

    free = available_memory()
    low = free < _MEMORY
    found = f"{free / 1e9:.1f} GB can be taken" if free < float("inf") else "the system does not tell"
    yield Finding(
        "memory", NOTE if low else OK, found,
        "Large shots are refused: end other programs, or raise the limit (ulimit -v, container)" if low else "",
    )  # fmt: skip


def _disk() -> Iterator[Finding]:
    for name, folder in (
        ("cache", cache_folder()),
        ("temporary files", system_temporary()),
        ("here", Path.cwd()),
    ):
        there = next((path for path in (folder, *folder.parents) if path.is_dir()), None)
        if there is None:
            continue
        free = shutil.disk_usage(there).free
        yield Finding(
            f"disk ({name})", NOTE if free < _DISK else OK, f"{free / 1e9:.1f} GB free at {there}",
            "Free some space, or `calmotion cache prune --size 100MB`" if free < _DISK else "",
        )  # fmt: skip


def _kernels() -> Iterator[Finding]:
    """Compile a kernel, which fails where numba or LLVM is broken."""
    from numba import config, njit

    if config.DISABLE_JIT:
        yield Finding("compiler", WRONG, "numba is told not to compile", "Unset NUMBA_DISABLE_JIT")
        return
    value = njit(lambda x: x + 1.0)(1.0)
    yield Finding(
        "compiler", OK if value == 2.0 else WRONG, "numba compiles", "" if value == 2.0 else "Reinstall numba"
    )


def _viewer() -> Iterator[Finding]:
    program = shutil.which("rerun") or shutil.which("rerun", path=str(Path(sys.executable).parent))
    wanted = metadata.version("rerun-sdk")
    if program is None:
        yield Finding("rerun viewer", NOTE, "not found", f"pip install rerun-sdk=={wanted}, to open recordings (--rrd)")
        return
    found = _first_line([program, "--version"])
    fits = wanted in found
    yield Finding(
        "rerun viewer", OK if fits else NOTE, found.partition(" (")[0] or program,
        "" if fits else f"Recordings are written by rerun {wanted}: install that version",
    )  # fmt: skip


def _blender() -> Iterator[Finding]:
    program = shutil.which("blender")
    if program is None:
        yield Finding("Blender", OK, "not found; only its extension needs it")
        return
    yield Finding("Blender", OK, _first_line([program, "--version"]) or program)


def _first_line(command: list[str]) -> str:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=20.0, stdin=subprocess.DEVNULL)
    except (OSError, subprocess.SubprocessError):
        return ""
    return next(iter((done.stdout or done.stderr).strip().splitlines()), "")
