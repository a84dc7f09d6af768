"""The motion that is baked: the predicted one at the frames, or that of a rigid robot with the written curves."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from ...errors import ShotError
from ...shot import Animation, Character, MassProperties, Motion, Result
from ...shot.character import Array


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


def simulated_motion(motion: Motion, frame_times: Array) -> BakedMotion:
    """Pick the steps of a simulation that are frames; a run that was interrupted gives the frames it reached.

    Raises:
        ValueError: A frame is no step, which the time grid rules out.
    """
    reached = frame_times[frame_times <= motion.times[-1] + 1e-9]
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


def rigid_motion(character: Character, animation: Animation, result: Result) -> BakedMotion:
    """A rigid robot performing the curves of a result (the animation, where there are none).

    Raises:
        ShotError: Joints without a motor, whose angles only a simulation gives.
    """
    from ...dynamics.kinematics import rigid_poses
    from ...dynamics.model import body_anchors, compile_model, rigid_body
    from ...dynamics.topology import span_tree
    from ...retarget.curves import curve_of

    times = animation.frame_times
    # Kinematics do not depend on mass, so a flexible body whose mass its mesh decides gets any.
    some = MassProperties(1.0, np.zeros(3), np.eye(3))
    rigid = dataclasses.replace(
        character,
        bodies=tuple(dataclasses.replace(b, mass=b.mass or some, flexible=None) for b in character.bodies),
    )
    tree = span_tree(rigid)
    anchors = body_anchors(rigid, tree)
    model = compile_model(rigid, tree, [rigid_body(b, a) for b, a in zip(rigid.bodies, anchors, strict=True)])
    if np.any(model.system.rows < 6) or len(character.joints) > len(character.bodies):
        raise ShotError(
            "a joint without a motor, or a closed loop, has no angle on a robot that is not simulated",
            path=character.path,
            attribute="bake",
            found="motors",
            remedy="Use --bake=simulated",
        )
    if result.curves:
        angles = np.stack([curve.frame_values for curve in result.curves], axis=1)
    else:
        cyclic = character.retarget.cyclic
        angles = np.stack([curve_of(t, float(times[-1]), cyclic)(times, 0) for t in animation.tracks], axis=1)
    positions, rotations = rigid_poses(model, model.joint_angles(angles))
    back = np.argsort(np.asarray(tree.body))  # from components to bodies
    return BakedMotion(times, positions[:, back], rotations[:, back], None)
