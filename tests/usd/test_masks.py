"""Large stages: what is read of a character does not depend on the set around it, and far prims are not looked at."""

import pytest
from calmotion.reduction.cache import cache_key
from calmotion.usd import masks
from calmotion.usd.reading.bodies import scenery
from calmotion.usd.reading.shot import read_shot
from calmotion.usd.stages import open_stage
from pxr import Gf, Sdf, UsdGeom
from small_shots import HAND, make_flexible, make_target, write_arm

FAR, NEAR = 60, 3


def with_set(stage):
    """The arm with a target and a flexible link, boxes far away in groups, and some near it."""
    make_flexible(stage)
    make_target(stage, HAND, positionWeight=1.0)
    for k in range(FAR + NEAR):
        cube = UsdGeom.Cube.Define(stage, f"/Set/{'far' if k < FAR else 'near'}/box{k}")
        cube.CreateSizeAttr(0.1)
        cube.AddTranslateOp().Set(Gf.Vec3d(500.0 + k, 0.0, 0.0) if k < FAR else Gf.Vec3d(0.3, 0.4, 0.1 * k - 6.0))
        cube.CreateExtentAttr([(-0.05, -0.05, -0.05), (0.05, 0.05, 0.05)])
    stage.GetPrimAtPath("/Set/far/box0").CreateAttribute("note", Sdf.ValueTypeNames.String).Set("nothing")


@pytest.fixture
def path(tmp_path):
    return str(write_arm(tmp_path / "shot.usda", with_set))


def test_a_large_stage_is_read_as_a_small_one(path, monkeypatch):
    small = read_shot(path)
    monkeypatch.setattr(masks, "LARGE", 20)
    stage = open_stage(path)
    part = masks.masked(stage)
    assert part != stage and not part.GetPrimAtPath("/Set/far/box0") and part.GetPrimAtPath("/Arm/fore/hand")
    assert part.GetPrimAtPath("/Arm/materials/Plastic"), "materials are what bodies refer to"
    large = read_shot(path)
    for one, two in zip(small, large, strict=True):
        assert cache_key(one) == cache_key(two)
    assert len(large[0].scenery) == NEAR


def test_a_stage_that_is_not_large_is_read_whole(path):
    stage = open_stage(path)
    assert masks.masked(stage) is stage


def test_bodies_in_instances_are_in_the_mask_of_their_instance(tmp_path, monkeypatch):
    monkeypatch.setattr(masks, "LARGE", 5)
    write_arm(tmp_path / "arm.usda")

    def reference(stage):
        prim = UsdGeom.Xform.Define(stage, "/World/arm").GetPrim()
        prim.GetReferences().AddReference(str(tmp_path / "arm.usda"))
        prim.SetInstanceable(True)

    path = str(write_arm(tmp_path / "shot.usda", reference))
    part = masks.masked(open_stage(path))
    assert part.GetPrimAtPath("/World/arm/fore/hand") and part.GetPrimAtPath("/Arm/fore/hand")


def test_far_groups_are_left_out_by_their_boxes(path, monkeypatch):
    seen = []
    surface = scenery._surface
    monkeypatch.setattr(
        scenery, "_surface", lambda reading, prim: seen.append(prim.GetName()) or surface(reading, prim)
    )
    character = read_shot(path)[0]
    assert len(character.scenery) == NEAR and len(seen) == NEAR
