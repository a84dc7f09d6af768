"""A small arm and a motion of it, with which plugins are tested."""

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.model import (
    WORLD,
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    Motor,
    SurfaceMesh,
    Target,
    TetGeometry,
    Track,
)

LENGTH, WIDTH, DENSITY = 0.4, 0.04, 1200.0


def small_shot(flexible: bool = False) -> tuple[Character, Animation]:
    """An arm of two beams that lies along x, turns about y, and swings down and back within a second.

    Args:
        flexible: The outer beam bends; it then carries its own tetrahedra.

    Returns:
        The character (gravity along -z), and its animation.
    """
    links = [_link("/Arm/Upper", 0.0, False), _link("/Arm/Fore", LENGTH, flexible)]
    # A quarter turn about x takes z, the joint's axis, to y.
    about_y = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0])
    root, tip = np.zeros(3), np.array([LENGTH, 0.0, 0.0])
    joints = (
        Joint("/Arm/Shoulder", "revolute", WORLD, 0, Frame(root, about_y), Frame(root, about_y)),
        Joint("/Arm/Elbow", "revolute", 0, 1, Frame(tip, about_y), Frame(root, about_y), -2.0, 2.0),
    )
    attribute = "drive:angular:physics:targetPosition"
    character = Character(
        path="/Arm",
        bodies=tuple(links),
        joints=joints,
        motors=tuple(Motor(index, joint.path, attribute) for index, joint in enumerate(joints)),
        targets=(Target("/Arm/Fore/Tip", 1, Frame(tip, np.array([1.0, 0.0, 0.0, 0.0]))),),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
    times = np.arange(25) / 24.0
    swing = 0.25 * (1.0 - np.cos(2.0 * np.pi * times))
    tracks = (Track(times, swing), Track(times, -0.5 * swing))
    return character, Animation(frame_times=times, tracks=tracks, current=tracks)


def _link(path: str, offset: float, flexible: bool) -> Body:
    points, tets, triangles = beam()
    mass = DENSITY * LENGTH * WIDTH**2
    inertia = mass / 12.0 * np.diag([2.0 * WIDTH**2, LENGTH**2 + WIDTH**2, LENGTH**2 + WIDTH**2])
    material = ElasticMaterial("/Arm/Materials/Plastic", 2.0e9, 0.35, DENSITY)
    return Body(
        path=path,
        rest=Frame(np.array([offset, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])),
        mass=None if flexible else MassProperties(mass, np.array([LENGTH / 2.0, 0.0, 0.0]), inertia),
        surfaces=(SurfaceMesh(f"{path}/Skin", points, triangles, displaced=len(points)),),
        tets=TetGeometry(f"{path}/Tets", points, tets) if flexible else None,
        flexible=FlexibleSettings(material) if flexible else None,
    )


def beam(cells: tuple[int, int, int] = (10, 2, 2)) -> tuple[Array, IntArray, IntArray]:
    """A beam along x whose axis starts at the origin, six tetrahedra a cell.

    Args:
        cells: Number of cells along x, y and z.

    Returns:
        Points [m], shape [n, 3]; tetrahedra with positive volumes, shape [m, 4]; the triangles of its surface,
        outward, shape [k, 3].
    """
    nx, ny, nz = cells
    axes = [np.linspace(0.0, LENGTH, nx + 1), *(np.linspace(-WIDTH / 2, WIDTH / 2, n + 1) for n in (ny, nz))]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    tets = []
    # Kuhn's division: one tetrahedron for each order of the axes, along the cell's diagonal; neighbours match.
    for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        corners = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        tets.append(np.stack([numbers[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners], axis=1))
    cells_of = np.concatenate(tets)
    a, b, c, d = (points[cells_of[:, i]] for i in range(4))
    flipped = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    cells_of[flipped] = cells_of[flipped][:, [0, 2, 1, 3]]
    faces = np.concatenate([cells_of[:, face] for face in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return points, cells_of.astype(np.int32), faces[first[count == 1]].astype(np.int32)
