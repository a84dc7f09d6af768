"""Flexible bodies that are too soft for their own weight, from their size alone, before they are meshed."""

import numpy as np

from calmotion.errors import ShotError, raise_all
from calmotion.model import Body, Character
from calmotion.reduction.material_laws.deflection import UNPHYSICAL

_COMPRESSED = 0.5  # of its length, by which a body is compressed under its own weight, beyond any material


def refuse_soft_bodies(character: Character) -> None:
    """Refuse bodies that their own weight would flatten, however they are held.

    Most often a modulus is in other units: in MPa or GPa instead of Pa, or not in those of the stage.

    Raises:
        ShotError: Each of them.
    """
    gravity = float(np.linalg.norm(character.gravity))
    problems = []
    for body in character.bodies:
        if body.simulated_flexible and (found := _least_deflection(body, gravity)) is not None:
            assert body.flexible is not None
            share, length = found
            material = body.flexible.material
            problems.append(
                ShotError(
                    f"the body {body.path} is too soft: its own weight would deform it by at least {share:.2g} times "
                    "its size",
                    path=material.path,
                    attribute="physics:youngsModulus",
                    found=f"{material.youngs_modulus:.3g} Pa, {material.density:.4g} kg/m^3, length {length:.3g} m",
                    remedy="Check these in units of the stage: moduli are in mass unit / (length unit s^2)",
                )
            )
    raise_all(problems)


def _least_deflection(body: Body, gravity: float) -> tuple[float, float] | None:
    """Deflection under its own weight over the size of a body, and that size [m], if it is too large; else None.

    A body of the length L that is held in its middle is compressed by at least rho g L / 4 E of it. Bent, it is a beam
    of the length L / 2 whose material is at most half of its width b away from the axis: its deflection is at least
    rho g L^4 / 32 E b^2 (Euler-Bernoulli).
    """
    assert body.flexible is not None
    parts = [surface.points[np.unique(surface.triangles)] for surface in body.surfaces if len(surface.triangles)]
    points = np.concatenate(parts) if body.tets is None and parts else None if body.tets is None else body.tets.points
    material = body.flexible.material
    if points is None or body.flexible.mesh_file or not np.all(np.isfinite(points)):
        return None
    width, length = np.sort(np.ptp(points, axis=0))[1:]
    weight = material.density * gravity / material.youngs_modulus
    compressed = 0.25 * weight * length
    bent = weight * length**3 / (32.0 * width**2) if width > 0.0 else 0.0
    too_soft = compressed > _COMPRESSED or bent > UNPHYSICAL
    return (float(max(compressed, bent)), float(length)) if too_soft else None
