"""What ground can do to feet, as limits of the search: quantities that are linear in the multipliers of contacts, and
the velocities with which feet land (`simulation.standing.ground_limits`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array, BoolArray
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.retargeting.problem.limits import LimitTerms
from calmotion.retargeting.solver.few_rows import with_rows
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.motor_limits import Bounds
from calmotion.simulation.standing.ground_limits import GroundLimits, Landing, landing_velocity

GROUND = "ground"
MARGIN = 0.01  # of the weight, or of the weight times the sole, by which limits are narrowed
SPEED = 0.1  # what velocities are measured by [m/s]
MOST = 64  # rows in a preconditioner; each costs an adjoint sweep, half a product, once where the problem is linearised
_NOWHERE = 1.0  # the value of a row at instants at which it does not count

Place = tuple[str, int, int]


def ground_of(robot: int) -> str:
    """The name of the limits of the feet of one of the robots of a problem."""
    return f"{GROUND} of robot {robot}" if robot else GROUND


def ground_bounds(limits: GroundLimits) -> Bounds:
    """Bounds of `ground_values`."""
    speeds = np.concatenate([np.zeros(0), *[landing.speeds for landing in limits.landings]]) / SPEED
    count = len(limits.joints)
    upper = np.concatenate([np.full(count, np.inf), speeds])
    return Bounds(np.concatenate([np.full(count, MARGIN), -speeds]), upper, np.ones(len(upper)))


def ground_values(limits: GroundLimits, run: ForwardRun, h: float) -> Array:
    """R rows over what the animation needs, and three velocities of each landing, in a run, shape [T, R + 3 L]."""
    count = limits.lower.shape[1]
    found = np.zeros((len(limits.lower), count + 3 * len(limits.landings)))
    counts = np.isfinite(limits.lower)
    found[:, :count] = np.where(counts, limits.values(run) - np.where(counts, limits.lower, 0.0), _NOWHERE)
    for k, landing in enumerate(limits.landings):
        found[landing.instant, count + 3 * k : count + 3 * k + 3] = landing_velocity(landing, run, h) / SPEED
    return found


@dataclass(frozen=True, eq=False)
class GroundSlopes:
    """Derivatives of `ground_values` about a run.

    Attributes:
        limits: With their rows.
        landings: Of each foot that lands, by its coordinates (R^T dc, dphi) at the two instants, shape [2, 3, 6].
    """

    limits: GroundLimits
    landings: tuple[Array, ...]

    @classmethod
    def about(cls, limits: GroundLimits, run: ForwardRun, h: float) -> GroundSlopes:
        """About a run with step h [s]."""
        return cls(limits, tuple(_by_motion(landing, run, h) for landing in limits.landings))

    def tangent(self, motion: Array, loads: Array) -> Array:
        """Change with the motion, shape [T, B, N], and the multipliers, shape [T, J, 6]."""
        count = len(self.limits.joints)
        found = np.zeros((len(motion), count + 3 * len(self.landings)))
        found[:, :count] = np.einsum("nri,nri->nr", self.limits.rows, loads[:, self.limits.joints])
        for k, (landing, by) in enumerate(zip(self.limits.landings, self.landings, strict=True)):
            n, b = landing.instant, landing.component
            found[n, count + 3 * k : count + 3 * k + 3] = by[0] @ motion[n - 1, b, :6] + by[1] @ motion[n, b, :6]
        return found

    def adjoint(self, values: Array, gradient: Array, loads: Array) -> None:
        """The transpose of `tangent`: adds to derivatives by the motion and by the multipliers."""
        count = len(self.limits.joints)
        pulled = self.limits.rows * values[:, :count, None]
        for row, joint in enumerate(self.limits.joints):
            loads[:, joint] += pulled[:, row]
        for k, (landing, by) in enumerate(zip(self.limits.landings, self.landings, strict=True)):
            n, b = landing.instant, landing.component
            own = values[n, count + 3 * k : count + 3 * k + 3]
            gradient[n - 1, b, :6] += own @ by[0]
            gradient[n, b, :6] += own @ by[1]


def with_ground_rows(
    inverse: Callable[[Array], Array], limits: LimitTerms | None, values: dict[str, Array], fixed: BoolArray,
    known: dict[Place, Array], pull: Callable[[dict[str, Array]], Array],
) -> Callable[[Array], Array]:  # fmt: skip
    """A preconditioner with the limits of feet that act; of many, those that pull most.

    Few of these limits act, but they are far stiffer than all else, and no matrix that is banded in time knows them:
    what a foot asks follows from all that the motors did before. Conjugate gradients without them took hundreds of
    products and did not keep the limits.

    Args:
        inverse: The preconditioner without them.
        limits: With terms that act, or None.
        values: Limited quantities, which say which limits act, by name, shape [T, R] each.
        fixed: Unknowns that keep their values, shape [n], bool.
        known: Rows of this linearisation by quantity, instant and column, shape [n] each; those missing are added.
        pull: Derivatives of the limited quantities by the unknowns, times values of the same shapes.
    """
    found: list[tuple[float, Place, float]] = []
    for name, v in values.items():
        if limits is not None and name.startswith(GROUND):
            pulls, weights = np.abs(limits.gradient(name, v)), limits.curvature(name, v)
            found += [(pulls[n, i], (name, int(n), int(i)), weights[n, i]) for n, i in np.argwhere(weights > 0.0)]
    found = sorted(found, key=lambda each: -each[0])[:MOST]
    for _, place, _ in found:
        if place not in known:
            one = np.zeros_like(values[place[0]])
            one[place[1:]] = 1.0
            known[place] = pull({place[0]: one})
    rows = [np.where(fixed, 0.0, known[place]) for _, place, _ in found]
    return with_rows(inverse, np.array(rows), np.array([weight for _, _, weight in found]))


def _by_motion(landing: Landing, run: ForwardRun, h: float) -> Array:
    """A foot's velocity over `SPEED` by (R^T dc, dphi) at its two instants, shape [2, 3, 6]."""
    found, R = np.zeros((2, 3, 6)), np.zeros((3, 3))
    for row, (instant, sign) in enumerate(((landing.instant - 1, -1.0), (landing.instant, 1.0))):
        matrix_of(run.trajectory.states.q[instant, landing.component], R)
        found[row, :, :3] = sign / (h * SPEED) * R
        # R (dphi x p) = R [-p x] dphi
        found[row, :, 3:] = np.cross(landing.point, found[row, :, :3])
    return found
