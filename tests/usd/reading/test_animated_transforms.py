"""Animated transforms of bodies."""

from __future__ import annotations

import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, UsdGeom
from small_shots import BASE, FORE, write_arm


def read(tmp_path, edit):
    return read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0]


def move(stage, path: str, far: float) -> None:
    op = UsdGeom.Xformable(stage.GetPrimAtPath(path)).AddTranslateOp(opSuffix="moved")
    op.Set(Gf.Vec3d(0, 0, 0), 0)
    op.Set(Gf.Vec3d(far, 0, 0), 12)


@pytest.mark.parametrize("path", [BASE, "/Arm"])
def test_a_moving_root_that_is_fixed_to_the_world_is_refused_with_the_prim_that_moves_it(tmp_path, path):
    with pytest.raises(ShotError, match="holds it in the world") as caught:
        read(tmp_path, lambda stage: move(stage, path, 0.1))
    assert caught.value.path == path and "12" in caught.value.found and "kinematicEnabled" in caught.value.remedy


def test_a_root_with_samples_that_stands_still_is_fine(tmp_path):
    assert len(read(tmp_path, lambda stage: move(stage, "/Arm", 0.0)).bodies) == 3


def test_baked_transforms_of_other_bodies_give_a_note(tmp_path):
    character = read(tmp_path, lambda stage: move(stage, FORE, 0.5))
    assert any(FORE in note and "drives alone" in note for note in character.notes)
