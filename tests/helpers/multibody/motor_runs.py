"""Simulations of compliant motors, for the tests of drives and of servos."""

from dataclasses import replace

import numpy as np
from arms import chain, compiled
from calmotion.model.motor import Rotor
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace

G = 9.81
MASS, LENGTH = 0.8, 0.5
INERTIA = MASS * LENGTH**2


def servo(character, k, d, limit=np.inf, **rotor):
    """The model with all motors as servos."""
    changes = {"model": "servo", "position_gain": k, "velocity_gain": d, "rotor": Rotor(**rotor), "max_torque": limit}
    motors = tuple(replace(motor, **changes) for motor in character.motors)
    return compiled(replace(character, motors=motors))


def pendulum(*gains, gravity=G, **rotor):
    character = chain(1, driven=(0,), mass=MASS, length=LENGTH)
    return servo(replace(character, gravity=np.array([0.0, 0.0, -gravity])), *gains, **rotor)


def run(model, motors, rates, h, integrator="bdf2"):
    angles, rates = model.joint_angles(motors), model.joint_angles(rates)
    workspace = Workspace.for_system(model.system)
    found = simulate(model.system, rigid_state(model, angles[0]), angles, rates, h, workspace, integrator=integrator)
    return found, reactions(model.system, found, angles, rates)


def smooth(times, size=0.7, w=4.0):
    """A curve that starts at rest, and its rate, shape [T, 1]."""
    return size * np.sin(w * times[:, None]) ** 3, 3 * w * size * (np.sin(w * times) ** 2 * np.cos(w * times))[:, None]


def pitch(states):
    """Angle about y of the first component, counted on over turns."""
    return np.unwrap(2.0 * np.arctan2(states.q[:, 0, 2], states.q[:, 0, 0]))


def transmitted(system, found):
    """What each joint's gear transmits along its axis [N m or N], shape [T, J]; a servo also turns its rotor."""
    loads = np.where((system.sliding == 1)[:, None], found.forces, found.moments)
    return np.einsum("tji,tji->tj", found.axes[..., 2], loads)
