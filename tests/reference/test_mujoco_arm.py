"""Servos and drives against MuJoCo's position actuators, on an arm of two links and on a KUKA iiwa.

MuJoCo is in the optional extra `bench`; its step goes to zero at first order.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from arms import chain, compiled, frame
from calmotion.model import Animation, MassProperties, Target, Track
from calmotion.model.motor import Rotor
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.motors.motor_effects import with_gains_used
from calmotion.usd.reading import read_shot
from motor_runs import pitch, run
from scipy.interpolate import CubicSpline

simulate_lumped = pytest.importorskip("calmotion_plugins.benchmarks.motors.lumped_robot").simulate_lumped
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


def test_position_actuator_whose_damping_lags_moves_as_in_mujoco_on_the_same_command():
    """kp 2000, kv 100 on 0.0825 kg m^2: the joint lags by kv/kp = 50 ms, which the command does not make up for."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string("""<mujoco><option integrator="implicit" gravity="0 0 0" timestep="2e-5"/>
      <worldbody><body><joint name="hinge" axis="0 1 0"/>
      <inertial pos="0.25 0 0" mass="1" diaginertia="1e-3 2e-2 2e-2"/>
      </body></worldbody><actuator><position joint="hinge" kp="2000" kv="100"/></actuator></mujoco>""")
    data, h, every = mujoco.MjData(model), 5e-4, 25
    times = np.arange(0.0, END, h)
    expected = []
    for t in times:
        expected.append(float(data.qpos[0]))
        for i in range(every):
            data.ctrl[:] = command(t + (i + 0.5) * h / every)[0][0]
            mujoco.mj_step(model, data)
    character = chain(1, driven=(0,))
    mass = MassProperties(1.0, np.array([0.25, 0.0, 0.0]), np.diag([1e-3, 2e-2, 2e-2]))
    (motor,), (body,) = character.motors, character.bodies
    drive = replace(motor, model="drive", position_gain=2000.0, velocity_gain=100.0, damping_on="joint")
    ours = compiled(replace(character, bodies=(replace(body, mass=mass),), motors=(drive,), gravity=np.zeros(3)))
    angles, rates = (part[:, :1] for part in command(times))
    found, loads = run(ours, angles, rates, h)
    turned = pitch(found.states)
    assert np.abs(turned - expected).max() < 1e-4 * np.ptp(expected)
    assert np.abs(turned - angles[:, 0]).max() > 0.1, "it lags"
    torque = 2000.0 * (angles[:, 0] - turned) - 100.0 * found.states.V[:, 0, 6]
    assert np.abs(loads.efforts[:, 0] - torque).max() < 1e-6 * np.abs(torque).max()


def test_what_inspect_promises_of_an_imported_position_actuator_is_what_mujoco_does_with_the_file(
    shared_data, calmotion, tmp_path
):
    """An arm of 0.5 m on kp 2000, kv 100, and a table of its angles as commands: 87.65 mm."""
    mujoco = pytest.importorskip("mujoco")
    pytest.importorskip("calmotion_plugins.robot_import")
    folder, shot = shared_data / "field" / "mjcf_position_actuator", tmp_path / "arm.usda"
    if not folder.is_dir():
        pytest.skip("the arm is not here")
    assert calmotion("import", folder / "arm.xml", "--motion", folder / "wave.csv", "-o", shot).returncode == 0
    (told,) = json.loads(calmotion("inspect", shot, "--json").stdout)["effects_of_gains"]
    times, angles = np.loadtxt(folder / "wave.csv", delimiter=",", skiprows=1).T
    model = mujoco.MjModel.from_xml_path(str(folder / "arm.xml"))
    model.opt.timestep = (times[1] - times[0]) / 100
    data, curve, off = mujoco.MjData(model), CubicSpline(times, angles), []
    for time, angle in zip(times, angles, strict=True):
        off.append(2 * 0.5 * np.sin(0.5 * abs(data.qpos[0] - angle)))
        for i in range(100):
            data.ctrl[0] = curve(min(time + (i + 0.5) * model.opt.timestep, times[-1]))
            mujoco.mj_step(model, data)
    assert told["max_error_m"] == pytest.approx(max(off), rel=5e-3) == pytest.approx(0.0876, rel=5e-3)
    assert told["ideal_max_error_m"] < 1e-6


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
