"""Simulations of motors that give, for the tests of drives and of servos."""

import numpy as np
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace


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
