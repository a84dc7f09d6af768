"""Options of commands on many shots: what is passed on to each shot is accepted there, with the same meaning."""

import os

import pytest
from calmotion.cli.main import build_parser
from calmotion.host import SettingError
from calmotion_plugins.shows.commands.forwarding import command_of, extras_of, forwarded

GIVEN = (
    "--tolerance", "0.5mm", "--step", "2ms", "--pre-roll", "1s", "--keep", "modes", "--leave-out", "turning",
    "--verify", "--strict", "--robust", "mean", "--scenarios", "5", "--bake", "--splines",
    "--motors", "ideal", "--set", "fe.mesh.element_size=5mm", "--run", "speed_watch.report", "--settings", "s.toml",
    "--plugins", "more", "--retime", "slowest=1.5,fastest=0.9",
)  # fmt: skip
SAME = (
    "tolerance", "step", "pre_roll", "keep", "leave_out", "verify", "strict", "robust", "scenarios", "bake",
    "splines", "motors", "set", "run", "retime",
)  # fmt: skip


@pytest.mark.parametrize("command", [("batch",), ("submit", "--openjd", "job.yaml")])
def test_options_have_the_same_meaning_for_each_shot(command):
    parser = build_parser()
    args = parser.parse_args([*command, "shot.usda", "-o", "out", "--csv", *GIVEN])
    assert command_of(args) == "optimize" and extras_of(args) == ("csv",)
    one = parser.parse_args(["optimize", "shot.usda", "-o", "layer.usda", *forwarded(args)])
    direct = parser.parse_args(["optimize", "shot.usda", "-o", "layer.usda", *GIVEN])
    for name in SAME:
        assert getattr(one, name) == getattr(direct, name), name
    assert one.settings == os.path.abspath("s.toml") and one.plugins == [os.path.abspath("more")]


def test_simulations_refuse_options_of_searches():
    parser = build_parser()
    simulated = ["batch", "shot.usda", "-o", "out", "--simulate", "--integrator", "newmark"]
    args = parser.parse_args(simulated)
    line = forwarded(args)
    assert command_of(args) == "simulate" and line == ["--integrator=newmark"]
    assert parser.parse_args(["simulate", "shot.usda", *line]).integrator == "newmark"
    for given in (["--scenarios", "5"], ["--robust"], ["--retime"]):
        with pytest.raises(SettingError, match=f"{given[0]} belongs to `calmotion optimize`"):
            forwarded(parser.parse_args([*simulated, *given]))


def test_sequences_keep_the_tempo_of_their_clips(capsys):
    with pytest.raises(SystemExit):
        build_parser().parse_args(["sequence", "clips.toml", "-o", "out", "--retime"])
    assert "--retime" in capsys.readouterr().err


def test_without_options_nothing_is_passed_on():
    assert forwarded(build_parser().parse_args(["batch", "shot.usda", "-o", "out"])) == []
