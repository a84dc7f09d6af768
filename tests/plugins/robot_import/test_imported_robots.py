"""Imported robots against MuJoCo's inverse dynamics and forward kinematics of their original files.

Torques agree to 1e-4 of the largest, bodies to a micrometre. MuJoCo runs in the environment of the converters.
"""

import os
import subprocess
from pathlib import Path

import calmotion as cm
import numpy as np
import pytest
from calmotion.model.curves import commanded_curves
from calmotion_plugins.robot_import import import_robot
from calmotion_plugins.robot_import.converters import VARIABLE, converter_python, environment_folder

PROGRAM = Path(__file__).resolve().parents[2] / "helpers" / "reference" / "mujoco_inverse.py"
RATE, EVERY = 1920, 16  # steps a second of the simulation, and how many of them are compared
SHARED = ("sources/so101/so101_new_calib.urdf", "sources/so101/so101_new_calib.xml", "sources/xarm7/xarm7_nohand.xml")
# of the package example-robot-data, whose folder `robots` is named by CALMOTION_ROBOTS
OTHERS = (
    "ur_description/urdf/ur5_robot.urdf", "kinova_description/robots/kinova.urdf", "z1_description/urdf/z1.urdf",
    "panda_description/urdf/panda.urdf",
)  # fmt: skip
INERTIA = '<inertial><mass value="{0}"/><origin xyz="0.2 0.01 0"/><inertia ixx="{1}" iyy="{2}" izz="{2}" ixy="0.0003" '
INERTIA += 'ixz="0" iyz="0"/></inertial>'
TWO_LINKS = f"""<robot name="arm"><link name="base"/><link name="upper">{INERTIA.format(1.0, 0.002, 0.02)}</link>
<link name="fore">{INERTIA.format(0.5, 0.001, 0.01)}</link>
<joint name="a" type="revolute"><parent link="base"/><child link="upper"/><origin rpy="0.3 0.1 0" xyz="0.1 0 0.5"/>
<axis xyz="0 0.6 0.8"/><limit lower="-2" upper="2" effort="0" velocity="3"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="fore"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/>
</joint></robot>"""

BOX = '<geom type="box" size="0.2 0.02 0.01" pos="0.2 0 0" mass="{}"/>'
SEVERAL = f"""<mujoco><default><default class="own"><joint axis="0 1 0"/></default></default><worldbody>
<body name="base" pos="0 0 0.4">{BOX.format(2)}<body name="arm" pos="0.1 0.2 0.3" euler="0.3 0 0.2" childclass="own">
<joint name="yaw" axis="0 0 1" pos="0.05 0 0" range="-1.5 1.5"/><joint name="pitch" range="-1 1"/>
<joint name="slide" type="slide" axis="1 0.2 0" range="-0.1 0.2"/>{BOX.format(0.5)}
<body name="hand" pos="0.4 0 0"><joint name="roll" axis="1 0 0" range="-1 1"/><joint name="bend" range="-1 1"/>
{BOX.format(0.2)}</body></body></body></worldbody></mujoco>"""

pytestmark = pytest.mark.skipif(
    not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file(),
    reason=f"the converters are not here: name their environment with {VARIABLE}, or run calmotion import once",
)


def performed(robot: Path, folder: Path) -> cm.SimulationResult:
    """A robot that performs a smooth motion of all joints that lead, from rest to rest within a second."""
    made = import_robot(robot, layer=folder / "robot.usda", solid="abs")
    character = made.character
    joints = [character.joints[motor.joint] for motor in character.motors if motor.follows is None]
    times = np.arange(61) / 60.0
    columns = []
    for k, joint in enumerate(joints):
        low, high = max(joint.lower, -1.5), min(joint.upper, 1.5)
        swing = 0.5 * (1.0 - np.cos(2.0 * np.pi * times)) * np.sin(2.0 * np.pi * times * (0.5 + 0.1 * k))
        columns.append(0.5 * (low + high) + 0.35 * (high - low) * swing)
    np.savez(folder / "wave.npz", time_s=times, **{j.name: c for j, c in zip(joints, columns, strict=True)})
    import_robot(robot, layer=folder / "robot.usda", solid="abs", motion=folder / "wave.npz")
    shot = cm.open_shot(folder / "robot.usda")
    return cm.simulate(shot, step=1.0 / RATE, integrator="bdf2", pre_roll=0.0)


def compare(robot: Path, folder: Path) -> tuple[float, float]:
    """Largest error of a torque over the largest torque, and of the position of a body [m]."""
    result = performed(robot, folder)
    character, animation = result.shot.character, result.shot.animation
    rows = slice(EVERY // 2, None, EVERY)
    curve = commanded_curves(character, animation, None)
    given = {name: curve(result.times[rows], order) for order, name in enumerate("qva")}
    names = np.array([character.joints[motor.joint].name for motor in character.motors])
    np.savez(folder / "in.npz", names=names, **given)
    python = converter_python(None, print)
    arguments = [str(robot), str(folder / "in.npz"), str(folder / "out.npz")]
    done = subprocess.run([python, "-I", str(PROGRAM), *arguments], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    expected = np.load(folder / "out.npz")
    torques = np.stack([motor.effort[rows] for motor in result.motors.values()], axis=1)
    motion = result.result.before.motion
    places = motion.positions[motion.judged][rows]
    far = [
        np.linalg.norm(places[:, b] - expected[f"position/{name}"], axis=1).max()
        for b, body in enumerate(character.bodies)
        if f"position/{(name := body.path.rsplit('/', 1)[-1])}" in expected
    ]
    assert len(far) >= len(character.bodies) // 2
    return float(np.abs(torques - expected["torques"]).max() / np.abs(expected["torques"]).max()), float(max(far))


BAR = '<collision><origin xyz="0.2 0 0"/><geometry><box size="0.4 0.02 0.02"/></geometry></collision></link>'
AT_ORIGIN = TWO_LINKS.replace('<origin xyz="0.2 0.01 0"/>', "").replace("</inertial></link>", f"</inertial>{BAR}")


CALIBRATED = TWO_LINKS.replace('rpy="0.3 0.1 0"', 'rpy="0.0003 0 1e-4"').replace('"0 0.6 0.8"', '"0.0002 0 1"')


# frames of sensors between links, and below the first one
FIXED = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/><axis xyz="0 0 0"/>{3}</joint>'
MOUNTS = '<link name="post"/><link name="flange"/><link name="cell"/>'
MOUNTS += FIXED.format("c", "base", "post", '<origin rpy="0.2 0.3 0.4" xyz="0.1 0.2 0.3"/>')
MOUNTS += FIXED.format("d", "upper", "flange", '<origin rpy="0 0 0.5" xyz="0 0 0.05"/>')
MOUNTS += FIXED.format("e", "flange", "cell", '<origin rpy="0.3 0 0" xyz="0.02 0 0.03"/>')
WITH_FRAMES = TWO_LINKS.replace('parent link="base"', 'parent link="post"')
WITH_FRAMES = WITH_FRAMES.replace('parent link="upper"', 'parent link="cell"').replace("</robot>", f"{MOUNTS}</robot>")
ARMS = {"": TWO_LINKS, "inertia_without_origin": AT_ORIGIN, "small_angles": CALIBRATED, "frames": WITH_FRAMES}


@pytest.mark.parametrize("text", ARMS.values(), ids=ARMS)
def test_two_links_of_a_urdf_need_the_torques_that_mujoco_finds(tmp_path, text):
    (tmp_path / "arm.urdf").write_text(text)
    torque, far = compare(tmp_path / "arm.urdf", tmp_path)
    assert torque < 1e-4 and far < 1e-6


WHOLE = {  # of another file
    "included": '<include file="parts/arm.xml"/>',
    "attached": '<asset><model name="s" file="parts/arm.xml"/></asset><worldbody><body name="post">'
    '<geom size="0.1" mass="1"/><attach model="s" body="arm" prefix="s_"/></body></worldbody>',
}


@pytest.mark.parametrize("text", WHOLE.values(), ids=WHOLE)
def test_joints_of_one_body_move_one_after_the_other_as_in_mujoco(tmp_path, text):
    """A body with three joints at different places, in a file of its own whose meshes and defaults are elsewhere."""
    (tmp_path / "parts").mkdir()
    radians = '<compiler angle="radian"/>'
    (tmp_path / "parts" / "arm.xml").write_text(SEVERAL.replace("<mujoco>", f"<mujoco>{radians}"))
    (tmp_path / "robot.xml").write_text(f'<mujoco model="m">{radians}{text}</mujoco>')
    torque, far = compare(tmp_path / "robot.xml", tmp_path)
    assert torque < 1e-4 and far < 1e-6


def test_angles_in_degrees_are_told(tmp_path):
    (tmp_path / "arm.urdf").write_text(TWO_LINKS.replace('rpy="0.3 0.1 0"', 'rpy="0 0 90"'))
    made = import_robot(tmp_path / "arm.urdf", layer=tmp_path / "robot.usda")
    assert any(note.endswith("degrees taken for radians? a") for note in made.notes)


def test_small_rotations_of_an_mjcf_are_kept(tmp_path):
    """Those of calibrated kinematics; a frame and a joint are turned by 0.01 and 0.02 degrees."""
    turned = SEVERAL.replace('euler="0.3 0 0.2"', 'quat="1 1e-4 0 -2e-3"').replace('axis="0 0 1"', 'axis="3e-4 0 1"')
    (tmp_path / "robot.xml").write_text(turned)
    torque, far = compare(tmp_path / "robot.xml", tmp_path)
    assert torque < 1e-4 and far < 1e-7


@pytest.mark.long
@pytest.mark.parametrize("name", SHARED)
def test_robots_need_the_torques_that_mujoco_finds(shared_data, tmp_path, name):
    torque, far = compare(shared_data / name, tmp_path)
    assert torque < 1e-4 and far < 1e-6


@pytest.mark.long
@pytest.mark.parametrize("name", OTHERS)
def test_robots_of_a_package_need_the_torques_that_mujoco_finds(tmp_path, name):
    folder = os.environ.get("CALMOTION_ROBOTS")
    if not folder:
        pytest.skip("name the folder `robots` of example-robot-data with CALMOTION_ROBOTS")
    torque, far = compare(Path(folder) / name, tmp_path)
    assert torque < 1e-4 and far < 1e-6
