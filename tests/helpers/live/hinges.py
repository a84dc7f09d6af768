"""Small robots and motions for tests of `live`."""

from dataclasses import replace

import numpy as np
from calmotion.multibody import WORLD, Mechanism, PoseModel, pose_model
from calmotion_plugins.live import Weighting

TICK = 1.0 / 250.0


def two_hinges() -> PoseModel:
    """Two links on drives: two modes, of 3.6 and 11 Hz."""
    arm = Mechanism()
    upper = arm.body("upper", 1.2, center=(0.25, 0, 0), inertia=(0.001, 0.03, 0.03))
    fore = arm.body("fore", 0.8, center=(0.2, 0, 0), inertia=(0.001, 0.012, 0.012), position=(0.5, 0, 0))
    for parent, child, place in ((WORLD, upper, 0.0), (upper, fore, 0.5)):
        joint = arm.joint("revolute", parent, child, position=(place, 0, 0), axis=(0, -1, 0))
        arm.motor(joint, model="drive", position_gain=300.0, velocity_gain=0.2)
    arm.target(fore, position=(0.9, 0, 0))
    return pose_model(arm.compile(), [0.3, -0.8])


def hinge(frequency=3.0, ratio=0.01, coupling=1.2):
    """One hinge and one mode; the tip is a metre away (formulation, section 12)."""
    omega, rows = 2.0 * np.pi * np.array([frequency]), np.zeros((1, 6, 1))
    rows[0, 0] = 1.0
    damping, push = np.array([[2.0 * ratio * omega[0]]]), np.array([[-coupling]])
    return PoseModel(omega, damping, push, np.zeros((1, 1)), rows, rows, *[np.eye(1)] * 5, np.eye(2))


def with_free_motion(pose: PoseModel, seen: float = 0.0) -> PoseModel:
    """The robot with a mode of frequency zero that no motor moves, such as the spin of a ball joint.

    Args:
        seen: How far it moves the targets.
    """

    def beside(matrix, axes, value=0.0):
        return np.pad(matrix, [(int(k in axes), 0) for k in range(matrix.ndim)], constant_values=value)

    return replace(
        pose, omega=np.array([0.0, *pose.omega]), damping=beside(pose.damping, (0, 1)),
        by_acceleration=beside(pose.by_acceleration, (0,)), by_rate=beside(pose.by_rate, (0,)),
        targets_by_mode=beside(pose.targets_by_mode, (2,), seen), shapes=beside(pose.shapes, (1,)),
        deflections=beside(pose.deflections, (1,)), by_deflection=beside(pose.by_deflection, (0,)),
        resistance=np.insert(pose.resistance, pose.by_rate.shape[1], 0.0, axis=1),
    )  # fmt: skip


def weighting(window, motors, penalty=1e-5, **changes):
    """An acceleration of 1 rad/s^2 counts as `penalty` metres."""
    targets = np.tile([1.0] * 3 + [0.0] * 3, (1, 1))
    return Weighting(TICK, window, targets, np.full(motors, penalty / TICK), **{"closeness": 0.0, **changes})


def moves(seconds, motors, seed=0, rest=0.4):
    """Random moves of 0.18 to 0.4 s between poses within a radian, and rests of at most so long, shape [T, m]."""
    random, times = np.random.default_rng(seed), TICK * np.arange(round(seconds / TICK))
    out = np.zeros((len(times), motors))
    for m in range(motors):
        at, pose = 0.2, 0.0
        while at < seconds - 1.0:
            length, to = random.uniform(0.18, 0.4), random.uniform(-1.0, 1.0)
            s = np.clip((times - at) / length, 0.0, 1.0)
            out[:, m] += (to - pose) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
            pose, at = to, at + length + random.uniform(0.0, rest)
    return out


def rms(found):
    return float(np.sqrt(np.mean(np.sum(found**2, axis=1))))
