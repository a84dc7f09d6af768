"""Pages that are followed by their text alone: their shell blocks, in an empty folder."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from pages import REPOSITORY

DOCS = REPOSITORY / "docs"


def script(page: str) -> str:
    """The shell blocks of a page, one after the other."""
    return "\n".join(blocks(page, "sh"))


def blocks(page: str, language: str) -> list[str]:
    """The blocks of a page in a language; a page is a tutorial, or has its folder in its name."""
    text = (DOCS / f"{page if '/' in page else f'tutorials/{page}'}.md").read_text()
    return re.findall(rf"```{language}\n(.*?)```", text, re.DOTALL)


def follow(page: str, folder: Path) -> str:
    """Run a page in an empty folder, or one with the files of `begun`; what it printed."""
    (folder / "work").mkdir(exist_ok=True)
    return run(script(page), folder, folder / "work")


def run(commands: str, folder: Path, work: Path) -> str:
    """Run commands with `calmotion` and `python3` on the path, in `folder / "tools"`; what they printed."""
    tools = folder / "tools"
    tools.mkdir(exist_ok=True)
    for name, command in {"python3": "", "calmotion": "-m calmotion "}.items():
        file = tools / name
        file.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {command}"$@"\n')
        file.chmod(0o755)
    environment = os.environ | {
        "PATH": os.pathsep.join(map(str, (tools, Path(sys.executable).parent, os.environ["PATH"]))),
        "PYTHONPATH": str(REPOSITORY / "pipeline"),
    }
    done = subprocess.run(
        ["bash", "-e", "-c", commands], cwd=work, env=environment, capture_output=True, text=True, timeout=3600
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def begun(page: str, end: str, folder: Path) -> None:
    """Make the files of a page in the working folder of another one: its blocks before that with the words `end`."""
    (folder / "work").mkdir()
    before = script(page).split(end)[0]
    run(before[: before.rindex("\n") + 1], folder, folder / "work")


def errors_of(printed: str) -> list[tuple[float, float]]:
    """Largest errors before and after, of each report of `optimize`, in mm."""
    found = re.findall(r"The largest error falls from ([\d.]+) mm to ([\d.]+) mm", printed)
    return [(float(before), float(after)) for before, after in found]


def needs_converters() -> None:
    """Skip where there are no converters of robots."""
    converters = pytest.importorskip("calmotion_plugins.robot_import.converters")
    variable = converters.VARIABLE
    if not os.environ.get(variable) and not (converters.environment_folder() / "ready").is_file():
        pytest.skip(
            f"the converters are not here: name their environment with {variable}, or run calmotion import once"
        )
