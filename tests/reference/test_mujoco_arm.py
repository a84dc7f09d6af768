"""Servos and drives against MuJoCo's position actuators, on an arm of two links and on a KUKA iiwa.

MuJoCo is in the optional extra `bench`; its step goes to zero at first order.
"""

from dataclasses import replace

import numpy as np
import pytest
from arms import chain, compiled, frame
from calmotion.accuracy.motors.motor_effects import with_gains_used
from calmotion.benchmarks.motors.lumped import simulate_lumped
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.shot import Animation, Target, Track
from calmotion.shot.motor import Rotor
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.usd.reading import read_shot

K, D, ARMATURE, LENGTH, MASS, END = 60.0, 2.0, 0.03, 0.4, 1.0, 0.8
LINK = f'<inertial pos="{LENGTH} 0 0" mass="{MASS}" diaginertia="1e-9 1e-9 1e-9"/>'
MODEL = f"""<mujoco>
  <compiler angle="radian" inertiafromgeom="false"/>
  <option gravity="0 0 -9.81" timestep="1e-5" integrator="implicit"/>
  <worldbody><body><joint name="a" axis="0 1 0" armature="{ARMATURE}"/>{LINK}
    <body pos="{LENGTH} 0 0"><joint name="b" axis="0 1 0" armature="{ARMATURE}"/>{LINK}</body></body></worldbody>
  <actuator><position joint="a" kp="{K}" kv="{D}"/><position joint="b" kp="{K}" kv="{D}"/></actuator>
</mujoco>"""


def command(times):
    """Angles and rates of both motors, shape [..., 2]."""
    s, c = np.sin(4.0 * times), np.cos(4.0 * times)
    return np.multiply.outer(0.7 * s**3, [1.0, -0.6]), np.multiply.outer(8.4 * s**2 * c, [1.0, -0.6])


def mujoco_arm(every):
    """Joint angles at multiples of so many steps, from rest, shape [n, 2]."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(MODEL)
    data, h = mujoco.MjData(model), model.opt.timestep
    for _ in range(200):  # the static start
        data.qvel[:] = 0.0
        mujoco.mj_forward(model, data)
        data.qpos[:] = -data.qfrc_bias / K
    found = []
    for n in range(round(END / h) + 1):
        if n % every == 0:
            found.append(data.qpos.copy())
        angles, rates = command((n + 0.5) * h)
        data.ctrl[:] = angles + D / K * rates  # its damping is that of the joint's own velocity
        mujoco.mj_step(model, data)
    return np.array(found)


@pytest.mark.long
def test_arm_moves_as_by_position_actuators_of_mujoco():
    h = 1e-3
    expected = mujoco_arm(every=round(h / 1e-5))
    character = chain(2, driven=(0, 1), length=LENGTH, mass=MASS)
    changes = {"model": "servo", "position_gain": K, "velocity_gain": D, "rotor": Rotor(armature=ARMATURE)}
    model = compiled(replace(character, motors=tuple(replace(m, **changes) for m in character.motors)))
    angles, rates = command(h * np.arange(len(expected)))
    start, workspace = rigid_state(model, angles[0]), Workspace.for_system(model.system)
    states = simulate(model.system, start, angles, rates, h, workspace).states
    assert np.abs(states.u[:, :, 0] - expected).max() < 1e-4 * np.ptp(expected)


@pytest.mark.long
def test_kuka_on_the_actuators_of_its_own_file_moves_as_in_mujoco(shared_data):
    """Seven motors whose gains (kp 2000, kv 200) the converter wrote; every joint turns at once."""
    pytest.importorskip("mujoco")
    robot = shared_data / "converted" / "kuka_iiwa_14" / "iiwa14.usda"
    character, _, _ = read_shot(str(robot), still=True)
    character = with_gains_used(character)
    assert {(m.model, m.position_gain, m.velocity_gain) for m in character.motors} == {("drive", 2000.0, 200.0)}
    tip = Target("/Tool", character.joints[character.motors[-1].joint].body1, frame(z=0.12))
    character = replace(character, targets=(tip,))
    frames = np.arange(31) / 30.0
    wave = np.sin(np.pi * frames) ** 4
    tracks = tuple(Track(frames, (0.5 + 0.1 * k) * (-1) ** k * wave) for k in range(7))
    shot = compile_shot(character, Animation(frames, tracks, tracks))
    ours = simulate_shot(shot, RunSettings(step=5e-4), lambda fraction, message: None).before
    theirs = simulate_lumped(character, ours.motion.times, ours.motion.motor_values, 2.5e-5)
    off = np.linalg.norm(ours.motion.target_positions - theirs.target_positions, axis=2)
    assert ours.position_errors.max() > 0.03, "the drives lag"
    assert off.max() < 1e-4 * np.ptp(theirs.target_positions, axis=0).max()
