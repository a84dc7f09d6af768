"""What follows from a shot's input alone is refused before the first mesh is made."""

from __future__ import annotations

import pytest
from broken_shots import half_turns
from calmotion import optimize, simulate
from calmotion.errors import ShotError, each
from calmotion.host import Outcome
from calmotion.shot.run import OutputPaths
from small_shots import ELBOW, FORE, FRAMES, SHOULDER, TARGET_POSITION, UPPER, make_flexible, write_arm


def motor_settings(**values):
    def edit(stage):
        for path in (SHOULDER, ELBOW):
            prim = stage.GetPrimAtPath(path)
            prim.AddAppliedSchema("CalmMotorAPI")
            for name, value in values.items():
                prim.GetAttribute(f"calm:motor:{name}").Set(value)

    return edit


def shot_settings(**values):
    def edit(stage):
        prim = stage.GetPrimAtPath("/Arm")
        prim.AddAppliedSchema("CalmRetargetAPI")
        for name, value in values.items():
            prim.GetAttribute(f"calm:retarget:{name}").Set(value)

    return edit


def limited_effort(stage):
    stage.GetPrimAtPath(ELBOW).GetAttribute("drive:angular:physics:maxForce").Set(10.0)


def open_loop(stage):
    shot_settings(cyclic=True)(stage)
    stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Set(12.0, FRAMES)


def fast(stage):
    """A motor that turns by 200 degrees from frame to frame: too fast for long steps alone."""
    for frame in range(FRAMES + 1):
        stage.GetPrimAtPath(SHOULDER).GetAttribute(TARGET_POSITION).Set(200.0 * (frame % 2), frame)


def short(stage):
    stage.SetEndTimeCode(2)
    shot_settings(endpoints="kept")(stage)


def one_frame(stage):
    stage.SetEndTimeCode(0)


def no_geometry(stage):
    """A second flexible body, whose surface is open."""
    make_flexible(stage, UPPER)
    stage.RemovePrim(f"{UPPER}/box")


def no_edit(stage):
    pass


CASES = {
    "half turns in each step": (optimize, half_turns, {}, "targetPosition"),
    "half turns in each step of a simulation": (simulate, half_turns, {}, "targetPosition"),
    "half turns in a given step": (simulate, fast, {"step": "40ms"}, "targetPosition"),
    "a cyclic shot that does not close": (simulate, open_loop, {}, "targetPosition"),
    "a pre-roll of a cyclic shot": (simulate, shot_settings(cyclic=True), {"pre_roll": 1.0}, "--pre-roll"),
    "an integrator that cannot be cyclic": (
        simulate, shot_settings(cyclic=True), {"integrator": "radau"}, "--integrator"
    ),
    "locked motors": (optimize, motor_settings(optimize=False), {}, "calm:motor:optimize"),
    "too short for kept ends": (optimize, short, {}, "calm:retarget:endpoints"),
    "a continuous adjoint of efforts": (
        optimize, limited_effort, {"adjoint": "continuous"}, "retarget.optimize.adjoint"
    ),
    "a continuous adjoint of a cyclic shot": (
        optimize, shot_settings(cyclic=True), {"adjoint": "continuous"}, "retarget.optimize.adjoint"
    ),
    "another integrator": (optimize, no_edit, {"integrator": "rk4"}, "--integrator"),
    "a shaper that is none": (simulate, no_edit, {"shaper": "zdv"}, "--shaper"),
    "a shot of one frame": (simulate, one_frame, {}, "endTimeCode"),
    "splines and samples": (
        optimize, no_edit, {"settings": {"usd.write": {"splines": True, "samples_per_second": 100.0}}}, "--splines"
    ),
    "a table of curves without a file": (optimize, no_edit, {"operators": ["curves.export"]}, "curves.export.file"),
    "a table of curves on a folder": (
        simulate, no_edit, {"operators": ["curves.export"], "settings": {"curves.export.file": "."}},
        "curves.export.file",
    ),
    "a second body without geometry": (simulate, no_geometry, {}, UPPER),
    "a joint away from its body": (
        simulate, lambda stage: stage.GetPrimAtPath(ELBOW).GetAttribute("physics:localPos1").Set((0.0, 0.3, 0.0)), {},
        "interfaceRadius",
    ),
    "elements that are too small": (simulate, no_edit, {"settings": {"fe.mesh.element_size": "0.02mm"}}, "elementSize"),
    "a pre-roll that takes too long": (simulate, no_edit, {"pre_roll": 1e7}, "endTimeCode"),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_it_is_refused_before_a_mesh_is_made(tmp_path, name):
    command, edit, options, place = CASES[name]

    def make(stage):
        make_flexible(stage, FORE)
        edit(stage)

    shot, seen = write_arm(tmp_path / "shot.usda", make), []
    outputs = OutputPaths(layer=str(tmp_path / "calm.usda"))
    with pytest.raises(ShotError) as refused:
        command(shot, outputs=outputs, on_operator=seen.append, **options)
    problems = each(refused.value)
    assert any(place in problem.place and problem.remedy for problem in problems), refused.value.message()
    made = {result.idname for result in seen if result.outcome == Outcome.DONE}
    assert "fe.mesh" not in made
    assert not (tmp_path / "calm.usda").exists()
