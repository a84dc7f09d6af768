"""The motion that is baked: the predicted one at the frames, or that of a rigid robot with the written curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Motion


@dataclass(frozen=True, eq=False)
class BakedMotion:
    """Poses at the frames that were reached.

    Attributes:
        times: [s], shape [f].
        positions: [m], shape [f, B, 3].
        rotations: Unit quaternions, shape [f, B, 4].
        elastic: Elastic coordinates of each body, shape [f, r_b]; None for a rigid motion.
    """

    times: Array
    positions: Array
    rotations: Array
    elastic: tuple[Array, ...] | None


def simulated_motion(motion: Motion, times: Array) -> BakedMotion:
    """Pick steps of a simulation, such as its frames; a run that was interrupted gives those that it reached.

    Args:
        times: Of the steps to pick [s], shape [f].

    Raises:
        ValueError: A time is no step, which the time grid rules out for frames.
    """
    reached = times[times <= motion.times[-1] + 1e-9]
    step = float(motion.times[1] - motion.times[0])
    indices = np.round((reached - motion.times[0]) / step).astype(int)
    if len(reached) == 0 or np.max(np.abs(motion.times[indices] - reached)) > 1e-3 * step:
        raise ValueError("the frames of the shot are not steps of the simulation")
    return BakedMotion(
        reached,
        motion.positions[indices],
        motion.rotations[indices],
        tuple(u[indices] for u in motion.elastic),
    )
