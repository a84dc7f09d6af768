"""What the table of attributes says becomes of each attribute of URDF and MJCF."""

import ctypes
import os
import re
from pathlib import Path

import pytest
from calmotion.errors import ShotError
from calmotion_plugins.robot_import.description.attributes import REFUSED, TREATMENTS, markdown, row_of, table
from calmotion_plugins.robot_import.description.descriptions import read_description

KINDS = ("mjcf", "urdf")
WRITES = "CALMOTION_WRITE_PAGES"  # set it, and the test of a page writes the page
HINGE = '<joint name="{}" axis="0 1 0"/>'


def robot(body="", extra="", joint="", geom=""):
    joints = HINGE.format("hip").replace("axis", f"{joint} axis")
    inner = f'<body name="b">{joints}<geom size="1" {geom}/>{body}</body>'
    return f'<mujoco model="m"><worldbody>{inner}</worldbody>{extra}</mujoco>'


def arm(joint="", extra="", kind="revolute"):
    return (
        '<robot name="a"><link name="l"/><link name="m"/><joint name="j" type="' + kind + '"><parent link="l"/>'
        f'<child link="m"/><limit lower="-1" upper="1" effort="1" velocity="1"/>{joint}</joint>{extra}</robot>'
    )


@pytest.fixture
def read(tmp_path):
    def run(text, name="robot.xml"):
        (tmp_path / "robot.xml").write_text(text)
        (tmp_path / "m.stl").touch()
        return read_description(str(tmp_path / name), {})

    return run


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_shows_the_table(repository, kind):
    page = repository / "docs" / "reference" / "robot_attributes.md"
    text = page.read_text()
    begin, end = f"<!-- {kind} -->\n", f"\n<!-- end of {kind} -->"
    made = re.sub(f"(?<={begin}).*?(?={end})", lambda _: markdown(kind), text, flags=re.DOTALL)
    if os.environ.get(WRITES):
        page.write_text(made)
        text = made
    assert begin in text and made == text, f"{page.name} shows an older table: run this test with {WRITES}=1"


@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_whole(kind):
    for row in table(kind):
        assert row.treatment in TREATMENTS and row.text and bool(row.remedy) == (row.treatment == REFUSED)


def schema():
    """Places and attributes of MuJoCo's own schema."""
    mujoco = pytest.importorskip("mujoco")
    library = ctypes.CDLL(str(next(Path(mujoco.__file__).parent.glob("*mujoco.*"))))
    text = ctypes.create_string_buffer(1_000_000)
    library.mj_printSchema(None, text, len(text), 0, 0)
    path: list[str] = []
    for line in text.value.decode().splitlines():
        head = re.match(r"^( *)(\S+) \(.\)", line)
        if head is not None:
            depth = len(head.group(1)) // 3
            path = [*path[:depth], head.group(2).replace("(world)body", "body")]
        names = line[head.end() :] if head is not None else line
        yield from (("/".join(path[1:]), name) for name in names.split())


def test_every_attribute_that_mujoco_knows_is_in_the_table():
    known = [(place, name) for place, name in schema() if place and not place.startswith("default")]
    assert len(known) > 1000
    assert [entry for entry in known if row_of("mjcf", *entry) is None] == []


EQUALITY = '<equality><joint joint1="knee" joint2="hip" polycoef="{}" {}/></equality>'
OPTION = "<option {}><flag {}/></option>"
NOTHING = {
    "line": robot(extra=EQUALITY.format("0.1 1 0 0 0", "")),
    "inactive": robot(extra=EQUALITY.format("0 1 2 0 0", 'active="false"')),
    "inactive_class": robot(extra='<default><equality active="false"/></default>' + EQUALITY.format("0 1 2 0 0", "")),
    "still_air": robot(extra=OPTION.format('wind="0 0 0" density="0"', 'spring="enable"')),
    "contacts_off": robot(extra=OPTION.format("", 'contact="disable" eulerdamp="disable"')),
    "no_gravcomp": robot(body='<body gravcomp="0"/>'),
    "zero_ref": robot(joint='ref="0.0"'),
    "linear": robot(joint='stiffness="3 0 0" damping="1 0"'),
    "unused_class": robot(extra='<default><default class="other"><joint ref="1"/></default></default>'),
    "pictures": robot(extra='<visual><global fovy="3"/></visual><asset><texture name="t" builtin="flat"/></asset>'),
    "contacts": robot(geom='condim="4" friction="1 1 1" solref="0.1 1" margin="0.1"'),
    "sensors": robot(extra='<sensor><jointpos joint="hip" noise="1"/></sensor>'),
    "servo": robot(
        extra='<actuator><general joint="hip" gaintype="fixed" biastype="affine" dyntype="none"/></actuator>'
    ),
    "same_mesh": robot(extra='<asset><mesh name="m" file="m.stl" refpos="0 0 0" refquat="1 0 0 0"/></asset>'),
    "urdf": arm('<dynamics damping="1" friction="2"/><calibration rising="0.3"/>'),
    "transmission": arm(
        extra='<transmission name="t"><type>x</type><actuator name="m"><mechanicalReduction>50</mechanicalReduction>'
        "</actuator></transmission>"
    ),
}


@pytest.mark.parametrize("name", NOTHING)
def test_what_changes_nothing_is_not_told(read, name):
    assert read(NOTHING[name]).unread == ()


ACTUATOR = '<actuator><{} name="drive" joint="hip" {}/></actuator>'
NOTED = {
    "tendon": (
        robot(extra='<tendon><fixed name="grip"><joint joint="hip" coef="1"/></fixed></tendon>'),
        "couples their joints: grip",
    ),
    "key frame": (robot(extra='<keyframe><key name="home" qpos="1 0"/></keyframe>'), "key frames are not taken"),
    "ref": (robot(joint='ref="30"'), "that counts as MuJoCo does: hip"),
    "class_ref": (robot(extra='<default><joint ref="30"/></default>'), "that counts as MuJoCo does: hip"),
    "inner_class_ref": (
        robot(
            joint='class="arm"',
            extra='<default><joint ref="30"/><default class="arm"><joint damping="1"/></default></default>',
        ),
        "that counts as MuJoCo does: hip",
    ),
    "childclass": (
        robot(
            body='<body childclass="c"><frame><body><joint name="toe"/></body></frame></body>',
            extra='<default><default class="c"><joint ref="1"/></default></default>',
        ),
        "that counts as MuJoCo does: toe",
    ),
    "air": (robot(extra=OPTION.format('density="1.2"', "")), "air and liquids are not simulated: option"),
    "gravcomp": (robot(body='<body name="c" gravcomp="1"/>'), "in full, gravcomp is not read: c"),
    "filter": (robot(extra=ACTUATOR.format("position", 'kp="5" timeconst="0.1"')), "filter between command"),
    "muscle": (robot(extra=ACTUATOR.format("muscle", "")), "only which joints they move is read: drive"),
    "speed": (robot(extra=ACTUATOR.format("velocity", 'kv="1"')), "the command of these actuators is a speed"),
    "delay": (robot(extra=ACTUATOR.format("motor", 'delay="0.1"')), "calm:motor:delay"),
    "crank": (robot(extra='<actuator><motor name="c" cranksite="a" slidersite="b"/></actuator>'), "drive nothing: c"),
    "plugin": (robot(body='<plugin plugin="mujoco.elasticity.cable"/>'), "plugins of MuJoCo are not run"),
    "newer": (robot(joint='creep="2"'), "not known, and not read: joint hip creep"),
    "gazebo": (
        arm(extra='<gazebo reference="j"><springStiffness>3</springStiffness></gazebo>'),
        "Gazebo are not read: j",
    ),
    "ros2_control": (
        arm(
            extra='<ros2_control name="r"><joint name="j"><command_interface name="position"><param name="min">0'
            "</param></command_interface></joint></ros2_control>"
        ),
        "ros2_control are not read",
    ),
    "jerk": (arm().replace("effort=", 'jerk="3" effort='), "acceleration and jerk are not read"),
    "gap": (arm(extra='<transmission name="t"><gap_joint name="g"/></transmission>'), "transmission couples"),
}


@pytest.mark.parametrize("name", NOTED)
def test_what_is_not_read_is_told(read, name):
    text, words = NOTED[name]
    (told,) = read(text).unread
    assert words in told


REFUSALS = {
    "curve": (robot(extra=EQUALITY.format("0.1 1 1.5 0 0", "")), "equality joint knee polycoef", "0.1 1 1.5 0 0"),
    "class_curve": (
        robot(extra='<default><equality active="true"/></default>' + EQUALITY.format("0 1 0 1 0", "")),
        "equality joint knee polycoef",
        "0 1 0 1 0",
    ),
    "tendon": (robot(extra='<equality><tendon name="t" tendon1="a"/></equality>'), "equality tendon t", "t"),
    "flag": (robot(extra=OPTION.format("", 'spring="disable"')), "option flag spring", "disable"),
    "progressive": (robot(joint='stiffness="3 0 20"'), "joint hip stiffness", "3 0 20"),
    "quadratic_damper": (
        robot(extra='<default><joint damping="1 2"/></default>'), "joint hip damping", "1 2"
    ),
    "frames": (
        robot(body='<frame name="f"><frame name="g" pos="1 0 0"><geom size="1"/></frame></frame>'), "frame frame g", "g"
    ),
    "cloth": (robot(body='<flexcomp name="c" type="grid"/>'), "flexcomp c", "c"),
    "moved_mesh": (
        robot(extra='<asset><mesh name="m" file="m.stl" refpos="0 0 1"/></asset>'), "asset mesh m refpos", "0 0 1"
    ),
    "inline_mesh": (robot(extra='<asset><mesh name="m" vertex="0 0 0"/></asset>'), "asset mesh m vertex", "0 0 0"),
}  # fmt: skip


def test_parts_of_a_body_may_be_in_another_file(read, tmp_path):
    (tmp_path / "part.xml").write_text('<mujocoinclude><geom size="1"/><body gravcomp="1" name="b"/></mujocoinclude>')
    found = read('<mujoco><worldbody><body name="a"><include file="part.xml"/></body></worldbody></mujoco>').unread
    assert len(found) == 1 and found[0].endswith("gravcomp is not read: b")


@pytest.mark.parametrize("included", [False, True])
@pytest.mark.parametrize("name", REFUSALS)
def test_what_would_be_another_robot_is_refused(read, tmp_path, name, included):
    text, attribute, found = REFUSALS[name]
    (tmp_path / "main.xml").write_text('<mujoco model="m"><include file="robot.xml"/></mujoco>')
    with pytest.raises(ShotError) as refused:
        read(text, "main.xml" if included else "robot.xml")
    assert (refused.value.attribute, refused.value.found) == (attribute, found) and refused.value.remedy
    assert os.path.basename(str(refused.value.path)) == "robot.xml"


def test_joints_of_one_body_are_told_and_refused_where_nothing_gives_the_bodies_between_a_mass(read):
    several = robot().replace("<joint", f"{HINGE.format('hip_x')}<joint")
    assert read(several).faults == ("joints of one body are those of bodies one inside the other: b",)
    with pytest.raises(ShotError, match="several joints") as refused:
        read(several.replace("<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>'))
    assert refused.value.attribute == "body b" and refused.value.found == "hip_x, hip" and refused.value.remedy


def test_locks_and_soft_limits_are_read(read):
    lock = '<equality><joint joint1="hip" polycoef="0.3 0 0 0 0"/><joint joint1="knee"/></equality>'
    assert read(robot(extra=lock)).locks == {"hip": 0.3, "knee": 0.0}
    soft = '<safety_controller soft_lower_limit="-0.5" soft_upper_limit="{}" k_velocity="1"/>'
    assert read(arm(soft.format(2))).soft_limits == {"j": (-0.5, 2.0)}
    assert read(arm(soft.format(-0.6))).soft_limits == {}
