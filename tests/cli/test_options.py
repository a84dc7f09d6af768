"""Options that commands share."""

import pytest
from calmotion.cli.main import build_parser, main
from calmotion.cli.options import KINDS, assignments, progress_display
from calmotion.model import model_choice
from calmotion.workflow.run import Progress


def test_the_command_line_has_every_kind():
    assert KINDS == model_choice.KINDS


def test_options_of_the_writer_are_stronger_than_assignments():
    arguments = ["optimize", "a.usda", "-o", "b.usda", "--bake", "--set", "usd.write.bake=simulated", "--splines"]
    args = build_parser().parse_args(arguments)
    assert assignments(args) == {"usd.write": {"bake": "motors", "splines": True}}


def test_without_arguments_it_prints_help(capsys):
    assert main([]) == 2
    printed = capsys.readouterr()
    assert not printed.out and "change the motor curves" in printed.err


@pytest.mark.parametrize(
    "wrong, right",
    [
        (["simulate", "a.usda", "--tolerence", "1mm"], "--tolerance"),
        (["simulate", "a.usda", "--tolerence=1mm"], "--tolerance"),
        (["inspect", "a.usda", "--stepp", "1ms"], "--step"),
        (["simulate", "a.usda", "--keep", "turnning"], "turning"),
        (["simualte", "a.usda"], "simulate"),
    ],
)
def test_a_misspelt_option_is_answered_with_the_nearest(wrong, right, capsys):
    assert main(wrong) == 2
    assert f"Did you mean {right}?" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["1", "0.001", "1e-3", "1.", "0"])
def test_a_tolerance_needs_a_unit(text, capsys):
    assert main(["simulate", "a.usda", "--tolerance", text]) == 2
    assert f"{text} has no unit; write {text}m or {text}mm" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("text, meters", [("1mm", 1e-3), ("1 cm", 1e-2), ("1e-3m", 1e-3)])
def test_a_tolerance_with_a_unit_is_in_metres(text, meters):
    assert build_parser().parse_args(["simulate", "a.usda", "--tolerance", text]).tolerance == meters


@pytest.mark.parametrize(
    ("text", "told"),
    [("1mm1", "is not a number"), ("", "is not a number"), ("mm", "is not a number"), ("1MM", "Did you mean mm?")],
)
def test_what_is_no_length_is_not_said_to_lack_a_unit(text, told, capsys):
    assert main(["simulate", "a.usda", "--tolerance", text]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert told in said and "has no unit" not in said


@pytest.mark.parametrize(
    ("option", "text", "told"),
    [
        ("--step", "-2ms", "-2ms is negative; write 2ms"),
        ("--tolerance", "-1", "-1 is negative; write 1m or 1mm"),
        ("--pre-roll", "-.5", "-.5 is negative; write .5"),
        ("--samples-per-second", "-50Hz", "-50Hz is negative; write 50Hz"),
        ("--step", "0ms", "0ms is not above zero"),
        ("--step", "inf", "inf is not finite"),
        ("--step", "--json", "its value is missing. Write --step TIME"),
        ("--figures", "-d", "its value is missing. Write --figures DIR, or --figures=DIR if it begins with a dash"),
        ("--motors", "--json", "its value is missing. Write --motors authored|ideal"),
    ],
)
def test_a_value_that_does_not_fit_is_named_with_its_option_and_the_remedy(option, text, told, capsys):
    assert main(["simulate", "a.usda", option, text]) == 2
    assert f"argument {option}: {told}" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["watch", "a.usda", "--runs", "0"], "0 is not a number of runs"),
        (["watch", "a.usda", "--runs", "1.5"], "1.5 is not a number of runs"),
        (["simulate", "my", "shot.usda"], "no argument takes shot.usda"),
        (["doctor", "x"], "no argument takes x"),
    ],
)
def test_numbers_and_arguments_that_do_not_fit_are_refused_at_once(arguments, told, capsys):
    assert main(arguments) == 2
    assert told in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    "words",
    [
        ["simulate", "a.usda"], ["inspect", "a.usda"], ["watch", "a.usda"],
        ["rig", "a.usda", "-o", "c.usda"],
    ],
)  # fmt: skip
def test_every_command_on_a_shot_shows_its_progress_as_it_is_asked_to(words, capsys):
    args = build_parser().parse_args([*words, "--openjd", "--progress"])
    with progress_display(args) as display:
        display(Progress("Stage", 0.5, "half"))
    told = capsys.readouterr()
    assert "openjd_status: Stage: half" in told.out and "progress\tStage\t0.5000\thalf" in told.err
