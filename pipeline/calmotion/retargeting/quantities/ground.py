"""What ground can do to feet, as limits of the search: quantities that are linear in the multipliers of contacts, and
the velocities with which feet land (`simulation.standing.ground_limits`)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from calmotion.arrays import Array
from calmotion.model.limits.bounds import Bounds
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.retargeting.quantities.base import Quantity, RobotChange
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.standing.ground_limits import GroundLimits, Landing, landing_velocity

MARGIN = 0.01  # of the weight, or of the weight times the sole, by which limits are narrowed
SPEED = 0.1  # what velocities are measured by [m/s]
_NOWHERE = 1.0  # the value of a row at instants at which it does not count


def ground_bounds(limits: GroundLimits) -> Bounds:
    """Bounds of `Ground`."""
    speeds = np.concatenate([np.zeros(0), *[landing.speeds for landing in limits.landings]]) / SPEED
    count = len(limits.joints)
    upper = np.concatenate([np.full(count, np.inf), speeds])
    return Bounds(np.concatenate([np.full(count, MARGIN), -speeds]), upper, np.ones(len(upper)))


@dataclass(frozen=True, eq=False)
class Ground(Quantity):
    """R rows over what the animation needs, and three velocities of each landing, R + 3 L.

    Attributes:
        limits: Of the feet of a robot.
        h: Step [s].
    """

    limits: GroundLimits
    h: float
    by_loads = True
    is_stiff: ClassVar[bool] = True

    def values(self, run: ForwardRun) -> Array:
        """By the multipliers of contacts and by the motion of feet that land."""
        limits, count = self.limits, self.limits.lower.shape[1]
        found = np.zeros((len(limits.lower), count + 3 * len(limits.landings)))
        counts = np.isfinite(limits.lower)
        found[:, :count] = np.where(counts, limits.values(run) - np.where(counts, limits.lower, 0.0), _NOWHERE)
        for k, landing in enumerate(limits.landings):
            velocity = landing_velocity(landing, run, self.h)
            found[landing.instant, count + 3 * k : count + 3 * k + 3] = velocity / SPEED
        return found

    def slopes(self, run: ForwardRun) -> GroundSlopes:
        """About the run."""
        return GroundSlopes(self.limits, tuple(_by_motion(landing, run, self.h) for landing in self.limits.landings))


@dataclass(frozen=True, eq=False)
class GroundSlopes:
    """Derivatives of `Ground` about a run.

    Attributes:
        limits: With their rows.
        landings: Of each foot that lands, by its coordinates (R^T dc, dphi) at the two instants, shape [2, 3, 6].
    """

    limits: GroundLimits
    landings: tuple[Array, ...]

    def change(self, by: RobotChange) -> Array:
        """With the motion and the multipliers."""
        motion, loads, count = by.motion, by.loads, len(self.limits.joints)
        assert loads is not None
        found = np.zeros((len(motion), count + 3 * len(self.landings)))
        found[:, :count] = np.einsum("nri,nri->nr", self.limits.rows, loads[:, self.limits.joints])
        for k, (landing, own) in enumerate(zip(self.limits.landings, self.landings, strict=True)):
            n, b = landing.instant, landing.component
            found[n, count + 3 * k : count + 3 * k + 3] = own[0] @ motion[n - 1, b, :6] + own[1] @ motion[n, b, :6]
        return found

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the motion and by the multipliers."""
        gradient, loads, count = onto.motion, onto.loads, len(self.limits.joints)
        assert loads is not None
        pulled = self.limits.rows * values[:, :count, None]
        for row, joint in enumerate(self.limits.joints):
            loads[:, joint] += pulled[:, row]
        for k, (landing, by) in enumerate(zip(self.limits.landings, self.landings, strict=True)):
            n, b = landing.instant, landing.component
            own = values[n, count + 3 * k : count + 3 * k + 3]
            gradient[n - 1, b, :6] += own @ by[0]
            gradient[n, b, :6] += own @ by[1]


def _by_motion(landing: Landing, run: ForwardRun, h: float) -> Array:
    """A foot's velocity over `SPEED` by (R^T dc, dphi) at its two instants, shape [2, 3, 6]."""
    found, R = np.zeros((2, 3, 6)), np.zeros((3, 3))
    for row, (instant, sign) in enumerate(((landing.instant - 1, -1.0), (landing.instant, 1.0))):
        matrix_of(run.trajectory.states.q[instant, landing.component], R)
        found[row, :, :3] = sign / (h * SPEED) * R
        # R (dphi x p) = R [-p x] dphi
        found[row, :, 3:] = np.cross(landing.point, found[row, :, :3])
    return found
