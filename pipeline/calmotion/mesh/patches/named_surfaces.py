"""Interfaces that a shot names on the surface of a flexible body: what is wrong with them on any mesh."""

from itertools import combinations

import numpy as np

from calmotion.errors import ShotError, raise_all
from calmotion.mesh.patches.interface_patches import overlapping
from calmotion.model import Character
from calmotion.model.character import InterfaceSurface

_FLAT = 1e-9  # area over the square of its size, below which an interface is a line


def refuse_named_surfaces(character: Character) -> None:
    """Refuse interfaces that no mesh can have: those without area, and two with a triangle in common.

    Raises:
        ShotError: Each of them.
    """
    problems = []
    for body in character.bodies:
        if not body.simulated_flexible:
            continue
        for surface in body.interfaces:
            if _has_no_area(surface):
                problems.append(
                    ShotError(
                        f"this interface of {surface.joint} has no area, which a joint needs",
                        path=surface.path,
                        attribute="indices",
                        found=f"{len(surface.triangles)} triangles",
                        remedy="Add faces to it, or remove it: a patch is then chosen around the joint",
                    )
                )
        for one, other in combinations(body.interfaces, 2):
            if one.joint != other.joint and _share_a_triangle(one, other):
                problems.append(overlapping(other, one.joint))
    raise_all(problems)


def _has_no_area(surface: InterfaceSurface) -> bool:
    corners = surface.triangles
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    return bool(area <= _FLAT * np.sum(np.ptp(corners.reshape(-1, 3), axis=0) ** 2))


def _share_a_triangle(one: InterfaceSurface, other: InterfaceSurface) -> bool:
    corners = [{tuple(np.sort(t.reshape(3, 3), axis=0).ravel()) for t in s.triangles} for s in (one, other)]
    return bool(corners[0] & corners[1])
