"""Which free joints stand in neutral equilibrium, and that a shot with them says so."""

import calmotion as cm
import numpy as np
import pytest
from arms import chain, compiled
from calmotion.multibody.analysis.joint_faults import dead_centres, unheld_joints
from neutral_hinges import push_rod, turning
from pxr import UsdPhysics
from small_shots import ELBOW, FORE, TARGET_POSITION, write_arm

DOWN, ASIDE = (0.0, 0.0, -9.81), (0.0, -9.81, 0.0)


@pytest.mark.parametrize(("scene", "expected"), [
    (turning(DOWN), [1]), (turning(ASIDE, 0.1), [1]), (turning(DOWN, 0.1), []), (push_rod(DOWN), []),
    (chain(2, driven=(0,)), []), (chain(2, driven=(0, 1)), []),
], ids=["wheel", "door", "pendulum", "linkage", "hinge", "motors"])  # fmt: skip
def test_wheels_and_doors_stand_where_they_are_put(scene, expected):
    model = compiled(scene)
    angles = np.zeros(len(model.motor))
    assert unheld_joints(model, angles) == expected


def test_a_carriage_that_nothing_drives_keeps_its_place_and_the_report_says_so(tmp_path):
    def edit(stage):
        prim = stage.GetPrimAtPath(ELBOW)
        prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
        prim.RemoveProperty(TARGET_POSITION)
        prim.SetTypeName("PhysicsPrismaticJoint")
        UsdPhysics.PrismaticJoint(prim).GetAxisAttr().Set("Y")
        for name in ("lower", "upper"):
            prim.RemoveProperty(f"physics:{name}Limit")

    result = cm.simulate(write_arm(tmp_path / "arm.usda", edit), step=1 / 120, pre_roll=0.0)
    assert any(row.what == f"{ELBOW}: starts where the shot has it" for row in result.result.left_out)
    motion = result.result.before.motion
    fore = next(k for k, body in enumerate(result.shot.character.bodies) if body.path == FORE)
    # the arm turns about y, along which the carriage is free: nothing pushes it
    np.testing.assert_allclose(motion.positions[:, fore, 1], 0.0, atol=1e-9)
    assert np.ptp(motion.positions[:, fore, 2]) > 0.1


def test_sharp_minima_far_below_what_is_usual_are_named():
    t = np.linspace(0.0, 2.0 * np.pi, 201)
    margins = 1e-3 * np.abs(np.cos(t)) + 1e-9
    margins[0] = 0.0  # before the first step nothing is known
    assert dead_centres(margins) == [50, 150]


def test_smooth_minima_and_trees_without_closed_chains_are_not_named():
    t = np.linspace(0.0, 2.0 * np.pi, 201)
    assert dead_centres(1e-3 * (2.0 + np.cos(t))) == []
    assert dead_centres(np.zeros(201)) == [] and dead_centres(np.zeros(2)) == []
