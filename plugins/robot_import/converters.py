"""The converters of URDF and MJCF, in an environment of their own: they bring a build of USD of their own."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.support import cache_folder, is_own, locked
from calmotion.support import temporary_folder as folder_beside

from .description.descriptions import URDF, Description

PACKAGES = ("urdf-usd-converter>=0.3.4,<0.4", "mujoco-usd-converter>=0.8,<0.9")
VARIABLE = "CALMOTION_CONVERTERS"  # names an environment that has them
_MODULES = ("urdf_usd_converter", "mujoco_usd_converter")
_PYTHONS = ((3, 10), (3, 12))  # oldest and newest version that they support
_READY = "ready"
_SCRIPT = Path(__file__).with_name("mujoco_values.py")
LONGEST = 1800.0  # time of a conversion [s]
_BROKEN_OBJ = re.compile(r'Failed to convert mesh(?: "[^"]*" from|:) (.+?\.obj)(?=:|$)', re.IGNORECASE)
_IN_PARTS = re.compile('"(.+?\\.obj)" contains multiple meshes', re.IGNORECASE)
_PLACE = re.compile(r" \(line: \d+\)$")
# of pictures and sensors, which change no motion, and of the converter's own code
_NO_MATTER = re.compile("texture|was deprecated|(cameras|lights|sensors|keys) are not supported")
# see `joints` and `ellipsoids`
_ADDED = re.compile("Unsupported transmission type '.*JOINTINPARENT'|Actuator '.*' is not converted|mjGEOM_ELLIPSOID ")
# of warnings after which a part of the robot is missing
_BAD_WORDS = ("Failed to", "Cannot", "not found", "Invalid input_path")


class BrokenMeshes(ShotError):
    """OBJ meshes that a converter refuses, as files.

    Attributes:
        files: Their paths.
    """

    def __init__(self, robot: str, meshes: Sequence[str]) -> None:
        super().__init__(
            "meshes of the robot cannot be converted",
            path=robot,
            attribute="mesh",
            found=", ".join(meshes[:4]),
            remedy="Write them anew with a mesh editor, as .stl for example",
        )
        self.files = tuple(dict.fromkeys(meshes))


def environment_folder() -> Path:
    """Where the environment is that `converter_python` makes."""
    return cache_folder() / "converters"


def converter_python(named: str | None, tell: Callable[[str], None]) -> str:
    """A Python that has both converters.

    Args:
        named: An environment, or its Python, that has them; None: that of `CALMOTION_CONVERTERS`, else our own,
            which is made if it is not there.
        tell: Told before the environment is made, which takes about a minute.

    Raises:
        ShotError: The environment has no converters, or cannot be made.
    """
    named = named or os.environ.get(VARIABLE)
    if named:
        python = _python_of(Path(named))
        if _lacks(python):
            raise ShotError(
                "this environment does not have the converters",
                path=named,
                found=_lacks(python),
                remedy=f"Install {' and '.join(PACKAGES)} there, or leave out --converters",
            )
        return str(python)
    folder = environment_folder()
    if not _is_ready(folder):
        tell(f"making an environment for the converters of URDF and MJCF in {folder} (once, about a minute)")
        folder.parent.mkdir(parents=True, exist_ok=True)
        with locked(folder.parent):  # the environment is not removed while another import makes it
            if not _is_ready(folder):
                _make(folder)
    return str(_python_of(folder))


def convert(description: Description, output: str, python: str) -> tuple[str, tuple[str, ...]]:
    """Convert a robot to USD.

    Args:
        description: The robot.
        output: Folder to write, which must not exist.
        python: As `converter_python` gives it.

    Returns:
        The USD file in the folder, and the warnings of the converter.

    Raises:
        BrokenMeshes: OBJ meshes cannot be converted as they are.
        ShotError: The robot cannot be converted.
    """
    module = _MODULES[description.kind != URDF]
    packages = [word for name, folder in description.packages.items() for word in ("--package", f"{name}={folder}")]
    # in isolation, so that neither the variables of this environment nor its packages reach it
    command = [python, "-I", "-m", module, os.path.abspath(description.path), output, *packages]
    try:
        done = subprocess.run(command, capture_output=True, text=True, env=_plain_environment(), timeout=LONGEST)
    except subprocess.TimeoutExpired:
        raise ShotError(
            f"the converter has not ended after {LONGEST / 60:g} minutes",
            path=description.shown,
            remedy=f"Make the meshes smaller; `{module}` of the converters' environment shows where it is",
        ) from None
    lines = [line.strip() for line in (done.stdout + done.stderr).splitlines() if line.strip()]
    files = [path for path in Path(output).glob("*.usd*") if path.is_file()] if os.path.isdir(output) else []
    if done.returncode or len(files) != 1:
        raise ShotError(
            "the converter refuses the robot",
            path=description.shown,
            found=_last_words(lines),
            remedy=f"Correct the file; `{module}` of the converters' environment shows the whole message",
        )
    warnings = [line.partition("] ")[2].partition("] ")[2] or line for line in lines if "Warning" in line]
    warnings = [line for line in warnings if not _ADDED.search(line) and not _NO_MATTER.search(line)]
    lost = [line for line in warnings if line.startswith(_BAD_WORDS)]
    if lost:
        broken = [match.group(1) for line in lost if (match := _BROKEN_OBJ.match(line))]
        if len(broken) == len(lost):
            raise BrokenMeshes(description.shown, broken)
        raise ShotError(
            "a part of the robot cannot be converted",
            path=description.shown,
            found="; ".join(dict.fromkeys(lost[:3])) + (f"; {len(lost) - 3} more" if len(lost) > 3 else ""),
            remedy="Correct the file: meshes are .stl, .obj or .dae, and their names relative to it",
        )
    if in_parts := [match.group(1) for line in warnings if (match := _IN_PARTS.match(line))]:
        raise BrokenMeshes(description.shown, in_parts)
    told = Counter(_PLACE.sub("", line) for line in warnings)
    return str(files[0]), tuple(f"{line} ({count} times)" if count > 1 else line for line, count in told.items())


def compiled_values(description: Description, python: str) -> dict[str, Any]:
    """What MuJoCo makes of an MJCF robot, see `mujoco_values`.

    Args:
        description: The robot.
        python: Of the environment of the converters.

    Raises:
        ShotError: MuJoCo does not load it.
    """
    command = [python, "-I", str(_SCRIPT), os.path.abspath(description.path)]
    done = subprocess.run(command, capture_output=True, text=True, env=_plain_environment(), timeout=LONGEST)
    if done.returncode:
        words = [line.strip() for line in done.stderr.splitlines() if line.strip()]
        raise ShotError(
            "MuJoCo does not load the robot",
            path=description.shown,
            found=" ".join(words[-2:])[:300] or None,
            remedy="Correct the file, until MuJoCo's own viewer opens it",
        )
    values: dict[str, Any] = json.loads(done.stdout)
    return values


def _make(folder: Path) -> None:
    python = _supported_python()
    if python is None:
        versions = "{}.{} to {}.{}".format(*_PYTHONS[0], *_PYTHONS[1])
        raise ShotError(
            f"the converters need Python {versions}, and there is none",
            found=sys.version.split()[0],
            remedy=f"Install one, and {' and '.join(PACKAGES)} into an environment of it; name that with --converters",
        )
    shutil.rmtree(folder, ignore_errors=True)
    for command in (
        [python, "-m", "venv", str(folder)],
        [str(_python_in(folder)), "-I", "-m", "pip", "install", "--quiet", *PACKAGES],
    ):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            errors = [line for line in done.stderr.splitlines() if "ERROR" in line or "rror:" in line]
            raise ShotError(
                "the environment of the converters cannot be made",
                path=str(folder),
                found=_last_words(errors),
                remedy=f"Install {' and '.join(PACKAGES)} into an environment of your own; name it with --converters",
            )
    (folder / _READY).write_text("\n".join(PACKAGES), encoding="utf-8")
    folder.chmod(0o755)  # also where the umask lets a group write


def _is_ready(folder: Path) -> bool:
    """Whether an environment is whole, and no other user can have changed what it runs."""
    return (folder / _READY).is_file() and is_own(folder.stat())


def _supported_python() -> str | None:
    if _PYTHONS[0] <= sys.version_info[:2] <= _PYTHONS[1]:
        return sys.executable
    names = [f"python3.{minor}" for minor in range(_PYTHONS[1][1], _PYTHONS[0][1] - 1, -1)]
    return next((found for name in names if (found := shutil.which(name))), None)


def _python_of(named: Path) -> Path:
    return _python_in(named) if named.is_dir() else named


def _python_in(environment: Path) -> Path:
    """The Python of an environment, also of one that is not made yet."""
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _lacks(python: Path) -> str:
    """What keeps a Python from converting; empty where nothing does."""
    if not python.is_file():
        return f"no {python}"
    code = f"import {', '.join(_MODULES)}"
    done = subprocess.run([str(python), "-I", "-c", code], capture_output=True, text=True, env=_plain_environment())
    return "" if done.returncode == 0 else _last_words(done.stderr.splitlines()) or "it fails"


def _plain_environment() -> dict[str, str]:
    """The environment without what names plugins of our USD."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("PXR_", "PYTHON"))}


def _last_words(lines: list[str]) -> str | None:
    """The last line, and the one before where that has the error of which the last one says the place."""
    behind = len(lines) > 1 and "rror" in lines[-2] and "rror" not in lines[-1]
    return " ".join(line.strip() for line in lines[-2 if behind else -1 :])[:300] or None


@contextmanager
def temporary_folder(beside: str) -> Iterator[str]:
    """A new folder beside a file, for a conversion that is moved to its place at the end; it goes when the block ends.
    What killed processes left there is removed first."""
    parent = Path(os.path.abspath(beside)).parent
    parent.mkdir(parents=True, exist_ok=True)
    with folder_beside(parent) as folder:
        yield str(folder)
