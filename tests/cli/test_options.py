"""Options that commands share, and the completion of shells."""

import subprocess

import pytest
from calmotion.cli.commands.completion import SHELLS
from calmotion.cli.main import build_parser, main
from calmotion.cli.options import KINDS, assignments
from calmotion.shot import model_choice


def test_the_command_line_has_every_kind():
    assert KINDS == model_choice.KINDS


def test_options_of_the_writer_are_stronger_than_assignments():
    arguments = ["optimize", "a.usda", "-o", "b.usda", "--bake", "--set", "usd.write.bake=simulated", "--splines"]
    args = build_parser().parse_args(arguments)
    assert assignments(args) == {"usd.write": {"bake": "motors", "splines": True}}


@pytest.mark.parametrize("shell", SHELLS)
def test_completion_names_commands_and_options(shell, capfd):
    assert main(["completion", shell]) == 0
    script = capfd.readouterr().out
    assert "optimize" in script and "tolerance" in script


def test_bash_takes_the_completion(capfd, tmp_path):
    main(["completion", "bash"])
    script = capfd.readouterr().out
    asked = "COMP_WORDS=(calmotion opt); COMP_CWORD=1; COMPREPLY=(); _shtab_calmotion; echo ${COMPREPLY[@]}"
    done = subprocess.run(["bash", "-c", f"{script}\n{asked}"], capture_output=True, text=True)
    assert done.stdout.strip() == "optimize", done.stderr
