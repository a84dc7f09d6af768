"""What of an imported robot can hardly be meant."""

from __future__ import annotations

from calmotion.shot import Character

HEAVIEST = 1e5  # of a robot [kg]


def doubts(character: Character) -> tuple[str, ...]:
    """Sentences for the user; none where nothing is strange."""
    masses = {body.path: body.mass.mass for body in character.bodies if body.mass is not None}
    if sum(masses.values()) < HEAVIEST:
        return ()
    heaviest = max(masses, key=masses.__getitem__)
    return (
        f"the robot weighs {1e-3 * sum(masses.values()):.4g} t, most of it {heaviest}: meshes in millimetres need "
        'scale="0.001 0.001 0.001" where the file names them',
    )
