"""Real robots, read whole."""

from __future__ import annotations

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.model import WORLD
from calmotion.usd.reading import read_shot
from calmotion.usd.transforms import rotation_from_quaternion
from small_shots import FRAMES, make_flexible, write_arm


def gaps(character) -> list[float]:
    """Distance of the two anchors of each joint at the rest pose."""
    found = []
    for joint in character.joints:
        ends = []
        for body, frame in ((joint.body0, joint.frame0), (joint.body1, joint.frame1)):
            if body == WORLD:
                ends.append(frame.position)
            else:
                rest = character.bodies[body].rest
                ends.append(rest.position + rotation_from_quaternion(rest.rotation) @ frame.position)
        found.append(float(np.linalg.norm(ends[0] - ends[1])))
    return found


def test_provenance_says_where_the_shot_came_from(tmp_path):
    path = str(write_arm(tmp_path / "arm.usda"))
    _, animation, provenance = read_shot(path)
    assert provenance.shot == path and provenance.default_prim == "Arm" and provenance.earlier_layers == ()
    assert (provenance.meters_per_unit, provenance.kilograms_per_unit, provenance.up_axis) == (1.0, 1.0, "Z")
    assert (provenance.start_time_code, provenance.end_time_code) == (0.0, FRAMES)
    assert len(animation.frame_times) == FRAMES + 1


def test_binary_and_packaged_shots_read_the_same(tmp_path):
    from pxr import Sdf, UsdUtils

    path = write_arm(tmp_path / "arm.usda", make_flexible)
    Sdf.Layer.FindOrOpen(str(path)).Export(str(tmp_path / "arm.usdc"))
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "arm.usdc"), str(tmp_path / "arm.usdz"))
    first = read_shot(str(path))[0]
    for name in ("arm.usdc", "arm.usdz"):
        other, _, provenance = read_shot(str(tmp_path / name))
        assert [b.path for b in other.bodies] == [b.path for b in first.bodies]
        assert provenance.layers[0].path == name and len(provenance.layers) == 1


@pytest.mark.parametrize("name", ["g1_dual_arm_hands_chop", "g1_dual_arm_disco"])
def test_the_g1_has_two_arms_of_seven_motors(shared_data, name):
    character, animation, provenance = read_shot(str(shared_data / "shots" / f"{name}.usda"))
    assert (len(character.bodies), len(character.joints), len(character.motors)) == (14, 14, 14)
    assert sum(j.body0 == WORLD for j in character.joints) == 2
    assert {t.path.split("/")[-1] for t in character.targets} == {"left_wrist_yaw_link", "right_wrist_yaw_link"}
    assert sum(b.mass.mass for b in character.bodies) == pytest.approx(7.0381, abs=1e-3)
    assert max(gaps(character)) < 1e-6
    assert len(animation.frame_times) == 480 and animation.frame_times[-1] == pytest.approx(479 / 60)
    assert len(provenance.layers) >= 6
    inertias = [np.linalg.eigvalsh(b.mass.inertia) for b in character.bodies]
    assert all(low > 0 and high < a + low for low, a, high in inertias)


def test_a_copy_of_a_mesh_for_collisions_is_not_shown_twice(shared_data):
    character, _, _ = read_shot(str(shared_data / "shots" / "g1_dual_arm_hands_chop.usda"))
    elbow = next(b for b in character.bodies if b.path.endswith("left_elbow_link"))
    assert [s.visible for s in elbow.surfaces] == [True, False]


def test_the_legs_keep_their_closed_chains_and_end_at_the_feet(shared_data):
    character, animation, _ = read_shot(str(shared_data / "shots" / "dr_legs_walk.usda"))
    assert (len(character.bodies), len(character.motors)) == (31, 12)
    assert sum(j.kind == "revolute" for j in character.joints) == 36
    assert len(character.joints) - len(character.bodies) == 6  # closed loops
    assert {t.path.split("/")[-1] for t in character.targets} == {"foot_l", "foot_r"}
    assert max(gaps(character)) < 2e-6
    assert len(animation.frame_times) == 800


def test_a_robot_without_animation_is_refused(shared_data):
    with pytest.raises(ShotError, match="motor without animation") as caught:
        read_shot(str(shared_data / "converted" / "kuka_iiwa_14" / "iiwa14.usda"))
    assert "joint" in caught.value.path and "time samples" in caught.value.remedy


def test_a_real_missing_reference_is_refused(shared_data):
    with pytest.raises(ShotError, match=r"surfaces\.usd") as caught:
        read_shot(str(shared_data / "robots" / "dr_legs" / "usd" / "dr_legs.usda"))
    assert caught.value.attribute == "references"
