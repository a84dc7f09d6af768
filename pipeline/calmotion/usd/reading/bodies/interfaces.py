"""Parts of a body's surface that name the joint attached to them: GeomSubsets of family `calmInterface`."""

from collections.abc import Sequence

import numpy as np
from pxr import Usd, UsdGeom

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.model import InterfaceSurface
from calmotion.support.naming import nearest
from calmotion.usd import gf
from calmotion.usd.reading.bodies.polygons import triangulate
from calmotion.usd.reading.bodies.shapes import finite_points, to_body
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below
from calmotion.usd.transforms import Pose

FAMILY = "calmInterface"
JOINT = "calm:interface:joint"
_SIDES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])  # outward faces of a tetrahedron


def interfaces_of(
    reading: Reading, body_prim: Usd.Prim, pose: Pose, joints: Sequence[str]
) -> tuple[InterfaceSurface, ...]:
    """The named interfaces of a body.

    A subset names its joint by the relationship `calm:interface:joint`, or by having the joint's name.

    Args:
        pose: Its pose, stage units.
        joints: Prim paths of the joints that touch the body.

    Raises:
        ShotError: A subset without faces, of faces that do not exist, or that names no joint of this body.
    """
    surfaces: list[InterfaceSurface] = []
    for prim in prims_below(body_prim, is_rigid_body):
        subset = UsdGeom.Subset(prim)
        if not subset or subset.GetFamilyNameAttr().Get() != FAMILY:
            continue
        joint = _joint_of(prim, joints)
        earlier = next((surface.path for surface in surfaces if surface.joint == joint), None)
        if earlier is not None:
            raise ShotError(
                f"the joint {joint} has an interface on this body already",
                path=prim.GetPath(),
                found=earlier,
                remedy="Keep one subset, with all its faces",
            )
        geometry = prim.GetParent()
        points, triangles = _triangles(prim, subset, geometry, reading.start)
        linear, offset = to_body(reading, geometry, pose)
        corners = (points @ linear.T + offset)[triangles]
        if np.linalg.det(linear) < 0.0:
            corners = corners[:, ::-1].copy()
        surfaces.append(InterfaceSurface(str(prim.GetPath()), joint, corners))
    return tuple(surfaces)


def _joint_of(prim: Usd.Prim, joints: Sequence[str]) -> str:
    relationship = prim.GetRelationship(JOINT)
    named = [str(target) for target in relationship.GetForwardedTargets()] if relationship else []
    matching = [path for path in joints if path in named] if named else []
    if not named:
        matching = [path for path in joints if path.rsplit("/", 1)[-1] == prim.GetName()]
    if len(matching) != 1:
        likely = nearest(named[0] if named else prim.GetName(), joints)
        raise ShotError(
            "this interface names no joint of its body",
            path=prim.GetPath(),
            attribute=JOINT,
            found=", ".join(named) or f"the subset's name, {prim.GetName()}",
            remedy=f"{likely}Point {JOINT} at one of {', '.join(joints) or 'its joints (it has none)'}",
        )
    return matching[0]


def _triangles(prim: Usd.Prim, subset: UsdGeom.Subset, geometry: Usd.Prim, time: float) -> tuple[Array, IntArray]:
    """Points of the geometry and the triangles of the subset."""
    kind = str(geometry.GetTypeName())
    element = str(subset.GetElementTypeAttr().Get())
    chosen = gf.indices(subset.GetIndicesAttr().Get(time))
    points = finite_points(geometry, time)
    if len(chosen) == 0:
        raise ShotError(
            "this interface is empty",
            path=prim.GetPath(),
            attribute="indices",
            remedy="List the faces that are attached to the joint, or remove the subset",
        )
    if kind == "Mesh" and element == "face":
        counts = gf.indices(geometry.GetAttribute("faceVertexCounts").Get(time))
        _check(prim, chosen, len(counts))
        corners = gf.indices(geometry.GetAttribute("faceVertexIndices").Get(time))
        keep = np.zeros(len(counts), dtype=bool)
        keep[chosen] = True
        triangles = triangulate(points, counts, corners, keep)
    elif kind == "TetMesh" and element == "tetrahedron":
        tets = gf.indices(geometry.GetAttribute("tetVertexIndices").Get(time), 4)
        _check(prim, chosen, len(tets))
        sides = tets[:, _SIDES].reshape(-1, 3)
        _, first, times = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        outer = np.zeros(len(sides), dtype=bool)
        outer[first[times == 1]] = True
        triangles = tets[chosen][:, _SIDES].reshape(-1, 3)[outer.reshape(-1, 4)[chosen].ravel()]
    elif kind == "TetMesh" and element == "face":
        faces = gf.indices(geometry.GetAttribute("surfaceFaceVertexIndices").Get(time), 3)
        _check(prim, chosen, len(faces))
        triangles = faces[chosen]
    else:
        raise ShotError(
            "an interface is made of faces of a Mesh, or of faces or tetrahedra of a TetMesh",
            path=prim.GetPath(),
            attribute="elementType",
            found=f"{element} of a {kind}",
            remedy="Put the subset below the body's Mesh with elementType face",
        )
    if kind == "TetMesh" or geometry.GetAttribute("orientation").Get() != "leftHanded":
        return points, triangles
    return points, triangles[:, ::-1].copy()


def _check(prim: Usd.Prim, chosen: IntArray, count: int) -> None:
    if chosen.min() < 0 or chosen.max() >= count:
        raise ShotError(
            f"this interface refers to elements that do not exist (there are {count})",
            path=prim.GetPath(),
            attribute="indices",
            found=int(chosen.min()) if chosen.min() < 0 else int(chosen.max()),
            remedy="Correct the indices",
        )
