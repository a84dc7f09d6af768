"""The manifest of a result: inputs, outputs, hashes, settings, verdict; what must hold before it is published."""

import hashlib
import json
import os
import platform
import shlex
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError, file_access
from calmotion.model import Character, Provenance
from calmotion.model.outputs import ERROR, CsvFile, Figures, Recording, Video, WrittenLayer
from calmotion.model.run import OutputPaths, Source
from calmotion.support.files import is_special, write_text
from calmotion.version import __version__
from calmotion.workflow.commands import inspect
from calmotion.workflow.outputs import refuse_overwriting
from calmotion.workflow.report import plain
from calmotion.workflow.results import SimulationResult
from calmotion.workflow.run import no_input
from calmotion.workflow.shot import Shot


def publishing_problems(
    manifest: str | os.PathLike[str], *, strict: bool = True, plugins: Sequence[str] = ()
) -> list[ShotError]:
    """Why a result must not be published; empty where it may be.

    Args:
        manifest: File that `--manifest` or `calmotion batch` wrote.
        strict: Whether the shot is checked as `calmotion inspect --strict` does; its warnings do not count.
        plugins: Folders with more plugins, for this check.

    Raises:
        ShotError: The manifest cannot be read.
    """
    found = read_manifest(manifest)
    folder = Path(manifest).parent
    problems = changed_files(found, folder) + _of_verdict(found["verdict"], found, str(manifest))
    if not strict or problems:
        return problems
    return _of_shot(os.path.join(folder, found["shot"]), plugins)


def _of_verdict(verdict: dict[str, Any], manifest: dict[str, Any], path: str) -> list[ShotError]:
    """What the result itself lacks."""
    problems = []

    def refuse(problem: str, key: str, remedy: str) -> None:
        problems.append(ShotError(problem, path=path, attribute=key, found=verdict.get(key), remedy=remedy))

    if not any(row["role"] == LAYER for row in manifest["outputs"]):
        problems.append(ShotError("the result has no layer", path=path, remedy="Run `calmotion optimize` with -o"))
    if verdict.get("tolerance_kept") is not True:
        refuse(
            "the simulation does not keep the tolerance",
            "tolerance_kept",
            "Raise --tolerance, or see the error budget (--verbose)",
        )
    if verdict.get("interrupted"):
        refuse("the search was interrupted", "interrupted", "Run the same command again: it resumes")
    if verdict.get("improved") is False:
        refuse("the curves are worse than the animated ones", "improved", "Look at the limits of the motors")
    if verdict.get("exceeded_limits"):
        refuse("limits of motors are exceeded", "exceeded_limits", "Slow the motion down, or correct the limits")
    return problems


def _of_shot(shot: str, plugins: Sequence[str]) -> list[ShotError]:
    """The errors that `inspect --strict` finds."""
    inspection = inspect(Shot(shot, plugins=plugins), strict=True)
    problems = [problem.error for problem in inspection.problems]
    findings = inspection.findings
    for item in () if findings is None else findings.items:
        if item.level == ERROR:
            problems.append(
                ShotError(
                    item.problem,
                    path=item.path,
                    attribute=item.attribute,
                    found=item.found or None,
                    remedy=item.remedy or f"Correct what {item.rule} found",
                )
            )
    return problems


FORMAT = 1
PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "usd-core", "scikit-fem", "pytetwild")
LAYER, ROOT = "layer", "root layer"  # roles of outputs
_KEYS = {"format": int, "command": str, "shot": str, "inputs": list, "outputs": list, "verdict": dict, "versions": dict}


def manifest_of(result: SimulationResult, folder: str | os.PathLike[str]) -> dict[str, Any]:
    """The manifest of a result whose files are written.

    Args:
        result: Of `simulate` or `optimize`.
    """
    outcome = result.outcome
    source, provenance = outcome.require(Source), outcome.require(Provenance)
    return {
        "format": FORMAT,
        "calmotion": __version__,
        "command": source.command,
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "shot": _named(provenance.shot, folder),
        "request": _request(result),
        "inputs": [_row(path, folder, role, digest) for path, role, digest in _inputs(result)],
        "outputs": [_row(path, folder, role, None) for path, role in _outputs(result)],
        "versions": {"python": platform.python_version(), "platform": platform.platform(), **_versions()},
        "verdict": _verdict(result),
    }


def origin_of(files: Mapping[str, str]) -> dict[str, Any]:
    """The provenance of a result for a page: the command line, versions, and hashes of the files that were read.

    Args:
        files: What was read, by what it is.
    """
    return {
        "command": shlex.join(["calmotion", *sys.argv[1:]]),
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "inputs": [{"path": path, "role": role, "sha256": sha256_of(path) or ""} for role, path in files.items()],
        "versions": {"python": platform.python_version(), "platform": platform.platform(), **_versions()},
    }


def origin_of_run(result: SimulationResult) -> dict[str, Any]:
    """The same of a run, whose layers were hashed when they were read."""
    rows = [_row(path, os.getcwd(), role, digest) for path, role, digest in _inputs(result)]
    return origin_of({}) | {"inputs": rows, "settings": _request(result)}


def _request(result: SimulationResult) -> dict[str, Any]:
    """What the user asked for."""
    source = result.outcome.require(Source)
    return {
        **{name: value for name, value in asdict(source.settings).items() if value is not None},
        "shaper": source.shaper,
        "verify": source.verify,
        "operators": plain(result.outcome.settings),
    }


def write_manifest(result: SimulationResult, path: str | os.PathLike[str]) -> str:
    """Write the manifest of a result; returns the path.

    Raises:
        SettingError: The file is read as the shot, or is another output of the result.
        ShotError: It cannot be written.
    """
    no_input(result.outcome, path)
    refuse_overwriting({}, {role: file for file, role in _outputs(result)} | {"manifest": os.fspath(path)})
    content = json.dumps(manifest_of(result, Path(path).parent), indent=2, allow_nan=False) + "\n"
    with file_access("the manifest cannot be written", path, "Choose another file"):
        write_text(Path(path), content)
    return os.fspath(path)


def read_manifest(path: str | os.PathLike[str]) -> dict[str, Any]:
    """A manifest that `write_manifest` wrote.

    Raises:
        ShotError: The file cannot be read, or is no manifest.
    """
    try:
        if is_special(path):
            raise OSError(0, "it is not a regular file")
        found: Any = json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise ShotError(
            "the manifest cannot be read",
            path=str(path),
            found=getattr(error, "strerror", None) or error,
            remedy="Write the result again with --manifest",
        ) from error
    wrong = [key for key, kind in _KEYS.items() if not isinstance(found, dict) or not isinstance(found.get(key), kind)]
    rows = [] if wrong else [*found["inputs"], *found["outputs"]]
    if wrong or found["format"] != FORMAT or not all(_is_row(row) for row in rows):
        raise ShotError(
            "this is no manifest of a result",
            path=str(path),
            found=f"no {wrong[0]}" if wrong else None,
            remedy="Name a file that --manifest wrote",
        )
    manifest: dict[str, Any] = found
    return manifest


def changed_files(manifest: Mapping[str, Any], folder: str | os.PathLike[str]) -> list[ShotError]:
    """The files of a manifest that are missing or differ from what they were, one error each.

    Args:
        manifest: See `read_manifest`.
    """
    found = []
    for kind, remedy in (
        ("inputs", "Run the shot again: the result is of another state of its inputs"),
        ("outputs", "Run the shot again, or restore the file"),
    ):
        for row in manifest[kind]:
            path = Path(folder) / row["path"]
            digest = sha256_of(path)
            if digest == row["sha256"]:
                continue
            problem = "is missing" if digest is None else "has changed since the result was made"
            found.append(ShotError(f"this {row['role']} {problem}", path=str(path), found=digest, remedy=remedy))
    return found


def sha256_of(path: str | os.PathLike[str]) -> str | None:
    """SHA-256 of a file; None where there is none that can be read."""
    try:
        if is_special(path):
            return None
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:
        return None


def _is_row(row: object) -> bool:
    return isinstance(row, dict) and all(isinstance(row.get(key), str) for key in ("path", "sha256", "role"))


def _row(path: str, folder: str | os.PathLike[str], role: str, digest: str | None) -> dict[str, str]:
    return {"path": _named(path, folder), "role": role, "sha256": digest or sha256_of(path) or ""}


def _named(path: str, folder: str | os.PathLike[str]) -> str:
    """A path relative to a folder, with slashes; as it is where it lies on another drive."""
    try:
        return Path(os.path.relpath(os.path.realpath(path), os.path.realpath(folder))).as_posix()
    except ValueError:
        return Path(os.path.realpath(path)).as_posix()


def _inputs(result: SimulationResult) -> Iterator[tuple[str, str, str | None]]:
    """Path, role and hash of each file that the result depends on; layers were hashed when they were read."""
    provenance, character = result.outcome.require(Provenance), result.outcome.require(Character)
    folder = os.path.dirname(os.path.realpath(provenance.shot))
    for number, layer in enumerate(provenance.layers):
        yield os.path.join(folder, layer.path), "layer of the shot" if number else "shot", layer.sha256
    if result.shot.motion:
        yield result.shot.motion, "motion", None
    if result.shot.settings_file:
        yield result.shot.settings_file, "file of settings", None
    for body in character.bodies:
        if body.flexible is not None and body.flexible.mesh_file:
            yield body.flexible.mesh_file, "mesh", None


def _outputs(result: SimulationResult) -> Iterator[tuple[str, str]]:
    get = result.outcome.run.get
    if (layer := get(WrittenLayer)) is not None:
        yield layer.layer, LAYER
        yield layer.root, ROOT
    for file, role in ((get(CsvFile), "table"), (get(Recording), "recording"), (get(Video), "video")):
        if file is not None:
            yield file.path, role
    if (figures := get(Figures)) is not None:
        for path in figures.paths:
            yield path, "figure"
    paths = get(OutputPaths)  # the page is written after the run
    if paths is not None and paths.html and os.path.isfile(paths.html):
        yield paths.html, "page"


def _versions() -> dict[str, str]:
    found = {"calmotion": __version__}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _verdict(result: SimulationResult) -> dict[str, Any]:
    report = result.report()
    keys = (
        "tolerance_m", "tolerance_kept", "improved", "objective_before", "objective_after", "stopped", "interrupted",
        "targets",
    )  # fmt: skip
    limits = [row for row in report["limits"] if row["exceeded"]]
    return {
        **{key: report[key] for key in keys if key in report},
        "largest_error_m": result.max_error,
        "exceeded_limits": [{"path": row["path"], "quantity": row["quantity"]} for row in limits],
    }
