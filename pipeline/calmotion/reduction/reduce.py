"""From a tetrahedral mesh to the reduced body that the dynamics steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from calmotion.errors import ShotError
from calmotion.reduction.basis.craig_bampton import Basis, reduced_basis
from calmotion.reduction.basis.modal_derivatives import Support
from calmotion.reduction.damping import damped
from calmotion.reduction.elements.assembly import FEModel, QuadraticMesh, assemble
from calmotion.reduction.elements.embedding import Embedding, embed
from calmotion.reduction.inertia_integrals import inertia_integrals
from calmotion.reduction.interfaces.interface_patches import Anchor, Patch, interface_patches
from calmotion.reduction.load_envelope import LoadEnvelope, patch_load_envelope
from calmotion.reduction.reduced_body import Elasticity, Marker, ReducedBody
from calmotion.shot.character import DEFAULT_TOLERANCE, Body, ElasticMaterial, SurfaceMesh
from calmotion.shot.meshes import FEMesh
from calmotion.shot.result import Simplification

__all__ = ["Anchor", "LinearModes", "linear_modes", "reduce_body"]


def reduce_body(
    mesh: FEMesh, body: Body, anchors: Sequence[Anchor], surfaces: Sequence[SurfaceMesh], root: int,
    load_envelope: LoadEnvelope | None = None, tolerance: float = DEFAULT_TOLERANCE, full: FullBody | None = None,
) -> ReducedBody:  # fmt: skip
    """Reduces one flexible body.

    The body frame is the prim frame as carried by the root's patch, which is clamped: every mode vanishes there.
    The patches of the other interfaces move as rigid ones; at their markers Phi and Psi are that motion exactly. At
    point anchors they are the displacement and half the curl of the nearest element.

    Args:
        mesh: Tetrahedra of the body.
        body: With `flexible` settings. A `mass` scales the density so that the mesh weighs as much.
        anchors: Where joints attach and targets are, body frame.
        surfaces: To be skinned, body frame.
        root: Index of the anchor of the parent-side joint; of kind `interface`.
        load_envelope: Loads on the body in this shot, for what is chosen automatically; None when nothing is known.
        tolerance: Error that does not matter [m].
        full: `full_body` of the same, where it is known.

    Returns:
        The reduced body, damped as one that carries nothing; markers in the order of the anchors, skins in the order
        of the surfaces.

    Raises:
        ShotError: A material that is none, or an anchor off the body.

    Source: Seed (11)-(20); formulation, section 1.
    """
    linear = linear_modes(mesh, body, anchors, root, load_envelope, tolerance, full)
    model, moving, basis, load_envelope = linear.model, linear.moving, linear.basis, linear.load_envelope
    left_out = _modes_left_out(basis, body, load_envelope)
    assert body.flexible is not None
    material = body.flexible.material
    elasticity = None
    law, without = _law(model, linear.support, basis, body, load_envelope, tolerance)
    left_out += without
    if law != "linear" and len(basis.omega_squared):
        from calmotion.reduction.material_laws.large_deflection import large_deflection

        basis, elasticity = large_deflection(
            model, linear.support, basis, material, law, load_envelope, tolerance, body.flexible.pairs_share
        )
        left_out += _pairs_left_out(elasticity, body)
    r = len(basis.omega_squared)
    reduced = ReducedBody(
        invariants=inertia_integrals(model.mesh.nodes, model.mass, basis.modes),
        stiffness=basis.omega_squared,
        damping=np.zeros((r, r)),
        markers=_markers(model.mesh, anchors, moving, basis),
        skin=tuple(embed(model.mesh, surface.points).displacements(basis.modes) for surface in surfaces),
        nodes=len(model.mesh.nodes),
        elements=len(model.mesh.tets),
        elasticity=elasticity,
        left_out=left_out,
        mesh_error_m=_mesh_error(mesh, linear),
    )
    return damped(reduced, material)


@dataclass(frozen=True, eq=False)
class FullBody:
    """A body before its reduction.

    Attributes:
        model: Full model.
        support: What holds the body.
        moving: Patches that move, in the order of the support's.
    """

    model: FEModel
    support: Support
    moving: Sequence[Patch]

    @property
    def entries(self) -> int:
        """Numbers in the factor that it keeps, most of its memory."""
        return self.support.fixed(self.model).solver.entries


def full_body(mesh: FEMesh, body: Body, anchors: Sequence[Anchor], root: int) -> FullBody:
    """The full model of a body and its interfaces; arguments and errors as of `reduce_body`."""
    settings = body.flexible
    if settings is None:
        raise ShotError("is not a flexible body", path=body.path, remedy="Apply CalmFlexibleBodyAPI")
    _check_material(settings.material)
    model = assemble(mesh.points, mesh.tets, settings.material, None if body.mass is None else body.mass.mass)
    patches = interface_patches(model.mesh, anchors, settings.interface_radius, body.path)
    held = next((patch for patch in patches if root in patch.anchors), None)
    if held is None:
        raise ShotError(
            "a flexible body needs a joint that carries it",
            path=body.path, remedy="Join it to its parent or to the world with a PhysicsJoint",
        )  # fmt: skip
    moving = [patch for patch in patches if patch is not held]
    centers = [anchors[patch.anchors[0]].frame.position for patch in moving]
    return FullBody(model, Support(held.nodes, [patch.nodes for patch in moving], centers), moving)


@dataclass(frozen=True, eq=False)
class LinearModes(FullBody):
    """The full model of a body and its linear basis.

    Attributes:
        basis: Its modes.
        load_envelope: The loads, by moving patch; None when they are not known.
    """

    basis: Basis
    load_envelope: LoadEnvelope | None


def linear_modes(
    mesh: FEMesh, body: Body, anchors: Sequence[Anchor], root: int, load_envelope: LoadEnvelope | None = None,
    tolerance: float = DEFAULT_TOLERANCE, full: FullBody | None = None,
) -> LinearModes:  # fmt: skip
    """The linear part of `reduce_body`, on the mesh; same arguments, same errors."""
    full = full or full_body(mesh, body, anchors, root)
    model, support, moving, settings = full.model, full.support, full.moving, body.flexible
    assert settings is not None
    if load_envelope is not None:
        positions = np.array([anchor.frame.position for anchor in anchors]).reshape(-1, 3)
        load_envelope = patch_load_envelope(
            load_envelope, [patch.anchors for patch in moving], positions, support.centers
        )
    basis = reduced_basis(
        model, support.root, support.patches, support.centers, settings, load_envelope=load_envelope,
        tolerance=settings.modes_share * tolerance if load_envelope is not None else None,
        targets=_points(model.mesh, anchors).displacements, fixed=support.fixed(model),
    )  # fmt: skip
    return LinearModes(model, support, moving, basis, load_envelope)


def _law(
    model: FEModel, support: Support, basis: Basis, body: Body, load_envelope: LoadEnvelope | None, tolerance: float
) -> tuple[str, tuple[Simplification, ...]]:
    """The elastic law of a body, and what it leaves out."""
    settings = body.flexible
    assert settings is not None
    law, what = settings.elasticity, f"nonlinear elasticity of {body.path}"
    if law != "auto":
        return law, (Simplification(what, "calm:flexible:elasticity is linear"),) if law == "linear" else ()
    if load_envelope is None:
        return "linear", (Simplification(what, "no motion tells how far it bends"),)
    from calmotion.reduction.material_laws.choice import choose_law

    choice = choose_law(model, support, basis, settings.material, load_envelope, tolerance, body.path)
    if choice.law == "neohookean":
        return choice.law, ()
    if choice.law == "stvk":
        what = f"nonlinear material of {body.path}"
    return choice.law, (Simplification(what, choice.reason, choice.error_m),)


def _mesh_error(mesh: FEMesh, linear: LinearModes) -> float | None:
    """What elements that are too stiff take from the deflection [m]: stiffness goes by the square of a frequency."""
    error = mesh.quality.frequency_error
    if error is None or linear.load_envelope is None:
        return None
    from calmotion.reduction.material_laws.choice import deflection_of

    return 2.0 * error * deflection_of(linear.model, linear.basis, linear.load_envelope)


def _points(mesh: QuadraticMesh, anchors: Sequence[Anchor]) -> Embedding:
    """The point anchors tied to the mesh."""
    places = [anchor.frame.position for anchor in anchors if anchor.kind != "interface"]
    return embed(mesh, np.array(places).reshape(-1, 3))


def _modes_left_out(basis: Basis, body: Body, load_envelope: LoadEnvelope | None) -> tuple[Simplification, ...]:
    """The modes that the basis does without, and what that costs."""
    if load_envelope is None or basis.cut_error_m is None:
        return ()
    kept = len(basis.omega_squared)
    return (
        Simplification(
            f"all but {kept} linear modes of {body.path}",
            "the motion of this shot hardly moves them",
            basis.cut_error_m,
        ),
    )


def _pairs_left_out(law: Elasticity, body: Body) -> tuple[Simplification, ...]:
    """The coordinates whose quadratic strain a law does without, and what that costs."""
    if law.seen is None:
        return ()
    p, r = law.seen.shape
    what = f"quadratic strain of {r - p} of {r} elastic coordinates of {body.path}"
    return (Simplification(what, "the loads of this shot hardly turn the body in them", law.unseen_m),)


def _markers(
    mesh: QuadraticMesh, anchors: Sequence[Anchor], moving: Sequence[Patch], basis: Basis
) -> tuple[Marker, ...]:
    r = len(basis.omega_squared)
    points = [i for i, anchor in enumerate(anchors) if anchor.kind != "interface"]
    tied = _points(mesh, anchors)
    Phi, Psi = np.zeros((len(anchors), 3, r)), np.zeros((len(anchors), 3, r))
    if points:
        Phi[points], Psi[points] = tied.displacements(basis.modes), tied.rotations(basis.modes)
    for patch, motion in zip(moving, basis.patch_motion, strict=True):
        for i in patch.anchors:
            Phi[i], Psi[i] = motion[:3], motion[3:]
    return tuple(
        Marker(position=a.frame.position, rotation=a.frame.rotation, Phi=Phi[i], Psi=Psi[i])
        for i, a in enumerate(anchors)
    )


def _check_material(material: ElasticMaterial) -> None:
    for value, low, high, name, meaning in (
        (material.youngs_modulus, 0.0, np.inf, "physics:youngsModulus", "must be positive"),
        (material.poissons_ratio, -1.0, 0.5, "physics:poissonsRatio", "must be between -1 and 0.5"),
        (material.density, 0.0, np.inf, "physics:density", "must be positive"),
    ):
        if not low < value < high:
            raise ShotError(
                f"of an elastic material {meaning}", path=material.path, attribute=name, found=value,
                remedy="Author a physical value in stage units",
            )  # fmt: skip
