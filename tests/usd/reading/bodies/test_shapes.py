"""Geometry of a body: frames, orientation, copies, colours, tetrahedra."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Gf, UsdGeom, UsdPhysics, Vt
from small_shots import FORE, LENGTH, UPPER, WIDTH, Scale, box, make_flexible, write_arm


def body(tmp_path, path: str, edit=None):
    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
    return next(b for b in character.bodies if b.path == path)


def signed_volume(surface) -> float:
    corners = surface.points[surface.triangles]
    return float(np.einsum("na,na->", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) / 6.0)


def test_scale_goes_into_points_and_quads_become_triangles(tmp_path):
    cube = body(tmp_path, UPPER).surfaces[0]
    assert np.allclose(cube.points.min(axis=0), [0, -WIDTH / 2, -WIDTH / 2])
    assert np.allclose(cube.points.max(axis=0), [LENGTH, WIDTH / 2, WIDTH / 2])
    assert cube.displaced == 0
    mesh = body(tmp_path, FORE).surfaces[0]
    assert len(mesh.triangles) == 12 and mesh.displaced == 8
    assert mesh.color == pytest.approx((0.2, 0.4, 0.6))
    for surface in (cube, mesh):
        assert signed_volume(surface) == pytest.approx(LENGTH * WIDTH**2, rel=1e-6)


def test_mirrored_and_left_handed_meshes_stay_outward(tmp_path):
    def edit(stage):
        mirrored = box(stage, f"{FORE}/mirrored", Scale())
        mirrored.AddScaleOp().Set(Gf.Vec3f(-1, 1, 1))
        left = box(stage, f"{FORE}/left", Scale())
        left.CreateOrientationAttr("leftHanded")
        indices = list(left.GetFaceVertexIndicesAttr().Get())
        left.GetFaceVertexIndicesAttr().Set([i for k in range(0, 24, 4) for i in reversed(indices[k : k + 4])])

    surfaces = {s.path.split("/")[-1]: s for s in body(tmp_path, FORE, edit).surfaces}
    assert surfaces["mirrored"].points[:, 0].min() == pytest.approx(-LENGTH)
    for name in ("mirrored", "left"):
        assert signed_volume(surfaces[name]) == pytest.approx(LENGTH * WIDTH**2, rel=1e-6)


def test_a_mirrored_body_keeps_its_geometry_in_place(tmp_path):
    def edit(stage):
        UsdGeom.Xformable(stage.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(-1, -1, -1))

    surface = body(tmp_path, FORE, edit).surfaces[0]
    # the body frame has no scale, so the mirrored box lies on its negative side
    assert surface.points[:, 0].min() == pytest.approx(-LENGTH)
    assert signed_volume(surface) == pytest.approx(LENGTH * WIDTH**2, rel=1e-6)


def test_copies_guides_and_hidden_meshes_are_not_shown(tmp_path):
    def edit(stage):
        box(stage, f"{FORE}/skin_collision", Scale())
        box(stage, f"{FORE}/guide", Scale()).CreatePurposeAttr("guide")
        hidden = box(stage, f"{FORE}/hidden", Scale())
        hidden.CreateVisibilityAttr("invisible")
        other = box(stage, f"{FORE}/other", Scale())
        other.AddTranslateOp().Set(Gf.Vec3d(0, 1, 0))

    shown = {s.path.split("/")[-1]: s.visible for s in body(tmp_path, FORE, edit).surfaces}
    assert shown == {"skin": True, "skin_collision": False, "guide": False, "hidden": False, "other": True}


def test_geometry_of_a_nested_body_belongs_to_that_body(tmp_path):
    def edit(stage):
        nested = UsdGeom.Xform.Define(stage, f"{FORE}/nested")
        UsdPhysics.RigidBodyAPI.Apply(nested.GetPrim())
        box(stage, f"{FORE}/nested/skin", Scale())

    assert [s.path for s in body(tmp_path, FORE, edit).surfaces] == [f"{FORE}/skin"]


def test_instanced_geometry_is_read_but_cannot_be_written_back(tmp_path):
    def edit(stage):
        box(stage, "/Prototype/skin", Scale()).AddTranslateOp().Set(Gf.Vec3d(0, 0.5, 0))
        instance = stage.DefinePrim(f"{FORE}/instance", "Xform")
        instance.GetReferences().AddInternalReference("/Prototype")
        instance.SetInstanceable(True)

    surface = next(s for s in body(tmp_path, FORE, edit).surfaces if "instance" in s.path)
    assert surface.displaced == 0
    assert surface.points[:, 1].mean() == pytest.approx(0.5)


def test_holes_are_not_part_of_the_polygon(tmp_path):
    def edit(stage):
        UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin")).CreateHoleIndicesAttr([0, 3])

    assert len(body(tmp_path, FORE, edit).surfaces[0].triangles) == 8


def test_dented_polygons_keep_their_volume_and_surface(tmp_path):
    """A channel section whose ends are polygons of eight corners."""
    ring = np.array([[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]) * 0.01

    def edit(stage):
        mesh = UsdGeom.Mesh.Define(stage, f"{FORE}/channel")
        mesh.CreatePointsAttr([(x, float(y), float(z)) for x in (0.0, 0.2) for y, z in ring])
        sides = [[i, (i + 1) % 8, 8 + (i + 1) % 8, 8 + i] for i in range(8)]
        faces = [list(range(7, -1, -1)), list(range(8, 16)), *sides]
        mesh.CreateFaceVertexCountsAttr([len(face) for face in faces])
        mesh.CreateFaceVertexIndicesAttr([i for face in faces for i in face])

    surface = next(s for s in body(tmp_path, FORE, edit).surfaces if "channel" in s.path)
    assert signed_volume(surface) == pytest.approx(7e-4 * 0.2, rel=1e-6)
    corners = surface.points[surface.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(2 * 7e-4 + 0.2 * 0.16, rel=1e-6)


def test_instances_of_one_prototype_are_each_where_they_belong(tmp_path):
    def edit(stage):
        box(stage, "/Prototype/skin", Scale())
        for name, place in (("left", 0.5), ("right", -0.5)):
            instance = UsdGeom.Xform.Define(stage, f"{FORE}/{name}")
            instance.AddTranslateOp().Set(Gf.Vec3d(0, place, 0))
            instance.AddScaleOp().Set(Gf.Vec3f(1, -2, 1))
            instance.GetPrim().GetReferences().AddInternalReference("/Prototype")
            instance.GetPrim().SetInstanceable(True)

    found = {s.path.split("/")[-2]: s for s in body(tmp_path, FORE, edit).surfaces if "skin" in s.path}
    for name, place in (("left", 0.5), ("right", -0.5)):
        assert found[name].points[:, 1].mean() == pytest.approx(place)
        assert signed_volume(found[name]) == pytest.approx(2.0 * LENGTH * WIDTH**2, rel=1e-6)


def points_instanced(stage):
    instancer = UsdGeom.PointInstancer.Define(stage, f"{FORE}/studs")
    box(stage, f"{FORE}/studs/prototypes/stud", Scale())
    instancer.CreatePrototypesRel().AddTarget(f"{FORE}/studs/prototypes/stud")
    instancer.CreatePositionsAttr([(0, 0, 0), (0.1, 0, 0)])
    instancer.CreateProtoIndicesAttr([0, 0])


def test_point_instances_are_skipped_on_a_rigid_body_and_refused_on_a_flexible_one(tmp_path):
    character, _, _ = read_shot(str(write_arm(tmp_path / "rigid.usda", points_instanced)))
    fore = next(b for b in character.bodies if b.path == FORE)
    assert [s.path for s in fore.surfaces] == [f"{FORE}/skin"]
    assert any("point instances" in note and "studs" in note for note in character.notes)

    def flexible(stage):
        points_instanced(stage)
        make_flexible(stage)

    with pytest.raises(ShotError, match="point instances") as caught:
        body(tmp_path, FORE, flexible)
    assert caught.value.path == f"{FORE}/studs" and caught.value.remedy


def tet_mesh(stage, path: str, scale=(1, 1, 1)):
    mesh = UsdGeom.TetMesh.Define(stage, path)
    mesh.CreatePointsAttr([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)])
    mesh.CreateTetVertexIndicesAttr(Vt.Vec4iArray([(0, 1, 2, 3)]))
    mesh.AddScaleOp().Set(Gf.Vec3f(*scale))
    return mesh


@pytest.mark.parametrize("scale", [(0.1, 0.2, 0.3), (-0.1, 0.2, 0.3)])
def test_tetrahedra_are_read_with_positive_volumes(tmp_path, scale):
    tets = body(tmp_path, FORE, lambda stage: tet_mesh(stage, f"{FORE}/tets", scale)).tets
    corners = tets.points[tets.tets[0]]
    assert np.linalg.det(corners[1:] - corners[0]) == pytest.approx(0.006, rel=1e-5)


def test_a_body_of_guides_alone_is_shown_by_them(tmp_path):
    def edit(stage):
        UsdGeom.Imageable(stage.GetPrimAtPath(FORE)).CreatePurposeAttr("guide")

    assert [surface.visible for surface in body(tmp_path, FORE, edit).surfaces] == [True]


def test_a_shape_that_viewers_show_and_simulations_do_not_have_is_told(tmp_path):
    def notes(flexible, animated):
        def edit(stage):
            if flexible:
                make_flexible(stage)
            mesh = UsdGeom.Mesh(stage.GetPrimAtPath(f"{FORE}/skin"))
            mesh.GetSubdivisionSchemeAttr().Set("catmullClark" if animated else "none")
            place = mesh.AddTranslateOp()
            for code in (0, 12):
                place.Set(Gf.Vec3d(0, 0, 0.01 * code * animated), code * animated)

        character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", edit)))
        return [note for note in character.notes if note.startswith(f"{FORE}/skin")]

    told = notes(True, True)
    assert len(told) == 2 and "catmullClark" in told[0] and "first frame" in told[1]
    assert notes(True, False) == notes(False, True) == []
