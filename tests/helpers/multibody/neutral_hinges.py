"""Rigid characters whose passive hinges have no stiffness at rest; some of them are constrained by closed chains."""

from collections.abc import Sequence

import numpy as np
from calmotion.model import Body, Character, Frame, Joint, MassProperties, Motor, Target
from calmotion.model.character import WORLD
from calmotion.testing.beam_arms import IDENTITY, LIFTS

_ANGLE = "drive:angular:physics:targetPosition"
_HEAVY, _SMALL = 0.4, 1e-3 * np.eye(3)
Point = tuple[float, float, float]


def _pin(name: str, parent: int, body: int, here: Point, there: Point) -> Joint:
    """A hinge about y."""
    return Joint(name, "revolute", parent, body, Frame(np.array(here), LIFTS), Frame(np.array(there), LIFTS))


def push_rod(gravity: Sequence[float] = (0.0, 0.0, -9.81), offset: float = 0.0, driven: bool = True) -> Character:
    """A crank and a horn, as on a servo, with a rod between them: a parallelogram in the plane of x and z.

    Args:
        gravity: [m/s^2].
        offset: Of the masses of crank and horn from their pivots along z [m]: balanced at 0.
        driven: Whether the crank has a motor.
    """
    disc = MassProperties(_HEAVY, np.array([0.0, 0.0, offset]), _SMALL)
    rod = MassProperties(0.1, np.array([0.15, 0.0, 0.0]), _SMALL)
    origin, up, far = (0.0, 0.0, 0.0), (0.0, 0.0, 0.05), (0.3, 0.0, 0.0)
    bodies = (
        Body("/Rod/Crank", Frame(np.zeros(3), IDENTITY), disc),
        Body("/Rod/Horn", Frame(np.array(far), IDENTITY), disc),
        Body("/Rod/Rod", Frame(np.array(up), IDENTITY), rod),
    )
    joints = (
        _pin("/Rod/Motor", WORLD, 0, origin, origin), _pin("/Rod/Pivot", WORLD, 1, far, origin),
        _pin("/Rod/Near", 0, 2, up, origin), _pin("/Rod/Far", 2, 1, far, up),
    )  # fmt: skip
    motors = (Motor(0, joints[0].path, _ANGLE),) if driven else ()
    target = Target("/Rod/Horn", 1, Frame(np.array(up), IDENTITY))
    return Character("/Rod", bodies, joints, motors, (target,), np.array(gravity, dtype=float))


def truss() -> Character:
    """Two pinned bars on a turntable that form a closed chain without degrees of freedom, with balanced bars."""
    mass = MassProperties(_HEAVY, np.zeros(3), _SMALL)
    origin, far = (0.0, 0.0, 0.0), (0.6, 0.0, 0.0)
    bodies = (
        Body("/Truss/Table", Frame(np.zeros(3), IDENTITY), mass),
        Body("/Truss/Left", Frame(np.zeros(3), IDENTITY), mass),
        Body("/Truss/Right", Frame(np.array(far), IDENTITY), mass),
    )
    turn = Frame(np.zeros(3), IDENTITY)
    joints = (
        Joint("/Truss/Turn", "revolute", WORLD, 0, turn, turn),
        _pin("/Truss/FootLeft", 0, 1, origin, origin), _pin("/Truss/FootRight", 0, 2, far, origin),
        _pin("/Truss/Top", 1, 2, (0.3, 0.0, 0.3), (-0.3, 0.0, 0.3)),
    )  # fmt: skip
    target = Target("/Truss/Left", 1, Frame(np.array([0.3, 0.0, 0.3]), IDENTITY))
    return Character(
        "/Truss", bodies, joints, (Motor(0, joints[0].path, _ANGLE),), (target,), np.array([0.0, 0.0, -9.81])
    )


def turning(gravity: Sequence[float] = (0.0, 0.0, -9.81), offset: float = 0.0) -> Character:
    """An arm that a motor turns about z, with a wheel about y at its end.

    Args:
        gravity: [m/s^2]; along y the wheel is a door.
        offset: Of the wheel's mass from its axis [m].
    """
    arm = MassProperties(_HEAVY, np.zeros(3), _SMALL)
    wheel = MassProperties(_HEAVY, np.array([offset, 0.0, 0.0]), _SMALL)
    origin, end = (0.0, 0.0, 0.0), (0.3, 0.0, 0.0)
    bodies = (
        Body("/Turn/Arm", Frame(np.zeros(3), IDENTITY), arm),
        Body("/Turn/Wheel", Frame(np.array(end), IDENTITY), wheel),
    )
    at = Frame(np.zeros(3), IDENTITY)
    joints = (Joint("/Turn/Motor", "revolute", WORLD, 0, at, at), _pin("/Turn/Axle", 0, 1, end, origin))
    target = Target("/Turn/Wheel", 1, Frame(np.array([0.05, 0.0, 0.0]), IDENTITY))
    return Character(
        "/Turn", bodies, joints, (Motor(0, joints[0].path, _ANGLE),), (target,), np.array(gravity, dtype=float)
    )
