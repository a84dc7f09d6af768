"""Forces and moments that joints transmit, and efforts of motors, from the multipliers of a simulation."""

from typing import NamedTuple

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.multibody.integrators.trajectory import Inputs, Trajectory, instant_of
from calmotion.multibody.kernels.joints import joint_kinematics
from calmotion.multibody.kernels.sliders import slides_freely
from calmotion.multibody.kernels.so3 import matrix_of
from calmotion.multibody.kernels.work import Work, allocate_work
from calmotion.multibody.linear_solver.closed_chains import copy_rows
from calmotion.multibody.model.system import State, System
from calmotion.multibody.motors.servos import rotor_effort
from calmotion.support.by_reference import by_reference
from calmotion.support.compilation import kernel


@by_reference
class Reactions(NamedTuple):
    """Force and moment of each joint on the component on its side 1, at that side's frame, world axes.

    Attributes:
        forces: [N], shape [T, J, 3].
        moments: [N m], shape [T, J, 3].
        efforts: Along the joint's axis, positive as its value: moments [N m], or forces [N] of a slider, shape [T, J];
            that of a servo's motor on its rotor.
        axes: Of the frame on the joint's side 0, as columns, world, shape [T, J, 3, 3].
    """

    forces: Array
    moments: Array
    efforts: Array
    axes: Array


@kernel
def _reactions(system: System, states: State, inputs: Inputs, work: Work, out: Reactions) -> None:
    forces, moments, efforts, frames = out.forces, out.moments, out.efforts, out.axes
    for n in range(len(inputs.angles)):
        copy_rows(inputs.world[n], work.world)
        for b in range(len(system.parent)):
            matrix_of(states.q[n, b], work.R[b])
        for joint in range(len(system.rows)):
            angle, rate = inputs.angles[n, joint], inputs.rates[n, joint]
            joint_kinematics(system, joint, angle, rate, instant_of(states, n), work)
            lam, axes = states.lam[n, joint], work.i.R
            for i in range(3):
                m = 0.0
                f = 0.0
                for k in range(3):
                    m += axes[i, k] * lam[3 + k]
                    f += axes[i, k] * lam[k]
                moments[n, joint, i] = m
                forces[n, joint, i] = f if slides_freely(system, joint) else lam[i]
            source = forces if system.sliding[joint] else moments
            t = 0.0
            for i in range(3):
                t += axes[i, 2] * source[n, joint, i]
            if system.switch[joint] >= 0 and not np.any(inputs.world[n, system.switch[joint], 9:]):
                t = 0.0
            elif system.rotor[joint] >= 0:
                t = rotor_effort(system, joint, inputs.angles[n, joint], inputs.rates[n, joint], instant_of(states, n))
            efforts[n, joint] = t
            for i in range(3):
                for k in range(3):
                    frames[n, joint, i, k] = axes[i, k]


_OSCILLATING = ("newmark", "generalized-alpha")  # integrators whose multipliers do
_SMOOTH = np.array([-1.0, 4.0, 10.0, 4.0, -1.0]) / 16.0  # exact for cubics; nothing of what alternates is left
_NEXT, _FIRST = np.array([1.0, 2.0, 1.0]) / 4.0, np.array([3.0, 2.0, -1.0]) / 4.0  # the same for lines, at the ends


def multipliers(trajectory: Trajectory) -> Array:
    """The multipliers of all instants, shape [T, J, 6], without what alternates from one to the next.

    Newmark's method and generalised-alpha hold the joints together in velocity: their multipliers oscillate with the
    step about the right ones after each change of the accelerations, and this hardly dies away where steps are coarse.
    Source: Arnold, Bruels, Cardona, Error analysis of generalized-alpha Lie group time integration methods for
    constrained mechanical systems, 2015.
    """
    lam = trajectory.states.lam
    if trajectory.integrator not in _OSCILLATING or len(lam) < len(_SMOOTH):
        return lam
    out = sum(share * lam[k : len(lam) - 4 + k] for k, share in enumerate(_SMOOTH))
    ends = [(lam[:3], _FIRST), (lam[:3], _NEXT), (lam[-3:], _NEXT), (lam[-3:], _FIRST[::-1])]
    first, second, last_but_one, last = (np.tensordot(weights, rows, 1)[None] for rows, weights in ends)
    return np.concatenate([first, second, out, last_but_one, last])


def reactions(
    system: System, trajectory: Trajectory, angles: Array, rates: Array, instants: IntArray | slice = slice(None)
) -> Reactions:
    """Reactions of all joints at all instants, or some.

    Where constraints are redundant (a planar mechanism of hinges) loads between them are not determined by rigid-body
    mechanics: the multipliers are those of least norm.

    Args:
        angles, rates: The joint angles (or lengths) and rates that were simulated, shape [T, J].
        instants: Those that are wanted.
    """
    states = State(*[part[instants] for part in trajectory.states._replace(lam=multipliers(trajectory))])
    angles, rates = angles[instants], rates[instants]
    total, joints = len(angles), len(system.rows)
    work: Work = allocate_work(system)
    result = Reactions(
        np.zeros((total, joints, 3)),
        np.zeros((total, joints, 3)),
        np.zeros((total, joints)),
        np.zeros((total, joints, 3, 3)),
    )
    _reactions(system, states, Inputs(angles, rates, trajectory.world[instants]), work, result)
    return result
