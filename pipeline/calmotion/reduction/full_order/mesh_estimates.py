"""The estimated error of a mesh: of the modes that loads excite, or of its first modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame, interface_patches
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.model.character import Body, Frame
from calmotion.model.meshes import CutPatch, FEMesh, MissingVolume
from calmotion.reduction.discretization_error import clamped_modes, element_errors, errors_and_form
from calmotion.reduction.elements.assembly import assemble
from calmotion.reduction.full_order.mesh_extrapolation import Estimate
from calmotion.reduction.full_order.shape_change import shape_forms
from calmotion.reduction.material_laws.choice import amplitudes
from calmotion.reduction.reduce import LinearModes

_MODES, _COUNT = 12, 3  # modes of a load estimate; frequencies that a motion excites


def load_estimate(linear: LinearModes, body: Body, missing: MissingVolume | None = None) -> Estimate:
    """Error of the modes that the loads excite, and of the static responses of the interfaces.

    Args:
        linear: The body on a mesh, with its loads.
        body: With `flexible` settings.
        missing: What the mesh leaves out.
    """
    envelope, fixed = linear.load_envelope, linear.support.fixed(linear.model)
    assert body.flexible is not None and envelope is not None
    count = min(_MODES, len(linear.basis.omega_squared))
    squares = linear.basis.omega_squared[:count]
    energy = squares * amplitudes(linear.model, linear.basis, envelope, count) ** 2
    weights = energy / max(energy.sum(), np.finfo(float).tiny)
    stiffness, nodes = fixed.patch_stiffness(), len(linear.model.mesh.nodes)
    compliance = np.linalg.inv(stiffness)
    unit = compliance / np.sqrt(np.diag(compliance))  # responses to wrenches, of energy one half each
    k = len(unit)
    shapes = [(fixed.constraint @ unit).reshape(nodes, 3, k), linear.basis.modes[:, :, :count]]
    all_shapes = np.concatenate(shapes, axis=2)
    errors, form = errors_and_form(linear.model.mesh, body.flexible.material, all_shapes)
    wrenches = np.hstack([envelope.force, envelope.moment]).ravel()
    levers = np.hstack([np.ones_like(envelope.force), np.tile(envelope.lever_arm[:, None], 3)]).ravel()
    moved = (levers @ np.abs(unit)) * wrenches * np.sqrt(np.diag(compliance))  # how far each wrench moves targets
    parts = errors[:, k:] @ weights
    indicators = parts + errors[:, :k] @ (moved / max(moved.sum(), np.finfo(float).tiny))
    to_unit = np.linalg.inv(unit)
    forms = to_unit.T @ form[:k, :k] @ to_unit
    found = Estimate(float(parts.sum()), squares, weights, indicators, nodes, stiffness, forms, wrenches, levers)
    if missing is None:
        return found
    stiffer, heavier, whole = shape_forms(linear.model.mesh, body.flexible.material, missing, all_shapes)
    along_interfaces = to_unit.T @ stiffer[:k, :k] @ to_unit
    found = replace(found, shape_stiffness=along_interfaces)
    return _with_shape(found, np.diag(stiffer)[k:], np.diag(heavier)[k:], whole[k:])


def frequency_estimate(
    mesh: FEMesh, body: Body, carrier: Frame | None, attachments: Sequence[AttachmentFrame] = ()
) -> Estimate:
    """Error of the first modes, of which each counts by its compliance relative to that of the first.

    Args:
        mesh, body, carrier, attachments: As of `refined_for_frequencies`.

    Raises:
        ShotError: Nothing of the mesh is free.
    """
    assert body.flexible is not None
    model = assemble(mesh.points, mesh.tets, body.flexible.material)
    clamped = _clamped_nodes(model.mesh, body, carrier, mesh.patches, attachments)
    frequencies, modes = clamped_modes(model, _COUNT, clamped)
    if not len(frequencies):
        raise ShotError(
            "its parent joint holds all of the mesh, so that nothing of it can bend", path=body.path,
            attribute="calm:flexible:interfaceRadius", found=f"{len(mesh.tets)} tetrahedra",
            remedy="Use a finer mesh or a smaller interface, or set calm:flexible:enabled to false.",
        )  # fmt: skip
    weights = (frequencies[0] / frequencies) ** 2
    errors = element_errors(model.mesh, body.flexible.material, modes)
    total = float((errors * weights).sum(axis=0).max())
    squares = (2.0 * np.pi * frequencies) ** 2
    found = Estimate(total, squares, weights / weights.sum(), errors @ weights, len(model.mesh.nodes))
    if mesh.missing is None:
        return found
    stiffer, heavier, whole = shape_forms(model.mesh, body.flexible.material, mesh.missing, modes)
    return _with_shape(found, np.diag(stiffer), np.diag(heavier), whole)


def _with_shape(estimate: Estimate, stiffer: Array, heavier: Array, whole: Array) -> Estimate:
    """The estimate with what missing volume changes about its modes, of mass one each.

    Args:
        estimate: Of the mesh.
        stiffer, heavier, whole: Stiffness and mass that it adds to each mode, and `shape_forms`' third, shape [k].
    """
    squares = estimate.squares
    return replace(estimate, shape_squares=stiffer / squares - heavier, shape_whole=whole / squares)


def _clamped_nodes(
    mesh: QuadraticMesh, body: Body, carrier: Frame | None, cut: Sequence[CutPatch],
    attachments: Sequence[AttachmentFrame],
) -> IntArray | None:  # fmt: skip
    assert body.flexible is not None
    if carrier is None:
        return None
    at = carrier.position
    own = next(
        (k for k, a in enumerate(attachments) if a.kind == "interface" and np.array_equal(a.frame.position, at)), None
    )
    joints = [AttachmentFrame(body.path, carrier, "interface")] if own is None else attachments
    try:
        patches = interface_patches(mesh, joints, body.flexible.interface_radius, body.path, cut)
    except ShotError:
        return None  # the reduction reports the error with the joint
    return next(patch.nodes for patch in patches if (own or 0) in patch.attachments)
