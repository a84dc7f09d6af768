"""Bodies cut from a skin: each triangle belongs to the joint of largest weight, and the cuts are closed."""

from __future__ import annotations

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.surfaces.closed_surfaces import close
from calmotion.mesh.tetrahedra import surface_volume

_FLAT = 1e-7  # volume of a negligible piece, of that of all pieces


def cut_skin(points: Array, triangles: IntArray, weights: Array) -> dict[int, tuple[Array, IntArray]]:
    """Cut a skin into closed pieces.

    Args:
        points: [m], shape [n, 3]; coincident points are merged.
        triangles: Shape [m, 3].
        weights: Skin weight of each joint at each point, shape [n, j].

    Returns:
        Points and outward triangles of the piece of each joint whose piece has a volume.
    """
    places, same = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    same = same.reshape(-1)
    merged = np.zeros((len(places), weights.shape[1]))
    np.add.at(merged, same, weights)
    faces = same[triangles]
    whole = (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])
    faces = faces[whole]
    owners = np.argmax(merged[faces].sum(axis=1), axis=1)
    pieces = {}
    for joint in np.unique(owners):
        used, corners = np.unique(faces[owners == joint], return_inverse=True)
        closure = close(places[used], corners.reshape(-1, 3))
        piece = closure.points, closure.triangles.astype(np.int32)
        volume = surface_volume(*piece)
        if volume < 0.0:
            piece = piece[0], piece[1][:, ::-1].copy()
        pieces[int(joint)] = (*piece, abs(volume))
    least = _FLAT * sum(volume for *_, volume in pieces.values())
    return {joint: (x, t) for joint, (x, t, volume) in pieces.items() if volume > least}
