"""Moving roots over time: the frames that a shot moves, at the instants of a simulation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from ..dynamics.markers import WORLD_MARKER
from ..dynamics.so3 import right_jacobian
from ..dynamics.world import pack
from ..shot.animation import MovingFrame, Track
from ..shot.character import Array
from .curves import TimeGrid, interpolate, pre_roll_weights


def sample_roots(moving: Sequence[MovingFrame], grid: TimeGrid) -> Array:
    """Moving markers of the world at the grid's instants, see `dynamics.world`, shape [T, W, 18].

    Positions and rotations are C2 cubic interpolants through the samples; a pre-roll eases into them as it does into
    motor tracks.
    """
    world = np.zeros((len(grid.times), len(moving), WORLD_MARKER))
    for k, frame in enumerate(moving):
        world[:, k] = _sampled(frame, grid)
    return world


def _sampled(frame: MovingFrame, grid: TimeGrid) -> Array:
    times, pre = grid.times, grid.pre_steps
    position, velocity = np.zeros((2, len(times), 3))
    axes = [interpolate(Track(frame.times, column), grid.frame_times[-1]) for column in frame.positions.T]
    turning = _rotation_spline(frame)
    first, last = frame.times[0], frame.times[-1]
    shown = times[pre:]
    inside, held = np.clip(shown, first, last), (shown < first) | (shown > last)
    for i, axis in enumerate(axes):
        clipped = np.clip(shown, axis.x[0], axis.x[-1])
        position[pre:, i], velocity[pre:, i] = axis(clipped), np.where(held, 0.0, axis(clipped, 1))
    rotation = turning(inside)
    # RotationSpline gives rates in the frame's own axes
    spin = np.where(held[:, None], 0.0, turning(inside, 1))
    if not pre:
        return pack(position, velocity, spin, rotation.as_matrix())
    value, rate, _ = pre_roll_weights(times[:pre], grid.pre_roll)
    starts = first <= 0.0
    bend = np.array([float(axis(0.0, 2)) if starts else 0.0 for axis in axes])
    position[:pre] = value @ np.stack([position[pre], velocity[pre], bend])
    velocity[:pre] = rate @ np.stack([position[pre], velocity[pre], bend])
    # rotation vectors from the first pose, by the same quintic: at 0 their rates are the angular velocity's
    start = rotation[0]
    turn_rates = np.stack([np.zeros(3), spin[0], turning(0.0, 2) if starts else np.zeros(3)])
    theta, slope = value @ turn_rates, rate @ turn_rates
    spins, J = np.zeros_like(theta), np.zeros((3, 3))
    for n in range(pre):
        right_jacobian(theta[n], J)
        spins[n] = J @ slope[n]
    matrices = np.concatenate([(start * Rotation.from_rotvec(theta)).as_matrix(), rotation.as_matrix()])
    return pack(position, velocity, np.concatenate([spins, spin]), matrices)


def _rotation_spline(frame: MovingFrame) -> RotationSpline:
    times, rotations = frame.times, Rotation.from_quat(np.roll(frame.rotations, -1, axis=1))
    if len(times) == 1:
        times, rotations = np.array([times[0], times[0] + 1.0]), Rotation.concatenate([rotations, rotations])
    return RotationSpline(times, rotations)


def root_tracks(moving: Sequence[MovingFrame]) -> list[Track]:
    """Positions [m] and turns from the first pose [rad] as tracks, which tell whether a shot starts in motion."""
    tracks = []
    for frame in moving:
        rotations = Rotation.from_quat(np.roll(frame.rotations, -1, axis=1))
        turns = np.unwrap((rotations[0].inv() * rotations).as_rotvec(), axis=0)
        tracks += [Track(frame.times, column) for column in (*frame.positions.T, *turns.T)]
    return tracks
