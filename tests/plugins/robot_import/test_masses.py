"""Links of an MJCF robot without mass."""

import os

import pytest
from calmotion.errors import ShotError
from calmotion.usd.reading.shot import read_shot
from calmotion_plugins.robot_import import import_robot
from calmotion_plugins.robot_import.converters import VARIABLE, environment_folder
from calmotion_plugins.robot_import.description.descriptions import MJCF, Description
from calmotion_plugins.robot_import.options import RobotOptions
from calmotion_plugins.robot_import.robot_layer import robot_layer
from converted_arm import CONVERTED, FORE

FRAMES = {
    "site": '<body name="site" pos="0.4 0 0"><site name="optical"/></body>',
    "camera": '<body name="camera" pos="0.4 0 0"><camera name="eye"/></body>',
    "light": '<body name="light" pos="0.4 0 0"><light pos="0 0 0"/></body>',
    "empty": '<body name="empty" pos="0.4 0 0"/>',
    "inner": '<body name="outer" pos="0.4 0 0"><body name="inner" pos="0 0 0.01"><site/></body></body>',
    "mount": '<body name="mount"><body name="hand"><joint name="grip"/><geom size="0.02" mass="0.1"/></body></body>',
    "in_frame": '<frame pos="0.4 0 0"><body name="in_frame"><site/></body></frame>',
    "shown": '<body name="shown"><geom size="0.01" contype="0" conaffinity="0" mass="0"/></body>',
    "hollow": '<body name="hollow"><geom size="0.01" contype="0" conaffinity="0" density="0"/></body>',
    "stated": '<body name="stated"><inertial pos="0 0 0" mass="0" diaginertia="0 0 0"/></body>',
    "wrist": '<body name="wrist"><joint name="turn"/><body name="tool"><geom size="0.02" mass="0.2"/></body></body>',
}
ROBOT = """<mujoco model="m"><worldbody><body name="post"><geom type="box" size="0.05 0.05 0.1" mass="2"/>
<body name="arm" pos="0 0 0.1"><joint name="lift" axis="0 -1 0"/>
<geom type="box" size="0.2 0.01 0.01" pos="0.2 0 0" mass="0.17"/>{}</body></body></worldbody></mujoco>"""

converts = pytest.mark.skipif(
    not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file(),
    reason="the converters are not here",
)


@converts
def test_bodies_without_mass_are_frames_at_their_parents(tmp_path):
    (tmp_path / "robot.xml").write_text(ROBOT.format("".join(FRAMES.values())))
    made = import_robot(tmp_path / "robot.xml", layer=tmp_path / "robot.usda", targets=["camera"])
    masses = {body.path.rsplit("/", 1)[-1]: body.mass.mass for body in made.character.bodies}
    assert {name: masses[name] for name in FRAMES} == pytest.approx(dict.fromkeys(FRAMES, 1e-6))
    assert sum(masses.values()) == pytest.approx(2.47 + 1e-6 * (len(FRAMES) + 1), rel=1e-7)
    fixed = {joint.path.split("/")[-2] for joint in made.character.joints if joint.kind == "fixed"}
    assert fixed >= FRAMES.keys() - {"wrist"}
    (told,) = (note for note in made.notes if "are frames" in note)
    assert "mount" in told and not any("centre of mass" in note for note in made.notes)


@converts
def test_frames_do_not_bend(tmp_path):
    (tmp_path / "robot.xml").write_text(ROBOT.format(FRAMES["site"] + FRAMES["stated"]))
    made = import_robot(tmp_path / "robot.xml", layer=tmp_path / "robot.usda", flexible=["*[ast]*=abs"])
    assert [body.path.split("/")[-1] for body in made.character.bodies if body.flexible] == ["post", "arm"]
    with pytest.raises(ShotError, match="frame, which does not bend"):
        import_robot(tmp_path / "robot.xml", layer=tmp_path / "robot.usda", flexible=["s*=abs"])


@converts
def test_a_body_without_mass_that_moves_and_carries_none_is_refused_as_mujoco_does(tmp_path):
    (tmp_path / "robot.xml").write_text(
        ROBOT.format('<body name="wrist"><joint name="turn"/><body name="tip"><site/></body></body>')
    )
    with pytest.raises(ShotError, match="without mass moves") as refused:
        import_robot(tmp_path / "robot.xml", layer=tmp_path / "robot.usda")
    assert (
        refused.value.path.endswith("/wrist") and "turn" in refused.value.found and "<inertial>" in refused.value.remedy
    )


def converted(tmp_path, joint):
    """The arm whose fore arm has no mass, and a finger that a joint of a type carries."""
    text = CONVERTED.replace("rel newton:mimicJoint = </arm/Physics/elbow>", "").replace(
        "float newton:mimicCoef1 = 0.01", ""
    )
    (tmp_path / "converted.usda").write_text(text.replace("PhysicsPrismaticJoint", joint))
    options = RobotOptions(Description("r.xml", MJCF))
    layer, notes = robot_layer(str(tmp_path / "converted.usda"), "./converted.usda", options)
    layer.Export(str(tmp_path / "robot.usda"))
    return read_shot(str(tmp_path / "robot.usda"), still=True)[0], notes


def test_a_moving_body_without_mass_needs_one_that_is_fixed_to_it(tmp_path):
    character, notes = converted(tmp_path, "PhysicsFixedJoint")
    assert next(body for body in character.bodies if body.path == FORE).mass.mass == pytest.approx(1e-6)
    assert any("fore.arm" in note for note in notes)
    with pytest.raises(ShotError, match="without mass moves"):
        converted(tmp_path, "PhysicsRevoluteJoint")
