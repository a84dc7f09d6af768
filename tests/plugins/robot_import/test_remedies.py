"""What an import tells to do works: each case is refused, changed as its remedy says, and imported."""

import os
import re
from collections.abc import Callable
from dataclasses import dataclass, field

import calmotion as cm
import pytest
import trimesh
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion_plugins.robot_import import import_robot
from calmotion_plugins.robot_import.converters import VARIABLE, environment_folder

pytestmark = [
    pytest.mark.skipif(
        not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file(),
        reason="the converters are not here",
    ),
    pytest.mark.usefixtures("warm_converters"),
]

INERTIAL = '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
BOX = '<visual><geometry><box size="0.4 0.02 0.02"/></geometry></visual>'
LIMIT = '<axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="9" velocity="5"/>'
JOINT = f'<joint name="lift" type="revolute"><parent link="base"/><child link="arm"/>{LIMIT}</joint>'
URDF = f'<robot name="r"><link name="base">{INERTIAL}</link><link name="arm">{INERTIAL}{BOX}</link>{JOINT}</robot>'
HAND = f"""<link name="hand">{INERTIAL}</link>
<joint name="turn" type="revolute"><parent link="arm"/><child link="hand"/>{LIMIT}</joint></robot>"""
BODY = '<body name="arm"><joint name="lift" axis="0 1 0"/><geom type="box" size="0.2 0.01 0.01"/></body>'
MJCF = f'<mujoco model="m"><worldbody>{BODY}</worldbody></mujoco>'
TABLE = "time_s,lift\n0,0\n0.5,0.1\n1,0\n"
POINTER = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n"


@dataclass(frozen=True)
class Case:
    """A robot that is refused.

    Attributes:
        robot: Its file.
        problem, remedy: What is told, the second as a regular expression.
        fixed: What becomes of the file as the remedy says; None: it stays, and the options change.
        options: Of the import.
        instead: Of the import afterwards; a function of what matches the remedy where it names them.
        motion, fixed_motion: Of its table.
        prepare: Makes files beside it, before, and with True as the remedy says.
    """

    robot: str
    problem: str
    remedy: str
    fixed: str | None = None
    options: dict[str, object] = field(default_factory=dict)
    instead: dict[str, object] | Callable[[re.Match[str]], dict[str, object]] | None = None
    motion: str = ""
    fixed_motion: str = ""
    prepare: Callable[[object, bool], None] = lambda folder, done: None


def mesh_file(folder, done, name="arm.stl"):
    (folder / name).parent.mkdir(exist_ok=True)
    if done:
        trimesh.creation.box((0.4, 0.02, 0.02)).export(folder / name)


def pointer(folder, done):
    (folder / "arm.stl").write_text(POINTER)
    mesh_file(folder, done)


def with_mesh(name):
    return URDF.replace('<box size="0.4 0.02 0.02"/>', f'<mesh filename="{name}"/>')


def mjcf(old, new, robot=MJCF):
    return robot.replace(old, new)


def tail(text):
    return MJCF.replace("</mujoco>", f"{text}</mujoco>")


CURVED = '<equality><joint joint1="lift" polycoef="0.1 {} 0 0"/></equality>'
TWO = BODY.replace("</body>", '<body name="hand" pos="0.2 0 0"><joint name="turn"/><geom size="0.02"/></body></body>')
COUPLED = MJCF.replace(BODY, TWO).replace("</mujoco>", "<equality>{}</equality></mujoco>")
FOLLOWS = '<joint joint1="turn" joint2="lift" polycoef="0 1 {} 0 0"/>'
FRAMES = '<frame pos="0 0 1"><frame pos="0 1 0">{}</frame></frame>'
SEVERAL = BODY.replace("<geom", '<joint name="turn" axis="0 0 1"/><geom')
BY_GEOMETRY = MJCF.replace("<worldbody>", '<compiler inertiafromgeom="true"/><worldbody>')
NESTED = f"""<body name="first"><joint name="lift" axis="0 1 0"/><geom size="0.005" mass="1e-3"/>
{BODY.replace("lift", "turn")}</body>"""
MESHED = '<mujoco model="m"><asset><mesh name="a" file="arm.stl" {}/></asset>' + MJCF[18:].replace(
    'type="box" size="0.2 0.01 0.01"', 'type="mesh" mesh="a"'
)
PID = '<actuator><pid joint="lift" kp="50" kd="2"/></actuator>'

ATTACHED = '<mujoco model="h"><compiler angle="radian"/><worldbody><body name="hand"><joint name="turn" range="-1 1"/>'
ATTACHED += '<geom size="0.02"/></body></worldbody></mujoco>'
ATTACHES = '<mujoco model="m"><asset><model name="h" file="hand.xml"/></asset>' + MJCF[18:].replace(
    "</body>", '<attach model="h" body="hand" prefix="l_"/></body>'
)

CASES = {
    "a missing mesh": Case(with_mesh("arm.stl"), "missing", "Put the files there", with_mesh("arm.stl"),
                           prepare=mesh_file),
    "an unknown package": Case(with_mesh("package://mine/arm.stl"), "package", r"--package mine=FOLDER",
                               instead={"packages": {"mine": "meshes"}},
                               prepare=lambda f, done: mesh_file(f, True, "meshes/arm.stl")),
    "a pointer of Git LFS": Case(with_mesh("arm.stl"), "Git LFS pointer", "git lfs pull", with_mesh("arm.stl"),
                                 prepare=pointer),
    "a planar joint": Case(URDF.replace("</robot>", HAND.replace("revolute", "planar")), "not supported",
                           "Write one of revolute", URDF.replace("</robot>", HAND)),
    "two roots": Case(URDF.replace("</robot>", f'<link name="b">{INERTIAL}</link></robot>'), "several roots",
                      "by fixed joints", URDF.replace("</robot>", f"""<link name="b">{INERTIAL}</link><joint name="f"
                      type="fixed"><parent link="base"/><child link="b"/></joint></robot>""")),
    "a joint that follows itself": Case(URDF.replace("<axis", '<mimic joint="lift"/><axis'), "in a circle",
                                        "Remove the <mimic>", URDF),
    "an expression of xacro": Case(URDF.replace('lower="-2"', 'lower="${-2}"'), "xacro",
                                   "`xacro robot.urdf > expanded.urdf`", URDF),
    "a rotation that is not rpy": Case(URDF.replace("<axis", '<origin quat_xyzw="0 0 1 0"/><axis'), "this rotation",
                                       "Write it as rpy", URDF.replace("<axis", '<origin rpy="0 0 3.14159"/><axis')),
    "an attached robot in radians": Case(ATTACHES, "the compiler of the file around it", "the same angle",
                                         ATTACHES.replace("<asset>", '<compiler angle="radian"/><asset>'),
                                         prepare=lambda f, done: (f / "hand.xml").write_text(ATTACHED)),
    "joints without names": Case(MJCF.replace(BODY, TWO).replace('name="lift"', "").replace('name="turn"', ""),
                                 "several joints have this name", "by its path: .*/m/Geometry/arm/PhysicsRevoluteJoint",
                                 motion=TABLE.replace("lift", "PhysicsRevoluteJoint"),
                                 fixed_motion=TABLE.replace("lift", "/m/Geometry/arm/PhysicsRevoluteJoint")),
    "geometry without inertia": Case(URDF.replace(f"{INERTIAL}{BOX}", BOX), "no inertia", "--solid (abs)",
                                     instead=lambda found: {"solid": found[1]}),
    "a link that is not there": Case(URDF, "no link", "Did you mean (arm)",
                                     options={"flexible": ["arn=abs"]},
                                     instead=lambda found: {"flexible": [f"{found[1]}=abs"]}),
    "a motor that is not there": Case(URDF, "no joint", "Did you mean (lift)", options={"motors": ["lfit"]},
                                      instead=lambda found: {"motors": [found[1]]}),
    "walls without a unit": Case(URDF, "no unit", r"Write (3mm)", options={"flexible": ["arm=abs,3"]},
                                 instead=lambda found: {"flexible": [f"arm=abs,{found[1]}"]}),
    "links without a material": Case(URDF, "PATTERN=MATERIAL", r'"\*forearm\*=(abs,3mm)"',
                                     options={"flexible": ["arm"]},
                                     instead=lambda found: {"flexible": [f"arm={found[1]}"]}),
    "a flag": Case(mjcf("<worldbody>", '<option><flag gravity="enable" limit="disable"/></option><worldbody>'),
                   "switches parts", "Remove the flag", MJCF),
    "a spring that is not linear": Case(mjcf('name="lift"', 'name="lift" stiffness="3 1"'), "not linear",
                                        "Keep its first number", mjcf('name="lift"', 'name="lift" stiffness="3"')),
    "a joint that follows a curve": Case(COUPLED.format(FOLLOWS.format(0.5)), "by a curve", "Keep its first two",
                                         COUPLED.format(FOLLOWS.format(0))),
    "a frame within a frame": Case(mjcf(BODY, FRAMES.format(BODY)), "frame within a frame", "as one frame",
                                   mjcf(BODY, f'<frame pos="0 1 1">{BODY}</frame>')),
    "a body with several joints": Case(mjcf(BODY, SEVERAL, BY_GEOMETRY), "several joints", "one inside the other",
                                       mjcf(BODY, NESTED, BY_GEOMETRY)),
    "a body without mass": Case(mjcf('size="0.2 0.01 0.01"', 'size="0.2 0.01 0.01" mass="0"'), "without mass moves",
                                "a geom with a mass", mjcf('size="0.2 0.01 0.01"', 'size="0.2 0.01 0.01" mass="1"')),
    "a mesh that is moved": Case(MESHED.format('refpos="0 0 1"'), "wrong side", "remove the attribute",
                                 MESHED.format(""), prepare=lambda f, done: mesh_file(f, True)),
    "a missing mesh of MuJoCo": Case(MESHED.format(""), "meshes of the robot are missing", "Put the files into",
                                     MESHED.format(""), prepare=mesh_file),
    "a controller of MuJoCo": Case(tail(PID), "does not know", "as <position>, with its kp, and kd as kv",
                                   tail(PID.replace("pid", "position").replace("kd", "kv"))),
    "a joint that the table misspells": Case(URDF, "no joint", "Did you mean lift",
                                             motion=TABLE.replace("lift", "lfit"), fixed_motion=TABLE),
    "times that go back": Case(URDF, "must increase", "Sort the rows", motion=TABLE.replace("1,0", "0.2,0"),
                               fixed_motion="time_s,lift\n0,0\n0.2,0\n0.5,0.1\n"),
    "a column twice": Case(URDF, "same name", "Rename one", motion=TABLE.replace("time_s,lift", "lift,lift"),
                           fixed_motion=TABLE),
    "an equality that the motion moves": Case(tail(CURVED.format(0)), "an equality holds", "remove the equality", MJCF,
                                              motion=TABLE, fixed_motion=TABLE),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_what_is_refused_is_imported_as_its_remedy_says(tmp_path, monkeypatch, name):
    case = CASES[name]
    monkeypatch.chdir(tmp_path)
    file = tmp_path / ("robot.xml" if case.robot.startswith("<mujoco") else "robot.urdf")

    def attempt(text, options, motion, done):
        case.prepare(tmp_path, done)
        file.write_text(text)
        more = {}
        if motion:
            (tmp_path / "take.csv").write_text(motion)
            more = {"motion": tmp_path / "take.csv"}
        return import_robot(file, layer=tmp_path / "robot.usda", **options, **more)

    with pytest.raises((ShotError, SettingError, cm.RunError)) as refused:
        attempt(case.robot, case.options, case.motion, False)
    told = str(refused.value)
    found = re.search(case.remedy, told)
    assert case.problem in told and found, told
    instead = case.instead(found) if callable(case.instead) else case.instead
    made = attempt(case.fixed or case.robot, case.options if instead is None else instead, case.fixed_motion, True)
    assert made.character.motors or made.character.joints
