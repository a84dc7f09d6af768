"""Commands in the robot's own MJCF file, as they are written."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.simulation import compile_shot
from calmotion_plugins.benchmarks.motors.commands import compare, giving_shot
from calmotion_plugins.benchmarks.motors.original import simulate_original

ARM = """<mujoco model="arm">
  <compiler angle="radian"/>
  <option integrator="implicitfast" timestep="0.002"/>
  <default><joint armature="0.02" damping="1.5" frictionloss="0.1" axis="0 1 0"/></default>
  <worldbody><body name="upper" pos="0 0 1">
    <inertial pos="0.15 0 0" mass="1" diaginertia="0.001 0.01 0.01"/>
    <joint name="shoulder"/>
    <geom type="box" size="0.15 0.02 0.02" pos="0.15 0 0" contype="0" conaffinity="0"/>
    <body name="fore" pos="0.3 0 0">
      <inertial pos="0.15 0 0" mass="0.5" diaginertia="0.001 0.005 0.005"/>
      <joint name="elbow"/>
      <geom type="box" size="0.15 0.02 0.02" pos="0.15 0 0" contype="0" conaffinity="0"/>
    </body>
  </body></worldbody>
  <actuator>
    <position joint="shoulder" kp="400" kv="20" forcerange="-60 60"/>
    <position joint="elbow" kp="100" kv="5" gear="2"/>
  </actuator>
</mujoco>"""


@pytest.fixture
def arm(tmp_path, calmotion):
    pytest.importorskip("mujoco")
    pytest.importorskip("calmotion_plugins.robot_import")
    times = np.arange(73) / 60.0
    wave = 1.0 - np.cos(2 * np.pi * np.clip(times - 0.1, 0.0, 1.0))
    table = np.column_stack([times, 0.3 * wave, -0.4 * wave])
    np.savetxt(tmp_path / "wave.csv", table, delimiter=",", header="time_s,shoulder,elbow", comments="")
    (tmp_path / "arm.xml").write_text(ARM)
    done = calmotion("import", tmp_path / "arm.xml", "--motion", tmp_path / "wave.csv", "-o", tmp_path / "arm.usda")
    assert done.returncode == 0, done.stderr
    return tmp_path / "arm.usda"


def test_commands_of_an_imported_robot_work_in_its_own_file(arm):
    row = compare("arm", giving_shot(str(arm), None), str(arm.with_suffix(".xml")))
    assert row.kept and row.mujoco_ideal_mm > 20.0
    assert row.told == pytest.approx(1.0, abs=0.01) and row.mujoco_share < 0.02
    # 0.1 N m over 400 and over 2 * 2 * 100 N m/rad, in reaches of 0.6 and 0.3 m
    assert 0.0 < row.friction_mm <= 1e3 * 0.1 * (0.6 / 400 + 0.3 / 400) * 1.01


@pytest.mark.parametrize("step", [1e-3, 2.5e-4])
def test_without_friction_what_optimised_commands_leave_is_told(arm, step):
    """Both programs without the errors of their steps: the animation to 1e-4, what commands leave within a tenth."""
    path = arm.with_suffix(".xml")
    path.write_text(ARM.replace('frictionloss="0.1"', ""))
    shot = giving_shot(str(arm), None)
    rotors = (replace(motor, rotor=replace(motor.rotor, friction=0.0)) for motor in shot.character.motors)
    shot = compile_shot(replace(shot.character, motors=tuple(rotors)), shot.animation)
    row = compare("arm", shot, str(path), mujoco_step=step)
    assert row.kept and row.friction_mm == 0.0 and row.told == pytest.approx(1.0, abs=1e-4)
    assert row.mujoco_optimised_mm == pytest.approx(row.optimised_mm, rel=0.1)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("elbow", "wrist", "has no joint"),
        ('name="fore"', 'name="hand"', "has no body"),
        ('<position joint="elbow" kp="100" kv="5" gear="2"/>', "", "not one actuator"),
        ("</mujoco>", "", "cannot read"),
    ],
    ids=["joint", "body", "actuator", "file"],
)
def test_files_of_other_robots_are_refused(arm, old, new, what):
    other = Path(arm).with_name("other.xml")
    other.write_text(ARM.replace(old, new))
    character = giving_shot(str(arm), None).character
    with pytest.raises(ShotError, match=what):
        simulate_original(str(other), character, np.arange(3) / 60.0, np.zeros((3, 2)))
