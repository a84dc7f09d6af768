"""Named interfaces of flexible bodies."""

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.usd.reading import read_shot
from pxr import Sdf, UsdGeom, Vt
from small_shots import ELBOW, FORE, SHOULDER, Scale, make_flexible, write_arm

SKIN = f"{FORE}/skin"


def subset(stage, name, indices, joint=None, element="face", parent=SKIN):
    item = UsdGeom.Subset.Define(stage, f"{parent}/{name}")
    item.CreateFamilyNameAttr("calmInterface")
    item.CreateElementTypeAttr(element)
    item.CreateIndicesAttr(Vt.IntArray(indices))
    if joint:
        item.GetPrim().CreateRelationship("calm:interface:joint").SetTargets([Sdf.Path(joint)])
    return item


def fore(tmp_path, edit, scale=None):
    def both(stage):
        make_flexible(stage, scale=scale) if scale else make_flexible(stage)
        edit(stage)

    character, _, _ = read_shot(str(write_arm(tmp_path / "arm.usda", both, scale)))
    return next(b for b in character.bodies if b.path == FORE)


@pytest.mark.parametrize("named", ["elbow", "Grip"])
@pytest.mark.parametrize("scale", [None, Scale(0.01, 1.0)])
def test_a_subset_names_its_joint_by_a_relationship_or_by_its_own_name(tmp_path, named, scale):
    joint = None if named == "elbow" else ELBOW
    (item,) = fore(tmp_path, lambda stage: subset(stage, named, [0], joint), scale).interfaces
    assert item.joint == ELBOW and item.path == f"{SKIN}/{named}"
    # face 0 of the box is its near end, x = 0, looking back
    assert item.triangles.shape == (2, 3, 3) and np.abs(item.triangles[..., 0]).max() < 1e-9
    normal = np.cross(item.triangles[:, 1] - item.triangles[:, 0], item.triangles[:, 2] - item.triangles[:, 0])
    assert np.allclose(normal.sum(axis=0) / 2, [-(0.04**2), 0, 0], atol=1e-9)


def test_subsets_of_other_families_mean_nothing(tmp_path):
    def edit(stage):
        subset(stage, "elbow", [0]).CreateFamilyNameAttr("materialBind")

    assert fore(tmp_path, edit).interfaces == ()


@pytest.mark.parametrize(
    ("edit", "attribute", "words"),
    [
        (lambda s: subset(s, "elbow", []), "indices", "empty"),
        (lambda s: subset(s, "elbow", [6]), "indices", "do not exist"),
        (lambda s: subset(s, "elbow", [-1]), "indices", "do not exist"),
        (lambda s: subset(s, "knee", [0]), "calm:interface:joint", "names no joint"),
        (lambda s: subset(s, "grip", [0], SHOULDER), "calm:interface:joint", "names no joint"),
        (lambda s: subset(s, "elbow", [0], element="point"), "elementType", "faces of a Mesh"),
        (lambda s: (subset(s, "elbow", [0]), subset(s, "again", [1], ELBOW)), None, "already"),
    ],
)
def test_prims_that_are_not_interfaces_are_refused(tmp_path, edit, attribute, words):
    with pytest.raises(ShotError, match=words) as caught:
        fore(tmp_path, edit)
    assert caught.value.path.startswith(SKIN) and caught.value.remedy
    assert attribute is None or caught.value.attribute == attribute


@pytest.mark.parametrize(("element", "indices", "count"), [("tetrahedron", [0], 4), ("face", [1, 2], 2)])
def test_on_a_tetmesh_faces_or_tetrahedra_are_named(tmp_path, element, indices, count):
    def edit(stage):
        tets = UsdGeom.TetMesh.Define(stage, f"{FORE}/tets")
        tets.CreatePointsAttr(Vt.Vec3fArray([(0, 0, 0), (0.4, 0, 0), (0, 0.04, 0), (0, 0, 0.04)]))
        tets.CreateTetVertexIndicesAttr(Vt.Vec4iArray([(0, 1, 2, 3)]))
        tets.CreateSurfaceFaceVertexIndicesAttr(Vt.Vec3iArray([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)]))
        subset(stage, "elbow", indices, element=element, parent=f"{FORE}/tets")

    (item,) = fore(tmp_path, edit).interfaces
    assert item.triangles.shape == (count, 3, 3)
    center = np.array([0.1, 0.01, 0.01])
    for a, b, c in item.triangles:
        assert np.cross(b - a, c - a) @ (a - center) > 0.0
