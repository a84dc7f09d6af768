"""How far a flexible body can at most bend in a shot, from its surface alone: before meshes and finite elements.

The body is a beam along the straight axis from its root to each of its anchors, loaded as if all peaks of the shot met,
each in the worst direction, and everything hung on a slice but what lies between it and the root. What only
finite elements tell (thin walls, sections in pieces, plates, bodies of closed loops) is not told at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calmotion.accuracy.deflection_bound.beam import Beam, beam_between, stub
from calmotion.accuracy.deflection_bound.interface_radius import grip_radius
from calmotion.accuracy.element_size import THIN, wall_thickness
from calmotion.geometry.solid import Solid, solid_of
from calmotion.reduction.basis.static_loads import ACCELERATIONS, OVERSHOOT, peak_loads, unit_accelerations
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.shot.character import Array, Body, ElasticMaterial

if TYPE_CHECKING:
    from calmotion.multibody.model.joint_arrays import BodyAnchors

SAFETY = 4.0  # on what a beam is softer than a compact solid: for sections that change fast, and grips at an edge
_SHORTEST = 1e-6  # axis [m]; nearer to the root nothing moves
_RAYS = 100


@dataclass(frozen=True)
class Stiffness:
    """How far a body bends at most; `SAFETY` and `OVERSHOOT` are in it.

    Attributes:
        displacement_m: Largest displacement that its bending causes: of an anchor, and by the turn there of what is at
            the load_envelope's reach beyond it [m].
        rotation: Largest turn of an anchor [rad].
    """

    displacement_m: float
    rotation: float


def static_reach(body: Body, anchors: BodyAnchors, load_envelope: LoadEnvelope) -> Stiffness | None:
    """How far a body can at most bend under the loads of a shot.

    Args:
        body: With `flexible` settings.
        anchors: The frames of its joints, then of its targets; `root` is clamped.
        load_envelope: Its loads, one row for each joint of `anchors`.

    Returns:
        None where a beam does not tell: a body of a closed loop, whose loads a rigid robot does not tell, or of no
        physical material; and see `solid_of`, `beam_between` and `grip_radius`.
    """
    if load_envelope.closed_chain or body.flexible is None or not _is_physical(body.flexible.material):
        return None
    solid, material = solid_of(body), body.flexible.material
    if solid is None:
        return None
    places = np.array([frame.position for frame in anchors.frames]).reshape(-1, 3)
    count = len(anchors.joints)
    root = places[anchors.root]
    wall = float(np.quantile(wall_thickness(solid.points, solid.triangles, _RAYS), THIN))
    held = _grip(solid, body, places[:count], anchors.root)
    if held is None:
        return None
    ends = [k for k, place in enumerate(places) if np.linalg.norm(place - root) > _SHORTEST]
    if not ends:  # nothing hangs on it: its own far end
        far = int(np.linalg.norm(solid.points - root, axis=1).argmax())
        places, ends = np.vstack([places, solid.points[far]]), [len(places)]
    found = []
    for k in ends:
        beam = beam_between(solid, material, wall, root, places[k])
        grip = _grip(solid, body, places[:count], k) if k < count else 0.0
        if beam is None or grip is None:
            return None
        loads = _Loads.of(beam, places[:count], anchors.root, load_envelope)
        u, turn = _bent(beam, loads, material, places[k], held)
        if k < count:
            here = np.linalg.norm(places[:count] - places[k], axis=1) <= _SHORTEST  # these share what they hold
            wrench = [np.abs(peaks[here]).sum(axis=0) for peaks in (load_envelope.force, load_envelope.moment)]
            v, more = _given(beam, wrench, material, places[k], grip)
            u, turn = u + v, turn + more
        lever = float(load_envelope.lever_arm[k]) if k < count else 0.0
        size = float(np.linalg.norm(turn))
        found.append((float(np.linalg.norm(u)) + lever * size, size))
    largest = SAFETY * OVERSHOOT * np.max(found, axis=0)
    return Stiffness(float(largest[0]), float(largest[1])) if np.isfinite(largest).all() else None


@dataclass(frozen=True, eq=False)
class _Loads:
    """Peaks of forces [N] and moments [N m] at points [m], each of shape [l, 3]: pieces of mass, then interfaces."""

    at: Array
    force: Array
    moment: Array

    @staticmethod
    def of(beam: Beam, places: Array, root: int, load_envelope: LoadEnvelope) -> _Loads:
        peaks = peak_loads(load_envelope)[:ACCELERATIONS]
        force = beam.mass[:, None] * (np.abs(unit_accelerations(beam.center)) @ peaks)
        omega = load_envelope.angular_velocity
        twist = float(np.linalg.norm(load_envelope.angular_acceleration) + omega @ omega)
        moment = np.repeat((beam.mass * beam.spread * twist)[:, None], 3, axis=1)
        others = np.arange(len(places)) != root
        return _Loads(
            np.vstack([beam.center, places[others]]),
            np.vstack([force, np.abs(load_envelope.force[others])]),
            np.vstack([moment, np.abs(load_envelope.moment[others])]),
        )

    def about(self, points: Array, hanging: Array) -> tuple[Array, Array]:
        """Peak force and moment on k places, shape [k, 3]; `hanging` of shape [k, l] tells which loads they carry."""
        arms = np.abs(self.at[None] - points[:, None])
        moment = self.moment[None] + _cross(arms, self.force[None])
        return hanging @ self.force, np.einsum("kl,klx->kx", hanging, moment)


def _bent(beam: Beam, loads: _Loads, material: ElasticMaterial, end: Array, held: float) -> tuple[Array, Array]:
    """Largest displacement [m] and turn [rad] of the end of a beam, each of shape [3]."""
    hanging = np.vstack([beam.hang(loads.at), np.ones(len(loads.at))])
    points = np.vstack([beam.middle, beam.root])
    turn, shift = stub(material, held, float(np.linalg.norm(beam.middle[0] - beam.root)))
    force, moment = loads.about(points, hanging)
    angle = np.append(beam.turn, turn)[:, None] * moment
    moved = np.append(beam.shift, shift)[:, None] * force + _cross(angle, np.abs(end - points))
    return moved.sum(axis=0), angle.sum(axis=0)


def _given(
    beam: Beam, wrench: Sequence[Array], material: ElasticMaterial, end: Array, grip: float
) -> tuple[Array, Array]:
    """Largest displacement [m] and turn [rad] of a joint against the middle of the beam, each of shape [3]."""
    (force, moment), arm = wrench, np.abs(end - beam.middle[-1])
    turn, shift = stub(material, grip, float(np.linalg.norm(arm)))
    angle = turn * (moment + _cross(arm, force))
    return shift * force + _cross(angle, arm), angle


def _is_physical(material: ElasticMaterial) -> bool:
    return material.youngs_modulus > 0.0 and -1.0 < material.poissons_ratio < 0.5


def _cross(a: Array, b: Array) -> Array:
    """Bound of a cross product, whatever the signs; of absolute values, shape [..., 3]."""
    return np.roll(a, -1, -1) * np.roll(b, -2, -1) + np.roll(a, -2, -1) * np.roll(b, -1, -1)


def _grip(solid: Solid, body: Body, places: Array, joint: int) -> float | None:
    """Radius of the surface that a joint holds [m]; None where it holds none, or a point."""
    apart = np.linalg.norm(places - places[joint], axis=1)
    room = float(apart[apart > _SHORTEST].min(initial=np.inf))
    radius = grip_radius(solid.points, solid.triangles, body, places[joint], room)
    return radius if radius else None
