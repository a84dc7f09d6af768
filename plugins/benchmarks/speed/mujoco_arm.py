"""The swung arm as a chain of rigid segments in MuJoCo: what a simulator without flexible bodies makes of a link.

As many hinges with springs and dampers as the reduced bodies of `exudyn_arm` have coordinates, so that both march as
many unknowns. The chain bends in the plane of the motion alone; it is measured against itself with a fine step, so that
only the error in time counts. The motion is that of a hub so heavy that it follows its torque.
"""

from __future__ import annotations

import time

import numpy as np
from calmotion.arrays import Array

from ..scenes.exudyn_arm import ExudynArm as Arm
from .exudyn_arm import DURATION, SAMPLES

HINGES = 6 + Arm.FIXED_MODES
HUB = 1e6  # inertia of the hub [kg m^2]: the arm turns it by a millionth of the motion


def accelerations(times: Array) -> Array:
    """Angular acceleration of `exudyn_arm.quarter_turn` at some times [rad/s^2]."""
    s = np.minimum(2.0 * times, 1.0)
    return np.asarray(0.5 * np.pi * 4.0 * (60.0 * s - 180.0 * s**2 + 120.0 * s**3))


class MujocoChain:
    """The chain, by `implicitfast`: `implicit` has the same errors in twice the time, `Euler` the same in the same.

    Attributes:
        steps: Numbers of steps at which it is measured: with fewer its stiffest hinges are unstable.
        fine: That of the reference.
    """

    steps, fine = (3840, 7680, 15360, 30720), 245760

    def __init__(self) -> None:
        import mujoco

        self.model = mujoco.MjModel.from_xml_string(_chain())
        self.data = mujoco.MjData(self.model)

    def run(self, steps: int) -> tuple[Array, float]:
        """Tip at the samples [m], shape [s, 3], and the run time [s]."""
        import mujoco
        from mujoco import rollout

        model, data, h = self.model, self.data, DURATION / steps
        model.opt.timestep = h
        mujoco.mj_resetData(model, data)
        # the mean of a step, which an integrator of first order takes at its beginning
        torque = HUB * accelerations(np.linspace(0.5, steps - 0.5, steps) * h)
        start = np.zeros(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        begin = time.perf_counter()
        _, sensed = rollout.rollout(model, data, start[None], torque[None, :, None])
        wall = time.perf_counter() - begin
        # what a step senses is of its beginning
        mujoco.mj_forward(model, data)
        tips = np.vstack([sensed[0], data.sensordata])
        return tips[:: steps // SAMPLES][1:], wall


def _chain() -> str:
    """The arm in MJCF: half a spring's length of the beam at its root, then equal segments."""
    length, area = Arm.LENGTH / HINGES, Arm.THICKNESS**2
    bending = Arm.MATERIAL.youngs_modulus * Arm.THICKNESS**4 / 12.0
    mass, edge = Arm.MATERIAL.density * area * length, Arm.THICKNESS
    across, along = mass * (length**2 + edge**2) / 12.0, mass * edge**2 / 6.0
    bodies, ends = "", ""
    for k in range(HINGES):
        # the spring at the clamp stands for half of a segment, those between two segments for a whole one
        stiffness = bending / length * (2.0 if k == 0 else 1.0)
        bodies += (
            f'<body pos="{0.0 if k == 0 else length} 0 0">'
            f'<joint type="hinge" axis="0 0 1" stiffness="{stiffness}" damping="{Arm.RETARDATION * stiffness}"/>'
            f'<inertial pos="{0.5 * length} 0 0" mass="{mass}" diaginertia="{along} {across} {across}"/>'
        )
        ends += "</body>"
    cube = Arm.PAYLOAD * (2.0 * Arm.THICKNESS) ** 2 / 6.0
    load = (
        f'<body pos="{length} 0 0"><inertial pos="0 0 0" mass="{Arm.PAYLOAD}" diaginertia="{cube} {cube} {cube}"/>'
        '<site name="tip"/></body>'
    )
    return (
        '<mujoco><option gravity="0 0 0" integrator="implicitfast"><flag contact="disable"/></option><worldbody>'
        f'<body name="hub"><joint name="hub" type="hinge" axis="0 0 1" armature="{HUB}"/>'
        '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
        f"{bodies}{load}{ends}</body></worldbody>"
        '<actuator><motor joint="hub"/></actuator><sensor><framepos objtype="site" objname="tip"/></sensor></mujoco>'
    )
