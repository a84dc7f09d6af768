"""Local poses of bodies and the motors' values in them: round trips, closed chains, moving roots."""

import dataclasses

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Provenance
from calmotion.workflow.run import carry_out
from calmotion_plugins.controller_export.controller_files import curves_of
from calmotion_plugins.controller_export.formats.body_poses import (
    body_tree,
    local_poses,
    motor_values,
    near_turn,
    upward,
)
from one_hinge import ONE_HINGE
from six_hinges import LENGTH, six_hinges, smooth, track_values


def curves(path):
    return curves_of(carry_out(cm.open_shot(path), "simulate", wanted=(Character, Animation, Provenance)), None)


@pytest.fixture
def arm(tmp_path):
    (tmp_path / "arm.usda").write_text(six_hinges())
    return curves(tmp_path / "arm.usda")


def test_pivots_of_hinges_stand_still_and_their_rotations_are_the_angles(arm):
    bodies = body_tree(arm)
    poses = local_poses(bodies, arm, 48.0)
    np.testing.assert_allclose(poses.translations[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(poses.translations[:, 1:], np.broadcast_to([0.0, 0.0, LENGTH], (49, 5, 3)), atol=1e-7)
    np.testing.assert_allclose(2.0 * np.arccos(np.abs(poses.rotations[..., 0])), np.abs(smooth(poses.times)), atol=1e-6)
    np.testing.assert_allclose(motor_values(bodies, poses), smooth(poses.times), atol=1e-6)


def test_whole_turns_are_those_of_the_curves(arm):
    far = np.array([7.0, 0.0, -13.0, 0.0, 0.0, 0.0])
    values = near_turn(track_values() + far, arm)
    np.testing.assert_allclose(values[0], far - [2.0 * np.pi, 0.0, -4.0 * np.pi, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("down", [(0, 0, -9.81), (0, -9.81, 0), (0, 9.81, 0), (0, 0, 0), (1, 2, 3)])
def test_up_becomes_y(arm, down):
    character = dataclasses.replace(arm.character, gravity=np.array(down, float))
    up = -character.gravity if any(down) else np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(upward(character).apply(up / np.linalg.norm(up)), [0.0, 1.0, 0.0], atol=1e-12)


def body(name, x, z, mass=0.3):
    api = '"PhysicsRigidBodyAPI", "PhysicsMassAPI"'
    tip = (
        '        def Xform "Tip" (prepend apiSchemas = ["CalmTargetAPI"])\n        {\n        }\n'
        if name == "B"
        else ""
    )
    weight = "" if mass is None else f"        float physics:mass = {mass}\n"
    return (
        f'    def Xform "{name}" (prepend apiSchemas = [{api}])\n    {{\n{weight}'
        "        float3 physics:diagonalInertia = (0.001, 0.001, 0.001)\n"
        f"        double3 xformOp:translate = ({x}, 0, {z})\n"
        f'        uniform token[] xformOpOrder = ["xformOp:translate"]\n{tip}    }}\n'
    )


def hinge(name, bodies, places, more="", api=""):
    rels = "".join(f"        rel physics:body{k} = </R/{b}>\n" for k, b in enumerate(bodies) if b)
    points = "".join(f"        point3f physics:localPos{k} = ({x}, 0, {z})\n" for k, (x, z) in enumerate(places))
    return (
        f'    def PhysicsRevoluteJoint "{name}"{api}\n    {{\n        uniform token physics:axis = "Y"\n'
        f"{rels}{points}{more}    }}\n"
    )


PARALLELOGRAM = (
    ONE_HINGE.split("def Xform")[0].replace('"Robot"', '"R"')
    + 'def Xform "R" (prepend apiSchemas = ["PhysicsArticulationRootAPI"])\n{\n'
    + body("A", 0, 0) + body("B", 0.3, 0) + body("C", 0, 0.2)
    + hinge(
        "M", (None, "A"), ((0, 0), (0, 0)),
        "        float drive:angular:physics:targetPosition.timeSamples = { 0: 0, 8: 12, 16: 30, 24: 35 }\n",
        ' (prepend apiSchemas = ["PhysicsDriveAPI:angular"])',
    )
    + hinge("BG", (None, "B"), ((0.3, 0), (0, 0))) + hinge("AC", ("A", "C"), ((0, 0.2), (0, 0)))
    + hinge("CB", ("C", "B"), ((0.3, 0), (0, 0.2)), "        uniform bool physics:excludeFromArticulation = true\n")
    + "}\n"
)  # fmt: skip


def test_passive_joints_of_a_closed_chain_follow(tmp_path):
    (tmp_path / "r.usda").write_text(PARALLELOGRAM)
    chain = curves(tmp_path / "r.usda")
    bodies = body_tree(chain)
    assert bodies.tree.closing
    poses = local_poses(bodies, chain, 24.0)
    angle = chain.at(poses.times)[:, 0]
    turned = {
        one.path: 2.0 * np.arctan2(poses.rotations[:, k, 2], poses.rotations[:, k, 0])
        for k, one in enumerate(bodies.bodies)
    }
    np.testing.assert_allclose(turned["/R/A"], angle, atol=1e-6)
    # both cranks stay parallel, and the coupler level
    np.testing.assert_allclose(turned["/R/B"], angle, atol=1e-4)
    np.testing.assert_allclose(turned["/R/C"], -angle, atol=1e-4)
    np.testing.assert_allclose(motor_values(bodies, poses)[:, 0], angle, atol=1e-6)


def test_a_closed_chain_without_masses_is_refused(tmp_path):
    (tmp_path / "r.usda").write_text(PARALLELOGRAM)
    chain = curves(tmp_path / "r.usda")
    light = dataclasses.replace(chain.character.bodies[0], mass=None)
    robot = dataclasses.replace(chain.character, bodies=(light, *chain.character.bodies[1:]))
    without = dataclasses.replace(chain, character=robot)
    with pytest.raises(ShotError, match="mass of each body"):
        local_poses(body_tree(without), without, 24.0)


def test_a_moving_root_carries_the_bodies(tmp_path):
    base = (
        '    def Xform "Base"\n    {\n'
        "        double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 24: (0.3, 0, 0.2) }\n"
        "        float xformOp:rotateZ.timeSamples = { 0: 0, 24: 40 }\n"
        '        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ"]\n    }\n'
    )
    text = six_hinges().replace('    def Xform "Link1"', base + '    def Xform "Link1"')
    text = text.replace(
        "        rel physics:body1 = </Arm/Link1>",
        "        rel physics:body0 = </Arm/Base>\n        rel physics:body1 = </Arm/Link1>",
    )
    (tmp_path / "arm.usda").write_text(text)
    arm = curves(tmp_path / "arm.usda")
    assert arm.animation.moving
    bodies = body_tree(arm)
    poses = local_poses(bodies, arm, 24.0)
    np.testing.assert_allclose(
        poses.translations[[0, 12, 24], 0], [[0, 0, 0], [0.15, 0, 0.1], [0.3, 0, 0.2]], atol=1e-6
    )
    np.testing.assert_allclose(motor_values(bodies, poses), smooth(poses.times), atol=1e-6)
