"""The skin of a skeleton at a time: points, triangles, and the weight of each joint at each point."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdSkel

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.usd import gf
from calmotion.usd.reading.bodies.shapes import mesh_geometry
from calmotion.usd.reading.context import prims_of
from calmotion.usd.reading.skeletons import BoundSkeleton


@dataclass(frozen=True, eq=False)
class Skin:
    """All meshes that a skeleton moves.

    Attributes:
        points: World, stage units, shape [n, 3].
        triangles: Shape [m, 3].
        weights: By joint of the skeleton, shape [n, j].
        meshes: Paths of the meshes.
    """

    points: Array
    triangles: IntArray
    weights: Array
    meshes: tuple[str, ...]


def skinned_meshes(stage: Usd.Stage, skeleton: BoundSkeleton) -> Iterator[UsdSkel.SkinningQuery]:
    """The meshes that a skeleton moves; one that several roots hold comes several times."""
    cache, every = UsdSkel.Cache(), Usd.TraverseInstanceProxies()
    for prim in prims_of(stage):
        if not prim.IsA(UsdSkel.Root):
            continue
        cache.Populate(UsdSkel.Root(prim), every)
        for binding in cache.ComputeSkelBindings(UsdSkel.Root(prim), every):
            if binding.GetSkeleton().GetPrim() == skeleton.prim:
                yield from (one for one in binding.GetSkinningTargets() if one.GetPrim().GetTypeName() == "Mesh")


def read_skin(stage: Usd.Stage, skeleton: BoundSkeleton, code: float) -> Skin:
    """The skin of a skeleton at a time code.

    Raises:
        ShotError: A mesh that cannot be skinned.
    """
    targets = {str(target.GetPrim().GetPath()): target for target in skinned_meshes(stage, skeleton)}
    parts, names = [_skinned(skeleton, target, code) for target in targets.values()], list(targets)
    if not parts:
        return Skin(np.zeros((0, 3)), np.zeros((0, 3), np.int32), np.zeros((0, len(skeleton.joints))), ())
    offsets = np.cumsum([0, *(len(points) for points, _, _ in parts[:-1])])
    return Skin(
        np.concatenate([points for points, _, _ in parts]),
        np.concatenate([triangles + offset for (_, triangles, _), offset in zip(parts, offsets, strict=True)]),
        np.concatenate([weights for _, _, weights in parts]),
        tuple(names),
    )


def _skinned(skeleton: BoundSkeleton, target: UsdSkel.SkinningQuery, code: float) -> tuple[Array, IntArray, Array]:
    prim = target.GetPrim()
    rest, triangles = mesh_geometry(prim, code)
    points = gf.to_points(rest)
    influences = target.ComputeVaryingJointInfluences(len(rest), code)
    transforms = skeleton.query.ComputeSkinningTransforms(code)
    if not influences or not target.ComputeSkinnedPoints(transforms, points, code):
        raise ShotError(
            "the mesh is bound to a skeleton, but cannot be skinned",
            path=prim.GetPath(),
            attribute="primvars:skel:jointIndices",
            remedy="Author joint indices and weights for each point, with joints that exist",
        )
    width = target.GetNumInfluencesPerComponent()
    order = target.GetJointOrder()
    names = [str(joint) for joint in order] if order else list(skeleton.joints)
    of_skeleton = np.array([skeleton.joints.index(joint) if joint in skeleton.joints else -1 for joint in names])
    indices = of_skeleton[gf.indices(influences[0])].reshape(-1, width)
    shares = np.array(influences[1], dtype=np.float64).reshape(-1, width)
    weights = np.zeros((len(rest), len(skeleton.joints)))
    for column in range(width):
        used = np.flatnonzero(indices[:, column] >= 0)
        np.add.at(weights, (used, indices[used, column]), shares[used, column])
    place = skeleton.placement(code)
    return gf.points(points) @ place[:3, :3].T + place[:3, 3], triangles, weights
