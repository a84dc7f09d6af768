"""A small robot for tests of `live`."""

from __future__ import annotations

from calmotion.multibody import WORLD, Mechanism, PoseModel, pose_model


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
