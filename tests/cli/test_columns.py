"""Every command on a terminal of 80 columns: lines are short, names are whole."""

import tempfile

import pytest
from calmotion.support.naming import distinct_names
from calmotion.usd.reading import read_shot
from one_hinge import ONE_HINGE

WIDTH = 80
HELP = [
    ("--help",), ("inspect", "--help"), ("simulate", "--help"), ("optimize", "--help"), ("rig", "--help"),
    ("plugins", "--help"), ("cache", "--help"), ("cache", "info"),
    ("plugins", "list"),
    *[("plugins", action, "--help") for action in ("list", "check", "enable", "disable", "new")],
    *[("cache", action, "--help") for action in ("info", "clear", "prune")],
]  # fmt: skip
ROBOTS = ["converted/kuka_iiwa_14/iiwa14.usda", "converted/shadow/right_shadow_hand.usda"]


@pytest.fixture
def lines_of(calmotion, monkeypatch):
    """What a command prints to a terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))

    def run(*arguments):
        done = calmotion(*arguments)
        assert done.returncode == 0, done.stderr
        return (done.stdout + done.stderr).splitlines()

    return run


def check(lines, names=()):
    """Only a name that is longer than a line may make one long; every name is there, whole or with an ellipsis."""
    for line in lines:
        name = line.replace(tempfile.gettempdir(), "/tmp")  # which may have spaces
        assert len(line) <= WIDTH or (len(name.split()) == 1 and "/" in name), line
    words = {word.strip(",;:()") for line in lines for word in line.split()}
    for name, short in distinct_names(names).items():
        assert words & {name, f"…/{short}"}, name


@pytest.mark.parametrize("command", HELP, ids=" ".join)
def test_help_and_lists(lines_of, command):
    check(lines_of(*command))


def inspected(lines_of, shot):
    character, _, _ = read_shot(str(shot), still=True)
    lines = lines_of("inspect", shot)
    for items in (character.bodies, character.joints, character.motors, character.targets):
        check(lines, [item.path for item in items])


@pytest.mark.parametrize("robot", ROBOTS)
def test_the_content_of_a_real_robot(lines_of, shared_data, robot):
    inspected(lines_of, shared_data / robot)


def test_the_content_of_a_sample(lines_of, repository):
    inspected(lines_of, repository / "samples" / "bartender" / "bartender.usda")


def test_the_report_of_a_simulation(lines_of, tmp_path):
    shot = tmp_path / "shot.usda"
    shot.write_text(ONE_HINGE)
    check(lines_of("simulate", shot, "-o", tmp_path / "moved.usda"), ["/Robot/Link/Tip"])
