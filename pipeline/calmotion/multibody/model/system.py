"""The compiled multibody system: flat arrays that the kernels read, one row a component, parents before children.

Each component hangs by one joint from its parent (-1: the world): component b by joint b. Further joints, from
number B on, close chains. Arrays are padded to the largest number of elastic coordinates. Side 0 of a joint is on the
parent, side 1 on the component; a joint that closes a chain may have the world on side 0, never on side 1.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from calmotion.arrays import Array, BoolArray, IntArray
from calmotion.support.by_reference import by_reference

CountArray = NDArray[np.int64]  # the type of Python's integers in a kernel, so that it is compiled once for both
JOINT_ROWS = 6
BACKWARD_DIFFERENCE, NEWMARK = 0, 1  # families of time-stepping formulas
# columns of `System.servo`
POSITION_GAIN, VELOCITY_GAIN, FRICTION, FRICTION_SPEED, LARGEST_EFFORT, INVERSE_SPEED, KNEE, RATE_SHARE = range(8)
BACK_EMF, BEYOND_COULOMB, FRICTION_TERMS = 8, 9, 10
SERVO_COLUMNS = 19
LINEAR, STVK, NEOHOOKEAN = 0, 1, 2  # elastic laws; `finite_rotation` distinguishes linear and nonlinear by zero


@by_reference
class System(NamedTuple):
    """Constants of the system (B components, J >= B joints, at most R elastic coordinates, N = 6 + R).

    Attributes:
        parent: Parent of each component, shape [B], -1 for the world.
        elastic: Number of elastic coordinates, shape [B]: modes, then those of compliant motors
            (`motors.drives`).
        modes: Number of those that deform the component, shape [B].
        side: Components on the two sides of each joint, shape [J, 2].
        rows: Number of constraint rows of each joint: 6 (weld, motor), 5 (free hinge or slider), 3 (ball) or 0
            (floating), shape [J].
        servos: Numbers of the joints that have a rotor.
        rotor: Elastic coordinate of the component on side 1 that is a joint's rotor, -1 for none, shape [J].
        servo: Of each rotor's motor, shape [J, 19]: gains [N m/rad], [N m s/rad], Coulomb friction [N m] and the speed
            by which it is smoothed [rad/s], largest effort [N m], inverse of the no-load speed [s/rad], the share of it
            up to which the largest effort is there, and the share of the command's rate that the velocity gain
            multiplies: 1, or 0 where it acts on the joint's own speed; torque by the induced voltage [N m s/rad],
            whether friction has more terms than Coulomb's, and these (`model.motor.FrictionTerms`).
        sliding: Whether a joint has a length along its axis instead of an angle, shape [J].
        moving: Row of `work.Work.world` that moves the world-side marker of a joint, -1 for none, shape [J].
        switch: Row of `work.Work.world` that tells whether the servo of a joint is on, -1 where it always is, shape
            [J]; see `phases`.
        contact: Rows of a joint that comes and goes while it holds, 0 for other joints, shape [J]; see `phases`.
        held: Inertia by which the regularised statics hold a component on a free joint [kg m^2], or its mass on a free
            slider [kg], shape [B]; see `statics.regularized_statics`.
        mass, s, Z, M3, M4, S: Inertia integrals, see `reduced_body.Invariants`.
        axial: axial(S[j, k]) = int rho phi_j x phi_k, shape [B, R, R, 3].
        axial0: axial(M4[j]) = int rho X x phi_j, shape [B, R, 3].
        rotating, nonrotating: Components with the inertia of `inertia`, and those with that of `constant_inertia`.
        inertia: Of each elastic coordinate by itself, shape [B, R]: 1 for modes, 0 for deflections of drives and
            gears, the armature of a rotor.
        stiffness: Diagonal, shape [B, R]; zero for a nonlinear body.
        damping: Symmetric, shape [B, R, R]; of a nonlinear body, the mass-proportional part.
        law: Elastic law: LINEAR, STVK, NEOHOOKEAN, shape [B].
        stvk, neohookean: Components of these laws.
        retardation: Kelvin-Voigt coefficient of nonlinear bodies [s], shape [B].
        lame: Lame's constants [Pa], shape [B, 2], where the law is NEOHOOKEAN.
        points: Number of cubature points, or dimension of the subspace of a STVK body's quadratic strain, shape [B].
        data_start, data: Data of `kernels.stvk` and `kernels.neohookean` of all bodies in one array, and where those of
            each body start.
        position, rotation, Phi, Psi: Joint markers, shapes [J, 2, 3], [J, 2, 3, 3], [J, 2, 3, R] twice.
        gravity: [m/s^2], shape [3].
        unit: What a change of each coordinate is compared with, shape [B, N]: a length of the mechanism for
            translations [m], 1 rad for rotations, and for an elastic coordinate what moves the component's mass by that
            length; decisions then do not depend on units. See `coordinate_units`.
    """

    parent: IntArray
    elastic: CountArray
    modes: CountArray
    side: IntArray
    rows: IntArray
    servos: IntArray
    rotor: IntArray
    servo: Array
    sliding: IntArray
    moving: IntArray
    switch: IntArray
    contact: IntArray
    held: Array
    mass: Array
    s: Array
    Z: Array
    M3: Array
    M4: Array
    S: Array
    axial: Array
    axial0: Array
    rotating: IntArray
    nonrotating: IntArray
    inertia: Array
    stiffness: Array
    damping: Array
    law: IntArray
    stvk: IntArray
    neohookean: IntArray
    retardation: Array
    lame: Array
    points: CountArray
    data_start: CountArray
    data: Array
    position: Array
    rotation: Array
    Phi: Array
    Psi: Array
    gravity: Array
    unit: Array

    @property
    def size(self) -> int:
        """Position coordinates of the largest component, N = 6 + R."""
        size: int = 6 + self.M3.shape[1]
        return size

    @property
    def starts(self) -> IntArray:
        """Where the coordinates of each component begin among those of all, and where they end, shape [B + 1]."""
        starts: IntArray = np.concatenate([[0], np.cumsum(6 + self.elastic)])
        return starts


class Integrator(NamedTuple):
    """Coefficients of an implicit integrator, or of the static equations.

    Attributes:
        velocity: d(velocity)/d(position) [1/s]; 0 for statics.
        acceleration: d(acceleration)/d(velocity) [1/s]; 0 for statics.
        gamma: Weight of the constraint at velocity level: 1, or 0 for statics.
        alpha: Baumgarte coefficient [1/s]; 1 for statics. Seed (31).
        family: BACKWARD_DIFFERENCE, or NEWMARK with the coefficients that follow.
        newmark_beta, newmark_gamma: Of Newmark's formulas.
        alpha_m, alpha_f: Share of the previous instant in the inertia and in the forces (generalised-alpha).
        h: Time step [s]; 0 for statics.
    """

    velocity: float
    acceleration: float
    gamma: float
    alpha: float
    family: int = BACKWARD_DIFFERENCE
    newmark_beta: float = 0.25
    newmark_gamma: float = 0.5
    alpha_m: float = 0.0
    alpha_f: float = 0.0
    h: float = 0.0


class State(NamedTuple):
    """State of one instant, all components.

    Attributes:
        c: Origins [m], shape [B, 3], world.
        q: Unit quaternions (w, x, y, z), shape [B, 4].
        u: Elastic coordinates, shape [B, R].
        turn: Rotation vector from the previous instant to this one, body axes [rad], shape [B, 3].
        V: Velocities (w in world axes, omega in body axes, v), shape [B, N].
        lam: Joint multipliers (force on the component at the joint in world axes [N], moment in the parent-side
            joint frame [N m]), shape [J, 6]. On a free slider the force, too, is in the parent-side joint frame.
    """

    c: Array
    q: Array
    u: Array
    turn: Array
    V: Array
    lam: Array


class Instants(NamedTuple):
    """The states of a step: the two instants before it, and the new one."""

    before2: State
    before: State
    now: State


@by_reference
class Blocks(NamedTuple):
    """The linearised equations of one instant, component by component (see `assembly.assemble`).

    Unknowns of a component are (R^T dc, dphi, du) in body axes and its joint's multipliers. An array of joints
    has one entry for each of the J joints; "component" and "parent" are its sides 1 and 0.

    Attributes:
        K: Tangent of its rows by its position, shape [B, N, N].
        P: By its velocity, dV-dot included, shape [B, N, N].
        D: By its acceleration (its mass matrix), shape [B, N, N].
        Lc, Lp: By the joint's multipliers: the component's rows, its parent's rows, shape [J, N, 6].
        Hc, Hp: The joint's constraint rows, by the component and by its parent, shape [J, 6, N]. A free slider has
            its length in place of a multiplier and the definition of it in place of a row, see `sliders`.
        Nc: The component's rows by the rotation of the parent-side marker, shape [J, N, 3].
        Jp: Rotation of the parent-side marker by the parent's coordinates, shape [J, 3, N].
        by_angle, by_rate: The joint's rows by the motor's angle (or length) and rate, shape [J, 6].
        on_parent: The parent's rows by the motor's length, shape [J, N]; zero where it is an angle.
        on_rotor: The row of a joint's rotor by the command and its rate, shape [J, 2].
        res: Residual of its rows, shape [B, N].
        gap: Residual of the joint's constraint rows, shape [J, 6].
    """

    K: Array
    P: Array
    D: Array
    Lc: Array
    Lp: Array
    Hc: Array
    Hp: Array
    Nc: Array
    Jp: Array
    by_angle: Array
    by_rate: Array
    on_parent: Array
    on_rotor: Array
    res: Array
    gap: Array


def coordinate_units(mass: Array, Z: Array, side: IntArray, position: Array, elastic: int) -> Array:
    """`System.unit`; its length is the largest lever of a joint or radius of gyration.

    Places in the world do not count: a mechanism is not larger for being far from the origin.

    Args:
        mass, Z, side, position: As of `System`.
        elastic: Number of elastic coordinates, R.
    """
    levers = np.linalg.norm(position, axis=2)[side >= 0]
    gyration = np.sqrt(np.trace(Z, axis1=1, axis2=2) / np.maximum(mass, np.finfo(float).tiny))
    length = float(max(levers.max(initial=0.0), gyration.max(initial=0.0))) or 1.0
    unit = np.ones((len(mass), 6 + elastic))
    unit[:, :3] = length
    # modes are orthonormal by mass
    unit[:, 6:] = length * np.sqrt(np.where(mass > 0.0, mass, 1.0))[:, None]
    return unit


def components(chosen: BoolArray) -> IntArray:
    """Numbers of the components that are chosen by an array of shape [B]."""
    return np.flatnonzero(chosen).astype(np.int32)


def allocate_state(system: System) -> State:
    """A state at the origin, at rest."""
    count, size = len(system.parent), system.size
    q = np.zeros((count, 4))
    q[:, 0] = 1.0
    return State(
        c=np.zeros((count, 3)),
        q=q,
        u=np.zeros((count, size - 6)),
        turn=np.zeros((count, 3)),
        V=np.zeros((count, size)),
        lam=np.zeros((len(system.rows), JOINT_ROWS)),
    )


def allocate_blocks(system: System) -> Blocks:
    """Zeroed blocks."""
    count, size, joints = len(system.parent), system.size, len(system.rows)

    def zeros(*shape: int) -> Array:
        return np.zeros(shape)

    square, wide, tall = (count, size, size), (joints, JOINT_ROWS, size), (joints, size, JOINT_ROWS)
    row = (joints, JOINT_ROWS)
    return Blocks(
        zeros(*square), zeros(*square), zeros(*square), zeros(*tall), zeros(*tall), zeros(*wide), zeros(*wide),
        zeros(joints, size, 3), zeros(joints, 3, size), zeros(*row), zeros(*row), zeros(joints, size),
        zeros(joints, 2), zeros(count, size), zeros(*row),
    )  # fmt: skip
