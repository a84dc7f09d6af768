"""Shots that loop: they must close, and what is judged is the motion that they end up in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, Slerp

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Track
from calmotion.model.curves import CLOSED, cycle_gap, root_at
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.trajectory import Trajectory, copy_of_instant
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.moving_markers import rooted
from calmotion.multibody.model.system import State
from calmotion.multibody.sensitivity.periodic import Monodromy, find_periodic_motion

EASE = 1.0  # in which the loop gets up to speed, before one of it leads to a first guess [s]


class SteadyState:
    """The periodic motions of one model for one motor curve after another, each found from the one before.

    Args:
        model: The model.
        world: Moving roots over the loop, shape [N + 2, W, 18]; None where there are none.
        h: Step [s].
        start: States of the first two instants near the first motion; None: from rest.
    """

    def __init__(
        self, model: Model, world: Array | None, h: float, workspace: Workspace, start: Sequence[State] | None = None
    ):
        self.model, self.world, self.h, self._workspace = model, world, h, workspace
        self._start = start
        self.known: Monodromy | None = None  # the derivative of a loop nearby

    def for_model(self, model: Model) -> SteadyState:
        """The same of another model of the same character, from the same start."""
        return SteadyState(model, self.world, self.h, self._workspace, self._start)

    def find(self, joint_angles: Array, joint_rates: Array) -> Trajectory:
        """The periodic motion for joint angles and rates of shape [N + 2, J].

        Raises:
            SimulationFailure: None was found.
        """
        start = self._start or self._from_rest(joint_angles, joint_rates)
        loop, self.known = find_periodic_motion(
            self.model.system, (start[0], start[1]), joint_angles, joint_rates, self.h, self._workspace, self.world,
            self.known,
        )  # fmt: skip
        self._start = [copy_of_instant(loop.trajectory.states, n) for n in (0, 1)]
        return loop.trajectory

    @property
    def floquet_multiplier(self) -> float:
        """Largest factor by which a disturbance of the last periodic motion grows from one cycle to the next."""
        return 0.0 if self.known is None else self.known.floquet_multiplier

    def _from_rest(self, joint_angles: Array, joint_rates: Array) -> list[State]:
        """The last two instants of a loop after one that got up to speed."""
        model, h = self.model, self.h
        angles, rates, world = eased(joint_angles, joint_rates, rooted(self.world, len(joint_angles)), h)
        state = rigid_state(model, start_angles(model, angles[0]), world[0])
        states = simulate(model.system, state, angles, rates, h, self._workspace, world=world).states
        return [copy_of_instant(states, n) for n in (-2, -1)]


def eased(angles: Array, rates: Array, world: Array, h: float) -> tuple[Array, Array, Array]:
    """A loop of N steps and one before it that starts at rest, shapes [T, J], [T, J], [T, W, 18].

    Args:
        angles, rates, world: Over the loop, instants 0 and 1 being those before its first step, [N + 2, ...].
        h: Step [s].
    """
    steps, rise = len(angles) - 2, max(2, round(EASE / h))
    length = steps * h
    times = h * np.arange(-rise, steps + 1)
    s = np.clip((times - times[0]) / (rise * h), 0.0, 1.0)
    # time goes by ever faster at first, with a continuous acceleration
    played = times + rise * h * (0.5 - s + s**3 - 0.5 * s**4)
    speed = 3.0 * s**2 - 2.0 * s**3
    inside, loops = np.mod(played, length), np.floor(played / length)
    own = h * np.arange(steps + 1)
    spline = CubicSpline(own, angles[1:])
    gain = angles[-1] - angles[1]
    moved = np.zeros((len(times), *world.shape[1:]))
    for k in range(world.shape[1]):
        turning = Slerp(own, Rotation.from_matrix(world[1:, k, 9:].reshape(-1, 3, 3)))
        path = CubicSpline(own, world[1:, k, :9])(inside)
        path[:, 3:] *= speed[:, None]
        moved[:, k] = np.hstack([path, turning(inside).as_matrix().reshape(-1, 9)])
    return spline(inside) + np.outer(loops, gain), CubicSpline(own, rates[1:])(inside) * speed[:, None], moved


def refuse_open_loops(character: Character, animation: Animation) -> None:
    """The last frame of a shot that loops must be its first again."""
    end = float(animation.frame_times[-1])
    for motor, tracks in zip(character.motors, zip(animation.tracks, animation.current, strict=True), strict=True):
        turning = character.joints[motor.joint].kind == "revolute"
        apart = max(cycle_gap(track, end, turning) for track in tracks)
        if apart > CLOSED:
            shown = f"{np.degrees(apart):.3g} degrees" if turning else f"{1e3 * apart:.3g} mm"
            raise ShotError(
                "calm:retarget:cyclic is true, but the first and the last frame of this motor differ",
                path=motor.path,
                attribute=motor.attribute,
                found=f"{shown} apart",
                remedy=_REMEDY,
            )
    for frame in animation.moving:
        first, last = root_at(frame, 0.0), root_at(frame, end)
        turned = float((first.inv() * last).magnitude())
        away = max(cycle_gap(Track(frame.times, column), end, False) for column in frame.positions.T)
        if max(turned, away) > CLOSED:
            raise ShotError(
                "calm:retarget:cyclic is true, but the first and the last frame of this root differ",
                path=character.joints[frame.joint].path,
                found=f"{np.degrees(turned):.3g} degrees and {1e3 * away:.3g} mm apart",
                remedy=_REMEDY,
            )


_REMEDY = "Let endTimeCode be the time at which the loop begins again, or set calm:retarget:cyclic to false."
