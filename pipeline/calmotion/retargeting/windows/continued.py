"""Motions that go on from the states in which an earlier simulation ended: windows of a long shot."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.analysis.kinematics import target_frames
from calmotion.multibody.integrators.trajectory import Trajectory
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.system import State
from calmotion.simulation.forward import ForwardRun, followed
from calmotion.simulation.simulator import LinearRun, Simulator

BDF2_INSTANTS = 4  # that it needs to go on exactly: two for the step, and two for the memory of the one before


def needed_instants(model: Model, h: float) -> int:
    """How many instants before the first frame of a window must be known: commands act late."""
    return BDF2_INSTANTS + int(np.ceil(max(model.delays, default=0.0) / h))


@dataclass(frozen=True, eq=False)
class Beginning:
    """The known instants of a window.

    Attributes:
        states: Arrays of shape [n, B, ...].
        margins: See `Trajectory`, shape [n].
    """

    states: State
    margins: Array

    @property
    def count(self) -> int:
        """Number of instants."""
        return len(self.margins)

    @classmethod
    def at(cls, run: ForwardRun, last: int, count: int) -> Beginning:
        """The instants of a run up to one of them, which is the last."""
        rows = slice(last + 1 - count, last + 1)
        trajectory = run.trajectory
        return cls(State(*[part[rows].copy() for part in trajectory.states]), trajectory.margins[rows].copy())

    def begun(self, model: Model, h: float, world: Array, angles: Array) -> ForwardRun:
        """A run over all instants of a window of which only these are known.

        Args:
            model: The robot.
            h: Step [s].
            world: Moving roots, shape [T, W, 18].
            angles: Of the motors, shape [T, M].
        """
        total, count = len(angles), self.count
        states = State(*[np.zeros((total, *part.shape[1:])) for part in self.states])
        margins = np.zeros(total)
        for part, known in zip((*states, margins), (*self.states, self.margins), strict=True):
            part[:count] = known
        trajectory = Trajectory(h, states, world, 0, 0, 0.0, 0.0, margins=margins, costs=np.zeros((total, 3)))
        positions, rotations = target_frames(model, states.c[:count], states.q[:count], states.u[:count])
        nothing = np.full((total, len(model.motor)), np.nan)
        return ForwardRun(trajectory, nothing, nothing, positions, rotations, angles)


class ContinuedSimulator(Simulator):
    """One robot over the time grid of a window, whose first instants are known.

    Args:
        model: The robot.
        h: Step [s].
        world: Moving roots, shape [T, W, 18].
        beginning: The known instants.
    """

    def __init__(self, model: Model, h: float, world: Array, beginning: Beginning):
        super().__init__(model, h, world, False)
        self._roots, self._beginning = world, beginning

    def of(self, model: Model) -> Simulator:
        """The same of another model of the same character, which begins in the same states."""
        return ContinuedSimulator(model, self.h, self._roots, self._beginning)

    def run(self, angles: Array, rates: Array, near: ForwardRun | None = None) -> ForwardRun:
        """As of `Simulator`."""
        joints = followed(self.model, angles, rates, self.h, False)
        known, first = near, self._beginning.count
        if known is None:
            known = self._beginning.begun(self.model, self.h, self._roots, angles)
        else:
            same = np.all(joints[0] == known.joint_angles, axis=1) & np.all(joints[1] == known.joint_rates, axis=1)
            same[:first] = True
            if np.all(same):
                return known
            changed = int(np.argmin(same))
            first = first if changed - 1 in known.trajectory.refined else changed
        return self._from(known, first, angles, joints)

    def linearize(self, run: ForwardRun, first: int = 0) -> LinearRun:
        """As of `Simulator`; what is known does not change in any case."""
        return super().linearize(run, max(first, self._beginning.count))
