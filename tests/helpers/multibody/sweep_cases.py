"""Trees whose motion and a random linear functional of it are differentiated by sweeps."""

from dataclasses import replace

import numpy as np
from calmotion.model import Motor
from calmotion.model.motor import Quadratic, Rotor
from calmotion.multibody.analysis.kinematics import set_rotors, system_poses
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.moving_markers import pack
from calmotion.multibody.model.system import LINEAR, NEOHOOKEAN, STVK, allocate_state
from calmotion.multibody.motors.drives import GivingMotor, add_motors
from particles import nonlinear, particle_system, without_rotation
from scipy.spatial.transform import Rotation

H = 0.01
TIMES = np.arange(0.0, 0.3 + H / 2, H)


def moving_marker():
    """A marker that sways and turns, at all instants, shape [T, 1, 18]."""
    s, c = np.sin(4.0 * TIMES), np.cos(4.0 * TIMES)
    axis = np.array([0.6, 0.0, 0.8])
    position, velocity = np.outer(s, [0.1, 0.2, 0.0]), np.outer(4.0 * c, [0.1, 0.2, 0.0])
    matrices = Rotation.from_rotvec(np.outer(0.4 * s, axis)).as_matrix()
    return pack(position, velocity, np.outer(1.6 * c, axis), matrices)[:, None]


MOVED = moving_marker()


def motor_of(model, gain):
    """A motor of a model with all that it may have: friction, gear, limits of torque and speed."""
    if model == "drive":
        return Motor(0, "", "", model="drive", position_gain=gain, velocity_gain=3.0)
    if model == "damped drive":
        return Motor(0, "", "", model="drive", position_gain=gain, velocity_gain=3.0, damping_on="joint")
    rotor = Rotor(0.3, np.inf, 0.0, 0.2, 0.4, 0.5, 40.0, 0.2)
    if model == "load":
        law = Quadratic(0.3, 0.4, 2.0, 0.05, 0.02, 0.05, 0.1, 1e-4, 2e-4)
        rotor = replace(rotor, law=law, back_emf=0.3)
    if model == "servo":
        rotor = replace(rotor, gear_stiffness=5.0 * gain, gear_damping=1.0)
    return Motor(0, "", "", model="servo", position_gain=gain, velocity_gain=3.0, rotor=rotor, max_torque=0.2 * gain)


def rigid_start(system, angle):
    state = allocate_state(system)
    c, q = system_poses(system, angle[None], MOVED[:1] if np.any(system.moving >= 0) else None)
    state.c[:], state.q[:] = c[0], q[0]
    set_rotors(system, state, angle)
    return state


def curves(p):
    """Joint angles and rates from coefficients of shape [4, J]: harmonics, so that the start moves too."""
    w = 3.0 + 2.0 * np.arange(4)
    phase = np.outer(TIMES, w)
    return np.cos(phase) @ p, (-w * np.sin(phase)) @ p


def close(system, angle):
    """Put the component-side markers of the loops where the parent-side ones are."""
    state = rigid_start(system, angle)
    R = Rotation.from_quat(np.roll(state.q, -1, axis=1)).as_matrix()
    for joint in range(len(system.parent), len(system.rows)):
        p, b = system.side[joint]
        point = state.c[p] + R[p] @ system.position[joint, 0]
        system.position[joint, 1] = R[b].T @ (point - state.c[b])
        system.rotation[joint, 1] = R[b].T @ R[p] @ system.rotation[joint, 0]


class Case:
    """A tree with free hinges, and a random linear functional of its motion."""

    def __init__(
        self, rows, laws=None, sliding=(), loops=(), moving=(), seed=0, nonrotating=(), weight=True, drives=()
    ):
        rng = np.random.default_rng(seed)
        self.system, _ = particle_system(rng, [-1, 0, 1, 0], [2, 0, 3, 2], rows, 3000.0, sliding, loops, moving)
        self.system = without_rotation(self.system, nonrotating)
        if not weight:
            self.system = self.system._replace(gravity=np.zeros(3))
        if laws is not None:
            self.system = nonlinear(self.system, laws, rng, stiffness=3000.0)
        if drives:
            # stiff and soft ones
            motors = [GivingMotor(j, motor_of(model, 400.0 / (1 + j))) for j, model in drives.items()]
            self.system = add_motors(self.system, motors)
        joints = len(self.system.rows)
        self.p = (0.1 if loops else 0.3) * rng.normal(size=(4, joints))
        self.dp = rng.normal(size=(4, joints))
        if not weight and not loops:  # a free hinge keeps the angle that it is given, which is no motor's
            self.dp[:, self.system.rows < 6] = 0.0
        if loops:
            close(self.system, curves(self.p)[0][0])
        self.world = MOVED if moving else None
        self.ws = Workspace.for_system(self.system)
        shape = (len(TIMES), 4)
        self.wc, self.wq, self.wu = (rng.normal(size=shape + (k,)) for k in (3, 4, self.system.size - 6))

    def simulate(self, p):
        angles, rates = curves(p)
        start = rigid_start(self.system, angles[0])
        return simulate(self.system, start, angles, rates, H, self.ws, world=self.world), angles, rates

    def value(self, p):
        states = self.simulate(p)[0].states
        return float(np.sum(self.wc * states.c) + np.sum(self.wq * states.q) + np.sum(self.wu * states.u))

    def gradient(self, states):
        """Derivative of `value` by (R^T dc, dphi, du)."""
        shape = states.q.shape[:2]
        R = Rotation.from_quat(np.roll(states.q.reshape(-1, 4), -1, axis=1)).as_matrix().reshape(shape + (3, 3))
        w, x, y, z = np.moveaxis(states.q, -1, 0)
        E = 0.5 * np.stack([[-x, -y, -z], [w, -z, y], [z, w, -x], [-y, x, w]])  # dq = E dphi
        out = np.zeros(shape + (self.system.size,))
        out[..., :3] = np.einsum("nbik,nbi->nbk", R, self.wc)
        out[..., 3:6] = np.einsum("ijnb,nbi->nbj", E, self.wq)
        out[..., 6:] = self.wu
        return out


DRIVES, LOOPED = dict.fromkeys((0, 1, 3), "drive"), dict.fromkeys((0, 1, 4), "drive")
SERVOS = {0: "servo", 1: "rigid gear", 3: "damped drive"}
CASES = {
    "driven": ([6, 6, 6, 6], None),
    "with a free hinge": ([6, 6, 5, 6], None),
    "bodies of large deflection": ([6, 6, 6, 6], [STVK, LINEAR, NEOHOOKEAN, LINEAR]),
    "sliders": ([6, 6, 6, 6], None, (0, 2, 3)),
    "a loop closed by a free slider": ([6, 5, 3, 5], None, (0, 4), ((2, 3, 5),), (), 1),
    "a moving root": ([6, 6, 5, 6], None, (), (), (0,)),
    "bodies that never turn": ([6, 6, 5, 6], [STVK, LINEAR, LINEAR, LINEAR], (3,), (), (), 0, (0, 2, 3)),
    "a loop": ([6, 5, 3, 5], None, (0,), ((2, 3, 3),)),
    "hinges that nothing holds": ([6, 5, 5, 6], None, (), (), (), 0, (), False),
    "hinges that a loop alone holds": ([6, 5, 5, 5], None, (), ((2, 3, 3),), (), 0, (), False),
    "drives": ([6, 6, 5, 6], [STVK, LINEAR, LINEAR, LINEAR], (3,), (), (), 0, (1,), True, DRIVES),
    "drives around a loop": ([6, 6, 3, 5], None, (1,), ((2, 3, 6),), (), 0, (), True, LOOPED),
    "servos": ([6, 6, 5, 6], [STVK, LINEAR, LINEAR, LINEAR], (3,), (), (), 0, (1,), True, SERVOS),
    "friction by load": ([6, 6, 6, 6], None, (3,), (), (), 0, (), True, dict.fromkeys((0, 1, 3), "load")),
    "servos around a loop": (
        [6, 6, 3, 5],
        None,
        (1,),
        ((2, 3, 6),),
        (),
        0,
        (),
        True,
        LOOPED | {0: "servo", 4: "rigid gear"},
    ),
}
