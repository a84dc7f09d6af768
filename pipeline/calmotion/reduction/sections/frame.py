"""Stiffness and mass of a frame of beams whose nodes are the sections of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import binary_closing, binary_fill_holes
from scipy.sparse import block_diag, coo_matrix

from calmotion.arrays import Array, Indices
from calmotion.model.character import ElasticMaterial
from calmotion.reduction.sections.bands import Bands
from calmotion.reduction.sections.cells import Cells

_LARGER = 3.0  # times the section of the other one
_SHORT = 0.7  # of the width of a band: shortest beam


@dataclass(frozen=True, eq=False)
class BeamFrame:
    """A frame, its first node held.

    Attributes:
        nodes: [m], shape [s, 3], body frame.
        stiffness: Of the free nodes, six coordinates each, sparse, shape [6 (s - 1), 6 (s - 1)].
        points: Six points of each node that have its mass and inertia [m], shape [s, 6, 3].
        point_mass: Of each of them [kg], shape [s].
    """

    nodes: Array
    stiffness: Any
    points: Array
    point_mass: Array

    def mass(self) -> Any:
        """Mass matrix of the free nodes, as of `stiffness`."""
        blocks = []
        for node, points, mass in zip(self.nodes[1:], self.points[1:], self.point_mass[1:], strict=True):
            motion = np.vstack([carried(point - node) for point in points])
            blocks.append(mass * motion.T @ motion)
        return block_diag(blocks, format="csc")

    def displacements(self, modes: Array) -> Array:
        """Displacement of the points by motions of the nodes, shape [s, 6, r] to [6 s, 3, r]."""
        arms = self.points - self.nodes[:, None]
        moved = modes[:, None, :3] + np.cross(modes[:, None, 3:], arms[..., None], axisa=2, axisb=2, axisc=2)
        return np.asarray(moved.reshape(-1, 3, modes.shape[2]))


def carried(arm: Array) -> Array:
    """Motion of a point that a node carries, by the six coordinates of the node, shape [3, 6]."""
    x, y, z = arm
    turned = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])
    return np.hstack([np.eye(3), turned])


def frame_of(cells: Cells, bands: Bands, material: ElasticMaterial, mass: float | None) -> BeamFrame:
    """The frame of a body.

    Args:
        mass: That is stated [kg]; None: that of volume and density.
    """
    section, count = bands.section, len(bands.width)
    center, stiff, second = _moments(cells.places, cells.stiffness, section, count, cells)
    middle, volume, spread = _moments(cells.places, cells.mass, section, count, cells)
    kilograms = material.density * volume
    if mass is not None:
        kilograms *= mass / max(float(kilograms.sum()), np.finfo(float).tiny)
    points = np.empty((count, 6, 3))
    for k in range(count):
        values, vectors = np.linalg.eigh(spread[k] / max(volume[k], np.finfo(float).tiny))
        arms = (np.sqrt(3.0 * np.maximum(values, 0.0)) * vectors).T
        points[k] = middle[k] + np.vstack([arms, -arms])
    stiffness = _assembled(bands, center, stiff, second, material, _Sections(cells, section, count))
    return BeamFrame(center, stiffness, points, kilograms / 6.0)


def _moments(places: Array, weight: Array, section: Indices, count: int, cells: Cells) -> tuple[Array, Array, Array]:
    """Center, sum and central second moments of the weights of each section, shapes [s, 3], [s] and [s, 3, 3]."""
    total: Array = np.bincount(section, weight, count).astype(float)
    safe = np.maximum(total, np.finfo(float).tiny)
    center = np.stack([np.bincount(section, weight * places[:, i], count) for i in range(3)], axis=1) / safe[:, None]
    arms = places - center[section]
    second = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(3):
            second[:, i, j] = np.bincount(section, weight * arms[:, i] * arms[:, j], count)
    own = (cells.axes.T * cells.sides**2 / 12.0) @ cells.axes
    return center, total, second + total[:, None, None] * own


def _assembled(
    bands: Bands, center: Array, stiff: Array, second: Array, material: ElasticMaterial, sections: _Sections
) -> Any:
    rows, columns, values = [], [], []
    for (a, b), direction, touch in zip(bands.pairs, bands.directions, bands.touch, strict=True):
        wide = stiff[[a, b]] / bands.width[[a, b]]
        # a section that is much larger than the other one carries it where they touch
        start = touch if a == 0 or wide[0] > _LARGER * wide[1] else center[a]
        end = touch if wide[1] > _LARGER * wide[0] and a else center[b]
        members = [k for k, place in ((a, start), (b, end)) if place is not touch]
        least = _SHORT * float(bands.width[members].min())
        step = end - start
        length = float(np.linalg.norm(step))
        along = _along(step, length > 0.5 * least, direction, second[b])
        length = max(length, least)
        own = [(stiff[k], second[k], bands.width[k], sections.places(k)) for k in members]
        element = _beam(along, length, own, material, sections.side)
        middle, half = 0.5 * (start + end), 0.5 * length * along
        start, end = middle - half, middle + half
        carry = np.zeros((12, 12))
        for block, node, place in ((0, center[a], start), (6, center[b], end)):
            carry[block : block + 3, block : block + 6] = carried(place - node)
            carry[block + 3 : block + 6, block + 3 : block + 6] = np.eye(3)
        element = carry.T @ element @ carry
        at = np.concatenate([6 * (a - 1) + np.arange(6), 6 * (b - 1) + np.arange(6)])
        free = at >= 0
        at = at[free]
        rows.append(np.repeat(at, len(at)))
        columns.append(np.tile(at, len(at)))
        values.append(element[np.ix_(free, free)].ravel())
    size = 6 * (len(center) - 1)
    return coo_matrix((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), (size, size)).tocsc()


def _along(step: Array, far: bool, direction: Array, second: Array) -> Array:
    """Direction of a beam: from one center to the other, or as the cells touch; across the section without either."""
    if not far and direction.any():
        return direction
    length = float(np.linalg.norm(step))
    return step / length if length > 0.0 else np.asarray(np.linalg.eigh(second)[1][:, 0])


def _beam(along: Array, length: float, members: Any, material: ElasticMaterial, side: float) -> Array:
    """Stiffness of a straight beam between two sections, its ends' six coordinates each, shape [12, 12]."""
    modulus, shear = material.youngs_modulus, material.youngs_modulus / (2.0 * (1.0 + material.poissons_ratio))
    plane = np.linalg.svd(along[None])[2][1:]
    areas = [stiff / width for stiff, _, width, _ in members]
    moments = [plane @ (second / width) @ plane.T for _, second, width, _ in members]
    area = len(areas) / sum(1.0 / a for a in areas)
    moment = np.linalg.inv(sum(np.linalg.inv(m) for m in moments) / len(moments))
    holes = [_hole(places @ plane.T, side) for *_, places in members]
    twists = [_torsion(a, float(np.trace(m)), *hole) for a, m, hole in zip(areas, moments, holes, strict=True)]
    twist = len(areas) / sum(1.0 / own for own in twists)
    carries = min(_thin_walls(a, float(np.trace(m))) for a, m in zip(areas, moments, strict=True))
    principal, turn = np.linalg.eigh(moment)
    p, q = turn.T @ plane
    if np.dot(np.cross(along, p), q) < 0.0:
        q = -q
    # flexibility at the far end, the near end held: force along, across p, across q, moments about the same
    flexibility = np.zeros((6, 6))
    flexibility[0, 0] = length / (modulus * area)
    flexibility[3, 3] = length / (shear * twist)
    for force, moment_, value, sign in ((1, 5, principal[0], 1.0), (2, 4, principal[1], -1.0)):
        bending = modulus * value
        flexibility[force, force] = length**3 / (3.0 * bending) + length / (carries * shear * area)
        flexibility[moment_, moment_] = length / bending
        flexibility[force, moment_] = flexibility[moment_, force] = sign * length**2 / (2.0 * bending)
    far = np.linalg.inv(flexibility)
    local = np.stack([along, p, q])
    turned = np.zeros((6, 6))
    turned[:3, :3] = turned[3:, 3:] = local
    far = turned.T @ far @ turned
    # the near end moves the far one as a rigid body
    rigid = np.eye(6)
    rigid[:3, 3:] = carried(length * along)[:, 3:]
    both = np.hstack([-rigid, np.eye(6)])
    return np.asarray(both.T @ far @ both)


def _torsion(area: float, polar: float, hole: float, hole_polar: float) -> float:
    """Torsion constant of a section [m^4]: that of the whole without that of what it encloses.

    Source: Saint-Venant's A^4 / (40 I_p), exact for ellipses within 1.3%.
    """
    if hole == 0.0:
        return min(area**4 / (40.0 * polar), polar)
    whole = (area + hole) ** 4 / (40.0 * (polar + hole_polar)) - hole**4 / (40.0 * hole_polar)
    return min(max(whole, area**4 / (40.0 * polar)), polar)


def _hole(places: Array, side: float) -> tuple[float, float]:
    """Area [m^2] and polar moment [m^4] of what a section encloses, by its cells [m], shape [n, 2]."""
    at = np.round((places - places.min(axis=0)) / side).astype(int) + 2
    filled = np.zeros(tuple(at.max(axis=0) + 3), bool)
    filled[tuple(at.T)] = True
    filled = binary_closing(filled)  # cells of an oblique section leave places between them
    holes = np.argwhere(binary_fill_holes(filled) & ~filled)
    if not len(holes):
        return 0.0, 0.0
    arms = (holes - at.mean(axis=0)) * side
    return float(len(holes)) * side**2, float((arms**2).sum()) * side**2


def _thin_walls(area: float, polar: float) -> float:
    """Share of a section that carries shear: 5/6 of a rectangle, 1/2 of a tube.

    Source: Cowper 1966, for solid sections and thin round tubes.
    """
    return 0.5 + 0.35 * min(area**2 / (2.0 * np.pi * polar), 1.0)


class _Sections:
    """The cells of each section.

    Args:
        cells, section: Of a body.
        count: Number of sections.
    """

    def __init__(self, cells: Cells, section: Indices, count: int):
        self.side = float(cells.sides.max())
        self._cells = cells.places[np.argsort(section, kind="stable")]
        self._ends = np.cumsum(np.bincount(section, minlength=count))

    def places(self, number: int) -> Array:
        """Centers of the cells of a section [m], shape [n, 3]."""
        return np.asarray(self._cells[self._ends[number - 1] : self._ends[number]])
