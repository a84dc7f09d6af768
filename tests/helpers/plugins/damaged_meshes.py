"""Meshes as they should not be: a link of known volume, damaged in every way that robots' files are."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import trimesh

LENGTH, RADIUS = 0.2, 0.02


@dataclass(frozen=True)
class Damaged:
    """A damaged mesh.

    Attributes:
        make: Gives points [m], shape [n, 3], and triangles, shape [m, 3].
        volume: Of the undamaged solid [m^3]; None where the mesh must be refused.
        tolerance: Relative, of the volume after repair.
        told: What a repair, or the refusal, says.
    """

    make: Callable[[], tuple[np.ndarray, np.ndarray]]
    volume: float | None
    told: str = ""
    tolerance: float = 1e-6


def capsule() -> tuple[np.ndarray, np.ndarray]:
    """A link with round ends: 0.2 m between the centres, radius 0.02 m."""
    mesh = trimesh.creation.capsule(LENGTH, RADIUS, count=[32, 32])
    return np.array(mesh.vertices), np.array(mesh.faces)


def box(extents=(0.2, 0.04, 0.03), at=(0.0, 0.0, 0.0), cuts: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """A box; `cuts` halves its edges so many times."""
    mesh = trimesh.creation.box(extents)
    for _ in range(cuts):
        mesh = mesh.subdivide()
    return np.array(mesh.vertices) + at, np.array(mesh.faces)


def volume_of(surface) -> float:
    x = surface[0][surface[1]]
    return float(np.einsum("ij,ij->", np.cross(x[:, 0], x[:, 1]), x[:, 2]) / 6.0)


BOX = 0.2 * 0.04 * 0.03
CAPSULE = volume_of(capsule())


def joined(*surfaces) -> tuple[np.ndarray, np.ndarray]:
    starts = np.cumsum([0] + [len(points) for points, _ in surfaces[:-1]])
    triangles = [t + k for (_, t), k in zip(surfaces, starts, strict=True)]
    return np.vstack([points for points, _ in surfaces]), np.vstack(triangles)


def turned(surface) -> tuple[np.ndarray, np.ndarray]:
    return surface[0], surface[1][:, ::-1]


def without(surface, faces) -> tuple[np.ndarray, np.ndarray]:
    return surface[0], np.delete(surface[1], faces, axis=0)


def holes(share: float):
    """The capsule without the triangles nearest to its pole, up to a share of its area."""

    def make():
        points, triangles = capsule()
        x = points[triangles]
        areas = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
        order = np.argsort(-x.mean(axis=1)[:, 2])
        count = int(np.searchsorted(np.cumsum(areas[order]), share * areas.sum()))
        return without((points, triangles), order[: max(count, 1)])

    return make


def scattered_holes():
    points, triangles = capsule()
    return without((points, triangles), np.arange(5, len(triangles), len(triangles) // 6))


def duplicate_faces():
    points, triangles = capsule()
    return points, np.vstack([triangles, triangles[::3], triangles[::5, [1, 2, 0]]])


def double_sided():
    points, triangles = capsule()
    return points, np.vstack([triangles, triangles[:, ::-1]])


def soup():
    points, triangles = capsule()
    return points[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)


def jittered(size: float):
    def make():
        points, triangles = soup()
        return points + size * np.random.default_rng(1).uniform(-1.0, 1.0, points.shape), triangles

    return make


def bad_point(value: float, used: bool):
    def make():
        points, triangles = capsule()
        points = np.vstack([points, [[value, 0.0, 0.0]]])
        if used:
            triangles = triangles.copy()
            triangles[7, 1] = len(points) - 1
        return points, triangles

    return make


def zero_area_triangles():
    """Collinear corners, and corners in one place under different numbers."""
    points, triangles = capsule()
    a, b = points[triangles[3, 0]], points[triangles[3, 1]]
    n = len(points)
    points = np.vstack([points, a, b, 0.5 * (a + b), a, a])
    return points, np.vstack([triangles, [[n, n + 1, n + 2], [n, n + 3, n + 4]]])


def only_zero_area():
    """Two triangles on one line."""
    return np.outer([0.0, 0.1, 0.3, 0.7], [1.0, 0.0, 0.0]), np.array([[0, 1, 2], [1, 2, 3]])


def slivers():
    """A box whose sides are cut into strips a thousand times as long as wide."""
    points, triangles = box()
    y = np.linspace(-0.02, 0.02, 201)
    rows = [np.array([[x, v, z] for v in y]) for x in (-0.1, 0.1) for z in (-0.015, 0.015)]
    strips, n = [], len(y)
    for low, high, flip in ((1, 3, False), (0, 2, True)):
        i = np.arange(n - 1)
        a, b, c, d = low * n + i, high * n + i, high * n + i + 1, low * n + i + 1
        quads = np.vstack([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        strips.append(quads[:, ::-1] if flip else quads)
    top_and_bottom = np.abs(points[triangles][:, :, 2].sum(axis=1)) > 0.044
    rest = without((points, triangles), np.flatnonzero(top_and_bottom))
    return joined(rest, (np.vstack(rows), np.vstack(strips)))


def t_junctions():
    """A box whose lid is cut more finely than the walls that meet it."""
    fine, coarse = box(cuts=2), box()
    lid = (fine[0][fine[1]][:, :, 2] > 0.0149).all(axis=1)
    wall = (coarse[0][coarse[1]][:, :, 2] > 0.0149).all(axis=1)
    return joined(without(fine, np.flatnonzero(~lid)), without(coarse, np.flatnonzero(wall)))


def partition():
    """A wall of no thickness across the inside: edges of three triangles."""
    points, triangles = joined(box((0.1, 0.04, 0.03), (-0.05, 0, 0)), box((0.1, 0.04, 0.03), (0.05, 0, 0)))
    wall = (np.abs(points[triangles][:, :, 0]) < 1e-12).all(axis=1)
    return without((points, triangles), np.flatnonzero(wall)[:2])


def fin():
    """A sheet that sticks out of a box: edges of three triangles, and free ones."""
    points, triangles = box()
    outer = [points[0] + [0, 0, -0.03], points[1] + [0, 0, -0.03]]
    at = np.argsort(np.linalg.norm(points - [-0.1, -0.02, -0.015], axis=1))[0]
    by = np.argsort(np.linalg.norm(points - [0.1, -0.02, -0.015], axis=1))[0]
    n = len(points)
    outer = np.array([points[at], points[by]]) + [0.0, 0.0, -0.03]
    return np.vstack([points, outer]), np.vstack([triangles, [[at, by, n], [n, by, n + 1]]])


def shared_edge():
    """Two boxes with one edge in common, of four triangles: they touch in a line, and cannot hold together."""
    return joined(box(), box(at=(0.0, 0.04, 0.03)))


def mobius():
    t = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    s = np.array([-0.01, 0.01])
    r = 0.05 + np.outer(np.cos(t / 2), s)
    points = np.stack([r * np.cos(t)[:, None], r * np.sin(t)[:, None], np.outer(np.sin(t / 2), s)], axis=-1)
    i = np.arange(40)
    a, b, c, d = 2 * i, 2 * i + 1, 2 * i + 2, 2 * i + 3
    c[-1], d[-1] = 1, 0  # joined with half a turn
    return points.reshape(-1, 3), np.vstack([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)])


def klein_bottle():
    """Closed, but of one side only."""
    turn = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False), np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    u, v = np.meshgrid(turn[0], turn[1] + np.pi / 16.0, indexing="ij")
    r = 0.05 + 0.02 * (np.cos(u / 2) * np.sin(v) - np.sin(u / 2) * np.sin(2 * v))
    z = 0.02 * (np.sin(u / 2) * np.sin(v) + np.cos(u / 2) * np.sin(2 * v))
    points = np.stack([r * np.cos(u), r * np.sin(u), z], axis=-1).reshape(-1, 3)
    triangles = []
    for i in range(24):
        for j in range(16):
            # after one turn about the axis v runs backwards
            k, far = (i + 1, lambda j: j % 16) if i < 23 else (0, lambda j: (-j - 1) % 16)
            a, b, c, d = 16 * i + j, 16 * i + (j + 1) % 16, 16 * k + far(j), 16 * k + far(j + 1)
            triangles += [[a, c, b], [b, c, d]]
    return points, np.array(triangles)


def scaled(surface, factor: float):
    return surface[0] * factor, surface[1]


def moved(surface, offset: float):
    return surface[0] + offset * np.array([1.0, -1.0, 0.5]), surface[1]


def single_precision(surface, offset: float):
    return (surface[0] + offset).astype(np.float32).astype(float), surface[1]


def some_turned():
    points, triangles = capsule()
    triangles = triangles.copy()
    triangles[::4] = triangles[::4][:, ::-1]
    return points, triangles


def crossing():
    """Two bars that run through each other, as one surface."""
    return joined(box((0.2, 0.02, 0.02)), box((0.02, 0.2, 0.02)))


def twisted():
    """A box one of whose ends is mirrored: its sides cross, and a part of it is inside out."""
    points, triangles = box()
    end = points[:, 0] > 0.0
    points[end, 1] *= -0.3
    return points, triangles


def flat_solid():
    points, triangles = box()
    return points * [1.0, 1.0, 0.0], triangles


def repeated_indices():
    points, triangles = capsule()
    i = np.arange(0, 60, 3)
    return points, np.vstack([triangles, np.stack([i, i, i + 1], axis=1), np.stack([i, i, i], axis=1)])


def unreferenced():
    points, triangles = capsule()
    return np.vstack([[[5.0, 5.0, 5.0]], points, [[-9.0, 0.0, 0.0]]]), triangles + 1


def out_of_range(index: int):
    def make():
        points, triangles = capsule()
        triangles = triangles.copy()
        triangles[11, 2] = index
        return points, triangles

    return make


def tetrahedron_without_a_face():
    points = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    return points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3]])


def open_box():
    points, triangles = box()
    return without((points, triangles), np.flatnonzero((points[triangles][:, :, 2] > 0.0149).all(axis=1)))


def sheet():
    return np.array([[0.0, 0, 0], [0.1, 0, 0], [0.1, 0.1, 0], [0, 0.1, 0]]), np.array([[0, 1, 2], [0, 2, 3]])


def cavity_turned(outward: bool):
    inner = box((0.16, 0.02, 0.015))
    return lambda: joined(box(), inner if outward else turned(inner))


def empty():
    return np.zeros((0, 3)), np.zeros((0, 3), dtype=int)


CORPUS: dict[str, Damaged] = {
    "a small hole": Damaged(holes(2e-3), CAPSULE, "closed 1 hole", 2e-3),
    "a large hole": Damaged(holes(0.1), None, "open surface"),
    "six missing triangles": Damaged(scattered_holes, CAPSULE, "closed", 1e-3),
    "one missing triangle of twelve": Damaged(lambda: without(box(), [4]), BOX, "closed 1 hole"),
    "a tetrahedron without a face": Damaged(tetrahedron_without_a_face, 1e-3 / 6.0, "closed 1 hole"),
    "a box without a lid": Damaged(open_box, None, "open surface"),
    "an open sheet": Damaged(sheet, None, "open surface"),
    "one triangle": Damaged(lambda: (np.eye(3), np.array([[0, 1, 2]])), None, "open surface"),
    "duplicate faces": Damaged(duplicate_faces, CAPSULE, "repeated"),
    "faces on both sides": Damaged(double_sided, CAPSULE, "repeated"),
    "unwelded corners": Damaged(soup, CAPSULE),
    "corners with jitter 1e-7 m": Damaged(jittered(1e-7), CAPSULE, "", 1e-5),
    "corners with jitter 3e-6 m": Damaged(jittered(3e-6), CAPSULE, "welded points", 1e-3),
    "a NaN point in a face": Damaged(bad_point(np.nan, True), None, "not finite"),
    "an infinite point in a face": Damaged(bad_point(np.inf, True), None, "not finite"),
    "a NaN point in no face": Damaged(bad_point(np.nan, False), CAPSULE, "not finite"),
    "zero-area triangles": Damaged(zero_area_triangles, CAPSULE, "removed"),
    "only zero-area triangles": Damaged(only_zero_area, None, "without area"),
    "slivers 1:1000": Damaged(slivers, BOX),
    "T-junctions": Damaged(t_junctions, BOX, "", 1e-6),
    "a partition inside": Damaged(partition, BOX, "sheets"),
    "a fin": Damaged(fin, BOX, "sheet"),
    "two boxes that share an edge": Damaged(shared_edge, None, "do not touch"),
    "two parts far apart": Damaged(lambda: joined(box(), box(at=(0, 0.2, 0))), None, "do not touch"),
    "two parts a hair apart": Damaged(lambda: joined(box(), box(at=(0, 0, 0.03005))), 2 * BOX, "bridged", 2e-3),
    "two parts that touch": Damaged(lambda: joined(box(), box(at=(0, 0.01, 0.03))), 2 * BOX, "", 1e-5),
    "coincident shells": Damaged(lambda: joined(capsule(), capsule()), CAPSULE, "repeated"),
    "nearly coincident shells": Damaged(lambda: joined(box(), moved(box(), 1e-6)), BOX, "", 1e-3),
    "inside out": Damaged(lambda: turned(capsule()), CAPSULE, "inside out"),
    "mixed winding": Damaged(some_turned, CAPSULE, "orientation"),
    "a cavity": Damaged(cavity_turned(False), BOX - 0.16 * 0.02 * 0.015),
    "a shell inside that faces outward": Damaged(cavity_turned(True), BOX, "as solid"),
    "a surface through itself": Damaged(crossing, 2 * 8e-5 - 8e-6),
    "a twisted box": Damaged(twisted, None, "intersects itself"),
    "a Moebius strip": Damaged(mobius, None, "one side"),
    "a Klein bottle": Damaged(klein_bottle, None, "one side"),
    "a solid of no thickness": Damaged(flat_solid, None, "no volume"),
    "faces with repeated indices": Damaged(repeated_indices, CAPSULE, "degenerate"),
    "points in no face": Damaged(unreferenced, CAPSULE),
    "an index too large": Damaged(out_of_range(99999), None, "does not exist"),
    "a negative index": Damaged(out_of_range(-1), None, "does not exist"),
    "nothing": Damaged(empty, None, "no geometry|no volume"),
    "microscopic": Damaged(lambda: scaled(capsule(), 5e-6), CAPSULE * 1.25e-16),
    "of kilometres": Damaged(lambda: scaled(capsule(), 1e4), CAPSULE * 1e12),
    "far from the origin": Damaged(lambda: moved(capsule(), 1e4), CAPSULE, "", 1e-6),
    "far from the origin in single precision": Damaged(lambda: single_precision(box(), 100.0), BOX, "", 1e-2),
    "a very thin plate": Damaged(lambda: box((0.2, 0.2, 2e-4)), 8e-6, "", 1e-5),
}
