"""The tutorials, followed by their text alone: the shell blocks of each page, in order, in an empty folder."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
PAGES = REPOSITORY / "docs" / "tutorials"
FOLLOWED = ("usd", "urdf", "skinned_character", "calibration", "two_workers", "puppeteer")


def script(page: str) -> str:
    """The shell blocks of a page, one after the other."""
    return "\n".join(re.findall(r"```sh\n(.*?)```", (PAGES / f"{page}.md").read_text(), re.DOTALL))


def follow(page: str, folder: Path) -> str:
    """Run a page in an empty folder with `calmotion` and `python3` on the path; what it printed."""
    tools = folder / "tools"
    tools.mkdir()
    for name, command in {"python3": "", "calmotion": "-m calmotion "}.items():
        file = tools / name
        file.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} {command}"$@"\n')
        file.chmod(0o755)
    work = folder / "work"
    work.mkdir()
    environment = os.environ | {
        "PATH": os.pathsep.join(map(str, (tools, Path(sys.executable).parent, os.environ["PATH"]))),
        "PYTHONPATH": str(REPOSITORY / "pipeline"),
    }  # fmt: skip
    done = subprocess.run(
        ["bash", "-e", "-c", script(page)], cwd=work, env=environment, capture_output=True, text=True, timeout=3600
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return done.stdout


def errors_of(printed: str) -> list[tuple[float, float]]:
    """Largest errors before and after, of each report of `optimize`, in mm."""
    found = re.findall(r"The largest error falls from ([\d.]+) mm to ([\d.]+) mm", printed)
    return [(float(before), float(after)) for before, after in found]


@pytest.mark.parametrize("page", FOLLOWED)
def test_the_commands_of_a_tutorial_are_accepted(page, capsys):
    from calmotion.cli.commands.table import all_commands
    from calmotion.cli.main import build_parser

    text = re.sub(r"<<'END'\n.*?\nEND\n", "\n", script(page), flags=re.DOTALL)
    lines = [line for line in text.splitlines() if line.startswith("calmotion ")]
    assert len(lines) >= 3
    if absent := {line.split()[1] for line in lines if all_commands()[line.split()[1]].disabled}:
        pytest.skip(f"the plugins that bring {', '.join(absent)} are not there")
    for line in lines:
        try:
            build_parser().parse_args(shlex.split(re.split(" [<>] ", line)[0])[1:])
        except SystemExit:
            pytest.fail(f"{line}: {capsys.readouterr().err}")


def test_every_tutorial_is_listed_and_tested():
    listed = re.findall(r"\]\(([\w./]+)\.md\)", (PAGES / "index.md").read_text())
    assert set(listed) >= {path.stem for path in PAGES.glob("*.md")} - {"index"}
    # the others are tested by test_tutorial.py, test_guide.py and below
    assert {path.stem for path in PAGES.glob("*.md")} == {"index", "blender", *FOLLOWED}


def test_the_page_on_blender_names_what_the_extension_shows():
    text = (PAGES / "blender.md").read_text()
    sources = "".join(path.read_text() for path in (REPOSITORY / "plugins" / "blender").glob("*.py"))
    shown = {*re.findall(r'(?:bl_label|bl_category|name|COLLECTION)\s*=\s*"([^"]+)"', sources)}
    of_others = {"Animation", "Armatures", "Scripting", "Run Script", "Compress"}
    named = set(re.findall(r"\*([A-Z][\w ()]+)\*", text)) - of_others
    assert len(named) >= 4 and named <= shown


@pytest.mark.long
def test_a_robot_from_usd(tmp_path):
    printed = follow("usd", tmp_path)
    before, after = errors_of(printed)[0]
    assert after < 0.5 * before
    assert (tmp_path / "work" / "calm_root.usda").is_file() and (tmp_path / "work" / "shake.csv").is_file()


@pytest.mark.long
def test_a_robot_from_urdf(tmp_path):
    needs_converters()
    printed = follow("urdf", tmp_path)
    (before, after), *_ = errors_of(printed)
    assert 4.0 < before < 9.0 and after < 2.0
    assert "The lowest rate that keeps it: " in printed
    assert "joint_names: ['turn', 'lift']" in (tmp_path / "work" / "trajectory.yaml").read_text()


@pytest.mark.long
def test_a_skinned_character(tmp_path):
    pytest.importorskip("pxr")
    printed = follow("skinned_character", tmp_path)
    before, after = errors_of(printed)[0]
    assert after < 0.5 * before
    assert "rotations" in (tmp_path / "work" / "calm.usda").read_text()


@pytest.mark.long
def test_a_calibration(tmp_path):
    pytest.importorskip("calmotion_plugins.calibration")
    printed = follow("calibration", tmp_path)
    assert errors_of(printed)
    from pxr import Usd

    stage = Usd.Stage.Open(str(tmp_path / "work" / "mine_root.usda"))
    modulus = stage.GetPrimAtPath("/Robot/ABS").GetAttribute("physics:youngsModulus").Get()
    assert modulus == pytest.approx(1.6e9, rel=0.01)  # three standard deviations


@pytest.mark.long
def test_a_show_on_two_workers(tmp_path):
    pytest.importorskip("distributed")
    follow("two_workers", tmp_path)
    for folder in ("calm", "farm"):
        jobs = json.loads((tmp_path / "work" / folder / "batch.json").read_text())["jobs"]
        assert len(jobs) == 2 and all(job["outcome"] in ("done", "kept") for job in jobs)


@pytest.mark.long
def test_a_puppeteer(tmp_path):
    printed = follow("puppeteer", tmp_path)
    rest = json.loads(printed.splitlines()[-1])
    assert rest["joints"]["/Bartender/Joints/Elbow"] == pytest.approx(-0.9, abs=0.02) and rest["late"] == 0
    assert "as sent" in printed
    assert (tmp_path / "work" / "live.rrd").stat().st_size > 100_000


def needs_converters():
    converters = pytest.importorskip("calmotion_plugins.robot_import.converters")
    variable = converters.VARIABLE
    if not os.environ.get(variable) and not (converters.environment_folder() / "ready").is_file():
        pytest.skip(
            f"the converters are not here: name their environment with {variable}, or run calmotion import once"
        )
