"""Which bodies never turn: what hangs from the world by welds, sliders and motors that keep their angle.

Such a body needs no Coriolis, centrifugal and gyroscopic terms, and its inertia does not change (formulation, section
1; the seed's M2 and M5). Where something that bends carries it, it turns by as much as that bends there; what is left
out is then of second order, a part of the deflections as large as that angle.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from calmotion.multibody.model.topology import Tree
from calmotion.shot import Animation, Character

if TYPE_CHECKING:
    from calmotion.accuracy.deflection_bound.bound import Stiffness

STILL_BY = "it does not rotate: attached by fixed and prismatic joints and idle motors"
STILL = 1e-9  # changes of an angle [rad] that are rounding


@dataclass(frozen=True)
class Turning:
    """Whether a body turns.

    Attributes:
        turns: Whether it does.
        why: In the user's words.
        error_m: What it costs to say that it does not [m]; None: nothing, or not known where it turns.
    """

    turns: bool
    why: str
    error_m: float | None = None


def turning_of(
    character: Character, animation: Animation, tree: Tree, stiffness: Mapping[int, Stiffness], changes: bool
) -> list[Turning]:
    """For each body whether it turns in a shot, in the order of the character's.

    Args:
        tree: Of the character.
        stiffness: Estimates of how far flexible bodies bend, by body, where there are any.
        changes: Whether motors' curves are to be changed.
    """
    found: dict[int, Turning] = {}
    bent: dict[int, tuple[float, float]] = {-1: (0.0, 0.0)}  # angle and deflections of what carries a component
    unknown = {-1: False}
    for k, (body, joint) in enumerate(zip(tree.body, tree.joint, strict=True)):
        parent, item = tree.parent[k], character.bodies[body]
        by = _turned_by(character, animation, joint, changes)
        own = stiffness.get(body)
        angle, way = bent[parent]
        before = found[tree.body[parent]] if parent >= 0 else None
        if by is not None:
            found[body] = Turning(True, by)
        elif before is not None and before.turns:
            found[body] = Turning(True, f"it is attached to {character.bodies[tree.body[parent]].path}, which rotates")
        elif unknown[parent]:
            found[body] = Turning(True, "the deflection of the bodies that carry it is not known")
        else:
            error = angle * (way + (own.displacement_m if own and item.bends else 0.0))
            found[body] = Turning(
                False, "it does not rotate: attached by fixed and prismatic joints and idle motors", error or None
            )
        if item.bends:
            bent[k] = (angle + (own.rotation if own else 0.0), way + (own.displacement_m if own else 0.0))
            unknown[k] = unknown[parent] or own is None
        else:
            bent[k], unknown[k] = bent[parent], unknown[parent]
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
