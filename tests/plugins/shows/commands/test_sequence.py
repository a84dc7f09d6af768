"""What `calmotion sequence` prints: the verdict, a table, and what to do next."""

import io

from calmotion.cli import console_on
from calmotion_plugins.shows.commands.sequence import _print
from calmotion_plugins.shows.sequence.run import Repertoire
from repertoires import member


def printed(*transitions):
    stream = io.StringIO()
    clips = [member("up", "up", "up"), member("down", "down", "down")]
    _print(Repertoire("out", clips, transitions, 1.0).report(), console_on(stream))
    return stream.getvalue()


def test_the_answer_is_first_and_the_next_command_last():
    lines = printed(member("up_to_down", "up", "down"), member("down_to_up", "down", "up")).splitlines()
    assert lines[0] == "Every clip may follow every other one."
    assert any(line.split() == ["up", "to", "down", "1.00", "s", "20", "mm", "1", "mm", "yes"] for line in lines)
    assert "wrote out/sequence.json" in lines
    assert lines[-1].startswith("next: calmotion export out/up.usda --to csv --rate 100")


def test_a_transition_that_may_not_be_played_tells_why_and_what_helps():
    limit = member("down_to_up", "down", "up", exceeded_limits=("/Arm/elbow velocity",))
    lines = printed(member("up_to_down", "up", "down"), limit).splitlines()
    assert lines[0] == "Not every clip may follow every other one."
    assert any("no: exceeds /Arm/elbow velocity" in line for line in lines)
    assert any("shortest_transition" in line and line.startswith("next: ") for line in lines)


def test_what_failed_tells_the_problem():
    failed = member("down_to_up", "down", "up", error_m=None, layer=None, problem={"problem": "no memory"})
    assert "down_to_up: no memory" in printed(failed).splitlines()
