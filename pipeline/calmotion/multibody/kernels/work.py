"""Scratch of the kernels that assemble the equations of one instant."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array
from calmotion.multibody.kernels.markers import WORLD_MARKER, MarkerWork, allocate_marker
from calmotion.multibody.model.system import JOINT_ROWS, System
from calmotion.support.by_reference import by_reference


@by_reference
class LawWork(NamedTuple):
    """Scratch of the elastic laws, for components of r coordinates.

    Attributes:
        strain: Strain coordinates and stresses of `stvk`, shape [2 size] with size = r + p (p + 1) / 2 for a subspace
            of dimension p.
        rows: Rows of `stvk`, shape [p, size], or of `neohookean`, shape [18, r].
        subspace: Coordinates in the subspace, their rates and a combination of both, shape [3, p].
        row, inner: Shapes [p] and [p, r].
        point: Quantities of one cubature point, shape [18, 18].
    """

    strain: Array
    rows: Array
    subspace: Array
    row: Array
    inner: Array
    point: Array


@by_reference
class Work(NamedTuple):
    """Scratch of `assembly.assemble`.

    Attributes:
        R: Rotation matrices of all components, shape [B, 3, 3].
        s, Z, B: Integrals of one deformed component, shapes [3], [3, 3], [R, 3, 3].
        W: Its gradient of acceleration, [alpha]x + [omega]x^2, shape [3, 3].
        a: Its acceleration less gravity, body axes [m/s^2], shape [3].
        E, T, Q, M: Small matrices, shape [3, 3]; Q is the rotation across a joint.
        tmp, x, y, tau, force: Small vectors, shape [3].
        wrench: Force (body axes) and moment (marker axes) of a joint on its two sides, shape [2, 6].
        along: Unused part of a free slider's constraint rows, shape [1].
        length, moved, columns: Derivatives at a free slider, shapes [N], [2, N], [N, 3].
        world: Moving markers of the world at the instant that is assembled (`markers.moving_marker`), shape [W, 18];
            set by the caller.
        i, j: Markers on sides 0 and 1 of a joint.
        law: Scratch of the elastic laws.
    """

    R: Array
    s: Array
    Z: Array
    B: Array
    W: Array
    a: Array
    E: Array
    T: Array
    Q: Array
    M: Array
    tmp: Array
    x: Array
    y: Array
    tau: Array
    force: Array
    wrench: Array
    along: Array
    length: Array
    moved: Array
    columns: Array
    world: Array
    i: MarkerWork
    j: MarkerWork
    law: LawWork


def allocate_law_work(r: int, p: int, cubature: bool) -> LawWork:
    """Scratch for components of at most r elastic coordinates.

    Args:
        p: Largest dimension of a subspace of the quadratic strain, perhaps 0; -1 where no component is of that law.
        cubature: Whether a component is integrated by cubature.
    """
    size, p = r + p * (p + 1) // 2 if p >= 0 else 0, max(p, 0)
    points = 18 if cubature else 0
    return LawWork(
        strain=np.zeros(2 * size),
        rows=np.zeros((max(p, points), max(size, r if cubature else 0))),
        subspace=np.zeros((3, p)),
        row=np.zeros(p),
        inner=np.zeros((p, r)),
        point=np.zeros((points, points)),
    )


def _first_markers(system: System) -> Array:
    """Moving markers of the world before they are given: zeros, contacts where the shot was authored, and motors on."""
    markers = np.zeros((int(max(system.moving.max(initial=-1), system.switch.max(initial=-1))) + 1, WORLD_MARKER))
    markers[system.switch[system.switch >= 0], 9:] = np.eye(3).ravel()
    for joint in np.flatnonzero(system.contact):
        markers[system.moving[joint], :3] = system.position[joint, 0]
        markers[system.moving[joint], 9:] = system.rotation[joint, 0].ravel()
    return markers


def allocate_work(system: System) -> Work:
    """Scratch for one system."""
    r, count = system.size - 6, len(system.parent)
    square, vector = (3, 3), 3
    return Work(
        R=np.zeros((count, 3, 3)),
        s=np.zeros(vector),
        Z=np.zeros(square),
        B=np.zeros((r, 3, 3)),
        W=np.zeros(square),
        a=np.zeros(vector),
        E=np.zeros(square),
        T=np.zeros(square),
        Q=np.zeros(square),
        M=np.zeros(square),
        tmp=np.zeros(vector),
        x=np.zeros(vector),
        y=np.zeros(vector),
        tau=np.zeros(vector),
        force=np.zeros(vector),
        wrench=np.zeros((2, JOINT_ROWS)),
        along=np.zeros(1),
        length=np.zeros(system.size),
        moved=np.zeros((2, system.size)),
        columns=np.zeros((system.size, 3)),
        world=_first_markers(system),
        i=allocate_marker(system.size),
        j=allocate_marker(system.size),
        law=allocate_law_work(r, int(system.points[system.stvk].max(initial=-1)), len(system.neohookean) > 0),
    )
