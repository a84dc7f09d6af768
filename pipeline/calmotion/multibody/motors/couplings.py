"""Motors that a second joint turns too: the gearing of a wrist, whose shafts pass through the joint before.

Seen at joint k, the rotor of its motor turns by phi_k = theta_k + r theta_j, and by virtual work the motor pulls at
joint j by r tau_k. Of a servo, phi_k is the rotor's coordinate, so that its inertia, friction and torque are those of
the sum, and the marker on side 0 of joint k, on the component that joint j carries, is turned by -r theta_j, in the
coordinates of motor j. Of ideal motors, the constraints' efforts tau' give tau_k = tau'_k, tau_j = tau'_j - r tau'_k.

Source: Siciliano, Sciavicco, Villani, Oriolo, Robotics, 2009, section 8.1 (kinematic coupling of motors and joints).
"""

from collections.abc import Sequence
from typing import NamedTuple

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.model.motor import DRIVE, SERVO, Motor
from calmotion.multibody.model.system import System


class Coupling(NamedTuple):
    """A joint whose motor another joint turns too, numbers of the system; the ratio is that of angles in the tree.

    Attributes:
        compliant: Whether both motors are servos; else both are ideal.
    """

    joint: int
    other: int
    ratio: float
    compliant: bool


def couplings(system: System, motor: IntArray, sign: Array, motors: Sequence[Motor]) -> tuple[Coupling, ...]:
    """The coupled motors.

    Args:
        motor, sign: As of `Model`.

    Raises:
        ShotError: One that has no place in this formulation.
    """
    found = []
    for joint, k in enumerate(motor):
        pair = motors[k].turns_with if k >= 0 else None
        if pair is None:
            continue
        own, other = motors[k], motors[pair.other]
        before = next((j for j, m in enumerate(motor) if m == pair.other), -1)
        _refuse(own, other, system, joint, before)
        ratio = pair.ratio * float(sign[joint] * sign[before])
        found.append(Coupling(joint, before, ratio, own.model == SERVO))
    return tuple(found)


def _refuse(own: Motor, other: Motor, system: System, joint: int, before: int) -> None:
    count, remedy = len(system.parent), "Remove calm:motor:coupledTo, or change what it asks for"
    between = int(system.side[joint, 0])
    problem = ""
    if own.linear or other.linear:
        problem = "motors are coupled between revolute joints only"
    elif own.model != other.model or own.model == DRIVE:
        problem = "coupled motors have to be servos both, or ideal both"
        remedy = "Set calm:motor:model of both joints to servo, or to prescribed"
    elif other.turns_with is not None or own.follows is not None or other.follows is not None:
        problem = "the motor of the other joint is coupled itself, or one of both is geared"
    elif not (0 <= before < count and joint < count and between == int(system.side[before, 1])):
        problem = "the other joint has to carry the body on which this joint sits, outside of closed chains"
    elif own.model == SERVO and system.modes[between]:
        problem = "the link between two coupled servos has to be rigid"
        remedy = "Set calm:flexible:enabled of that link to false, or the model of both motors to prescribed"
    if problem:
        raise ShotError(problem, path=own.path, attribute="calm:motor:coupledTo", found=other.path, remedy=remedy)
