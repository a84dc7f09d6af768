"""What of an MJCF robot no shot can hold."""

import pytest
from calmotion.errors import ShotError
from calmotion_plugins.robot_import.descriptions import read_description

HINGE = '<joint name="{}" axis="0 1 0"/>'


def robot(*joints, extra=""):
    inner = "".join(HINGE.format(name) for name in joints)
    return f'<mujoco model="m"><worldbody><body name="b">{inner}<geom size="1"/></body></worldbody>{extra}</mujoco>'


@pytest.fixture
def read(tmp_path):
    def run(text, name="robot.xml"):
        (tmp_path / "robot.xml").write_text(text)
        return read_description(str(tmp_path / name), {})

    return run


def test_a_body_has_one_joint(read, tmp_path):
    assert read(robot("hip")).unread == ()
    with pytest.raises(ShotError, match="several joints") as refused:
        read(robot("hip_x", "hip_y"))
    assert refused.value.attribute == "body b" and refused.value.found == "hip_x, hip_y" and refused.value.remedy
    (tmp_path / "main.xml").write_text('<mujoco model="m"><include file="robot.xml"/></mujoco>')
    with pytest.raises(ShotError, match="several joints"):
        read(robot("hip_x", "hip_y"), "main.xml")


def test_tendons_and_shifted_joints_are_told(read):
    tendon = '<tendon><fixed name="grip"><joint joint="hip" coef="1"/></fixed></tendon>'
    (told,) = read(robot("hip", extra=tendon)).unread
    assert "tendons are not read" in told and "grip" in told
    (told,) = read(robot("hip").replace("axis", 'ref="30" axis')).unread
    assert "hip" in told and "subtract ref" in told


def test_a_joint_that_follows_by_a_curve_is_refused(read):
    follower = '<equality><joint joint1="knee" joint2="hip" polycoef="{}"/></equality>'
    assert read(robot("hip", extra=follower.format("0.1 1 0 0 0"))).unread == ()
    with pytest.raises(ShotError, match="by a curve") as refused:
        read(robot("hip", extra=follower.format("0.1 1 1.5 0 0")))
    assert refused.value.attribute == "equality joint knee polycoef" and refused.value.found == "0.1 1 1.5 0 0"


@pytest.mark.parametrize(
    ("name", "value", "body"),
    [
        ("settotalmass", "3", ""),
        ("inertiafromgeom", "true", '<inertial pos="0 0 0" mass="1"/>'),
        ("inertiagrouprange", "0 0", '<geom size="1" group="1"/>'),
    ],
)
def test_settings_that_change_masses_are_refused(read, name, value, body):
    def text(value, body):
        compiler = f'<compiler {name}="{value}"/>'
        return robot("hip", extra=compiler).replace("<geom", f"{body}<geom", 1)

    with pytest.raises(ShotError, match="changes masses") as refused:
        read(text(value, body))
    assert refused.value.attribute == f"compiler {name}" and f"remove {name}" in refused.value.remedy
    harmless = {"settotalmass": "-1", "inertiafromgeom": "true", "inertiagrouprange": "0 0"}[name]
    assert read(text(harmless, "")).unread == (), "it changes nothing"
