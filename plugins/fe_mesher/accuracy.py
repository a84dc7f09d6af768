"""Accuracy of the first frequencies of a mesh."""

from __future__ import annotations

from calmotion.accuracy.element_size import ACCURACY
from calmotion.geometry.tetrahedra import tet_volumes
from calmotion.shot import Body, Character, FEMesh, Frame
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
    if material.core is not None:
        return ()  # see `print_note`
    ratio = body.mass.mass / (material.density * volume)
    if abs(ratio - 1.0) <= _SAME_MASS:
        return ()
    note = (
        f"the shot states a mass of {body.mass.mass:.3g} kg, {ratio:.2g} times that of its volume and material: "
        f"its density is {material.density * ratio:.4g} instead of {material.density:.4g} kg/m^3"
    )
    return (note + ("; if it is hollow, author calm:flexible:wallThickness" if ratio < _HOLLOW else ""),)


def print_note(body: Body, mesh: FEMesh) -> tuple[str, ...]:
    """Message about what a printed part is taken for, and about a stated mass that is not that of the print."""
    from calmotion.geometry.print_core import skin_share

    if body.flexible is None or body.flexible.material.core is None:
        return ()
    material, core = body.flexible.material, body.flexible.material.core
    share = skin_share(mesh.points, mesh.tets, core).relative(core.infill)
    mass = float(material.density * (tet_volumes(mesh.points, mesh.tets) @ share))
    note = (
        f"printed: a solid skin of {1e3 * core.skin:.3g} mm around {100.0 * core.infill:.3g}% infill with "
        f"{100.0 * core.stiffness:.2g}% of the modulus (Hashin-Shtrikman); its mass is "
        f"{100.0 * mass / (material.density * mesh.quality.volume):.3g}% of that of a solid part, {mass:.3g} kg"
    )
    if body.mass is not None and abs(body.mass.mass / mass - 1.0) > _SAME_MASS:
        note += (
            f", where the shot states {body.mass.mass:.3g} kg: densities are {body.mass.mass / mass:.3g} times those"
        )
    return (note,)


def remark(quality: MeshQuality) -> tuple[str, ...]:
    """Message about a mesh that is less accurate than wanted."""
    if quality.frequency_error is None or quality.frequency_error <= ENOUGH:
        return ()
    return (
        f"estimated error of the first frequencies: {100.0 * quality.frequency_error:.2g}%, "
        f"more than {100.0 * ENOUGH:.2g}%: author a smaller calm:flexible:elementSize to reduce it",
    )
