"""`calmotion doctor`: what is wrong with this installation and this machine, and what to do."""

import argparse
import platform
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

from calmotion.cli import Output, console_on, counted, json_option, print_table
from calmotion.support.caching.cache_folder import cache_folder
from calmotion.support.files import try_writing
from calmotion.version import __version__

EXAMPLES = (("calmotion doctor", "is everything in its place?"),)
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


def add_arguments(command: argparse.ArgumentParser) -> None:
    """Add the options of the command."""
    command.description = f"{command.description} Exit status 1 if something is wrong."
    json_option(command)


def run(args: argparse.Namespace, output: Output) -> int:
    """Print what was found, what is wrong first."""

    findings = sorted(examine(), key=lambda one: (WRONG, NOTE, OK).index(one.state))
    wrong, notes = (sum(one.state == state for one in findings) for state in (WRONG, NOTE))
    if output.json:
        output.object({"findings": [asdict(one) for one in findings], "wrong": wrong})
    else:
        title = f"{counted(wrong, 'thing') if wrong else 'Nothing'} wrong, {counted(notes, 'thing')} to note"
        rows = [[one.state, one.name, one.found, one.remedy] for one in findings]
        print_table(console_on(output.stream), title, ["", "what", "found", "what to do"], rows, texts=4)
    return int(wrong > 0)


def examine() -> list[Finding]:
    """Look at everything; a look that fails is a finding itself."""
    findings: list[Finding] = []
    for look in (_versions, _plugins, _processor, _memory, _disk, _compiler, _viewer):
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
            found = "is not installed"
        fits = found[0].isdigit() and requirement.specifier.contains(found, prereleases=True)
        yield Finding(requirement.name, OK if fits else WRONG, found, "" if fits else f"pip install '{requirement}'")


def _plugins() -> Iterator[Finding]:
    from calmotion.host import open_host

    host = open_host([])
    for plugin in host.failures():
        remedy = f"Repair it, or calmotion plugins disable {plugin.id}"
        yield Finding(f"plugin {plugin.id}", WRONG, str(plugin.error), remedy)
    yield Finding("plugins", OK, f"{len(host.operators)} operators")


def _processor() -> Iterator[Finding]:
    from llvmlite import binding

    features = binding.get_host_cpu_features()
    units = [name for name in ("avx2", "fma", "avx512f", "neon") if features.get(name)]
    fast = "avx2" in units or "neon" in units
    yield Finding(
        "processor",
        OK if fast else NOTE,
        f"{binding.get_host_cpu_name()}, {platform.machine()}, {', '.join(units) or 'no vector units'}",
        "" if fast else "Runs take several times as long without AVX2; use another machine, or wait",
    )


def _memory() -> Iterator[Finding]:
    from calmotion.support.memory import available_memory

    free = available_memory()
    low = free < _MEMORY
    found = f"{free / 1e9:.1f} GB can be taken" if free < float("inf") else "the system does not tell"
    remedy = "Large shots are refused: end other programs, or raise the limit (ulimit -v, container)"
    yield Finding("memory", NOTE if low else OK, found, remedy if low else "")


def _disk() -> Iterator[Finding]:
    folder = cache_folder()
    try:
        try_writing(folder / "file")
    except OSError as error:
        remedy = "Kernels compile anew in every run, for minutes: make it writable, or set CALMOTION_CACHE"
        yield Finding("cache folder", WRONG, f"{folder}: {error.strerror or type(error).__name__}", remedy)
        return
    free = shutil.disk_usage(next(path for path in (folder, *folder.parents) if path.is_dir())).free
    remedy = "Free some space, or calmotion cache prune --size 100MB" if free < _DISK else ""
    yield Finding("cache folder", NOTE if remedy else OK, f"{folder}, {free / 1e9:.1f} GB free", remedy)


def _compiler() -> Iterator[Finding]:
    """Compile a kernel, which fails where numba or LLVM is broken."""
    from numba import __version__ as numba_version
    from numba import config, njit

    if config.DISABLE_JIT:
        yield Finding("compiler", WRONG, "numba is told not to compile", "Unset NUMBA_DISABLE_JIT")
    elif njit(lambda x: x + 1.0)(1.0) == 2.0:
        from calmotion.support.compilation import is_plain

        slowly = ", plainly: first runs take five times as long" if is_plain() else ""
        yield Finding("compiler", OK, f"numba {numba_version} compiles{slowly}")
    else:
        yield Finding("compiler", WRONG, "numba computes wrong numbers", "Reinstall numba and llvmlite")


def _viewer() -> Iterator[Finding]:
    program = shutil.which("rerun") or shutil.which("rerun", path=str(Path(sys.executable).parent))
    wanted = metadata.version("rerun-sdk")
    found = "not found"
    if program is not None:
        done = subprocess.run(
            [program, "--version"], capture_output=True, text=True, timeout=20.0, stdin=subprocess.DEVNULL
        )
        found = (done.stdout or done.stderr).partition(" (")[0].strip()
    fits = wanted in found
    remedy = f"Recordings (--rrd) are written by rerun {wanted}: pip install rerun-sdk=={wanted}"
    yield Finding("rerun viewer", OK if fits else NOTE, found, "" if fits else remedy)
