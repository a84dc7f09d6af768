"""Reduction of a tetrahedral mesh to a body of few elastic coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.patches.interface_patches import AttachmentFrame, InterfacePatch, interface_patches
from calmotion.mesh.quadratic import QuadraticMesh
from calmotion.mesh.tetrahedra import surface_area
from calmotion.model.character import DEFAULT_TOLERANCE, Body, ElasticMaterial, SurfaceMesh
from calmotion.model.meshes import FEMesh
from calmotion.model.result import Simplification
from calmotion.model.tolerance import REDUCTION
from calmotion.reduction.basis.craig_bampton import Basis, reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.damping import damped, ratio_of_parts
from calmotion.reduction.elements.assembly import FEModel, assemble
from calmotion.reduction.elements.embedding import Embedding, embed
from calmotion.reduction.inertia import inertia_integrals
from calmotion.reduction.load_envelope import LoadEnvelope, patch_load_envelope
from calmotion.reduction.reduced_body import Marker, ReducedBody
from calmotion.reduction.weak_seats import weak_patch

__all__ = ["AttachmentFrame", "LinearModes", "linear_modes", "reduce_body"]


def reduce_body(
    mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], surfaces: Sequence[SurfaceMesh], root: int,
    load_envelope: LoadEnvelope | None = None, tolerance: float = DEFAULT_TOLERANCE, full: FullBody | None = None,
) -> ReducedBody:  # fmt: skip
    """Reduce one flexible body.

    The body frame is the prim frame, fixed to the root patch. The root patch is clamped: all modes are zero there. The
    patches of the other interfaces are rigid, and Phi and Psi of their markers are the motion of the patch. Phi and Psi
    of a point are the displacement and half the curl in the nearest element.

    Args:
        mesh: Tetrahedra of the body.
        body: With `flexible` settings. A `mass` scales the density to that total mass.
        attachments: Frames of the joints and targets on the body, body frame.
        surfaces: Surfaces to skin, body frame.
        root: Index of the attachment frame of the joint to the parent; of kind `interface`.
        load_envelope: Loads on the body in this shot, for automatic choices; None when they are not known.
        tolerance: Acceptable error [m].
        full: `full_body` of the same arguments, where it is known.

    Returns:
        The reduced body, damped as a single body; markers in the order of the attachment frames, skins in the order of
        the surfaces.

    Raises:
        ShotError: The material constants are not physical, or an attachment frame is away from the body.

    Source: Seed (11)-(20); docs/formulation.md, "A flexible body".
    """
    linear = linear_modes(mesh, body, attachments, root, load_envelope, tolerance, full)
    model, moving, basis, load_envelope = linear.model, linear.moving, linear.basis, linear.load_envelope
    left_out = _omitted_modes(basis, body, load_envelope)
    assert body.flexible is not None
    material = _material(mesh, body.flexible.material)
    settings = replace(body.flexible, material=material)
    from calmotion.reduction.material_laws.laws import reduced_by_law

    by_law = reduced_by_law(model, linear.support, basis, settings, load_envelope, tolerance, body.path)
    basis = by_law.basis
    r, mesh_error = len(basis.omega_squared), _mesh_error(mesh)
    reduced = ReducedBody(
        invariants=inertia_integrals(model.mesh.nodes, model.mass, basis.modes),
        stiffness=basis.omega_squared,
        damping=np.zeros((r, r)),
        markers=_markers(model.mesh, attachments, moving, basis),
        skin=tuple(linear.embedding(surface).displacements(basis.modes) for surface in surfaces),
        nodes=len(model.mesh.nodes),
        elements=len(model.mesh.tets),
        elasticity=by_law.elasticity,
        left_out=left_out + by_law.told,
        limit_m=by_law.limit_m,
        mesh_error_m=_mesh_error_at_targets(mesh_error, linear),
        mesh_error=mesh_error,
        element_error=max(1.0 / mesh.quality.stiffness_factor - 1.0, 0.0),
        damping_ratio=ratio_of_parts(model.mesh, material, linear.basis.modes),
        weak_seat=_weak_seat(linear, material, root),
    )
    return damped(reduced, material)


def _weak_seat(linear: LinearModes, material: ElasticMaterial, root: int) -> int | None:
    """The attachment frame of the patch that gives way most, where that is much."""
    basis = linear.basis
    weak = weak_patch(linear.model, material, linear.radii, basis.omega_squared, basis.patch_motion)
    if weak is None:
        return None
    return root if weak == 0 else linear.moving[weak - 1].attachments[0]


@dataclass(frozen=True, eq=False)
class FullBody:
    """A body before its reduction.

    Attributes:
        model: Full model.
        support: Its root patch and moving patches.
        moving: The moving patches, in the order of the support.
        radii: Of the root patch, and of each moving patch [m].
    """

    model: FEModel
    support: Support
    moving: Sequence[InterfacePatch]
    radii: Sequence[float]
    _embedded: dict[int, tuple[SurfaceMesh, Embedding]] = field(default_factory=dict, kw_only=True, repr=False)

    def embedding(self, surface: SurfaceMesh) -> Embedding:
        """The points of a surface in the elements; found once for all reductions of the body."""
        if id(surface) not in self._embedded:
            self._embedded[id(surface)] = surface, embed(self.model.mesh, surface.points)
        return self._embedded[id(surface)][1]

    def scaled(self, factor: float) -> FullBody:
        """The same body with its stiffness times a factor, without a new factorisation."""
        own = self.support
        support = Support(own.root, own.patches, own.centers)
        model = self.model.stiffened(factor)
        return FullBody(
            model,
            support.known(model, own.fixed(self.model).scaled(model, factor)),
            self.moving,
            self.radii,
            _embedded=self._embedded,
        )

    def factorize(self) -> None:
        """Factorise its matrix now, not when it is needed."""
        self.support.fixed(self.model)

    @property
    def entries(self) -> int:
        """Number of entries of its matrix factor, most of its memory."""
        return self.support.fixed(self.model).solver.entries


def full_body(mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int) -> FullBody:
    """The full model of a body and its interfaces; arguments and errors as of `reduce_body`."""
    settings = body.flexible
    if settings is None:
        raise ShotError("this body is not flexible", path=body.path, remedy="Apply CalmFlexibleBodyAPI")
    _check_material(settings.material)
    material = _material(mesh, settings.material)
    model = assemble(mesh.points, mesh.tets, material, None if body.mass is None else body.mass.mass)
    patches = interface_patches(model.mesh, attachments, settings.interface_radius, body.path, mesh.patches)
    root_patch = next((patch for patch in patches if root in patch.attachments), None)
    if root_patch is None:
        raise ShotError(
            "no joint connects this flexible body to a parent",
            path=body.path,
            remedy="Connect it to its parent or to the world by a PhysicsJoint",
        )
    moving = [patch for patch in patches if patch is not root_patch]
    centers = [attachments[patch.attachments[0]].frame.position for patch in moving]
    support = Support(root_patch.nodes, [patch.nodes for patch in moving], centers)
    if len(np.unique(np.concatenate([support.root, *support.patches]))) == len(model.mesh.nodes):
        raise ShotError(
            "its joints hold all of the mesh, so that nothing of it can bend",
            path=body.path,
            attribute="calm:flexible:interfaceRadius",
            found=f"{len(mesh.tets)} tetrahedra",
            remedy="Use a finer mesh or a smaller interface, or set calm:flexible:enabled to false.",
        )
    return FullBody(model, support, moving, [_radius_of(model.mesh, patch) for patch in (root_patch, *moving)])


def _radius_of(mesh: QuadraticMesh, patch: InterfacePatch) -> float:
    """Radius of a disc of the area of a patch [m]."""
    held = np.isin(mesh.surface[:, :3], patch.nodes).all(axis=1)
    return float(np.sqrt(surface_area(mesh.nodes, mesh.surface[held, :3]) / np.pi)) or patch.radius


def _material(mesh: FEMesh, material: ElasticMaterial) -> ElasticMaterial:
    """The material with which the elements of a mesh are as stiff as those of a finer one."""
    return replace(material, youngs_modulus=mesh.quality.factor * material.youngs_modulus)


@dataclass(frozen=True, eq=False)
class LinearModes(FullBody):
    """The full model of a body and its linear basis.

    Attributes:
        basis: Its modes.
        load_envelope: Its loads, one row for each moving patch; None when they are not known.
    """

    basis: Basis
    load_envelope: LoadEnvelope | None


def linear_modes(
    mesh: FEMesh, body: Body, attachments: Sequence[AttachmentFrame], root: int,
    load_envelope: LoadEnvelope | None = None, tolerance: float = DEFAULT_TOLERANCE, full: FullBody | None = None,
) -> LinearModes:  # fmt: skip
    """The linear modes of `reduce_body` on the full mesh; same arguments and errors."""
    full = full or full_body(mesh, body, attachments, root)
    model, support, moving, settings = full.model, full.support, full.moving, body.flexible
    assert settings is not None
    if load_envelope is not None:
        positions = np.array([attachment.frame.position for attachment in attachments]).reshape(-1, 3)
        load_envelope = patch_load_envelope(
            load_envelope, [patch.attachments for patch in moving], positions, support.centers
        )
    basis = reduced_basis(
        model, support.root, support.patches, support.centers, settings, load_envelope=load_envelope,
        tolerance=settings.modes_share * tolerance if load_envelope is not None else None,
        targets=_points(model.mesh, attachments).displacements, fixed=support.fixed(model),
    )  # fmt: skip
    return LinearModes(model, support, moving, full.radii, basis, load_envelope, _embedded=full._embedded)


def _mesh_error(mesh: FEMesh) -> float | None:
    """Relative error of the stiffness by the mesh: that of deflections, else twice that of a frequency."""
    own, by_frequency = mesh.quality.deflection_error, mesh.quality.frequency_error
    return own if own is not None or by_frequency is None else 2.0 * by_frequency


def _mesh_error_at_targets(error: float | None, linear: LinearModes) -> float | None:
    """Error of the deflection [m] by a relative error of the stiffness."""
    if error is None or linear.load_envelope is None:
        return None
    from calmotion.reduction.material_laws.deflection import deflection_of

    return error * deflection_of(linear.model, linear.basis, linear.load_envelope)


def _points(mesh: QuadraticMesh, attachments: Sequence[AttachmentFrame]) -> Embedding:
    """The origins of the point attachment frames, embedded in the mesh."""
    positions = [attachment.frame.position for attachment in attachments if attachment.kind != "interface"]
    return embed(mesh, np.array(positions).reshape(-1, 3))


def _omitted_modes(basis: Basis, body: Body, load_envelope: LoadEnvelope | None) -> tuple[Simplification, ...]:
    """The linear modes that the basis omits, with the estimated error."""
    if load_envelope is None or basis.cut_error_m is None:
        return ()
    kept, flexible = len(basis.omega_squared), body.flexible
    why = "the loads of this shot excite the others by less than the tolerance"
    if flexible is not None and flexible.mode_count >= 0:
        why = "modeCount is authored"
    elif flexible is not None and flexible.max_frequency >= 0.0:
        why = f"maxFrequency of {flexible.max_frequency:.4g} Hz is authored"
    what = f"{body.path}: only {kept} linear mode{'' if kept == 1 else 's'}"
    return (Simplification(what, why, basis.cut_error_m, REDUCTION),)


def _markers(
    mesh: QuadraticMesh, attachments: Sequence[AttachmentFrame], moving: Sequence[InterfacePatch], basis: Basis
) -> tuple[Marker, ...]:
    r = len(basis.omega_squared)
    points = [i for i, attachment in enumerate(attachments) if attachment.kind != "interface"]
    embedding = _points(mesh, attachments)
    Phi, Psi = np.zeros((len(attachments), 3, r)), np.zeros((len(attachments), 3, r))
    if points:
        Phi[points], Psi[points] = embedding.displacements(basis.modes), embedding.rotations(basis.modes)
    for patch, motion in zip(moving, basis.patch_motion, strict=True):
        center = attachments[patch.attachments[0]].frame.position
        for i in patch.attachments:
            arm = attachments[i].frame.position - center
            Phi[i], Psi[i] = motion[:3] + np.cross(motion[3:], arm, axisa=0, axisc=0), motion[3:]
    return tuple(
        Marker(position=a.frame.position, rotation=a.frame.rotation, Phi=Phi[i], Psi=Psi[i])
        for i, a in enumerate(attachments)
    )


def _check_material(material: ElasticMaterial) -> None:
    for value, low, high, name, meaning in (
        (material.youngs_modulus, 0.0, np.inf, "physics:youngsModulus", "must be positive"),
        (material.poissons_ratio, -1.0, 0.5, "physics:poissonsRatio", "must be between -1 and 0.5"),
        (material.density, 0.0, np.inf, "physics:density", "must be positive"),
    ):
        if not low < value < high:
            raise ShotError(
                f"{name} of an elastic material {meaning}",
                path=material.path,
                attribute=name,
                found=value,
                remedy="Author a physical value in stage units",
            )
