"""Scenery: still geometry that belongs to no body is read for pictures, and never makes a shot fail."""

import numpy as np
import pytest
from calmotion.usd.reading import read_shot
from calmotion.usd.reading.bodies import scenery
from pxr import Gf, UsdGeom, Vt
from small_shots import Scale, box, write_arm


def scenery_of(tmp_path, edit):
    return {s.path: s for s in read_shot(str(write_arm(tmp_path / "arm.usda", edit)))[0].scenery}


def test_still_geometry_is_read_in_metres_and_world_axes_with_its_colour(tmp_path):
    def edit(stage):
        table = UsdGeom.Cube.Define(stage, "/Set/Table")
        table.CreateSizeAttr(0.2)
        table.CreateDisplayColorAttr([(0.1, 0.2, 0.3)])
        table.AddTranslateOp().Set(Gf.Vec3d(0.1, 0.2, 0.7))
        mirrored = box(stage, "/Set/Mirrored", Scale())
        mirrored.AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))

    read = scenery_of(tmp_path, edit)
    assert set(read) == {"/Set/Table", "/Set/Mirrored"}
    assert read["/Set/Table"].color == pytest.approx((0.1, 0.2, 0.3))
    np.testing.assert_allclose(read["/Set/Table"].points.mean(axis=0), (0.1, 0.2, 0.7), atol=1e-9)
    corners = read["/Set/Mirrored"].points[read["/Set/Mirrored"].triangles]
    assert np.einsum("na,na->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) > 0.0, "it faces outwards"


def test_what_moves_is_hidden_broken_far_or_a_landscape_is_left_out(tmp_path, monkeypatch):
    def edit(stage):
        moving = UsdGeom.Xform.Define(stage, "/Set/Moving")
        move = moving.AddTranslateOp()
        for time in (0.0, 10.0):
            move.Set(Gf.Vec3d(time, 0, 0), time)
        UsdGeom.Cube.Define(stage, "/Set/Moving/Cube").CreateSizeAttr(0.1)
        UsdGeom.Cube.Define(stage, "/Set/Hidden").CreateVisibilityAttr("invisible")
        UsdGeom.Cube.Define(stage, "/Set/Guide").CreatePurposeAttr("guide")
        UsdGeom.Cube.Define(stage, "/Set/Sky").CreateSizeAttr(500.0)
        UsdGeom.Cube.Define(stage, "/Set/Far").AddTranslateOp().Set(Gf.Vec3d(900, 0, 0))
        broken = box(stage, "/Set/Broken", Scale())
        broken.GetFaceVertexIndicesAttr().Set(Vt.IntArray([99] * 24))
        stage.DefinePrim("/Set/Skinned", "SkelRoot")
        UsdGeom.Cube.Define(stage, "/Set/Skinned/Skin").CreateSizeAttr(0.1)
        for name in "AB":
            UsdGeom.Cube.Define(stage, f"/Set/{name}").CreateSizeAttr(0.1)

    assert set(scenery_of(tmp_path, edit)) == {"/Set/A", "/Set/B"}
    monkeypatch.setattr(scenery, "MOST_TRIANGLES", 12)
    assert set(scenery_of(tmp_path, edit)) == {"/Set/A"}
