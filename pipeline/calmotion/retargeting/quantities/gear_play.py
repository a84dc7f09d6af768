"""The play of gears in the objective: gears should not change their sides for little, where the targets matter.

A gear with play b lies on the side to which the torque tau that it transmits pushes it (`tolerance.motors.backlash`).
With J the motion of the targets by the joint, weighted as their errors are, they move by |J| b where it changes its
side. Some reversals cannot be avoided: a link that swings must be braked. Others are short, or hardly push. Sides
sigma(t) = +1 or -1 that a gear should have are those of least

    int (max(0, -sigma tau) / max |tau|)^2 dt  +  (`REVERSAL` for each change of sigma)

along the input: what torques would have to change by, against reversals. Half the squares of

    r(t) = sqrt(weight) |J(t)| b / 2 (1 - tanh(sigma(t) tau(t) / w + 1))

are added to the objective: the way of the targets across the play while a gear is on the wrong side, smoothed. A gear
that nothing pushes stays where it is, so that this begins somewhat beyond zero. While sigma changes nothing counts, and
where a torque is far on the wrong side, r no longer depends on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.multibody.analysis.reactions import reactions, transmitted
from calmotion.multibody.model.model import Model
from calmotion.retargeting.problem.offset_space import OffsetSpace
from calmotion.retargeting.quantities.base import Quantity, RobotChange
from calmotion.retargeting.quantities.efforts import Efforts
from calmotion.simulation.forward import ForwardRun

WIDTH = 0.05  # of a gear's largest torque in the input: within it the side changes smoothly
CLEAR = 2.0  # widths from zero at which a change of sides has ended
REVERSAL = 0.01  # what a reversal counts [s]: the largest torque on the wrong side for so long


@dataclass(frozen=True, eq=False)
class GearPlay(Quantity):
    """Residuals of P motors with play, functions of the efforts that their gears transmit, R = P.

    Attributes:
        model: The robot.
        motors: Their numbers, shape [P].
        sides: On which side each should lie, 1 or -1, shape [T, P].
        widths: w, the effort within which it changes its side [N m or N], shape [P].
        ways: sqrt(weight) |J| b / 2; 0 while a gear changes its side, shape [T, P].
    """

    model: Model
    motors: IntArray
    sides: Array
    widths: Array
    ways: Array
    by_efforts = True

    def values(self, run: ForwardRun) -> Array:
        """r."""
        return np.asarray(self.ways * (1.0 - self._side(transmitted_by(self.model, run))))

    def slopes(self, run: ForwardRun) -> PlaySlopes:
        """By the effort of each motor."""
        side = self._side(transmitted_by(self.model, run))
        return PlaySlopes(self.motors, np.asarray(-self.ways * self.sides * (1.0 - side**2) / self.widths))

    def rigid_metric(
        self, weights: Array, run: ForwardRun, inertia: Array, space: OffsetSpace
    ) -> tuple[csr_matrix, Array]:
        """As that of efforts."""
        squared = np.zeros(inertia.shape[:2])
        squared[:, self.motors] = weights * self.slopes(run).by_effort ** 2
        return Efforts(self.model).rigid_metric(squared, run, inertia, space)

    def _side(self, efforts: Array) -> Array:
        return np.asarray(np.tanh(self.sides * efforts[:, self.motors] / self.widths + 1.0))


@dataclass(frozen=True, eq=False)
class PlaySlopes:
    """Derivatives of the residuals by the efforts of their motors, shape [T, P]."""

    motors: IntArray
    by_effort: Array

    def change(self, by: RobotChange) -> Array:
        """With the efforts."""
        assert by.efforts is not None
        return np.asarray(self.by_effort * by.efforts[:, self.motors])

    def pull(self, values: Array, onto: RobotChange) -> None:
        """By the efforts."""
        assert onto.efforts is not None
        onto.efforts[:, self.motors] += self.by_effort * values


def transmitted_by(model: Model, run: ForwardRun) -> Array:
    """The torque [N m] or force [N] that each motor's gear transmits in a run, shape [T, M]."""
    found = reactions(model.system, run.trajectory, run.joint_angles, run.joint_rates)
    return model.motor_efforts(transmitted(model.system, found), through_gears=True)


def gear_play(
    model: Model, play: Array, efforts: Array, h: float, judged: BoolArray, levers: Array, weight: float
) -> GearPlay:
    """The terms of the motors that have play.

    Args:
        play: Of all motors [rad or m], shape [M].
        efforts: That their gears transmit with the curves of the input, shape [T, M].
        h: Step [s].
        judged: Instants of the shot, shape [T].
        levers: Weighted motion of the targets by the motors with play, shape [T, K, 6, P].
        weight: Of a squared way of a target, over that of a squared error.
    """
    motors = np.flatnonzero(play > 0.0).astype(np.int32)
    pushed = efforts[:, motors]
    largest = np.abs(pushed[judged]).max(axis=0, initial=0.0)
    shares = pushed / np.where(largest > 0.0, largest, 1.0)
    wanted = np.stack([wanted_sides(share, h) for share in shares.T], axis=1)
    changing = np.stack([_changing(*pair) for pair in zip(wanted.T, shares.T, strict=True)], axis=1)
    ways = 0.5 * np.sqrt(weight) * np.sqrt(np.sum(levers**2, axis=(1, 2))) * play[motors]
    return GearPlay(model, motors, wanted, WIDTH * np.where(largest > 0.0, largest, 1.0), np.where(changing, 0.0, ways))


def wanted_sides(share: Array, h: float) -> Array:
    """The sides of one gear with the least cost, by dynamic programming, shape [T].

    Args:
        share: The efforts that it transmits, over the largest, shape [T].
        h: Step [s].
    """
    wrong = h * np.stack([np.maximum(0.0, share) ** 2, np.maximum(0.0, -share) ** 2])  # on side -1, on side +1
    came = np.zeros((2, len(share)), np.int8)
    low, high = wrong[:, 0]
    for n in range(1, len(share)):
        came[0, n], came[1, n] = high + REVERSAL < low, not low + REVERSAL < high
        low, high = min(low, high + REVERSAL) + wrong[0, n], min(high, low + REVERSAL) + wrong[1, n]
    sides, side = np.zeros(len(share)), int(high < low)
    for n in range(len(share) - 1, -1, -1):
        sides[n] = 2 * side - 1
        side = int(came[side, n])
    return sides


def _changing(sides: Array, share: Array) -> BoolArray:
    """While a gear changes its side: around each change, until the effort is clearly on the wanted side, shape [T]."""
    clear, found = sides * share > CLEAR * WIDTH, np.zeros(len(sides), bool)
    for n in np.flatnonzero(np.diff(sides)):
        before, after = np.flatnonzero(clear[: n + 1]), np.flatnonzero(clear[n + 1 :])
        found[before[-1] + 1 if len(before) else 0 : n + 1 + after[0] if len(after) else len(sides)] = True
    return found
