"""How fine a mesh has to be for a wanted accuracy, and how closely it follows the surface."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from calmotion.arrays import Array, Indices, box_diagonal
from calmotion.mesh.surfaces.distances import ray_length
from calmotion.mesh.tetrahedra import surface_area, surface_volume
from calmotion.mesh.tetrahedralize.tetwild import SIMPLE
from calmotion.model.meshes import Core

ACCURACY = 5e-3  # relative, of the first frequencies
MAX_NODES = 15_000  # of the ten-node tetrahedra: some seconds and half a gigabyte to reduce

# Measured on clamped beams (3:1 to 20:1) and a plate (20:1), three frequencies each: 0.06 to 0.12
_ERROR = 0.12
_REGULAR, _FACE = 0.118, 0.433  # volume of a regular tetrahedron and area of a regular triangle of edge 1
_NODES = 0.8  # for each tetrahedron inside and each triangle outside, of beams and plates; small features add more
_RAYS = 200
THIN = 0.25  # of the surface is on walls that are as thin as that: they bend first
_FORM = 2e-3  # of the diagonal; at twice that, real links lost 1% of volume and with it up to 6% of a frequency
_WALL = 0.2  # of the thickness: the widest envelope that leaves a wall its stiffness
_LEAST = 2e-4  # of the diagonal; below, the tetrahedraliser takes minutes for a box
# Elements as long as that, of the thickness, in walls of more triangles are those of a thin round shell: following a
# tube of 2 mm within 0.05 mm takes more than 36 s, within 0.25 mm some 30 s, for a frequency that is 0.05% off
_SHELL, _FLAT = 2.0, 100
# Largest elements of a printed body over the thickness of its skin: first frequencies of five bars, 3:1 to 15:1, are
# up to 0.9% too high; elements twice as large make that 2%
_SKINS = 6.0


@dataclass(frozen=True)
class Shape:
    """What decides how fine a body has to be meshed.

    Attributes:
        thickness: Of its thinner walls [m].
        length: Longest side of its bounding box [m].
        volume: [m^3].
        area: [m^2].
    """

    thickness: float
    length: float
    volume: float
    area: float


def shape_of(points: Array, triangles: Indices) -> Shape:
    """Measures a closed, outward surface.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3].
    """
    walls = wall_thickness(points, triangles)
    return Shape(
        thickness=float(np.quantile(walls, THIN)),
        length=float(np.ptp(points, axis=0).max()),
        volume=surface_volume(points, triangles),
        area=surface_area(points, triangles),
    )


def wall_thickness(points: Array, triangles: Indices, rays: int = _RAYS) -> Array:
    """Depth of a body below places spread evenly over its surface [m], shape [rays] or somewhat fewer.

    Args:
        points: [m], shape [n, 3].
        triangles: Shape [m, 3], closed and outward.
        rays: Number of places.
    """
    x = points[triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    doubled = np.linalg.norm(normal, axis=1)
    size = box_diagonal(points)
    # evenly along the surface laid out triangle by triangle: the same places every time, large faces often
    upto = np.cumsum(doubled)
    chosen = np.minimum(np.searchsorted(upto, upto[-1] * (np.arange(rays) + 0.5) / rays), len(x) - 1)
    weights = np.random.default_rng(1).dirichlet(np.ones(3), rays)
    depths = []
    for i, w in zip(chosen, weights, strict=True):
        inward = -normal[i] / max(doubled[i], np.finfo(float).tiny)
        depths.append(ray_length(w @ x[i], inward, x, 1e-6 * size))
    found = np.array(depths)
    found = found[np.isfinite(found)]
    return found if len(found) else np.array([size])


def element_size(
    shape: Shape, accuracy: float = ACCURACY, max_nodes: int = MAX_NODES, core: Core | None = None
) -> float:
    """Edge length [m] with which the first frequencies are as accurate as wanted.

    The strains of a ten-node tetrahedron are linear. Where a wall of thickness t bends along a length L, those of the
    exact solution that it misses are s^2 / (t L) of the largest, from the shear that balances the bending; next to
    a clamp, where the stress is singular, that enters the frequency to the first power. A slender beam so gets
    one element across its thickness, a stubby link three, a plate elements longer than it is thick.

    Args:
        accuracy: Relative error of the first frequencies.
        max_nodes: The size never falls below that which takes so many nodes.
        core: Of a printed body, in whose soft core it shears more than one element across can follow.
    """
    wanted = float(np.sqrt(accuracy / _ERROR * shape.thickness * shape.length))
    if core is not None:
        wanted = min(wanted, _SKINS * core.skin)
    return max(wanted, smallest_size(shape, max_nodes))


def expected_nodes(shape: Shape, size: float) -> float:
    """Number of nodes of ten-node tetrahedra of a size [m]; small features of the surface come on top."""
    return _NODES * (shape.volume / (_REGULAR * size**3) + shape.area / (_FACE * size**2))


def smallest_size(shape: Shape, max_nodes: int) -> float:
    """The size [m] that takes a number of nodes."""
    low = high = shape.length
    while expected_nodes(shape, low) < max_nodes:
        low *= 0.5
    while expected_nodes(shape, high) > max_nodes:
        high *= 2.0
    return float(brentq(lambda size: expected_nodes(shape, size) - max_nodes, low, high, xtol=1e-6 * shape.length))


def envelope(element_size: float, diagonal: float, shape: Shape, triangles: int) -> float:
    """How far the mesh may leave the surface [m].

    It, more than the element size, decides how many elements the small features of a surface cost. Walls keep their
    thickness only within an envelope much narrower than they are.

    Args:
        element_size: [m].
        diagonal: Of the body's bounding box [m].
    """
    simple = SIMPLE if element_size < _SHELL * shape.thickness else _FLAT
    part = 100.0 if triangles <= simple else 20.0
    distance = min(element_size / part, _FORM * diagonal, _WALL * shape.thickness)
    return max(distance, _LEAST * diagonal)
