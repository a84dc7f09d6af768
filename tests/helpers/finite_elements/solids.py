"""Closed surfaces of simple solids, points [n, 3] and outward triangles [m, 3], and the bodies that they make."""

from __future__ import annotations

import numpy as np
from calmotion.model import Body, ElasticMaterial, FlexibleSettings, Frame, SurfaceMesh

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
STEEL = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)
PLASTIC = ElasticMaterial("/Looks/Plastic", 1.8e9, 0.35, 1200.0)
_BOX = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]], dtype=np.int32,
)  # fmt: skip


def box(size, origin=(0.0, 0.0, 0.0)):
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    return corners * size + origin, _BOX


def inside_out(solid):
    return solid[0], solid[1][:, ::-1]


def joined(*solids):
    """Several surfaces as one."""
    offsets = np.cumsum([0] + [len(points) for points, _ in solids])
    triangles = [solid[1] + offset for solid, offset in zip(solids, offsets, strict=False)]
    return np.vstack([points for points, _ in solids]), np.vstack(triangles).astype(np.int32)


def prism(sides, radius, length):
    """A polygonal cylinder along x, between 0 and its length."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.zeros(sides), radius * np.cos(angle), radius * np.sin(angle)], axis=1)
    points = np.vstack([ring, ring + [length, 0, 0], [[0, 0, 0]], [[length, 0, 0]]])
    i = np.arange(sides)
    j = (i + 1) % sides
    middle, end = np.full(sides, 2 * sides), np.full(sides, 2 * sides + 1)
    parts = [(i, j, j + sides), (i, j + sides, i + sides), (middle, j, i), (end, i + sides, j + sides)]
    return points, np.vstack([np.stack(part, axis=1) for part in parts]).astype(np.int32)


def tube(size, wall):
    """A closed box, hollow along x behind end plates as thick as its walls."""
    inner = box(np.array(size) - 2 * wall, (wall, wall, wall))
    return joined(box(size), inside_out(inner))


def rotated(axis, angle):
    """Rotation matrix about an axis [rad]."""
    k = axis / np.linalg.norm(axis)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def body_of(*solids, material=PLASTIC, mass=None, tets=None, **settings):
    """A flexible body with one surface for each solid."""
    surfaces = tuple(SurfaceMesh(f"/Robot/Link/Mesh{k}", *solid) for k, solid in enumerate(solids))
    flexible = FlexibleSettings(material, **settings)
    return Body("/Robot/Link", frame(0.0, 0.0, 0.0), mass, surfaces, tets, flexible)


def frame(*position):
    return Frame(np.array(position, dtype=float), IDENTITY)
