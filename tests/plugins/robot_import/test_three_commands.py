"""The three commands of the README, from a robot and a motion that nobody here made to commands for ROS 2.

A test of each kind of file: the SO-101 as URDF, the xArm7 of MuJoCo's menagerie as MJCF; the motion is the right arm of
a recorded dancer (G1 Moves), a table without names and times.
"""

import json
import os
import re
import shlex
import subprocess
import sys

import numpy as np
import pytest
import yaml
from calmotion_plugins.robot_import.converters import VARIABLE, environment_folder

ROWS = slice(300, 421)  # two seconds
RIGHT_ARM = 29  # first of its seven columns: shoulder pitch, roll, yaw, elbow, wrist roll, pitch, yaw
ROBOTS = {
    "URDF": (
        "sources/so101/so101_new_calib.urdf", "*upper_arm*=abs",
        {2: "shoulder_pan", 0: "shoulder_lift", 3: "elbow_flex", 5: "wrist_flex", 4: "wrist_roll"},
    ),
    "MJCF": (
        # the elbow bends further than joint 4 may
        "sources/xarm7/xarm7_nohand.xml", "link5=polycarbonate",
        {0: "joint1", 1: "joint2", 2: "joint3", 4: "joint5", 3: "joint6", 5: "joint7"},
    ),
}  # fmt: skip


def commands(repository) -> list[str]:
    """The commands of the README's section."""
    section = (repository / "README.md").read_text().split("## From a URDF to a ROS 2 controller")[1].split("\n## ")[0]
    return re.findall(r"^    (calmotion .+)$", section, re.MULTILINE)


def test_the_readme_has_three_commands(repository):
    assert [line.split()[1] for line in commands(repository)] == ["import", "optimize", "export"]


@pytest.mark.long
@pytest.mark.parametrize("kind", ROBOTS)
def test_three_commands_lead_from_a_robot_and_a_table_to_ros_2(repository, shared_data, tmp_path, kind):
    if not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file():
        pytest.skip(
            f"the converters are not here: name their environment with {VARIABLE}, or run calmotion import once"
        )
    robot, flexible, joints = ROBOTS[kind]
    lines = (shared_data / "motion" / "g1-moves" / "B_HandsChop.csv").read_text().splitlines()[ROWS]
    (tmp_path / "wave.csv").write_text("\n".join(lines) + "\n")
    columns = ["-"] * len(lines[0].split(","))
    for offset, name in joints.items():
        columns[RIGHT_ARM + offset] = name
    table = f" --set motion.read.joints={','.join(columns)} --set motion.read.rate=60Hz"
    reports = []
    for line in commands(repository):
        line = line.replace("robot.urdf", str(shared_data / robot)).replace("*upper_arm*=abs", flexible)
        line += table if " import " in line else " --tolerance 5mm --json"
        done = subprocess.run(
            [sys.executable, "-m", "calmotion", *shlex.split(line)[1:]], cwd=tmp_path, capture_output=True, text=True,
            env=os.environ | {"PYTHONPATH": str(repository / "pipeline")},
        )  # fmt: skip
        assert done.returncode == 0, f"{line}\n{done.stderr[-2000:]}"
        reports.append(done.stdout)
    optimized, exported = (json.loads(text) for text in reports[1:])
    # the file's limit of effort, which the motion exceeds by a factor of two, counts more than the error
    exceeded = any(abs(row["before"]) > abs(row["limit"]) for row in optimized["limits"])
    assert exceeded == (kind == "MJCF") and not any(row["exceeded"] for row in optimized["limits"])
    assert exceeded or optimized["max_error_after_m"] <= optimized["max_error_before_m"] + 1e-4
    assert exported["tolerance_kept"] and exported["lowest_rate_hz"] <= 100
    message = yaml.safe_load((tmp_path / "trajectory.yaml").read_text())
    assert set(joints.values()) <= set(message["joint_names"])
    points = np.array([point["positions"] for point in message["points"]])
    recorded = np.loadtxt(tmp_path / "wave.csv", delimiter=",")
    for offset, name in joints.items():
        played = points[:, message["joint_names"].index(name)]
        # the curves are the dancer's but for a few degrees
        assert abs(played - np.interp(np.arange(len(played)) / 100, np.arange(len(recorded)) / 60,
                                      recorded[:, RIGHT_ARM + offset])).max() < np.radians(8.0)  # fmt: skip
