"""Moving roots over time: the frames that a shot moves, at the instants of a simulation."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.model.animation import MovingFrame, Track
from calmotion.model.curves import curve_of, rotation_spline
from calmotion.multibody.kernels.markers import WORLD_MARKER
from calmotion.multibody.kernels.so3 import right_jacobian
from calmotion.multibody.model.moving_markers import pack
from calmotion.simulation.inputs.time_grid import TimeGrid, over_grid, pre_roll_weights

LOOPS = 3  # on either side of the one that is interpolated


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
    axes = [
        over_grid(grid, curve_of(Track(frame.times, column), grid.end, grid.cyclic)) for column in frame.positions.T
    ]
    position, velocity = (np.stack([axis[k] for axis in axes], axis=1) for k in range(2))
    if grid.cyclic:
        rotation, spin = _looped_rotation(frame, grid)
    else:
        rotation, spin = _eased_rotation(frame, grid)
    return pack(position, velocity, spin, rotation.as_matrix())


def _looped_rotation(frame: MovingFrame, grid: TimeGrid) -> tuple[Rotation, Array]:
    """Rotations and angular velocities, in their own axes, of a root that loops."""
    inner = (frame.times >= 0.0) & (frame.times < grid.end - 1e-9)
    times, quaternions = frame.times[inner], frame.rotations[inner]
    # loops on both sides make the interpolant periodic, as the influence of its ends dies out in a few samples
    around = range(-LOOPS, LOOPS + 1)
    times = np.concatenate([times + k * grid.end for k in around])
    turning = rotation_spline(MovingFrame(frame.joint, times, frame.positions, np.tile(quaternions, (len(around), 1))))
    inside = np.mod(grid.times, grid.end)
    # RotationSpline gives rates in the frame's own axes
    return turning(inside), turning(inside, 1)


def _eased_rotation(frame: MovingFrame, grid: TimeGrid) -> tuple[Rotation, Array]:
    """The same of one that plays once, after a pre-roll."""
    times, pre = grid.times, grid.pre_steps
    turning = rotation_spline(frame)
    first, last = frame.times[0], frame.times[-1]
    shown = times[pre:]
    inside, held = np.clip(shown, first, last), (shown < first) | (shown > last)
    rotation, spin = turning(inside), np.where(held[:, None], 0.0, turning(inside, 1))
    if not pre:
        return rotation, spin
    # rotation vectors from the first pose, by the quintic of `over_grid`: at 0 their rates are the angular velocity's
    value, rate = pre_roll_weights(times[:pre], grid.pre_roll)[:2]
    start = rotation[0]
    turn_rates = np.stack([np.zeros(3), spin[0], turning(0.0, 2) if first <= 0.0 else np.zeros(3)])
    theta, slope = value @ turn_rates, rate @ turn_rates
    spins, J = np.zeros_like(theta), np.zeros((3, 3))
    for n in range(pre):
        right_jacobian(theta[n], J)
        spins[n] = J @ slope[n]
    return Rotation.concatenate([start * Rotation.from_rotvec(theta), rotation]), np.concatenate([spins, spin])


def root_tracks(moving: Sequence[MovingFrame]) -> list[Track]:
    """Positions [m] and turns from the first pose [rad] as tracks, which tell whether a shot starts in motion."""
    tracks = []
    for frame in moving:
        rotations = Rotation.from_quat(frame.rotations, scalar_first=True)
        turns = np.unwrap((rotations[0].inv() * rotations).as_rotvec(), axis=0)
        tracks += [Track(frame.times, column) for column in (*frame.positions.T, *turns.T)]
    return tracks
