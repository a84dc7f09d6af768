"""The bartender sample: built to the byte, opens without complaint, stands where its joints say, shakes slowly."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

pxr = pytest.importorskip("pxr")
from pxr import Gf, Usd, UsdGeom, UsdPhysics  # noqa: E402

FOLDER = Path(__file__).resolve().parents[2] / "samples" / "bartender"
SAMPLE = FOLDER / "bartender.usda"


@pytest.fixture(scope="module")
def builder():
    spec = importlib.util.spec_from_file_location("bartender_build", FOLDER / "build.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def stage():
    return Usd.Stage.Open(str(SAMPLE))


def joints_of(stage):
    return [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]


def meshes_of(stage):
    return [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]


def triangles_of(mesh):
    indices, start, triangles = mesh.GetFaceVertexIndicesAttr().Get(), 0, []
    for count in mesh.GetFaceVertexCountsAttr().Get():
        face = indices[start : start + count]
        triangles += [(face[0], face[k], face[k + 1]) for k in range(1, count - 1)]
        start += count
    return np.array(triangles)


def test_rebuilding_gives_the_committed_bytes(builder, tmp_path):
    builder.build(tmp_path / "again.usda")
    assert (tmp_path / "again.usda").read_bytes() == SAMPLE.read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["again.usda"]


def test_the_stage_opens_without_errors_and_states_its_units(stage):
    assert not stage.GetCompositionErrors()
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert (stage.GetEndTimeCode() - stage.GetStartTimeCode()) / stage.GetTimeCodesPerSecond() == 4.0
    assert stage.GetDefaultPrim().GetPath() == "/Bartender"


def test_every_mesh_is_closed_and_faces_outward(stage):
    for mesh in meshes_of(stage):
        triangles = triangles_of(mesh)
        edges = [(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)]
        assert len(set(edges)) == len(edges), mesh.GetPath()
        assert {(b, a) for a, b in edges} == set(edges), mesh.GetPath()
        points = np.array(mesh.GetPointsAttr().Get(), dtype=float)
        assert np.linalg.det(points[triangles]).sum() > 0.0, mesh.GetPath()


def test_the_authored_poses_close_every_joint_at_the_first_frame(stage):
    cache = UsdGeom.XformCache(stage.GetStartTimeCode())
    joints = joints_of(stage)
    assert len(joints) == 8
    for joint in joints:
        frames = []
        for body, position, rotation in (
            (joint.GetBody0Rel(), joint.GetLocalPos0Attr(), joint.GetLocalRot0Attr()),
            (joint.GetBody1Rel(), joint.GetLocalPos1Attr(), joint.GetLocalRot1Attr()),
        ):
            local = Gf.Matrix4d().SetRotate(Gf.Quatd(rotation.Get()))
            local.SetTranslateOnly(Gf.Vec3d(position.Get()))
            targets = body.GetTargets()
            world = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(targets[0])) if targets else Gf.Matrix4d(1.0)
            frames.append(local * world)
        gap = (frames[0].ExtractTranslation() - frames[1].ExtractTranslation()).GetLength()
        assert gap < 1e-6, joint.GetPath()
        turn = (frames[1] * frames[0].GetInverse()).ExtractRotation()
        angle, axis = 0.0, Gf.Vec3d(0, 0, 1)
        drive = UsdPhysics.DriveAPI.Get(joint.GetPrim(), "angular")
        if joint.GetPrim().IsA(UsdPhysics.RevoluteJoint):
            angle = drive.GetTargetPositionAttr().Get(stage.GetStartTimeCode())
            axis = Gf.Vec3d(*(float(name == joint.GetPrim().GetAttribute("physics:axis").Get()) for name in "XYZ"))
        off = (Gf.Rotation(axis, angle).GetInverse() * turn).GetAngle()
        assert min(off, 360.0 - off) < 1e-4, joint.GetPath()


def test_the_motion_starts_at_rest_and_keeps_the_servo_limits_with_a_margin(stage):
    frames = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    rate = stage.GetTimeCodesPerSecond()
    driven = [joint for joint in joints_of(stage) if joint.GetPrim().IsA(UsdPhysics.RevoluteJoint)]
    assert len(driven) == 5
    for joint in driven:
        prim = joint.GetPrim()
        attribute = UsdPhysics.DriveAPI.Get(prim, "angular").GetTargetPositionAttr()
        assert attribute.GetTimeSamples() == frames.tolist()
        curve = np.array([attribute.Get(frame) for frame in frames], dtype=float)
        assert np.ptp(curve[:6]) == 0.0 and np.ptp(curve[-12:]) == 0.0, prim.GetPath()
        assert prim.GetAttribute("physics:lowerLimit").Get() + 10.0 < curve.min()
        assert curve.max() + 10.0 < prim.GetAttribute("physics:upperLimit").Get()
        assert np.abs(np.diff(curve)).max() * rate < 0.7 * prim.GetAttribute("calm:motor:maxVelocity").Get()
        assert np.abs(np.diff(curve, 2)).max() * rate**2 < 0.5 * prim.GetAttribute("calm:motor:maxAcceleration").Get()


def test_joints_of_a_flexible_link_lie_inside_its_ends(stage):
    links = {
        p.GetPath() for p in stage.Traverse() if "CalmFlexibleBodyAPI" in p.GetPrimTypeInfo().GetAppliedAPISchemas()
    }
    assert len(links) == 2
    seen = 0
    for joint in joints_of(stage):
        sides = (joint.GetBody0Rel(), joint.GetLocalPos0Attr()), (joint.GetBody1Rel(), joint.GetLocalPos1Attr())
        for body, position in sides:
            for path in links.intersection(body.GetTargets()):
                mesh = UsdGeom.Mesh(stage.GetPrimAtPath(path.AppendChild("Link")))
                low, high = np.array(mesh.GetExtentAttr().Get(), dtype=float)
                anchor = np.array(position.Get(), dtype=float)
                assert np.all(anchor >= low - 1e-6) and np.all(anchor <= high + 1e-6)
                radius = stage.GetPrimAtPath(path).GetAttribute("calm:flexible:interfaceRadius").Get()
                near = np.linalg.norm(np.array(mesh.GetPointsAttr().Get()) - anchor, axis=1) < radius
                assert near.sum() >= 12
                seen += 1
    assert seen == 4


def test_the_keyed_curve_never_overshoots_its_keys(builder):
    from kit.curves import sample_keys

    keys = [(1.0, 0.0), (4.0, 10.0), (9.0, 11.0), (12.0, -5.0), (20.0, -5.0)]
    curve = sample_keys(keys, range(1, 22))
    assert curve[[0, 3, 8, 11, 19, 20]].tolist() == [0.0, 10.0, 11.0, -5.0, -5.0, -5.0]
    assert curve.max() == 11.0 and curve.min() == -5.0
    assert np.all(np.diff(curve[:9]) > 0.0)
