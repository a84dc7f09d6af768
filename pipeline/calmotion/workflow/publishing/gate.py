"""What must hold before a result is published: nothing has changed since, the verdict is good, the shot is clean."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError
from calmotion.model.outputs import ERROR
from calmotion.workflow.publishing.manifest import LAYER, changed_files, read_manifest


def publishing_problems(
    manifest: str | os.PathLike[str], *, strict: bool = True, plugins: Sequence[str] = ()
) -> list[ShotError]:  # fmt: skip
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
            "the simulation does not keep the tolerance", "tolerance_kept",
            "Raise --tolerance, or see the error budget (--verbose)",
        )  # fmt: skip
    if verdict.get("interrupted"):
        refuse("the search was interrupted", "interrupted", "Run the same command again: it resumes")
    if verdict.get("improved") is False:
        refuse("the curves are worse than the animated ones", "improved", "Look at the limits of the motors")
    if verdict.get("exceeded_limits"):
        refuse("limits of motors are exceeded", "exceeded_limits", "Slow the motion down, or correct the limits")
    return problems


def _of_shot(shot: str, plugins: Sequence[str]) -> list[ShotError]:
    """The errors that `inspect --strict` finds."""
    from calmotion.workflow.commands import inspect
    from calmotion.workflow.shot import Shot

    inspection = inspect(Shot(shot, plugins=plugins), strict=True)
    problems = [problem.error for problem in inspection.problems]
    findings = inspection.findings
    for item in () if findings is None else findings.items:
        if item.level == ERROR:
            problems.append(
                ShotError(
                    item.problem, path=item.path, attribute=item.attribute, found=item.found or None,
                    remedy=item.remedy or f"Correct what {item.rule} found",
                )
            )  # fmt: skip
    return problems
