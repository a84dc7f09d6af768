"""Joints whose seats, not the body, decide how far a flexible body bends, where nobody has said how large they are.

A patch turns on the ground under it, the more the smaller it is. Where this is most of what a body turns by, its
frequencies are those of the patch: with half the radius the first one is up to 2.8 times lower.
"""

from collections.abc import Sequence

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.mesh.patches.automatic_patch import radius_alike
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches, spans_a_plane
from calmotion.model.character import Body, ElasticMaterial
from calmotion.model.meshes import FEMesh
from calmotion.reduction.basis.natural_modes import clamped_modes
from calmotion.reduction.elements.assembly import FEModel, assemble

# Of what a body turns by at its end, from which a patch is looked at. With half the radius a patch turns eight times as
# far, and the frequency is half where that is 3/7 of what counts for it: of a bar, 12.4 E I / L^3 and m / 3 for its
# bending and for its turning on a spring make that 0.24 of the compliance at its end
_SHARE = 0.15
_FALLS = 2.0  # factor by which the first frequency falls with half the radius, from which it is told
_FEWEST = 6  # nodes of a triangle


def weak_patch(
    model: FEModel, material: ElasticMaterial, radii: Sequence[float], omega_squared: Array, patch_motion: Array
) -> int | None:
    """The patch that gives way most, 0 for the root patch, where that is much of what a body turns by; else None.

    It is found by what a reduction has, without a mode more.

    Args:
        model: Full model.
        radii: Of the root patch, and of each moving patch [m].
        omega_squared, patch_motion: As of `shares_of_patches`.
    """
    if len(patch_motion) and len(omega_squared):
        shares = shares_of_patches(radii, material, omega_squared, patch_motion)
    else:
        alike = radius_alike(model.mesh.nodes[model.mesh.surface[:, :3]])
        shares = np.array([alike**3 / (alike**3 + radii[0] ** 3)])
    worst = int(shares.argmax())
    return worst if shares[worst] > _SHARE else None


def shares_of_patches(
    radii: Sequence[float], material: ElasticMaterial, omega_squared: Array, patch_motion: Array
) -> Array:
    """What patches turn by on the ground under them, of what a body turns by, shape [1 + p]; may exceed one.

    A patch turns on the ground under it as a rigid disc on a half space does; its radius matters by the share of that
    in the compliance of the body.

    Args:
        radii: Of the root patch, and of each moving patch [m].
        omega_squared: Of its linear modes [1/s^2], shape [r].
        patch_motion: Motion of the moving patches in them, shape [p, 6, r].

    Source: Johnson, Contact Mechanics, 1985, 3.6: a moment turns a disc of radius a by 3 (1 - nu) / (8 G a^3).
    """
    shear = material.youngs_modulus / (2.0 * (1.0 + material.poissons_ratio))
    turned = patch_motion[:, 3:]
    whole = np.linalg.eigvalsh((turned / omega_squared) @ turned.transpose(0, 2, 1))[:, -1]
    # the end that the body turns farthest at also turns by what the root patch does
    of_each = np.concatenate([[whole.max()], whole])
    own = 3.0 * (1.0 - material.poissons_ratio) / (8.0 * shear * np.maximum(radii, np.finfo(float).tiny) ** 3)
    return np.asarray(own / np.maximum(of_each, np.finfo(float).tiny))


def weak_seat_note(mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], weak: int) -> str:
    """What a body would do with half the radius of a seat; empty where that matters little, or is as someone said.

    Args:
        body: With `flexible` settings.
        weak: Index of that of the seat.
    """
    settings, at = body.flexible, attachments[weak]
    assert settings is not None
    if settings.interface_radius >= 0.0 or at.surface is not None:
        return ""
    model = assemble(mesh.points, mesh.tets, settings.material, None if body.mass is None else body.mass.mass)
    patches = interface_patches(model.mesh, attachments, settings.interface_radius, body.path, mesh.patches)
    held = next(patch.nodes for patch in patches if weak in patch.attachments)
    half = _inner_half(model.mesh.nodes, held, at.frame.position)
    stiffness = np.sqrt(mesh.quality.factor)
    own, less = (float(stiffness * clamped_modes(model, 1, nodes)[0][0]) for nodes in (held, half))
    if own <= _FALLS * less:
        return ""
    return (
        f"{body.path}: its stiffness depends on the size of the interface of {at.path}, which the shot does not "
        f"author. Held there alone, its first frequency is {own:.4g} Hz; with half of the radius it is {less:.4g} Hz. "
        "A GeomSubset of family calmInterface sets the size"
    )


def _inner_half(points: Array, nodes: IntArray, origin: Array) -> IntArray:
    """The nodes of a patch in the nearer half of the distances that it has from the origin of its frame."""
    distance = np.linalg.norm(points[nodes] - origin, axis=1)
    half = nodes[distance <= 0.5 * (distance.min() + distance.max())]
    if spans_a_plane(points[half]):
        return np.asarray(half)
    return np.asarray(nodes[np.argsort(distance, kind="stable")][: max(_FEWEST, len(nodes) // 4)])
