"""Natural modes of the whole character, joints locked by their motors."""

from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, eigh, lstsq, null_space, solve_triangular, svd

from calmotion.arrays import Array, IntArray
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.kernels.sliders import LENGTH, slides_freely
from calmotion.multibody.model.model import Model
from calmotion.multibody.model.phases import system_held
from calmotion.multibody.model.system import VELOCITY_GAIN, State, System
from calmotion.multibody.statics.equilibrium import equilibrium, linearize

_MASSLESS = 1e-14  # of the largest inertia of a motion: what has less has none
_SINGULAR = 1e8  # condition of the rows of a joint for its child, beyond which they do not tell all six coordinates


def system_modes(model: Model, joint_angles: Array, world: Array | None = None) -> tuple[Array, Array]:
    """Undamped natural frequencies [Hz], ascending, and damping ratios of their modes, about the equilibrium at joint
    angles of shape [B], moving roots fixed at `world`, shape [W, 18].

    Motions that the joints forbid are projected out; free joints count as motions. A negative stiffness (an
    unstable pose) gives a frequency of zero, and a ratio of zero. Modes couple through the damping; ratios are those
    of each mode by itself.

    Raises:
        SimulationFailure: No equilibrium.
    """
    system, workspace = model.system, Workspace.for_system(model.system)
    if world is not None:
        workspace.work.world[:] = world
        system = system_held(system, world)
    state, _ = equilibrium(system, rigid_state(model, joint_angles, world), joint_angles, workspace)
    omega, shapes, C = _natural_modes(system, state, joint_angles, workspace)
    damping = np.einsum("ik,ij,jk->k", shapes, C, shapes)
    return omega / (2.0 * np.pi), np.where(omega > 0.0, damping / np.maximum(2.0 * omega, 1e-300), 0.0)


def falling_rate(model: Model, state: State, joint_angles: Array, world: Array) -> float:
    """With what rate a robot leaves an equilibrium by itself [1/s]; 0 where it is stable.

    Args:
        state: The equilibrium; an iteration may end in one that is not stable.
        joint_angles: Shape [B].
        world: Moving markers, shape [W, 18].
    """
    workspace = Workspace.for_system(model.system)
    workspace.work.world[:] = world
    squares, *_ = _squares(system_held(model.system, world), state, joint_angles, workspace)
    return float(np.sqrt(max(0.0, -float(squares.min(initial=0.0)))))


def elastic_modes(model: Model) -> tuple[Array, list[Array]]:
    """Natural modes of the undeformed character in the pose in which the shot was authored, without gravity.

    From the singular values of a root of the stiffness: squares of frequencies would have a rounding error relative to
    the largest one, which exceeds those of slow modes, and motions of free joints would have a frequency.

    Returns:
        Angular frequencies [rad/s], ascending, shape [n]; and for each component its elastic coordinates in the modes,
        shape [r, n]. The modes have mass one; those of frequency zero, up to rounding, deform nothing.
    """
    system = model.system._replace(gravity=np.zeros(3))
    angles = model.rest_angles
    found = matrices_at(system, rigid_state(model, angles), angles, Workspace.for_system(system))
    K, M, allowed = found.stiffness, found.mass, found.with_inertia()
    parts = [slice(end - r, end) for end, r in zip(system.starts[1:], system.elastic, strict=True)]
    size = allowed.shape[1]
    if not size:
        return np.zeros(0), [np.zeros((int(r), 0)) for r in system.elastic]
    mass = allowed.T @ M @ allowed
    stiff = _stiff_modes(np.sum([allowed[part].T @ K[part, part] @ allowed[part] for part in parts], axis=0), mass)
    if stiff is not None:
        omega, shapes = np.sqrt(stiff[0]), allowed @ stiff[1]
    else:
        unit = solve_triangular(cholesky(mass, lower=True), allowed.T, lower=True).T
        _, roots, rotation = svd(np.concatenate([_root(K[part, part]) @ unit[part] for part in parts]))
        omega, shapes = np.pad(roots, (0, size - len(roots)))[::-1], (unit @ rotation.T)[:, ::-1]
    return omega, [shapes[part] for part in parts]


def _stiff_modes(K: Array, M: Array) -> tuple[Array, Array] | None:
    """Squares of the frequencies, ascending, and modes of mass one, of what resists every motion; None for the rest.

    Rounding is relative to the largest eigenvalue, and a thin link has stretches that are 10^15 times as stiff as its
    bending. The inverses of the squares have the slow modes as the largest, and scaled coordinates have one stiffness.
    """
    diagonal = np.diag(K)
    if not diagonal.min() > 0.0:
        return None
    scale = 1.0 / np.sqrt(diagonal)
    try:
        inverses, shapes = eigh(scale[:, None] * M * scale, scale[:, None] * K * scale)
    except np.linalg.LinAlgError:
        return None
    if not inverses[0] > 0.0:
        return None
    return 1.0 / inverses[::-1], (scale[:, None] * shapes / np.sqrt(inverses))[:, ::-1]


def _root(K: Array) -> Array:
    """A matrix whose square (transposed times itself) is a stiffness, shape [r, r]."""
    values, vectors = eigh(K) if len(K) else (np.zeros(0), K)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def _natural_modes(
    system: System, state: State, joint_angles: Array, workspace: Workspace
) -> tuple[Array, Array, Array]:
    """Angular frequencies [rad/s], modes of mass one, shape [N, n], and damping, shape [N, N], in all coordinates."""
    squares, shapes, C = _squares(system, state, joint_angles, workspace)
    return np.sqrt(np.maximum(squares, 0.0)), shapes, C


def _squares(system: System, state: State, joint_angles: Array, workspace: Workspace) -> tuple[Array, Array, Array]:
    """Squares of the angular frequencies [1/s^2], negative where the pose is unstable, and the rest of the same."""
    found = matrices_at(system, state, joint_angles, workspace)
    return *found.modes(), found.damping


class Matrices(NamedTuple):
    """The equations of small motions about an equilibrium, in all N coordinates of the components.

    Attributes:
        stiffness, mass, damping: Shape [N, N].
        allowed: A basis of the motions that joints allow while their motors hold, shape [N, n].
        rows: Rows of all joints, by which those motions are zero, shape [6 J, N].
    """

    stiffness: Array
    mass: Array
    damping: Array
    allowed: Array
    rows: Array

    def with_inertia(self) -> Array:
        """A basis of the allowed motions that have inertia; those that have none follow them in equilibrium, such as a
        rotor whose armature is not known, between its controller and its gear."""
        allowed = self.allowed
        if not allowed.shape[1]:
            return allowed
        values, vectors = eigh(allowed.T @ self.mass @ allowed)
        none = values <= _MASSLESS * values[-1]
        if not np.any(none):
            return allowed
        still, moving = allowed @ vectors[:, none], allowed @ vectors[:, ~none]
        follows = lstsq(still.T @ self.stiffness @ still, still.T @ self.stiffness @ moving)[0]
        return np.asarray(moving - still @ follows)

    def modes(self) -> tuple[Array, Array]:
        """Squares of the angular frequencies [1/s^2], ascending, and modes of mass one, shape [N, n]."""
        allowed = self.with_inertia()
        if not allowed.shape[1]:
            return np.zeros(0), allowed
        stiffness = allowed.T @ self.stiffness @ allowed
        # symmetric but for a part from the axes of the moments, which vanishes on allowed motions
        stiffness, mass = 0.5 * (stiffness + stiffness.T), allowed.T @ self.mass @ allowed
        values, shapes = _stiff_modes(stiffness, mass) or eigh(stiffness, mass)
        return values, allowed @ shapes


def matrices_at(system: System, state: State, joint_angles: Array, workspace: Workspace) -> Matrices:
    """The equations of small motions about a state; what the motors do is left in the blocks of the workspace."""
    linearize(system, state, joint_angles, workspace)
    blocks = workspace.blocks
    offset = system.starts
    total = int(offset[-1])
    (K, M, C), H = np.zeros((3, total, total)), np.zeros((6 * len(system.rows), total))
    for b, r in enumerate(system.elastic):
        part = slice(offset[b], offset[b] + 6 + r)
        K[part, part] = blocks.K[b, : 6 + r, : 6 + r]
        M[part, part] = blocks.D[b, : 6 + r, : 6 + r]
        C[part, part] = blocks.P[b, : 6 + r, : 6 + r]
    for joint, (p, b) in enumerate(system.side):
        n = int(6 + system.elastic[b])
        part, rows = slice(offset[b], offset[b] + n), slice(6 * joint, 6 * joint + 6)
        H[rows, part] = blocks.Hc[joint, :, :n]
        free = slides_freely(system, joint)
        if p >= 0:
            m = int(6 + system.elastic[p])
            parent = slice(offset[p], offset[p] + m)
            K[part, parent] += blocks.Nc[joint, :n] @ blocks.Jp[joint, :, :m]
            H[rows, parent] = blocks.Hp[joint, :, :m]
            if free:
                # the parent's rows by the length, which follows the coordinates of both
                K[parent] -= np.outer(blocks.Lp[joint, :m, LENGTH], H[6 * joint + LENGTH])
        if free:
            H[6 * joint + LENGTH] = 0.0
    for joint in system.servos:
        # statics know no rates: the gain on the rotor's speed
        rotor = offset[system.side[joint, 1]] + 6 + system.rotor[joint]
        C[rotor, rotor] += system.servo[joint, VELOCITY_GAIN]
    allowed = _tree_motions(system, H, offset)
    return Matrices(K, M, C, null_space(H) if allowed is None else allowed, H)


def _tree_motions(system: System, H: Array, offset: IntArray) -> Array | None:
    """A basis of the motions that the joints of a tree allow, shape [N, n], at less cost than `null_space`.

    Each joint tells the six rigid coordinates of its child from the child's elastic ones and those of the parent, so
    that a motion is one elastic coordinate and what follows from it along the tree.

    Returns:
        None where the joints form a loop, or leave a coordinate of a child free.
    """
    parents, children = system.side[:, 0], system.side[:, 1]
    if len(children) != len(system.elastic) or len(set(children.tolist())) != len(children):
        return None
    joints = {int(b): joint for joint, b in enumerate(children)}
    starts = np.concatenate([[0], np.cumsum(system.elastic)])
    allowed = np.zeros((int(offset[-1]), int(starts[-1])))
    done: set[int] = set()
    # parents first
    waiting = [int(b) for b in children]
    while waiting:
        ready = [b for b in waiting if int(parents[joints[b]]) < 0 or int(parents[joints[b]]) in done]
        if not ready:
            return None
        for b in ready:
            joint, p, r = joints[b], int(parents[joints[b]]), int(system.elastic[b])
            rows, rigid = slice(6 * joint, 6 * joint + 6), slice(offset[b], offset[b] + 6)
            own, free = slice(offset[b] + 6, offset[b] + 6 + r), slice(starts[b], starts[b] + r)
            allowed[own, free] = np.eye(r)
            moved = H[rows, own] @ allowed[own]
            if p >= 0:
                moved += H[rows, offset[p] : offset[p + 1]] @ allowed[offset[p] : offset[p + 1]]
            if np.linalg.cond(H[rows, rigid]) > _SINGULAR:
                return None
            allowed[rigid] = -np.linalg.solve(H[rows, rigid], moved)
        done.update(ready)
        waiting = [b for b in waiting if b not in done]
    return allowed
