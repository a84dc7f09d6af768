"""Feet that cannot stay where they are held: motors between them contradict each other, or nothing balances.

Rigid legs with ideal motors between two held feet are a closed chain that their curves may not fit: the feet then share
what is left. Contacts are no balance either: a robot on points falls over at rest.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array, BoolArray
from calmotion.errors import ShotError
from calmotion.model import Character
from calmotion.model.tolerance import tolerance_of
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.modes import falling_rate
from calmotion.multibody.integrators.trajectory import copy_of_instant
from calmotion.multibody.model.model import Model, start_angles
from calmotion.multibody.model.phases import held_contacts
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.time_grid import TimeGrid

ABOVE = 1.1  # of a slip: the tolerance that lets it be
TOPPLED = 0.2  # turn of a base at rest that is no sag [rad]
FALLING = 0.1  # rate with which an equilibrium is left [1/s]; a pendulum of a kilometre upside down has as much


def refuse_slipping(
    character: Character, model: Model, grid: TimeGrid, run: ForwardRun, tolerance: float | None
) -> None:
    """Refuse feet that slip by more than the tolerance while they are held, and robots that fall over at rest, by a
    simulation of the rigid robot.

    Raises:
        ShotError: The contact, and when.
    """
    system, states = model.system, run.trajectory.states
    joints = np.flatnonzero(system.contact)
    if not len(joints):
        return
    _refuse_toppled(character, model, run)
    allowed = tolerance_of(character, tolerance)
    held, order = held_contacts(system, run.trajectory.world), [*model.tree.joint, *model.tree.closing]
    for column, joint in enumerate(joints):
        body = system.side[joint, 1]
        turns = Rotation.from_quat(states.q[:, body], scalar_first=True)
        places = states.c[:, body] + turns.apply(system.position[joint, 1])
        far, worst = _largest_slip(places, held[:, column])
        if far > allowed:
            others = [
                character.joints[order[other]].path
                for k, other in enumerate(joints)
                if other != joint and held[worst, k]
            ]
            when = f"at {grid.times[worst]:.3f} s" + (", in the pre-roll" if grid.times[worst] < 0.0 else "")
            raise ShotError(
                f"this contact slips by up to {1e3 * far:.3g} mm while it is held, {when}: the curves of the motors "
                f"between it and {', '.join(others) or 'the world'} contradict each other",
                path=character.joints[order[joint]].path,
                attribute="calm:contact:active",
                found=True,
                remedy="Hold one foot at a time: let one contact end when the other begins. Or correct the curves so "
                f"that feet stay where they are held, or accept the slip with --tolerance {1e3 * far * ABOVE:.2g}mm",
            )


def _largest_slip(places: Array, held: BoolArray) -> tuple[float, int]:
    """How far a frame at places of shape [T, 3] moves at most from where it was when it came [m], and when."""
    far, worst, anchor = 0.0, 0, 0
    for n in range(1, len(places)):
        if not held[n]:
            anchor = n
            continue
        moved = float(np.linalg.norm(places[n] - places[anchor]))
        if moved > far:
            far, worst = moved, n
    return far, worst


def _refuse_toppled(character: Character, model: Model, run: ForwardRun) -> None:
    """Refuse a robot whose static start is far from the pose of its first frame, or is not stable: which of the two the
    search for an equilibrium ends in is a matter of rounding."""
    world, angles = run.trajectory.world[0], run.joint_angles[0]
    bases = np.flatnonzero(model.system.rows[: len(model.system.parent)] == 0)
    if not len(bases):
        return
    pose, start = rigid_state(model, start_angles(model, angles), world), copy_of_instant(run.trajectory.states, 0)
    turns = [Rotation.from_quat(state.q[bases], scalar_first=True) for state in (pose, start)]
    turned = (turns[0].inv() * turns[1]).magnitude()
    far = int(np.argmax(turned))
    if turned[far] <= TOPPLED and falling_rate(model, start, angles, world) <= FALLING:
        return
    by = f", by {np.degrees(turned[far]):.0f} degrees" if turned[far] > TOPPLED else ""
    raise ShotError(
        f"the robot falls over at rest: its contacts leave it free to turn{by}",
        path=character.bodies[model.tree.body[bases[far]]].path,
        attribute="calm:contact:kind",
        remedy="Hold a foot as a sole, or by three points or more that are not in a line",
    )
