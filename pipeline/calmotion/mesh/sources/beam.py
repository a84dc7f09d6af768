"""An equivalent beam: the solid of a body without useful geometry, from its joints, mass, inertia and material.

Bars of one rectangular section lead from the joint towards the world to each other joint, or twice as far as the center
of mass where there is none. Length and density give the area of the section, the moments of inertia its proportions,
and the center of mass the taper of a single bar.
"""

from collections.abc import Sequence

import manifold3d
import numpy as np

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.mesh.repair.closed_solid import Solid
from calmotion.mesh.repair.closing import Part
from calmotion.mesh.repair.uniting import part_of
from calmotion.model import Body, Frame, MassProperties

_FLATTEST = 10.0  # width over height of a section
_TAPER = 0.6  # largest share by which the area differs at an end
_SHORT = 1e-6  # of the longest bar and of the radius of gyration: joints at one place


def equivalent_beam(body: Body, frames: Sequence[Frame]) -> Solid:
    """The equivalent beam of a body.

    Args:
        body: With `flexible` settings and a mass.
        frames: Of its joints, body frame; the first is that towards the world.

    Raises:
        ShotError: It has no mass or no joint, or its mass is in one place.
    """
    assert body.flexible is not None
    if body.mass is None or not frames:
        missing = "no mass" if body.mass is None else "no joint"
        raise ShotError(
            "this flexible body has no geometry",
            path=body.path,
            found=f"no TetMesh, Mesh or mesh file, and {missing} for an equivalent beam",
            remedy="Add a closed Mesh below it, name a mesh file in calm:flexible:meshFile, or author its physics:mass",
        )
    root = frames[0].position
    bars = [frame.position - root for frame in frames[1:]]
    if not any(np.linalg.norm(bar) > 0.0 for bar in bars):
        bars = [2.0 * (body.mass.center - root)]
    # a center of mass that rounding alone moves off the joint makes no beam: it is compared with the radius of gyration
    size = float(np.sqrt(np.trace(body.mass.inertia) / (2.0 * body.mass.mass)))
    longest = max(size, *(float(np.linalg.norm(bar)) for bar in bars))
    bars = [bar for bar in bars if np.linalg.norm(bar) > _SHORT * longest]
    if not bars:
        raise ShotError(
            "this flexible body has no geometry, and no length for an equivalent beam",
            path=body.path,
            found="its joints and its center of mass are in one place",
            remedy="Add a closed Mesh below it, or name a mesh file in calm:flexible:meshFile",
        )
    length = sum(float(np.linalg.norm(bar)) for bar in bars)
    area = body.mass.mass / (body.flexible.material.density * length)
    taper = 0.0
    if len(bars) == 1:  # the center of mass of a bar whose area grows by a share c to both sides is at 1/2 + c/6
        middle = float((body.mass.center - root) @ bars[0]) / float(bars[0] @ bars[0])
        taper = float(np.clip(6.0 * (middle - 0.5), -_TAPER, _TAPER))
    boxes = [_box(root, bar, area, taper, body.mass) for bar in bars]
    parts = [manifold3d.Manifold.hull_points(np.ascontiguousarray(box)) for box in boxes]
    part: Part = part_of(manifold3d.Manifold.batch_boolean(parts, manifold3d.OpType.Add))
    bar_or_bars = "a beam" if len(bars) == 1 else f"{len(bars)} beams"
    sides = " x ".join(f"{1e3 * side:.3g}" for side in _sides(bars[0], area, body.mass.inertia, body.mass.mass)[0])
    note = f"no geometry is used: {bar_or_bars} of {sides} mm from its mass, inertia, joints and material; expect 20%"
    return Solid(part.points, part.triangles.astype(np.int32), part.volume, (note,), "equivalent beam")


def _box(root: Array, bar: Array, area: float, taper: float, mass: MassProperties) -> Array:
    """Corners of a bar whose area is smaller at its root and larger at its tip by a share, shape [8, 3]."""
    (wide, high), across = _sides(bar, area, mass.inertia, mass.mass)
    signs = np.array([[s, t] for s in (-0.5, 0.5) for t in (-0.5, 0.5)])
    section = (signs * [wide, high]) @ across
    return np.vstack([root + np.sqrt(1.0 - taper) * section, root + bar + np.sqrt(1.0 + taper) * section])


def _sides(bar: Array, area: float, inertia: Array, mass: float) -> tuple[tuple[float, float], Array]:
    """Sides of the section [m] and their directions, unit vectors, shape [2, 3].

    A bar of sides b, h and length L has the moments m (h^2 + L^2) / 12 about b and m (b^2 + L^2) / 12 about h.
    """
    along = bar / np.linalg.norm(bar)
    plane = np.linalg.svd(along[None])[2][1:]
    moments, turned = np.linalg.eigh(plane @ inertia @ plane.T)
    difference = 12.0 * float(moments[1] - moments[0]) / mass  # of the squares of the sides
    wide = float(np.sqrt(0.5 * (difference + np.hypot(difference, 2.0 * area))))
    wide = min(wide, np.sqrt(_FLATTEST * area))
    # the larger moment is that about the direction across the wide side
    return (wide, area / wide), np.stack([turned[:, 0] @ plane, turned[:, 1] @ plane])
