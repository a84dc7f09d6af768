"""Loops: redundant rows by Gruebler's count, and joints that hold nothing."""

from dataclasses import replace

import pytest
from calmotion.model import Motor
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.preparation import grid_of
from calmotion.simulation.rigid_run import rigid_bodies, rigid_poses
from calmotion.tolerance.simplification.redundant_constraints import Closures, closures_of
from linkage_arm import linkage_arm, performance
from simplification_shots import SimplificationShot, clevis_arm, plastic_arm


def _of(shot):
    tree = span_tree(shot.character)
    grid = grid_of(shot.character, shot.animation, RunSettings(step=1 / 60))
    bodies = rigid_bodies(shot.character, tree, shot.meshes)
    return closures_of(rigid_poses(shot.character, shot.animation, grid, tree, bodies)), tree


def test_trees_have_no_closed_chains():
    assert _of(plastic_arm())[0] == Closures()


def test_a_planar_four_bar_has_three_redundant_rows_and_needs_its_joint():
    character, meshes = linkage_arm()
    found, tree = _of(SimplificationShot("linkage", character, performance(), meshes))
    assert found.joints == (len(tree.body),)
    assert found.redundant_rows == 3
    assert found.redundant == ()


@pytest.mark.parametrize("links", [1, 3])
def test_the_second_pin_of_a_clevis_carries_no_load(links):
    shot = clevis_arm(links)
    found, tree = _of(shot)
    assert found.redundant_rows == 5 * links
    assert found.redundant == found.joints
    names = [shot.character.joints[tree.closing[k - len(tree.body)]].path for k in found.redundant]
    assert all("Right" in name for name in names) and len(names) == links


def test_a_ball_joint_on_the_axis_of_a_hinge_does_not_lock_it_either():
    shot = clevis_arm(1)
    joints = list(shot.character.joints)
    joints[1] = replace(joints[1], kind="spherical")
    found, _ = _of(replace(shot, character=replace(shot.character, joints=tuple(joints))))
    assert found.redundant_rows == 3 and found.redundant == found.joints


def test_a_motor_on_a_second_pin_is_kept_for_its_effort():
    shot = clevis_arm(1)
    motors = (*shot.character.motors, Motor(1, shot.character.joints[1].path, shot.character.motors[0].attribute))
    tracks = shot.animation.tracks * 2
    animation = replace(shot.animation, tracks=tracks, current=tracks)
    found, _ = _of(replace(shot, character=replace(shot.character, motors=motors), animation=animation))
    assert found.redundant_rows == 6 and found.redundant == ()
