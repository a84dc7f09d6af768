"""What of an imported robot can hardly be meant."""

from __future__ import annotations

from calmotion.model import Character

HEAVIEST = 1e5  # of a robot [kg]


def doubts(character: Character) -> tuple[str, ...]:
    """Sentences for the user; none where nothing is strange."""
    return (*_too_heavy(character), *_cannot_move(character))


def _too_heavy(character: Character) -> tuple[str, ...]:
    masses = {body.path: body.mass.mass for body in character.bodies if body.mass is not None}
    if sum(masses.values()) < HEAVIEST:
        return ()
    heaviest = max(masses, key=masses.__getitem__)
    return (
        f"the robot weighs {1e-3 * sum(masses.values()):.4g} t, most of it {heaviest}: meshes in millimetres need "
        'scale="0.001 0.001 0.001" where the file names them',
    )


def _cannot_move(character: Character) -> tuple[str, ...]:
    """A URDF joint whose limit names no range has the range from 0 to 0."""
    joints = (character.joints[motor.joint] for motor in character.motors)
    held = [joint.path for joint in joints if joint.lower == joint.upper]
    if not held:
        return ()
    which = f"{held[0]} and {len(held) - 1} more joints" if len(held) > 1 else held[0]
    return (f"{which} cannot move: lower and upper limit are the same; a joint without limits is `continuous` in URDF",)
