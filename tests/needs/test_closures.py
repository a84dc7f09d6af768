"""Loops: redundant rows by Gruebler's count, and joints that hold nothing."""

import numpy as np
import pytest
from calmotion.dynamics.topology import span_tree
from calmotion.evidence.linkage_arm import linkage_arm, performance
from calmotion.evidence.needs_shots import NeedsShot, clevis_arm, plastic_arm
from calmotion.needs.closures import Closures, closures_of
from calmotion.retarget.excitation import rigid_bodies, rigid_run
from calmotion.retarget.prepare import Options, grid_of


def _of(shot):
    tree = span_tree(shot.character)
    grid = grid_of(shot.character, shot.animation, Options(step=1 / 60))
    model, run = rigid_run(
        shot.character, shot.animation, grid, tree, rigid_bodies(shot.character, tree, shot.meshes)
    )  # fmt: skip
    return closures_of(model, run), tree


def test_no_loops():
    assert _of(plastic_arm())[0] == Closures()


def test_a_planar_four_bar_has_three_redundant_rows_and_needs_its_joint():
    character, meshes = linkage_arm()
    found, tree = _of(NeedsShot("linkage", character, performance(), meshes))
    assert found.joints == (len(tree.body),)
    assert found.redundant_rows == 3
    assert found.redundant == ()


@pytest.mark.parametrize("links", [1, 3])
def test_the_second_pin_of_a_clevis_holds_nothing(links):
    shot = clevis_arm(links)
    found, tree = _of(shot)
    assert found.redundant_rows == 5 * links
    assert found.redundant == found.joints
    names = [shot.character.joints[tree.loops[k - len(tree.body)]].path for k in found.redundant]
    assert all("Right" in name for name in names) and len(names) == links


def test_pins_that_are_out_of_line_are_no_second_pins():
    shot = clevis_arm(1)
    joints = list(shot.character.joints)
    frame = joints[1].frame0
    tilted = type(frame)(frame.position, np.array([np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]))
    from dataclasses import replace

    joints[1] = replace(joints[1], kind="spherical", frame0=tilted)
    found, _ = _of(replace(shot, character=replace(shot.character, joints=tuple(joints))))
    # a ball on the hinge's axis still holds nothing
    assert found.redundant == found.joints
