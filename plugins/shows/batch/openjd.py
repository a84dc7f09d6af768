"""Job templates of Open Job Description (2023-09), by which render farms run the jobs of a batch.

A task is one shot; it runs the same command line as a job of `calmotion batch`, and tells its progress in the words of
Open Job Description.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError, file_access
from calmotion.host import SettingError
from calmotion.support import write_text

from .jobs import Job

SPECIFICATION = "jobtemplate-2023-09"
_SUFFIXES = (".yaml", ".yml")
MOST_TASKS = 1024  # values of a task parameter, by the specification
NOTICE = 120  # a task that is cancelled may write its best curves [s]
_SHOT, _NAME, _FOLDER, _PROGRAM = "Shot", "Name", "OutputFolder", "Calmotion"


def openjd_template(jobs: Sequence[Job], folder: str = "", name: str = "Calmotion") -> dict[str, Any]:
    """The template of jobs that differ in their shots alone.

    Args:
        jobs: Of one batch, one or more.
        folder: Of the template; a folder of results below it is a path that farms map, another one a text.
        name: Of the job on the farm.

    Raises:
        ShotError: A path or an option has what the templates take for an expression.
    """
    for job in jobs:
        for text in (job.shot, job.folder, *job.arguments):
            if "{{" in text or any(ord(letter) < 32 for letter in text):
                raise ShotError(
                    "a template cannot hold this text",
                    path="--openjd",
                    found=repr(text),
                    remedy="Remove {{ and control characters from it",
                )
    parts = [jobs[k : k + MOST_TASKS] for k in range(0, len(jobs), MOST_TASKS)]
    return {
        "specificationVersion": SPECIFICATION,
        "name": name,
        "parameterDefinitions": [
            _output(jobs[0].folder, folder),
            {
                "name": _PROGRAM,
                "type": "STRING",
                "default": "calmotion",
                "description": "The program, where it is not in the path of the workers",
            },
        ],
        "steps": [_step(part, k if len(parts) > 1 else None) for k, part in enumerate(parts)],
    }


def _output(results: str, folder: str) -> dict[str, Any]:
    """The parameter that is the folder of the results: the default of a path must be below that of the template."""
    own = os.path.relpath(os.path.realpath(results), os.path.realpath(folder)) if folder else os.pardir
    text = {"name": _FOLDER, "description": "Folder of the results"}
    if own.split(os.sep)[0] == os.pardir or os.path.isabs(own):
        return text | {"type": "STRING", "default": results}
    return text | {"type": "PATH", "objectType": "DIRECTORY", "dataFlow": "OUT", "default": Path(own).as_posix()}


def write_template(path: str | os.PathLike[str], jobs: Sequence[Job]) -> dict[str, Any]:
    """Write the template of jobs as YAML.

    Raises:
        ShotError: It cannot be written, or a text does not fit.
        SettingError: It is not named as a template, or is the folder of the results.
    """
    import yaml

    _refuse_other_files(os.fspath(path), jobs)
    template = openjd_template(jobs, os.path.dirname(os.path.abspath(path)))
    with file_access("the template cannot be written", path, "Choose another file"):
        write_text(Path(path), yaml.safe_dump(template, sort_keys=False, width=1000))
    return template


def _refuse_other_files(path: str, jobs: Sequence[Job]) -> None:
    """Refuse a template in the place of a shot or of the results, or under a name that farms do not read."""
    if not path.lower().endswith(_SUFFIXES):
        raise SettingError(
            "the template is not named like one",
            path="--openjd",
            found=path,
            remedy=f"Give it the extension {' or '.join(_SUFFIXES)}.",
        )
    for job in jobs:
        if os.path.realpath(path) in (os.path.realpath(job.shot), os.path.realpath(job.folder)):
            raise SettingError(
                "the template would be written over a shot, or be in the place of the folder of the results",
                path="--openjd",
                found=path,
                remedy="Choose another file.",
            )


def _step(jobs: Sequence[Job], number: int | None) -> dict[str, Any]:
    """The step whose tasks are some shots."""
    first = jobs[0]
    # the line of a job in which what differs between jobs is a parameter
    pattern = Job(
        f"{{{{Task.Param.{_NAME}}}}}", f"{{{{Task.Param.{_SHOT}}}}}", f"{{{{Param.{_FOLDER}}}}}", first.command,
        first.arguments, first.extras,
    )  # fmt: skip
    line = [text for text in pattern.line if text not in ("--json", "--quiet")]  # farms keep what tasks print
    name = first.command.capitalize() if number is None else f"{first.command.capitalize()}{number + 1}"
    return {
        "name": name,
        "parameterSpace": {
            "taskParameterDefinitions": [
                {"name": _SHOT, "type": "PATH", "range": [job.shot for job in jobs]},
                {"name": _NAME, "type": "STRING", "range": [job.name for job in jobs]},
            ],
            "combination": f"({_SHOT}, {_NAME})",
        },
        "script": {
            "actions": {
                "onRun": {
                    "command": f"{{{{Param.{_PROGRAM}}}}}",
                    "args": [*line, "--openjd"],
                    "cancelation": {"mode": "NOTIFY_THEN_TERMINATE", "notifyPeriodInSeconds": NOTICE},
                }
            }
        },
    }
