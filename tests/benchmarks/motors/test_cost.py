"""The benchmark of motors' cost: its rows, its status, and the arm that it measures."""

import json

import numpy as np
from calmotion.benchmarks.motors import cost
from calmotion.benchmarks.scenes.rigid_arm import rigid_arm
from calmotion.simulation.compiled_shot import compile_shot


def test_rows_have_the_coordinates_that_drives_and_servos_add(capsys):
    status = cost.main(["seven-links", "--repeats", "1", "--json"])
    rows = json.loads(capsys.readouterr().out)
    assert [row["model"] for row in rows] == ["prescribed", "drive", "servo"]
    assert [row["coordinates"] for row in rows] == [42, 49, 56]
    assert rows[0]["over_ideal"] == rows[0]["sweeps_over_ideal"] == 1.0
    assert status == int(any(row["over_ideal"] > cost.ALLOWED[row["model"]] for row in rows))


def test_times_of_actions_that_take_turns_are_medians():
    called = []
    actions = {name: lambda name=name: called.append(name) for name in "ab"}
    assert set(cost._in_turns(actions, 3)) == {"a", "b"} and called == list("ababab")


def test_links_of_the_rigid_arm_turn_about_two_axes_and_start_at_rest():
    character, animation = rigid_arm(3)
    shot = compile_shot(character, animation)
    assert shot.model.dof == 18 and [motor.joint for motor in character.motors] == [0, 1, 2]
    assert all(np.allclose(track.values[[0, -1]], 0.0, atol=1e-9) for track in animation.tracks)
