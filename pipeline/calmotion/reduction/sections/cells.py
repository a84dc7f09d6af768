"""What of a body is in the cells of a grid: how much of each is filled, and how stiff and heavy that is.

The cells are those of a box along the main axes of the surface, at least some across its thinnest side. Rays along
each axis count how often the surface winds around a cell, so that it may be open, in several parts, or inside out.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_fill_holes, distance_transform_edt, label

from calmotion.arrays import Array, BoolArray, Indices
from calmotion.mesh.grids import projected_area, ray_crossing
from calmotion.mesh.parts import holders
from calmotion.model.character import FlexibleSettings
from calmotion.support.compilation import kernel

_CELLS, _ACROSS = 200_000, 16  # of the box, and at least of its thinnest side
_LEAST_FILLED, _MOST_FILLED = 30_000, 60_000  # cells; with fewer or more, the box is cut anew
_LARGEST_BOX = 800_000  # cells
_LOOSE = 0.005  # of the cells: smaller loose parts are left out, as by the mesher
_ASIDE = (0.0031830989, 0.0036787944)  # of a cell: rays do not run along edges of CAD surfaces
_LEAST = 0.2  # share of a cell from which it belongs to the body


@dataclass(frozen=True, eq=False)
class Cells:
    """The filled cells of a body.

    Attributes:
        places: Their centers [m], shape [n, 3], body frame.
        grid: Their indices in the box, shape [n, 3].
        sides: Of a cell [m], shape [3].
        axes: Directions of the sides, one a row, shape [3, 3], body frame.
        stiffness: Volume of each, times its modulus over that of the material of the body [m^3], shape [n].
        mass: Volume of each, times its density over that of the material [m^3], shape [n].
        outside: Whether a cell has an empty neighbour, shape [n].
        volume: That they fill [m^3].
        low: First corner of the box, along `axes` [m], shape [3].
        within: Whether a cell of the box is deep inside the body, shape of the box.
    """

    places: Array
    grid: Indices
    sides: Array
    axes: Array
    stiffness: Array
    mass: Array
    outside: BoolArray
    volume: float
    low: Array
    within: BoolArray

    @property
    def side(self) -> float:
        """Side of a cube of the volume of a cell [m]."""
        return float(np.prod(self.sides) ** (1.0 / 3.0))

    def buried(self, places: Array) -> BoolArray:
        """Whether places [m], shape [n, 3], are deep inside the body."""
        at = np.floor((places @ self.axes.T - self.low) / self.sides).astype(int)
        return np.asarray(self.within[tuple(np.clip(at, 0, np.array(self.within.shape) - 1).T)])


def cells_of(points: Array, triangles: Indices, settings: FlexibleSettings) -> Cells | None:
    """The cells of a body; None where its surface encloses nothing.

    Args:
        points: Of its surface [m], shape [n, 3].
        triangles: Shape [m, 3].
        settings: Its wall, and its material with core or parts.
    """
    corners = points[triangles]
    axes = _main_axes(corners)
    turned = corners @ axes.T
    low, high = turned.min(axis=(0, 1)), turned.max(axis=(0, 1))
    if not np.all(high > low):
        return None
    count = _CELLS
    for _ in range(2):
        sides = _sides(high - low, count)
        counts = np.ceil((high - low) / sides).astype(int) + 2
        first = 0.5 * (low + high) - 0.5 * counts * sides
        filled = _filled((turned - first) / sides, counts)
        solid = filled > _LEAST
        found = int(solid.sum())
        if found == 0:
            return None
        if _LEAST_FILLED <= found <= _MOST_FILLED or (found < _LEAST_FILLED and count >= _LARGEST_BOX):
            break
        count = min(int(count * np.sqrt(_LEAST_FILLED * _MOST_FILLED) / found), _LARGEST_BOX)
    low, solid = first, _without_loose(solid)
    within = _solid_neighbours(solid)
    grid = np.argwhere(solid)
    places = (low + (grid + 0.5) * sides) @ axes
    share = filled[solid] * _wall_share(solid, sides, settings)
    volume = float(np.prod(sides)) * share
    moduli, densities = _materials(places, solid, sides, settings)
    kept = share > 1e-3
    return Cells(
        places[kept], grid[kept], sides, axes, (volume * moduli)[kept], (volume * densities)[kept],
        ~within[solid][kept], float(volume.sum()), low, within,
    )  # fmt: skip


def _main_axes(corners: Array) -> Array:
    """Main axes of a surface, unit vectors, one a row, right-handed."""
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    middle = corners.mean(axis=1)
    arms = middle - area @ middle / max(float(area.sum()), np.finfo(float).tiny)
    axes = np.linalg.eigh(np.einsum("e,ei,ej->ij", area, arms, arms))[1].T
    if np.linalg.det(axes) < 0.0:
        axes[0] *= -1.0
    return np.asarray(axes)


def _sides(extent: Array, count: float) -> Array:
    """Sides of a cell [m]: even, but no larger than a part of the thinnest sides."""
    sides = np.full(3, float(np.prod(extent) / count) ** (1.0 / 3.0))
    thin: BoolArray = np.zeros(3, bool)
    for _ in range(2):
        thin |= extent < _ACROSS * sides
        sides[thin] = extent[thin] / _ACROSS
        left = count / _ACROSS ** int(thin.sum())
        if not thin.all():
            sides[~thin] = float(np.prod(extent[~thin]) / left) ** (1.0 / float((~thin).sum()))
    return sides


def _filled(corners: Array, counts: Array) -> Array:
    """Share of each cell inside a surface whose corners are in units of cells, shape `counts`.

    A ray that leaves an open surface counts nothing; where the others disagree about a whole cell, most of them decide.
    """
    shares = np.full((3, *counts), np.nan)
    for axis in range(3):
        order = [axis, (axis + 1) % 3, (axis + 2) % 3]
        turned = np.zeros(tuple(counts[order]))
        _cross(np.ascontiguousarray(corners[:, :, order]), _ASIDE[0], _ASIDE[1], turned)
        np.cumsum(turned, axis=0, out=turned)
        open_rays = np.abs(turned[-1]) > 0.5
        turned = np.minimum(np.abs(turned), 1.0)
        turned[:, open_rays] = np.nan
        shares[axis] = np.moveaxis(turned, (0, 1, 2), order)
    known = np.isfinite(shares)
    partial = known & (shares > 1e-6) & (shares < 1.0 - 1e-6)
    values = np.where(known, shares, 0.0)
    whole = values.sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    count = partial.sum(axis=0)
    mean = np.where(partial, shares, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(count > 0, mean, np.where(whole > 0.5, 1.0, 0.0))


@kernel
def _cross(corners: Array, aside_y: float, aside_z: float, changes: Array) -> None:
    """Add what each crossing of a ray along x with a triangle changes of the share of the cells behind it."""
    for t in range(len(corners)):
        x = corners[t]
        area = projected_area(x)
        if area == 0.0:
            continue
        y0, y1 = min(x[0, 1], x[1, 1], x[2, 1]), max(x[0, 1], x[1, 1], x[2, 1])
        z0, z1 = min(x[0, 2], x[1, 2], x[2, 2]), max(x[0, 2], x[1, 2], x[2, 2])
        for j in range(max(int(y0 - 1.0), 0), min(int(y1) + 1, changes.shape[1])):
            y = j + 0.5 + aside_y
            for k in range(max(int(z0 - 1.0), 0), min(int(z1) + 1, changes.shape[2])):
                z = k + 0.5 + aside_z
                crossing = ray_crossing(x, area, y, z)
                if np.isnan(crossing):
                    continue
                i = min(max(int(crossing), 0), changes.shape[0] - 2)
                sign = -1.0 if area > 0.0 else 1.0
                changes[i, j, k] += sign * (i + 1.0 - crossing)
                changes[i + 1, j, k] += sign * (crossing - i)


def _without_loose(solid: BoolArray) -> BoolArray:
    """The solid cells without small parts that nothing holds."""
    parts, count = label(solid, np.ones((3, 3, 3)))
    if count == 1:
        return solid
    sizes = np.bincount(parts.ravel())
    sizes[0] = 0
    large = sizes >= min(_LOOSE * float(sizes.sum()), float(sizes.max()))
    return np.asarray(large[parts])


def _solid_neighbours(solid: BoolArray) -> BoolArray:
    """Whether all six neighbours of a cell are solid, shape of `solid`, whose rim is empty."""
    whole = binary_fill_holes(solid)  # walls of a cavity are no outside
    within = whole.copy()
    for axis in range(3):
        within &= np.roll(whole, 1, axis) & np.roll(whole, -1, axis)
    return np.asarray(within)


def _wall_share(solid: BoolArray, sides: Array, settings: FlexibleSettings) -> Array:
    """Share of each solid cell in the wall of a hollow part, shape [n]."""
    if settings.wall_thickness <= 0.0:
        return np.ones(int(solid.sum()))
    return _skin_share(solid, sides, settings.wall_thickness)


def _skin_share(solid: BoolArray, sides: Array, thickness: float) -> Array:
    """Share of each solid cell that lies no deeper than a thickness [m], shape [n]."""
    depth = distance_transform_edt(solid, sampling=sides)[solid]  # of its center, and half a cell more
    side = float(sides.mean())
    # in a layer of cells that is thicker than the wall the wall is a part of each
    return np.asarray(np.clip((thickness - depth) / side + 1.0, 0.0, 1.0))


def _materials(places: Array, solid: BoolArray, sides: Array, settings: FlexibleSettings) -> tuple[Array, Array]:
    """Modulus and density of each solid cell over those of the material, shape [n] each."""
    material, ones = settings.material, np.ones(len(places))
    if material.core is not None:
        skin = _skin_share(solid, sides, material.core.skin)
        low, light = material.core.stiffness, material.core.infill
        return low + (1.0 - low) * skin, light + (1.0 - light) * skin
    if not material.parts:
        return ones, ones
    part = holders(places, material.parts)
    moduli, densities = np.array([(p.modulus, p.density) for p in material.parts]).T
    return moduli[part], densities[part]
