"""Accuracy of the first frequencies of a mesh."""

from __future__ import annotations

from calmotion.accuracy.element_size import ACCURACY
from calmotion.shot import Body, Character, Frame
from calmotion.shot.meshes import MeshQuality

# The estimate is 1.2 to 3 times the true error of clamped beams and plates on meshes that are nearly fine enough, and
# larger for links with many edges (see `calmotion bench meshing`). Twice the wanted error is therefore accepted.
ENOUGH = 2.0 * ACCURACY
_SAME_MASS, _HOLLOW = 0.05, 0.7  # difference that is reported; ratio below which a body may be hollow


def frames_of(character: Character, index: int) -> tuple[Frame, ...]:
    """Frames on a body of its joints, body frame, that of the joint to its parent first."""
    carrying = [joint.frame1 for joint in character.joints if joint.body1 == index]
    return (*carrying, *(joint.frame0 for joint in character.joints if joint.body0 == index))


def mass_note(body: Body, volume: float) -> tuple[str, ...]:
    """Message about a stated mass that is not that of the solid and its material; the density follows the mass."""
    if body.mass is None or body.flexible is None:
        return ()
    material = body.flexible.material
    ratio = body.mass.mass / (material.density * volume)
    if abs(ratio - 1.0) <= _SAME_MASS:
        return ()
    note = (
        f"the shot states a mass of {body.mass.mass:.3g} kg, {ratio:.2g} times that of its volume and material: "
        f"its density is {material.density * ratio:.4g} instead of {material.density:.4g} kg/m^3"
    )
    return (note + ("; if it is hollow, author calm:flexible:wallThickness" if ratio < _HOLLOW else ""),)


def remark(quality: MeshQuality) -> tuple[str, ...]:
    """Message about a mesh that is less accurate than wanted."""
    if quality.frequency_error is None or quality.frequency_error <= ENOUGH:
        return ()
    return (
        f"estimated error of the first frequencies: {100.0 * quality.frequency_error:.2g}%, "
        f"more than {100.0 * ENOUGH:.2g}%: author a smaller calm:flexible:elementSize to reduce it",
    )
