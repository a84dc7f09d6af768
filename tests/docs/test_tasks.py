"""What newcomers want to do has a page that is found, and whose commands are accepted."""

import re
import shlex
from pathlib import Path

import pytest
from calmotion.cli.commands.table import all_commands
from calmotion.cli.main import build_parser
from followed import DOCS, script
from pages import REPOSITORY

TUTORIALS = DOCS / "tutorials"
FOLLOWED = (
    "usd", "urdf", "animated_parts", "skinned_character", "calibration", "two_workers", "puppeteer", "diagnosis",
)  # fmt: skip
HOW_TO = (
    "arduino", "phone", "weights", "remaining_error", "offline_or_live", "slow_motors", "diagnose", "shows", "workers",
    "clips",
)  # fmt: skip
OTHERS = ("./quickstart", "./importing", "./troubleshooting", "./exporting")
# What newcomers want to do, and the page that is enough for it: all of them are followed beside this module.
TASKS = {
    "see it work, and show it in a browser": "./quickstart",
    "make a robot of a URDF calm": "tutorials/urdf",
    "make a robot in USD calm": "tutorials/usd",
    "make a robot of animated parts": "tutorials/animated_parts",
    "make a robot of a skinned character": "tutorials/skinned_character",
    "play the result on an Arduino": "how_to/arduino",
    "say which target counts when": "how_to/weights",
    "find out why error remains": "how_to/remaining_error",
    "keep slow motors within their limits": "how_to/slow_motors",
    "find out what shakes": "how_to/diagnose",
    "make the model fit the robot": "tutorials/calibration",
    "import a robot": "./importing",
    "write commands for a controller": "./exporting",
    "find the cause of what looks wrong": "./troubleshooting",
    "optimise many shots": "how_to/shows",
    "use several machines": "how_to/workers",
    "play clips in any order": "how_to/clips",
}


def linked(page: Path) -> set[Path]:
    """The pages that a page leads to."""
    targets = re.findall(r"\]\(([\w./-]+\.md)", page.read_text())
    return {path for target in targets if (path := (page.parent / target).resolve()).is_file()}


@pytest.mark.parametrize("page", TASKS.values(), ids=TASKS)
@pytest.mark.parametrize("front", [REPOSITORY / "README.md", DOCS / "index.md"], ids=lambda front: front.name)
def test_a_task_of_a_newcomer_is_found_in_two_clicks_and_followed(page, front):
    first = linked(front)
    assert (DOCS / f"{page}.md").resolve() in first.union(*map(linked, first))
    assert f'follow("{page.removeprefix("tutorials/")}", ' in "".join(
        path.read_text() for path in Path(__file__).parent.glob("*.py")
    )


@pytest.mark.parametrize("page", [*FOLLOWED, *OTHERS, *(f"how_to/{page}" for page in HOW_TO)])
def test_the_commands_of_a_page_are_accepted(page, capsys):
    text = re.sub(r"<<'END'\n.*?\nEND\n", "\n", script(page), flags=re.DOTALL)
    lines = [line for line in text.splitlines() if line.startswith("calmotion ")]
    assert len(lines) >= 2
    if absent := {line.split()[1] for line in lines if all_commands()[line.split()[1]].disabled}:
        pytest.skip(f"the plugins that bring {', '.join(absent)} are not there")
    for line in lines:
        try:
            build_parser().parse_args(shlex.split(re.split(" [<>] ", line)[0])[1:])
        except SystemExit:
            pytest.fail(f"{line}: {capsys.readouterr().err}")


def test_every_tutorial_is_listed_and_tested():
    listed = re.findall(r"\]\(([\w./]+)\.md\)", (TUTORIALS / "index.md").read_text())
    assert set(listed) >= {path.stem for path in TUTORIALS.glob("*.md")} - {"index"}
    # the others are tested by tests/test_tutorial.py, tests/test_guide.py and below
    of_blender = {"blender", "blender_macos", "blender_windows"}
    assert {path.stem for path in TUTORIALS.glob("*.md")} == {"index", *of_blender, *FOLLOWED}


def test_the_page_on_blender_names_what_the_extension_shows():
    text = (TUTORIALS / "blender.md").read_text()
    sources = "".join(path.read_text() for path in (REPOSITORY / "plugins" / "blender").glob("*.py"))
    shown = {*re.findall(r'(?:bl_label|bl_category|name|COLLECTION)\s*=\s*"([^"]+)"', sources)}
    of_others = {"Animation", "Armatures", "Scripting", "Run Script", "Compress", "Clear Constraints"}
    named = set(re.findall(r"\*([A-Z][\w ()]+)\*", text)) - of_others
    assert len(named) >= 4 and named <= shown
