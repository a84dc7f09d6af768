"""What follows from a shot's input alone is refused before the first mesh is made."""

import numpy as np
import pytest
from calmotion import optimize, simulate
from calmotion.errors import ShotError, each
from calmotion.host import Outcome
from calmotion.model.run import OutputPaths
from pxr import Gf, UsdGeom, UsdPhysics
from shot_edits import half_turns
from small_shots import (
    BASE,
    ELBOW,
    FORE,
    FRAMES,
    LENGTH,
    PLASTIC,
    SHOULDER,
    TARGET_POSITION,
    UPPER,
    make_flexible,
    write_arm,
)


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


def closed_chain(gap):
    """A rod from the tip to the world: one motor would do, and two contradict each other, at once by a gap [m]."""

    def edit(stage):
        tip, foot = np.array([0.4 + 0.4 * np.cos(np.radians(10)), 0, 1 - 0.4 * np.sin(np.radians(10))]), [0.9, 0, 0.6]
        xform = UsdGeom.Xform.Define(stage, "/Arm/rod")
        xform.AddTranslateOp().Set(Gf.Vec3d(*tip))
        xform.AddRotateYOp().Set(float(np.degrees(np.arctan2(tip[2] - foot[2], foot[0] - tip[0]))))
        rod = xform.GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(rod)
        UsdPhysics.MassAPI.Apply(rod).CreateMassAttr(0.2)
        UsdPhysics.MassAPI(rod).CreateDiagonalInertiaAttr(Gf.Vec3f(1e-3))
        for name, other, there, here in (
            ("tip", FORE, (LENGTH, 0, 0), 0.0),
            ("foot", BASE, (foot[0], 0, foot[2] - 1), 1.0),
        ):
            joint = UsdPhysics.RevoluteJoint.Define(stage, f"/Arm/joints/{name}")
            joint.CreateBody0Rel().SetTargets([other])
            joint.CreateBody1Rel().SetTargets(["/Arm/rod"])
            joint.CreateAxisAttr("Y")
            joint.CreateLocalPos0Attr(Gf.Vec3f(*there))
            joint.CreateLocalPos1Attr(Gf.Vec3f(here * (float(np.linalg.norm(tip - foot)) + gap), 0, 0))

    return edit


def soft(modulus):
    """A link whose own weight would flatten it."""
    return lambda stage: stage.GetPrimAtPath(PLASTIC).GetAttribute("physics:youngsModulus").Set(modulus)


def interfaces(one, other, flat=False):
    """Named interfaces of the elbow and of a weight at the tip, by their faces; the first one without area if flat."""

    def edit(stage):
        tip = UsdGeom.Xform.Define(stage, "/Arm/weight").GetPrim()
        UsdPhysics.RigidBodyAPI.Apply(tip)
        UsdPhysics.MassAPI.Apply(tip).CreateMassAttr(0.2)
        UsdPhysics.MassAPI(tip).CreateDiagonalInertiaAttr(Gf.Vec3f(1e-3))
        weld = UsdPhysics.FixedJoint.Define(stage, "/Arm/joints/weld")
        weld.CreateBody0Rel().SetTargets([FORE])
        weld.CreateBody1Rel().SetTargets(["/Arm/weight"])
        weld.CreateLocalPos0Attr(Gf.Vec3f(LENGTH, 0, 0))
        for name, joint, faces in (("elbow", ELBOW, one), ("other", "/Arm/joints/weld", other)):
            subset = UsdGeom.Subset.Define(stage, f"{FORE}/skin/{name}")
            subset.CreateElementTypeAttr("face")
            subset.CreateFamilyNameAttr("calmInterface")
            subset.CreateIndicesAttr(faces)
            subset.GetPrim().CreateRelationship("calm:interface:joint").SetTargets([joint])
        if flat:
            points = stage.GetPrimAtPath(f"{FORE}/skin").GetAttribute("points")
            corners = np.array(points.Get())
            corners[:4, 1] = 0.0
            points.Set(corners)

    return edit


def no_edit(stage):
    pass


CASES = {
    "half turns in each step": (optimize, half_turns, {}, "targetPosition"),
    "half turns in each step of a simulation": (simulate, half_turns, {}, "targetPosition"),
    "half turns in a given step": (simulate, fast, {"step": "40ms"}, "targetPosition"),
    "a cyclic shot that does not close": (simulate, open_loop, {}, "targetPosition"),
    "a pre-roll of a cyclic shot": (simulate, shot_settings(cyclic=True), {"pre_roll": 1.0}, "--pre-roll"),
    "an integrator that cannot be cyclic": (
        simulate, shot_settings(cyclic=True), {"integrator": "rk4"}, "--integrator"
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
    "no tolerance at all": (simulate, no_edit, {"tolerance": 0.0}, "--tolerance"),
    "a tolerance that is no number": (simulate, no_edit, {"tolerance": float("nan")}, "tolerance"),
    "a tolerance below rounding": (optimize, no_edit, {"tolerance": 1e-300}, "--tolerance"),
    "a tolerance beyond the character": (optimize, no_edit, {"tolerance": 1.0}, "--tolerance"),
    "a tolerance of a shot beyond the character": (
        simulate, shot_settings(tolerance=1e6), {}, "calm:retarget:tolerance"
    ),
    "a step of zero": (simulate, no_edit, {"step": 0.0}, "--step"),
    "a negative step": (optimize, no_edit, {"step": -1e-3}, "--step"),
    "a negative pre-roll": (simulate, no_edit, {"pre_roll": -1.0}, "--pre-roll"),
    "more samples than can be read": (
        optimize, no_edit, {"settings": {"usd.write": {"samples_per_second": 1e12}}}, "--samples-per-second"
    ),
    "splines and samples": (
        optimize, no_edit, {"settings": {"usd.write": {"splines": True, "samples_per_second": 100.0}}}, "--splines"
    ),
    "a second body without geometry": (simulate, no_geometry, {}, UPPER),
    "a modulus in GPa": (simulate, soft(2.0), {}, "physics:youngsModulus"),
    "a modulus in MPa": (optimize, soft(2e3), {}, "physics:youngsModulus"),
    "two interfaces on one face": (simulate, interfaces([0, 1], [1]), {}, "other"),
    "an interface without area": (simulate, interfaces([0], [1], flat=True), {}, "elbow"),
    "elements that are larger than the body": (
        simulate, no_edit, {"settings": {"fe.mesh.element_size": "5m"}}, "fe.mesh.element_size"
    ),
    "a step that is longer than the shot": (simulate, no_edit, {"step": 5.0}, "--step"),
    "a step of the shot that is longer than it": (simulate, shot_settings(timeStep=5.0), {}, "calm:retarget:timeStep"),
    "a step of the shot of next to nothing": (simulate, shot_settings(timeStep=1e-30), {}, "calm:retarget:timeStep"),
    "knots farther apart than the shot is long": (
        optimize, no_edit, {"settings": {"retarget.optimize.knot_spacing": "10s"}}, "retarget.optimize.knot_spacing"
    ),
    "knots of a shot farther apart than it is long": (
        optimize, shot_settings(knotSpacing=2.0), {}, "calm:retarget:knotSpacing"
    ),
    "more robots than can be computed": (
        optimize, no_edit, {"settings": {"retarget.optimize": {"robust": "mean", "scenarios": 99_999}}}, "scenarios"
    ),
    "more random robots than can be computed": (
        optimize, no_edit, {"settings": {"retarget.optimize": {"robust": "mean", "draws": 10**9}}}, "draws"
    ),
    "elements that are too small": (simulate, no_edit, {"settings": {"fe.mesh.element_size": "0.02mm"}}, "elementSize"),
    "motors that contradict each other later": (simulate, closed_chain(0.0), {"pre_roll": 0.0}, "/Arm/joints/"),
    "motors that contradict each other at once": (optimize, closed_chain(0.03), {"pre_roll": 0.0}, "/Arm/joints/"),
    "a pre-roll that takes too long": (simulate, no_edit, {"pre_roll": 1e7}, "--pre-roll"),
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
