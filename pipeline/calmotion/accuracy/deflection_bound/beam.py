"""A solid as a beam from one place in it to another: slices across a straight axis, as soft as they can be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.geometry.sections import Sections, cross_sections
from calmotion.geometry.solid import Solid
from calmotion.geometry.tetrahedra import surface_volume
from calmotion.shot.character import Array, BoolArray, ElasticMaterial

_FILL = 0.25  # of the bounding box, below which a section is no beam's
_COMPACTNESS = 0.2  # below, walls are thinner than a fifth of a square tube, and give locally
_WIDE = 1.5  # times the axis, wider than which a section does not take part as a whole
_STEEP = 1.5  # slope of the middle line against the axis
_STATIONS, _FINEST = 40, 600  # least number on the axis, and largest along the body
_WINDOW = 0.125  # of the axis, over which the slope of the middle line is taken
_LOST = 0.05  # of the volume, that sections may miss or count twice
_PUNCH = 0.6  # radii of a round bar that gives at least as much as the half-space around a rigid disc, every way
_SHEAR = 5.0 / 6.0


@dataclass(frozen=True, eq=False)
class Beam:
    """Slices between the ends of an axis, then pieces of mass along the whole body.

    Attributes:
        middle: Centroids of the slices [m], shape [k, 3], body frame, from the root on.
        turn: Largest rotation of each slice by a moment [1/(N m)], shape [k].
        shift: Largest displacement of each slice by a force [1/N], shape [k].
        root: Where it is clamped [m], shape [3].
        axis: From the root to the other end, unit, shape [3].
        along: Places of the slices on the axis, from the root [m], shape [k].
        center: Centers of the pieces [m], shape [s, 3].
        mass: [kg], shape [s].
        spread: Mean square distance of each piece's mass from its center [m^2], shape [s].
    """

    middle: Array
    turn: Array
    shift: Array
    root: Array
    axis: Array
    along: Array
    center: Array
    mass: Array
    spread: Array

    def hang(self, places: Array) -> BoolArray:
        """Which of l places, shape [l, 3], hang on each slice, shape [k, l]: all but those between it and the root."""
        x = (places - self.root) @ self.axis
        return ~((x > 0.0) & (x < self.along[:, None]))


def beam_between(solid: Solid, material: ElasticMaterial, wall: float, root: Array, end: Array) -> Beam | None:
    """The beam of a solid between two places.

    Slices follow the middle line where it leaves the axis, and are cut down to what is across it. None bends more
    stiffly than if it came apart into walls as thick as it is deep (twice its area over its outline), or as the body's
    thinner walls are: what a section does not show, as plates across the axis, counts as well.

    Args:
        solid: The body.
        material: Of it.
        wall: Thickness of the body's thinner walls [m].
        root: Clamped end of the axis [m], shape [3].
        end: Its other end [m], shape [3].

    Returns:
        None unless every slice is compact, and the solid long and straight enough for a beam.
    """
    length = float(np.linalg.norm(end - root))
    axis = (end - root) / length
    along = (solid.points - root) @ axis
    stations, thickness = _stations(along, length)
    found = cross_sections(solid.points, solid.triangles, root, axis, stations)
    volume = found.area * thickness
    if abs(volume.sum() / surface_volume(solid.points, solid.triangles) - 1.0) > _LOST:
        return None
    inside = (stations > 0.0) & (stations < length)
    slope = _slope(found, inside, root, axis, length)
    if slope is None or not _is_compact(found, inside, length):
        return None
    cosine = 1.0 / np.hypot(1.0, slope)
    area = found.area[inside] * cosine
    depth = np.minimum(2.0 * found.depth[inside], wall)
    bending = np.minimum(found.second[inside, 0], found.area[inside] * depth**2 / 12.0) * cosine**3
    torsion = area**4 / (40.0 * found.second[inside].sum(axis=1))
    step = thickness[inside] / cosine
    turn, shift = compliance(material, area, bending, torsion)
    safe = np.where(found.area > 0.0, found.area, 1.0)
    return Beam(
        middle=found.centroid[inside],
        turn=turn * step,
        shift=shift * step,
        root=root,
        axis=axis,
        along=stations[inside],
        center=found.centroid,
        mass=volume * solid.mass.mass / volume.sum(),
        spread=found.second.sum(axis=1) / safe + thickness**2 / 12.0,
    )


def stub(material: ElasticMaterial, radius: float, length: float) -> tuple[float, float]:
    """Rotation by a moment [1/(N m)] and displacement by a force [1/N] of what is around a joint.

    A round bar as thick as what the joint holds leads from there to the middle of the body, and is longer by what the
    material around a rigid disc gives.

    Args:
        material: Of the body.
        radius: Of the surface that the joint holds [m].
        length: From the joint to the middle of the body [m].

    Source: Johnson, Contact Mechanics, 3.4 to 3.7 (rigid discs on a half-space).
    """
    area, second = np.pi * radius**2, 0.25 * np.pi * radius**4
    turn, shift = compliance(material, np.array(area), np.array(second), np.array(2.0 * second))
    whole = length + _PUNCH * radius
    return float(turn * whole), float(shift * whole)


def compliance(material: ElasticMaterial, area: Array, bending: Array, torsion: Array) -> tuple[Array, Array]:
    """Rotation by a moment [1/(N m^2)] and displacement by a force [1/N], each for a unit of length.

    Whichever way they act, they count as if they acted the softest way.

    Args:
        area: [m^2].
        bending: Second moment of area [m^4].
        torsion: Torsion constant [m^4].
    """
    shear = material.youngs_modulus / (2.0 * (1.0 + material.poissons_ratio))
    turn = 1.0 / np.minimum(material.youngs_modulus * bending, shear * torsion)
    return turn, 1.0 / (area * np.minimum(material.youngs_modulus, _SHEAR * shear))


def _stations(along: Array, length: float) -> tuple[Array, Array]:
    """Middles of slices along the axis, and their thickness [m]; corners lie between slices, where not too many do.

    Args:
        along: Of the points, on the axis [m], shape [n].
        length: Of the axis [m].
    """
    low, high = min(float(along.min()), 0.0), max(float(along.max()), length)
    finest = (high - low) / _FINEST
    levels = np.unique(np.concatenate([along, np.arange(low, high, length / _STATIONS)]))
    kept = levels[np.unique(np.floor((levels - low) / finest), return_index=True)[1]]
    kept = kept[(np.abs(kept) > finest) & (np.abs(kept - length) > finest)]
    kept = np.unique(np.concatenate([kept, [low, 0.0, length, high]]))
    return 0.5 * (kept[1:] + kept[:-1]), np.diff(kept)


def _slope(found: Sections, inside: BoolArray, root: Array, axis: Array, length: float) -> Array | None:
    """Slope of the middle line against the axis, shape [k]; None where it wanders too far."""
    x = found.stations[inside]
    aside = found.centroid[inside] - root
    aside -= np.outer(aside @ axis, axis)
    if float(np.linalg.norm(np.diff(aside, axis=0), axis=1).sum()) > length:
        return None
    window = 0.5 * _WINDOW * length
    ends = np.maximum(x - window, x[0]), np.minimum(x + window, x[-1])
    moved = [np.interp(ends[1], x, aside[:, k]) - np.interp(ends[0], x, aside[:, k]) for k in range(3)]
    slope = np.linalg.norm(moved, axis=0) / (ends[1] - ends[0])
    return slope if slope.max() <= _STEEP else None


def _is_compact(found: Sections, inside: BoolArray, length: float) -> bool:
    return bool(
        (found.fill[inside] >= _FILL).all()
        and (found.compactness[inside] >= _COMPACTNESS).all()
        and found.extent[inside].max() <= _WIDE * length
    )
