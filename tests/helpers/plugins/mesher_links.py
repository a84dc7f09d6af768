"""Boxes as links, and what the tests of the mesher do with them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from calmotion.mesh.repair import closed_solid
from calmotion.model import Body, Character, ElasticMaterial, FEMeshes, FlexibleSettings, Frame, SurfaceMesh
from calmotion.testing import run_operator
from calmotion.tolerance.meshes import body_mesh
from calmotion.tolerance.meshes.accurate_mesh import frames_of
from calmotion.usd import schemas
from calmotion.usd.reading import read_shot
from pxr import Usd, UsdGeom

PLUGIN = Path(__file__).resolve().parents[3] / "plugins" / "fe_mesher"
REST = Frame(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
FLEXIBLE = FlexibleSettings(ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0))


def surface(mesh, path="/Arm/link/mesh", **fields):
    return SurfaceMesh(path, np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32), **fields)


def box(extents=(0.2, 0.02, 0.02), at=(0.0, 0.0, 0.0)):
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation(at)
    return mesh


def bracket():
    """A part without any symmetry."""
    base = trimesh.creation.box((0.1, 0.03, 0.01))
    ear = trimesh.creation.box((0.02, 0.012, 0.03))
    ear.apply_translation((0.035, 0.006, 0.015))
    foot = trimesh.creation.box((0.015, 0.02, 0.014))
    foot.apply_translation((-0.03, -0.012, -0.004))
    return trimesh.boolean.union([base, ear, foot])


def link(*surfaces, **fields):
    return Body("/Arm/link", REST, None, tuple(surfaces), flexible=replace(FLEXIBLE, **fields))


def run(host, *bodies, **properties):
    character = Character("/Arm", bodies, (), (), (), np.array([0.0, 0.0, -9.81]))
    (meshes,) = run_operator(host, "fe.mesh", [character], {"fe.mesh": properties})
    assert isinstance(meshes, FEMeshes)
    return meshes.meshes


def solid(*surfaces):
    return closed_solid.closed_solid(surfaces, "/Arm/link")


def links_of(shared_data, *names):
    """Surfaces of links of a real robot, in their body frames, as the reader gives them."""
    schemas.register()  # before USD is used, as it reads schemas once in a process
    file = shared_data / "converted" / "g1_dual_arm" / "g1_dual_arm.usda"
    if not file.is_file():
        pytest.skip("the robot is not here")
    stage = Usd.Stage.Open(str(file))
    cache = UsdGeom.XformCache()
    found = {}
    for prim in stage.Traverse():
        if prim.GetName() not in names or prim.IsA(UsdGeom.Mesh):
            continue
        to_body = cache.GetLocalToWorldTransform(prim).GetInverse()
        surfaces = []
        for child in prim.GetFilteredChildren(Usd.TraverseInstanceProxies()):
            if child.IsA(UsdGeom.Mesh):
                mesh = UsdGeom.Mesh(child)
                matrix = np.array(cache.GetLocalToWorldTransform(child) * to_body)
                points = np.array(mesh.GetPointsAttr().Get(), dtype=float) @ matrix[:3, :3] + matrix[3, :3]
                assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
                triangles = np.array(mesh.GetFaceVertexIndicesAttr().Get(), dtype=np.int32).reshape(-1, 3)
                surfaces.append(SurfaceMesh(str(child.GetPath()), points, triangles))
        found[prim.GetName()] = tuple(surfaces)
    return [found[name] for name in names]


def link_of(file, name):
    """The body of a link of a robot's file, with flexible settings, and the frames of its joints."""
    if not file.is_file():
        pytest.skip("the robot is not here")
    character, _, _ = read_shot(str(file), still=True)
    index = next(k for k, body in enumerate(character.bodies) if body.path.endswith(f"/{name}"))
    return replace(character.bodies[index], flexible=FLEXIBLE), frames_of(character, index)


def divided(points, triangles):
    """The same surface with each triangle divided at its middle."""
    middles = points[triangles].mean(axis=1)
    at = len(points) + np.arange(len(triangles))
    parts = [np.column_stack([triangles[:, i], triangles[:, j], at]) for i, j in ((0, 1), (1, 2), (2, 0))]
    return np.vstack([points, middles]), np.vstack(parts)


def mesh_body(body, options, frames=(), attachments=()):
    """The tetrahedra of a flexible body."""
    return body_mesh.mesh_of(0, body, body_mesh.geometry_of(0, body, options, frames), options, frames, attachments)
