"""Options of the commands."""

import pytest
from calmotion.cli import progress_display
from calmotion.cli.main import build_parser, main
from calmotion.workflow.run import Progress


def test_a_number_of_motions_that_is_none_is_refused(capsys):
    assert main(["excite", "a.usda", "-o", "b.usda", "--tries", "-5"]) == 2
    assert "-5 is not a number of motions" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    "words",
    [
        ["calibrate", "a.usda", "--recording", "b.csv"],
        ["excite", "a.usda", "-o", "c.usda"],
        ["refine", "a.usda", "--recording", "b.csv", "-o", "c.usda"],
    ],
)
def test_every_command_shows_its_progress_as_it_is_asked_to(words, capsys):
    args = build_parser(words[0]).parse_args([*words, "--openjd", "--progress"])
    with progress_display(args) as display:
        display(Progress("Stage", 0.5, "half"))
    told = capsys.readouterr()
    assert "openjd_status: Stage: half" in told.out and "progress\tStage\t0.5000\thalf" in told.err
