"""Error of a body's compliance by its interface patches: on a mesh, the rim of a patch is a polygon, not a circle.

A patch along whose rim the mesh is cut is a polygon of the right area; one of whole elements also has the wrong area. A
finer mesh of the same elements keeps the rim of the first, so that the error of the mesh does not contain this one. End
faces and surfaces that the shot names end at edges of the surface and have no such error.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array
from calmotion.mesh.patches.interface_patches import InterfacePatch
from calmotion.mesh.patches.joint_places import cut_at
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.model.character import ElasticMaterial
from calmotion.model.meshes import CutPatch

# Relative error of the radius. A square turns on a half space as a circle of the same area with 1.5% more radius does
# (Dobry and Gazetas 1986), and the effect of a polygon goes with its corners to the third power.
_SQUARE = 0.015
# Of the elements at a rim of whole elements, over the radius: on ten pairs of mesh and patch of a plate, the compliance
# was off by 0.17 to 1.2 times what follows
_WHOLE = 0.25
_SAME = 1e-6  # of the size of a patch: corners that are nearer are one


def rim_error(
    mesh: QuadraticMesh, patch: InterfacePatch, origin: Array, cut: Sequence[CutPatch]
) -> tuple[float, float]:
    """Relative error of a patch's radius by its rim, and its radius [m].

    Args:
        mesh: Of the body.
        patch: One of its interface patches.
        origin: Of its attachment frame [m], shape [3].
        cut: Patches along whose rims the mesh is cut.
    """
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    if patch.center is not None:
        at = mesh.nodes[mesh.surface[np.isin(mesh.surface[:, :3], patch.nodes).any(axis=1), :3]]
        edge = np.linalg.norm(at - at[:, [1, 2, 0]], axis=2).mean() if len(at) else patch.radius
        return min(_WHOLE * float(edge) / patch.radius, 1.0), patch.radius
    known = cut_at(origin, cut, size)
    if known is None:
        return 0.0, patch.radius
    x = known.triangles
    area = 0.5 * float(np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1).sum())
    radius = float(np.sqrt(area / np.pi))
    return min(_SQUARE * (4.0 / max(rim_edges(x), 3)) ** 3, 1.0), radius


def rim_edges(triangles: Array) -> int:
    """Number of edges of a surface that belong to one triangle.

    Args:
        triangles: Corners [m], shape [k, 3, 3].
    """
    points = triangles.reshape(-1, 3)
    size = float(np.ptp(points, axis=0).max(initial=0.0))
    rounded = np.round((points - points.min(axis=0)) / max(_SAME * size, np.finfo(float).tiny)).astype(np.int64)
    corner = np.unique(rounded, axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] == 1).sum())


def compliance_error(
    rims: Sequence[tuple[float, float]], material: ElasticMaterial, omega_squared: Array, patch_motion: Array
) -> float:
    """Relative error of the compliance of a body by the rims of its patches: that of the third power of their radii.

    Args:
        rims: `rim_error` of the root patch, and of each moving patch.
        material, omega_squared, patch_motion: As of `shares_of_patches`.
    """
    if not len(omega_squared) or not len(patch_motion):
        return 0.0
    shares = shares_of_patches([radius for _, radius in rims], material, omega_squared, patch_motion)
    found = [3.0 * error * min(float(share), 1.0) for (error, _), share in zip(rims, shares, strict=True)]
    return float(found[0] + max(found[1:]))


def shares_of_patches(
    radii: Sequence[float], material: ElasticMaterial, omega_squared: Array, patch_motion: Array
) -> Array:
    """What patches turn by on the ground under them, of what a body turns by, shape [1 + p]; may exceed one.

    A patch turns on the ground under it as a rigid disc on a half space does; its radius matters by the share of that
    in the compliance of the body.

    Args:
        radii: Of the root patch, and of each moving patch [m].
        material: Of the body.
        omega_squared: Of its linear modes [1/s^2], shape [r].
        patch_motion: Motion of the moving patches in them, shape [p, 6, r].

    Source: Johnson, Contact Mechanics, 1985, 3.6: a moment turns a disc of radius a by 3 (1 - nu) / (8 G a^3).
    """
    shear = material.youngs_modulus / (2.0 * (1.0 + material.poissons_ratio))
    turned = patch_motion[:, 3:]
    whole = np.linalg.eigvalsh((turned / omega_squared) @ turned.transpose(0, 2, 1))[:, -1]
    # the end that the body turns farthest at also turns by what the root patch does
    of_each = np.concatenate([[whole.max()], whole])
    own = 3.0 * (1.0 - material.poissons_ratio) / (8.0 * shear * np.maximum(radii, np.finfo(float).tiny) ** 3)
    return np.asarray(own / np.maximum(of_each, np.finfo(float).tiny))
