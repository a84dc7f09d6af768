"""The help: one screen by task, with examples that the commands accept."""

import shlex

import pytest
from calmotion.cli import parser as texts
from calmotion.cli.commands.table import all_commands
from calmotion.cli.main import build_parser, main

PRESENT = {name: command for name, command in all_commands().items() if not command.disabled}
EXAMPLES = {name: getattr(command.load(), "EXAMPLES", ()) for name, command in PRESENT.items()}
COMMANDS = next(action for action in build_parser()._actions if action.choices and "inspect" in action.choices).choices


def test_the_overview_is_one_screen_and_names_every_command(capsys):
    assert main([]) == 2
    shown = capsys.readouterr().err
    with pytest.raises(SystemExit):
        build_parser().parse_args(["--help"])
    assert capsys.readouterr().out == shown
    lines = shown.splitlines()
    assert len(lines) < 50 and max(map(len, lines)) < 90
    for name in COMMANDS:
        assert any(line.startswith(f"  {name} ") for line in lines), name


@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_are_accepted_and_shown(name):
    for line, purpose in EXAMPLES[name]:
        program, *arguments = shlex.split(line)
        assert program == "calmotion" and arguments[0] == name
        build_parser().parse_args(arguments)
        shown = COMMANDS[name].format_help()
        assert line in shown and purpose in shown and f"usage: calmotion {name}" in shown


def test_wrong_usage_is_answered_in_three_lines(capsys):
    for arguments in (["optimize"], ["optimze", "x"], ["simulate", "shot.usda", "--stp", "1ms"]):
        assert main(arguments) == 2
        said = capsys.readouterr().err.strip()
        assert len(said.splitlines()) <= 3 and "error: " in said and "--help" in said


def test_a_command_of_several_names_them(capsys):
    assert main(["cache"]) == 2
    assert "its commands are info, clear, prune" in capsys.readouterr().err


def test_a_command_that_belongs_to_no_task_is_listed_as_well():
    shown = texts.overview({"inspect": "look", "dance": "do something new"})
    assert "  dance " in shown and shown.index("Prepare") < shown.index("dance")
    assert "Remove the shake" not in shown, "no heading without commands"


def test_what_a_command_alone_has_comes_before_what_all_have(capsys):
    assert main(["optimize", "--help"]) == 0
    printed = capsys.readouterr().out
    heads = ("\n  --verify", "\noutputs:", "\nsimulation:", f"\n{texts.SHARED}:", "\n  --json", "\nexamples:")
    places = [printed.index(head) for head in heads]
    assert places == sorted(places)


def test_options_before_the_command_are_told_where_they_stand(capsys):
    assert main(["--json", "simulate", "a.usda"]) == 2
    assert "there is no option --json. Options stand behind the command." in capsys.readouterr().err
