"""What the kernels of one component read: its constants, its motion, its elastic law and its markers; compiled."""

from typing import NamedTuple

from calmotion.arrays import Array
from calmotion.multibody.kernels.finite_rotation import LINEAR_BODY
from calmotion.multibody.model.system import System
from calmotion.support.compilation import kernel


class Component(NamedTuple):
    """Constants of one component of r elastic coordinates: a row of `System`.

    Attributes:
        r: Number of elastic coordinates.
        mass, s, Z, M3, M4, S, axial, axial0: Inertia integrals, see `System`.
        inertia, stiffness, damping: Of the elastic coordinates, shapes [R], [R] and [R, R].
    """

    r: int
    mass: float
    s: Array
    Z: Array
    M3: Array
    M4: Array
    S: Array
    axial: Array
    axial0: Array
    inertia: Array
    stiffness: Array
    damping: Array


class ComponentMotion(NamedTuple):
    """Motion of one component at an instant.

    Attributes:
        a: Acceleration of the origin less gravity, R^T (c'' - g), body axes [m/s^2], shape [3].
        om, al: Angular velocity [rad/s] and acceleration [rad/s^2], body axes, shape [3].
        u, v, vd: Elastic coordinates, their rates and accelerations, shape [r].
    """

    a: Array
    om: Array
    al: Array
    u: Array
    v: Array
    vd: Array


class ElasticLaw(NamedTuple):
    """Elastic law of one nonlinear component.

    Attributes:
        r: Number of coordinates that deform it.
        points: Number of cubature points, or dimension of the subspace of a STVK body's quadratic strain.
        retardation: Retardation time of Kelvin-Voigt damping [s].
        lame: Lame's constants [Pa], shape [2], where the law is NEOHOOKEAN.
        start, data: The flat array of all components, and where this one's data start.
    """

    r: int
    points: int
    retardation: float
    lame: Array
    start: int
    data: Array


class ComponentMarker(NamedTuple):
    """A marker on a component.

    Attributes:
        r: Number of the component's elastic coordinates.
        law: Elastic law of the component, which decides how it rotates the marker (`finite_rotation`).
        position: In the undeformed component [m], body axes, shape [3].
        rotation: In the undeformed component, shape [3, 3].
        Phi, Psi: Displacement and small rotation by the elastic coordinates, shape [3, R].
    """

    r: int
    law: int
    position: Array
    rotation: Array
    Phi: Array
    Psi: Array


@kernel
def component_of(system: System, b: int) -> Component:
    """Component b of a system."""
    return Component(
        system.elastic[b], system.mass[b], system.s[b], system.Z[b], system.M3[b], system.M4[b], system.S[b],
        system.axial[b], system.axial0[b], system.inertia[b], system.stiffness[b], system.damping[b],
    )  # fmt: skip


@kernel
def law_of(system: System, b: int) -> ElasticLaw:
    """Elastic law of component b."""
    return ElasticLaw(
        system.modes[b], system.points[b], system.retardation[b], system.lame[b], system.data_start[b], system.data
    )


@kernel
def marker_of(system: System, joint: int, side: int) -> ComponentMarker:
    """Marker of a joint on its side 0 or 1, which is a component.

    Modes do not move the marker by which a component hangs in the tree; deflections of drives turn it as exp.
    """
    b = system.side[joint, side]
    law = LINEAR_BODY if side == 1 and joint < len(system.parent) else system.law[b]
    return ComponentMarker(
        system.elastic[b], law, system.position[joint, side], system.rotation[joint, side],
        system.Phi[joint, side], system.Psi[joint, side],
    )  # fmt: skip
