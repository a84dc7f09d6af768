"""Joints that no mesh of their body can touch."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.errors import ShotError, each
from calmotion.reduction.interfaces.far_frames import refuse_far_frames
from calmotion.usd.reading import read_shot
from small_shots import ELBOW, FORE, make_flexible, write_arm


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    return read_shot(str(write_arm(tmp_path_factory.mktemp("arm") / "shot.usda", make_flexible)))[0]


def moved(arm, position, radius=-1.0, **changes):
    """The arm with its elbow elsewhere on the flexible forearm."""

    def at(joint):
        if joint.path != ELBOW:
            return joint
        return replace(joint, frame1=replace(joint.frame1, position=np.array(position)))

    bodies = tuple(
        replace(b, flexible=replace(b.flexible, interface_radius=radius), **changes) if b.flexible else b
        for b in arm.bodies
    )
    return replace(arm, joints=tuple(map(at, arm.joints)), bodies=bodies)


@pytest.mark.parametrize(
    ("position", "radius"),
    [((0.0, 0.0, 0.0), -1.0), ((0.2, 0.0, 0.0), -1.0), ((-0.01, 0.0, 0.0), -1.0), ((0.0, 0.1, 0.0), 0.09)],
)
def test_joints_that_a_mesh_may_touch_pass(arm, position, radius):
    refuse_far_frames(moved(arm, position, radius))


@pytest.mark.parametrize(
    ("position", "radius"), [((0.2, 0.3, 0.0), -1.0), ((-0.1, 0.0, 0.0), -1.0), ((0.0, 0.1, 0.0), 0.02)]
)
def test_joints_that_no_mesh_can_touch_are_refused(arm, position, radius):
    with pytest.raises(ShotError) as error:
        refuse_far_frames(moved(arm, position, radius))
    (problem,) = each(error.value)
    assert (problem.path, problem.attribute) == (FORE, "calm:flexible:interfaceRadius")
    assert ELBOW in problem.problem and problem.remedy


def test_bodies_that_are_not_meshed_from_their_surfaces_are_left_to_the_mesher(arm):
    far = (0.2, 0.3, 0.0)
    refuse_far_frames(moved(arm, far, stiff=True))
    refuse_far_frames(moved(arm, far, surfaces=()))
    bodies = tuple(replace(b, flexible=replace(b.flexible, mesh_file="x.msh")) if b.flexible else b for b in arm.bodies)
    refuse_far_frames(replace(moved(arm, far), bodies=bodies))
