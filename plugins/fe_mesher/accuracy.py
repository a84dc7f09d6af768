"""Accuracy of the first frequencies of a mesh."""

from __future__ import annotations

from calmotion.accuracy.element_size import ACCURACY
from calmotion.shot import Character, Frame
from calmotion.shot.meshes import MeshQuality

# The estimate is 1.2 to 3 times the true error of clamped beams and plates on meshes that are nearly fine enough, and
# larger for links with many edges (see `calmotion bench meshing`). Twice the wanted error is therefore accepted.
ENOUGH = 2.0 * ACCURACY


def carrier_of(character: Character, index: int) -> Frame | None:
    """Frame on a body of the joint to its parent, body frame; None without a joint."""
    return next((joint.frame1 for joint in character.joints if joint.body1 == index), None)


def remark(quality: MeshQuality) -> tuple[str, ...]:
    """Message about a mesh that is less accurate than wanted."""
    if quality.frequency_error is None or quality.frequency_error <= ENOUGH:
        return ()
    return (
        f"estimated error of the first frequencies: {100.0 * quality.frequency_error:.2g}%, "
        f"more than {100.0 * ENOUGH:.2g}%: author a smaller calm:flexible:elementSize to reduce it",
    )
