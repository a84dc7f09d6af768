"""Which bodies never turn: what hangs from the world by welds, sliders and motors that keep their angle.

Such a body needs no Coriolis, centrifugal and gyroscopic terms, and its inertia does not change (formulation, section
1; the seed's M2 and M5). What a flexible body carries rotates with its deflection.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.model import Animation, Character
from calmotion.model.motor import PRESCRIBED
from calmotion.multibody.model.topology import Tree

STILL_BY = "it does not rotate: attached by fixed and prismatic joints and idle motors"
STILL = 1e-9  # changes of an angle [rad] that are rounding


@dataclass(frozen=True)
class Turning:
    """Whether a body turns.

    Attributes:
        turns: Whether it does.
        why: In the user's words.
    """

    turns: bool
    why: str


def turning_of(character: Character, animation: Animation, tree: Tree, changes: bool) -> list[Turning]:
    """For each body whether it turns in a shot, in the order of the character's.

    Args:
        tree: Of the character.
        changes: Whether motors' curves are to be changed.
    """
    found: dict[int, Turning] = {}
    for k, (body, joint) in enumerate(zip(tree.body, tree.joint, strict=True)):
        parent = tree.body[tree.parent[k]] if tree.parent[k] >= 0 else None
        by = _turned_by(character, animation, joint, changes)
        if by is not None:
            found[body] = Turning(True, by)
        elif parent is not None and found[parent].turns:
            found[body] = Turning(True, f"it is attached to {character.bodies[parent].path}, which rotates")
        elif parent is not None and character.bodies[parent].simulated_flexible:
            found[body] = Turning(True, f"it is attached to {character.bodies[parent].path}, which is flexible")
        else:
            found[body] = Turning(False, STILL_BY)
    return [found[body] for body in range(len(character.bodies))]


def _turned_by(character: Character, animation: Animation, joint: int, changes: bool) -> str | None:
    """What turns the body beyond a joint against what carries it; None where nothing does."""
    item = character.joints[joint]
    frame = next((frame for frame in animation.moving if frame.joint == joint), None)
    if frame is not None and np.ptp(frame.rotations, axis=0).max() > STILL:
        return "its root is animated to rotate"
    if item.kind in ("fixed", "prismatic"):
        return None
    motor = next((k for k, motor in enumerate(character.motors) if motor.joint == joint), None)
    if motor is None:
        return f"{item.path} moves freely"
    if character.motors[motor].model != PRESCRIBED:
        return f"the motor of {item.path} gives way"
    leader = character.motors[motor] if (follows := character.motors[motor].follows) is None else (
        character.motors[follows.leader]
    )  # fmt: skip
    if any(_moves(tracks[motor].values) for tracks in (animation.tracks, animation.current)):
        return f"{item.path} rotates it"
    if changes and leader.optimize and not leader.idle:
        return f"{item.path} may rotate it"
    return None


def _moves(values: Sequence[float] | np.ndarray) -> bool:
    return bool(np.ptp(values) > STILL)
