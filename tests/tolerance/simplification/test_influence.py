"""How far motors move targets, against differences of poses."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.model import Follows
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_poses, target_frames
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation import rigid_run
from calmotion.simulation.inputs.curves import leaders
from calmotion.simulation.preparation import grid_of
from calmotion.simulation.rigid_run import rigid_bodies
from calmotion.tolerance.simplification.influence import influence
from linkage_arm import linkage_arm, performance
from simplification_shots import SimplificationShot, arm_with_head


def _rigid(shot):
    tree = span_tree(shot.character)
    grid = grid_of(shot.character, shot.animation, RunSettings(step=1 / 60))
    bodies = rigid_bodies(shot.character, tree, shot.meshes)
    return rigid_run.rigid_poses(shot.character, shot.animation, grid, tree, bodies)


def _of(shot):
    return influence(shot.character, _rigid(shot), leaders(shot.character))


def test_against_differences_of_poses():
    shot = arm_with_head()
    rigid = _rigid(shot)
    model, found = rigid.model, influence(shot.character, rigid, leaders(shot.character))
    largest, d = np.zeros(4), 1e-6
    for n in range(0, len(rigid.joint_angles), 3):
        for k in range(4):
            places = []
            for sign in (1.0, -1.0):
                values = model.motor_values(rigid.joint_angles[n : n + 1])
                values[0, k] += sign * d
                poses = rigid_poses(model, model.joint_angles(values))
                places.append(target_frames(model, *poses, np.zeros((1, len(model.tree.body), 0)))[0])
            largest[k] = max(largest[k], np.linalg.norm(places[0] - places[1]) / (2 * d))
    assert found == pytest.approx(largest, rel=1e-3, abs=1e-8)
    assert found[2] < 1e-12 and found[3] < 1e-12 and found[1] > 0.29


def test_of_a_linkage_every_motor_counts():
    character, meshes = linkage_arm()
    found = _of(SimplificationShot("linkage", character, performance(), meshes))
    assert np.all(found > 0.1)


def test_what_is_geared_to_a_motor_counts_with_it():
    shot = arm_with_head()
    motors = list(shot.character.motors)
    motors[1] = replace(motors[1], follows=Follows(3, 0.5, 0.0))  # the elbow follows the shaking head
    geared = replace(shot, character=replace(shot.character, motors=tuple(motors)))
    found = _of(geared)
    assert len(found) == 3
    assert found[2] == pytest.approx(0.15, rel=1e-3)


def test_only_weighted_targets_count_and_rotations_only_with_a_rotation_weight():
    shot = arm_with_head()

    def with_weights(position, rotation):
        target = replace(shot.character.targets[0], position_weight=position, rotation_weight=rotation)
        return _of(replace(shot, character=replace(shot.character, targets=(target,))))

    assert not np.any(with_weights(0.0, 0.0))
    assert with_weights(0.0, 1.0)[:2] == pytest.approx([1.0, 1.0])
    assert with_weights(1.0, 4.0)[1] == pytest.approx(with_weights(1.0, 0.0)[1] + 2.0)
