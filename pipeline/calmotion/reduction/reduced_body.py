"""Reduced flexible bodies as multibody dynamics takes them; a rigid body has no elastic coordinates."""

from dataclasses import dataclass

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import MassProperties
from calmotion.model.result import Simplification


@dataclass(frozen=True, eq=False)
class Invariants:
    """Inertia integrals of a component over its undeformed body frame, basis of r modes phi_j.

    Every inertia term of the seed follows from these: M1 = -axial(M4_j) rows, M2 and M5 from S, M6 = tr M4.

    Attributes:
        mass: m = int rho [kg].
        s: int rho X [kg m], shape [3].
        Z: int rho X X^T [kg m^2], shape [3, 3].
        M: int rho Phi^T Phi, shape [r, r]; identity for a mass-orthonormal basis. Seed (4), (12).
        M3: int rho phi_j, shape [r, 3]. Seed (15).
        M4: int rho X phi_j^T, shape [r, 3, 3]. Seed (16).
        S: S[j, k] = int rho phi_j phi_k^T, shape [r, r, 3, 3]. Seed (14), (17).
    """

    mass: float
    s: Array
    Z: Array
    M: Array
    M3: Array
    M4: Array
    S: Array


@dataclass(frozen=True, eq=False)
class Marker:
    """A frame on a body at which joints attach or targets are measured.

    With elastic coordinates u the marker is at `position + Phi u` (body frame), and rotated by the rotation vector
    `Psi u` (body axes) before `rotation`. On a body of large deflection `Psi u` is the axis of the rotation times the
    sine of its angle (`multibody.kernels.finite_rotation`).

    Attributes:
        position: [m], shape [3], body frame, undeformed.
        rotation: Unit quaternion (w, x, y, z), shape [4].
        Phi: Translation of each mode, shape [3, r].
        Psi: Rotation of each mode [rad], shape [3, r].
    """

    position: Array
    rotation: Array
    Phi: Array
    Psi: Array


@dataclass(frozen=True, eq=False)
class Elasticity:
    """The elastic law of a body of large deflection.

    Attributes:
        law: `stvk` or `neohookean`.
        retardation: Kelvin-Voigt coefficient [s].
        data: Flat array. `stvk`: the Gram matrix of `elastic_forms.strain_gram`. `neohookean`: a correction of the
            stiffness (r x r), then for each cubature point its weight [m^3] and the displacement gradients of the
            modes (9 x r).
        points: Number of cubature points.
        lame: Lame's constants (lambda, mu) [Pa].
        strain_projection: Of `stvk`: projection W onto the subspace of the quadratic strain, W u its coordinates, shape
            [p, r] with p < r; None where the subspace has all r coordinates.
        strain_error_m: Estimated error of this subspace at the targets [m].
    """

    law: str
    retardation: float
    data: Array
    points: int = 0
    lame: tuple[float, float] = (0.0, 0.0)
    strain_projection: Array | None = None
    strain_error_m: float = 0.0


@dataclass(frozen=True, eq=False)
class ReducedBody:
    """A component of the multibody system in its own frame, clamped to its parent-side interface.

    Attributes:
        invariants: Inertia integrals.
        stiffness: Diagonal of the reduced stiffness about the undeformed state, omega_j^2 [1/s^2], shape [r].
        damping: Reduced damping [1/s], symmetric, shape [r, r]; with `elasticity`, the part proportional to the mass.
        markers: One for each attachment frame, in their order.
        skin: One array for each skinned surface: displacement of its points by each mode, shape [n, 3, r].
        nodes, elements: Size of the finite-element mesh; 0 for a rigid body.
        elasticity: None for a linear body.
        left_out: Simplifications of the model of this body, with their estimated errors.
        mesh_error_m: Estimated error of its finite-element mesh in the shot [m]; None where it is not known.
        mesh_error: Estimated relative error of its stiffness by the mesh, which makes a body too stiff; likewise.
        element_error: Relative error of the compliance of its elements, without what finer ones have told.
        damping_ratio: Fraction of critical damping of a body of several materials; None: that of its material.
        limit_m: Estimated error that no finer reduction takes away [m].
        weak_seat: A marker whose seat seems to decide how far it bends, see `weak_seats`; None without one.
    """

    invariants: Invariants
    stiffness: Array
    damping: Array
    markers: tuple[Marker, ...]
    skin: tuple[Array, ...] = ()
    nodes: int = 0
    elements: int = 0
    elasticity: Elasticity | None = None
    left_out: tuple[Simplification, ...] = ()
    mesh_error_m: float | None = None
    mesh_error: float | None = None
    element_error: float = 0.0
    damping_ratio: float | None = None
    limit_m: float = 0.0
    weak_seat: int | None = None

    @property
    def frequencies(self) -> Array:
        """Frequencies of the basis [Hz], shape [r]."""
        return np.sqrt(np.maximum(self.stiffness, 0.0)) / (2.0 * np.pi)


def rigid_invariants(mass: MassProperties) -> Invariants:
    """The integrals of a rigid body (r = 0) from its mass properties; docs/formulation.md."""
    inertia = mass.inertia
    about_center = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    return Invariants(
        mass=mass.mass,
        s=mass.mass * mass.center,
        Z=about_center + mass.mass * np.outer(mass.center, mass.center),
        M=np.zeros((0, 0)),
        M3=np.zeros((0, 3)),
        M4=np.zeros((0, 3, 3)),
        S=np.zeros((0, 0, 3, 3)),
    )
