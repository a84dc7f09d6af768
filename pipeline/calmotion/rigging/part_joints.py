"""The joint between two rigid parts, found from the motion of one in the axes of the other.

With the rotation D and the displacement of its origin u since the first sample, the point of the part that was at c is
displaced by u + (D - I) (c - p). A hinge holds the points of a line, a ball one point: c follows by linear least
squares over all samples.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.rigging.hinge_rows import follow, hinges_for

FIXED, REVOLUTE, PRISMATIC, BALL, FREE = "fixed", "revolute", "prismatic", "ball", "free"
FREEDOMS = {FIXED: 0, REVOLUTE: 1, PRISMATIC: 1, BALL: 3, FREE: 6}
STILL_ANGLE = 5e-6  # [rad] a part that rotates by less is still: matrices in single precision err by a tenth of this
GAP = 1e-4  # [m] largest distance of a part from where its joint has it, as the reader of posed joints has it
SINGLE = 6e-8  # rounding of single precision, in which most programs compute transforms, over the coordinate


@dataclass(frozen=True, eq=False)
class PartJoint:
    """A joint and its motion.

    Attributes:
        kind: `fixed`, `revolute`, `prismatic`, `ball` (two or three hinges through one point) or `free`.
        axes: Unit axes of its hinges, or of its slide, axes of the carrier at the first sample, shape [m, 3].
        point: On all axes [m], axes of the carrier, shape [3].
        values: Angles, unwrapped [rad], or lengths [m], 0 at the first sample, shape [n, m].
        tilt: Residual angle [rad], shape [n].
        gap: Residual distance at the point [m], shape [n].
    """

    kind: str
    axes: Array
    point: Array
    values: Array
    tilt: Array
    gap: Array

    def moved(self, R: Array, p: Array) -> tuple[Array, Array]:
        """Rotation [n, 3, 3] and origin [n, 3] of the part by this joint, from those of the first sample [3, 3] and
        [3], in the carrier."""
        if self.kind == PRISMATIC:
            return np.broadcast_to(R, (len(self.values), 3, 3)), p + self.values * self.axes
        D = np.broadcast_to(np.eye(3), (len(self.values), 3, 3))
        for axis, angle in zip(self.axes, self.values.T, strict=True):
            D = D @ Rotation.from_rotvec(angle[:, None] * axis).as_matrix()
        return D @ R, self.point + D @ (p - self.point)

    def uncertainty(self, rounding: float) -> float:
        """How far the axis may be elsewhere [m]: the residual, or the rounding of positions [m], over the angle."""
        return max(float(self.gap.max()), rounding) / max(float(np.ptp(self.values)), 1e-300)


def relative(R0: Array, p0: Array, R1: Array, p1: Array) -> tuple[Array, Array]:
    """Rotation [n, 3, 3] and origin [n, 3] of frame 1 in the axes of frame 0."""
    back = np.swapaxes(R0, 1, 2)
    return back @ R1, np.einsum("nij,nj->ni", back, p1 - p0)


def find_joint(R: Array, p: Array, tolerance: float, rounding: float) -> PartJoint:
    """The joint of the fewest degrees of freedom that performs a motion.

    Args:
        R, p: Rotation and origin [m] of a part in the axes of its carrier, neighbours less than half a turn apart,
            shapes [n, 3, 3] and [n, 3].
        tolerance: Largest residual angle [rad]; that of the distance is `GAP`.
        rounding: Of positions [m].

    Returns:
        Where nothing but a free motion fits, the hinge that is nearest to it, with the kind `free`.
    """
    D, u = R @ R[0].T, p - p[0]
    vectors = Rotation.from_matrix(D).as_rotvec()
    turned, away = np.linalg.norm(vectors, axis=1), np.linalg.norm(u, axis=1)
    if turned.max() <= STILL_ANGLE and away.max() <= max(1e-6, 16.0 * rounding):
        return PartJoint(FIXED, np.zeros((0, 3)), p[0], np.zeros((len(p), 0)), turned, away)
    allowed = max(GAP, 16.0 * rounding)
    single = [_slide(p, turned)]
    if turned.max() > STILL_ANGLE:
        single.append(_hinge(D, p, vectors))

    def off(joint: PartJoint) -> float:
        return max(float(joint.tilt.max()) / max(tolerance, STILL_ANGLE), float(joint.gap.max()) / allowed)

    best = min(single, key=off)
    if off(best) <= 1.0:
        return best
    point = center(D, p)
    gap = _gap(D, p, point)
    if turned.max() > STILL_ANGLE and gap.max() <= allowed:
        return PartJoint(BALL, np.eye(3), point, np.zeros((len(p), 3)), np.zeros(len(p)), gap)
    nearest = single[-1]
    return PartJoint(FREE, nearest.axes, nearest.point, nearest.values, nearest.tilt, nearest.gap)


def with_hinges(joint: PartJoint, R: Array, tolerance: float) -> PartJoint:
    """A ball joint with the fewest hinges that follow the rotations R [n, 3, 3] of its part in the carrier."""
    row = hinges_for(R @ R[0].T, tolerance)
    return PartJoint(BALL, row.axes, joint.point, row.angles, row.residual, joint.gap)


def center(D: Array, p: Array, axis: Array | None = None) -> Array:
    """The point of a carrier from which a part goes away the least, nearest to the part's first origin.

    Args:
        D: Rotations since the first sample, shape [n, 3, 3].
        p: Origins of the part [m], shape [n, 3].
        axis: Of the rotations: nothing is sought along it.
    """
    across = np.eye(3) if axis is None else np.linalg.svd(axis[None])[2][1:]
    A = ((D - np.eye(3)) @ across.T).reshape(-1, len(across))
    # a direction about which hardly anything turns has no say
    found: Array = p[0] + np.linalg.lstsq(A, (p[0] - p).ravel(), rcond=1e-4)[0] @ across
    return found


def _gap(D: Array, p: Array, point: Array) -> Array:
    gap: Array = np.linalg.norm(p + D @ (point - p[0]) - point, axis=1)
    return gap


def _slide(p: Array, turned: Array) -> PartJoint:
    middle = p.mean(axis=0)
    axis = _signed(np.linalg.svd(p - middle, full_matrices=False)[2][0])
    along = (p - middle) @ axis
    gap = np.linalg.norm(p - middle - along[:, None] * axis, axis=1)
    return PartJoint(PRISMATIC, axis[None], p[0], (along - along[0])[:, None], turned, gap)


def _hinge(D: Array, p: Array, vectors: Array) -> PartJoint:
    axis = _signed(np.linalg.svd(vectors, full_matrices=False)[2][0])
    angles, tilt = follow(axis[None], D)
    point = center(D, p, axis)
    return PartJoint(REVOLUTE, axis[None], point, angles - angles[0], tilt, _gap(D, p, point))


def _signed(axis: Array) -> Array:
    # the sign is arbitrary: the largest component is positive, so that similar joints have similar axes
    signed: Array = axis * np.sign(axis[np.argmax(np.abs(axis))])
    return signed
