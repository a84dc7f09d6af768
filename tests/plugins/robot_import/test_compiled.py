"""Masses, springs, gains and limits of an imported MJCF robot are those that MuJoCo compiles."""

import os

import calmotion as cm
import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.support.rotations import rotation_from_quaternion
from calmotion_plugins.robot_import import import_robot
from calmotion_plugins.robot_import.converters import VARIABLE, environment_folder

mujoco = pytest.importorskip("mujoco")
pytestmark = [
    pytest.mark.skipif(
        not os.environ.get(VARIABLE) and not (environment_folder() / "ready").is_file(),
        reason="the converters are not here",
    ),
    pytest.mark.usefixtures("warm_converters"),
]

ROBOT = """<mujoco model="m">{head}<worldbody><body name="post"><geom type="box" size="0.05 0.05 0.1" mass="2"/>
<body name="arm" pos="0 0 0.1"><joint name="lift" axis="0 -1 0" {joint}/>{arm}
<body name="hand" pos="0.4 0 0"><joint name="grip" type="slide" axis="1 0 0" range="-0.1 0.2" {grip}/>{hand}</body>
</body></body></worldbody>{tail}</mujoco>"""
BOX = '<geom type="box" size="0.2 0.01 0.01" pos="0.2 0 0" {}/>'
ELLIPSOID = '<geom type="ellipsoid" size="0.2 0.02 0.03" pos="0.2 0 0" euler="0 20 0" {}/>'
HEAVY = '<default><default class="heavy"><geom mass="0.7"/></default></default>'
BALL = '<geom size="0.02" {}/>'


def robot(arm='mass="0.17"', hand='mass="0.2"', **parts):
    """Geometry, or attributes of one geom, of both links."""
    arm, hand = (text if "<" in text else geom.format(text) for text, geom in ((arm, BOX), (hand, BALL)))
    return ROBOT.format(**{"head": "", "joint": "", "grip": "", "tail": ""} | parts, arm=arm, hand=hand)


INERTIAL = '<inertial pos="0.1 0 0" mass="0.4" {}/>'
MASSES = {
    "boundmass": robot(head='<compiler boundmass="0.3"/>'),
    "boundinertia": robot(head='<compiler boundinertia="0.002"/>'),
    "balanceinertia": robot(
        INERTIAL.format('diaginertia="0.001 0.002 0.01"'), head='<compiler balanceinertia="true"/>'
    ),
    "settotalmass": robot(head='<compiler settotalmass="3"/>'),
    "inertiafromgeom": robot(INERTIAL.format("") + BOX.format('mass="0.5"'), head='<compiler inertiafromgeom="true"/>'),
    "inertiagrouprange": robot(
        BOX.format('mass="0.1" group="1"') + BOX.format('mass="0.3" group="3"'),
        head='<compiler inertiagrouprange="0 2"/>',
    ),
    "shown_mass": robot(BOX.format('mass="0.1"') + BOX.format('mass="0.3" contype="0" conaffinity="0"')),
    "shell": robot(hand=BALL.format('density="700" shellinertia="true"')),
    "class_mass": robot(BOX.format('class="heavy"'), head=HEAVY),
    "childclass_density": robot(head='<default><geom density="300"/></default>', arm=BOX.format("")),
    "turned": robot(INERTIAL.format('diaginertia="0.001 0.002 0.0025" euler="0 30 40"')),
    "full": robot(INERTIAL.format('fullinertia="0.002 0.003 0.0035 0.0004 0.0002 -0.0003"')),
    "weightless_geom": robot(BOX.format('mass="0"') + BOX.format('mass="0.3"')),
    "in_frame": robot(f'<frame pos="0 0 0.1" euler="0 20 0">{BOX.format("")}</frame>'),
    "ellipsoid": robot(ELLIPSOID.format('density="700"'), hand=ELLIPSOID.format('class="heavy"'), head=HEAVY),
    "visual_discarded": robot(
        BOX.format('mass="0.2" contype="0" conaffinity="0"'), head='<compiler discardvisual="true"/>'
    ),
}


def imported(tmp_path, text, **options):
    (tmp_path / "robot.xml").write_text(text)
    made = import_robot(tmp_path / "robot.xml", layer=tmp_path / "robot.usda", **options)
    return made, mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))


@pytest.mark.parametrize("name", MASSES)
def test_masses_and_inertias_are_those_of_mujoco(tmp_path, name):
    made, model = imported(tmp_path, MASSES[name])
    bodies = {body.path.rsplit("/", 1)[-1]: body.mass for body in made.character.bodies}
    for k in range(1, model.nbody):
        mass, turn = bodies[model.body(k).name], rotation_from_quaternion(model.body_iquat[k])
        inertia = turn @ np.diag(model.body_inertia[k]) @ turn.T
        assert mass.mass == pytest.approx(model.body_mass[k], rel=1e-6)
        np.testing.assert_allclose(mass.center, model.body_ipos[k], atol=1e-7)
        np.testing.assert_allclose(mass.inertia, inertia, atol=1e-6 * np.abs(inertia).max())


def test_gravity_that_is_switched_off_is_off(tmp_path):
    made, _ = imported(tmp_path, robot(head='<option><flag gravity="disable"/></option>'))
    assert made.character.gravity.tolist() == [0.0, 0.0, 0.0]


def test_geometry_gives_no_mass_where_the_compiler_does_not(tmp_path):
    inertial = INERTIAL.format('diaginertia="0.001 0.002 0.0025"')
    post = ROBOT.replace('<body name="post">', f'<body name="post">{inertial}')
    text = post.format(head='<compiler inertiafromgeom="false"/>', joint="", grip="", tail="", arm=inertial,
                       hand=BALL.format(""))  # fmt: skip
    with pytest.raises(ShotError, match="without mass moves"):
        imported(tmp_path, text)


def test_a_base_that_nothing_drives_is_told_and_can_get_motors(tmp_path):
    """The floating base of a planar walker."""
    joints = "".join(
        f'<joint name="{name}" type="slide" axis="{axis}"/>' for name, axis in (("x", "1 0 0"), ("z", "0 0 1"))
    )
    text = robot(tail=POSITION.format("")).replace('<body name="post">', f'<body name="post">{joints}')
    (tmp_path / "wave.csv").write_text("time_s,lift\n0,0\n0.1,0.1\n0.2,0\n")
    imported(tmp_path, text, motion=tmp_path / "wave.csv")
    with pytest.raises((ShotError, cm.RunError), match=r"Give \S+/x, \S+/z, \S+/grip motors"):
        cm.simulate(tmp_path / "robot.usda", step=0.01)
    made, _ = imported(tmp_path, text, motion=tmp_path / "wave.csv", motors=["all"])
    assert len(made.character.motors) == 4 and cm.simulate(tmp_path / "robot.usda", step=0.01)


def test_one_link_at_the_world_is_where_its_joint_is(tmp_path):
    body = '<body name="arm" pos="0 0 0.1"><joint name="lift"/><geom size="0.1"/></body>'
    made, _ = imported(tmp_path, f'<mujoco model="m"><worldbody>{body}</worldbody></mujoco>')
    assert not any("do not meet" in note for note in made.notes)


def test_a_robot_in_two_files_has_the_masses_of_both(tmp_path):
    (tmp_path / "arm.xml").write_text(f'<mujoco><include file="parts/bar.xml"/>{MASSES["turned"][18:]}')
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "bar.xml").write_text('<mujoco><compiler boundmass="0.5"/></mujoco>')
    made, _ = imported(tmp_path, '<mujoco model="m"><include file="arm.xml"/></mujoco>')
    assert sorted(body.mass.mass for body in made.character.bodies) == pytest.approx([0.5, 0.5, 2.0])


@pytest.mark.parametrize(
    ("arm", "head", "mass"),
    [
        (BOX.format('mass="0.5"'), "", 0.5),
        (BOX.format('density="700"'), "", 0.112),
        (BOX.format(""), '<default><geom density="700"/></default>', 0.112),
        (ELLIPSOID.format('density="700"'), "", 700.0 * 4.0 / 3.0 * np.pi * 0.2 * 0.02 * 0.03),
        (ELLIPSOID.format('class="heavy"'), HEAVY, 0.7),
        (BOX.format('mass="0.5"'), '<compiler settotalmass="5.4"/>', 1.0),
        (INERTIAL.format('diaginertia="0.001 0.002 0.0025"'), '<compiler boundmass="1.5"/>', 1.5),
    ],
)
def test_a_stated_mass_of_a_flexible_link_is_that_of_mujoco(tmp_path, arm, head, mass):
    shape = BOX.format('contype="0" conaffinity="0" mass="0"') if "inertial" in arm else ""
    made, _ = imported(tmp_path, robot(arm + shape, head=head), flexible=["arm=abs"])
    (link,) = (body for body in made.character.bodies if body.flexible is not None)
    assert link.mass.mass == pytest.approx(mass, rel=1e-6)


@pytest.mark.parametrize("folder", ["", "meshes"])
def test_a_mesh_in_several_parts_is_whole(tmp_path, folder):
    solids = "".join(
        f"o part{k}\nv {k} 0 0\nv {k} 0.1 0\nv {k} 0 0.1\nv {k + 0.1} 0 0\n"
        f"f {n + 1} {n + 3} {n + 2}\nf {n + 1} {n + 2} {n + 4}\nf {n + 2} {n + 3} {n + 4}\nf {n + 3} {n + 1} {n + 4}\n"
        for k, n in ((0, 0), (1, 4))
    )
    (tmp_path / folder).mkdir(exist_ok=True)
    (tmp_path / folder / "parts.obj").write_text(solids)
    head = f'<compiler meshdir="{folder}"/><asset><mesh file="parts.obj"/></asset>'
    arm = '<geom type="mesh" mesh="parts" mass="0.3"/>'
    made, model = imported(tmp_path, robot(arm=arm, head=head), flexible=["arm=abs"])
    (link,) = (body for body in made.character.bodies if body.flexible is not None)
    assert np.ptp(np.concatenate([surface.points for surface in link.surfaces])[:, 0]) == pytest.approx(1.1, rel=1e-5)
    assert link.mass.mass == pytest.approx(0.3) and any("divisions into parts: parts.obj" in n for n in made.notes)


POSITION = '<actuator><position name="p" joint="lift" kp="50" {}/></actuator>'
SERVOS = {
    "dampratio": robot(tail=POSITION.format('dampratio="0.7"')),
    "class_dampratio": robot(
        head='<default><position dampratio="1"/></default>', tail=POSITION.format('inheritrange="0"')
    ),
    "gear": robot(tail=POSITION.format('kv="2" gear="3"')),
    "scaled": robot(
        tail='<actuator><general joint="lift" biastype="affine" gainprm="20" biasprm="0 -40 -3"/></actuator>'
    ),
    "general_defaults": robot(
        head='<default><general biastype="affine" gainprm="80" biasprm="0 -80 -3"/></default>',
        tail='<actuator><general joint="lift"/></actuator>',
    ),
}


def test_gains_and_limits_of_several_actuators_of_a_joint_add_up(tmp_path):
    pair = (
        '<position joint="lift" kp="50" forcerange="-9 9"/><velocity joint="lift" kv="3" gear="2" forcerange="-2 2"/>'
    )
    made, _ = imported(tmp_path, robot(tail=f"<actuator>{pair}</actuator>"))
    (motor,) = made.character.motors
    assert (motor.position_gain, motor.velocity_gain, motor.max_torque) == pytest.approx((50.0, 12.0, 13.0))


@pytest.mark.parametrize("name", SERVOS)
def test_gains_are_those_of_the_compiled_actuator(tmp_path, name):
    made, model = imported(tmp_path, SERVOS[name])
    (motor,) = made.character.motors
    gear = model.actuator_gear[0, 0] ** 2
    _, stiffness, damping = -gear * model.actuator_biasprm[0, :3]
    assert (motor.position_gain, motor.velocity_gain) == pytest.approx((stiffness, damping), rel=1e-6)


GENERAL = '<actuator><general joint="lift" biastype="affine" {}/></actuator>'
COMMANDS = {  # head and joint, actuator, limits of the joint that its commands leave [rad], what is told of it
    "ctrlrange": ("", "", POSITION.format('ctrlrange="-0.2 0.3"'), (-0.2, 0.3), "its limits are those of the commands"),
    "gear": ("", "", POSITION.format('gear="-10" ctrlrange="-2 3"'), (-0.3, 0.2), "its limits are those"),
    "not_limited": ("", "", POSITION.format('ctrlrange="-0.2 0.3" ctrllimited="false"'), (-np.inf, np.inf), ""),
    "wider": ("", 'range="-10 10"', POSITION.format('ctrlrange="-2 3"'), (-np.pi / 18, np.pi / 18), ""),
    "inherited": ("", 'range="-10 10"', POSITION.format('inheritrange="0.5"'), (-np.pi / 36, np.pi / 36), "-5 to 5"),
    "ref": ('<compiler angle="radian"/>', 'ref="0.4" range="-1 1"', POSITION.format('ctrlrange="-0.8 0.5"'),
            (-1.2, 0.1), "its command is the joint's value + 0.4"),
    "ref_in_degrees": ("", 'ref="20" range="-50 50"', POSITION.format('ctrlrange="-0.8 0.5"'),
                       (-0.8 - np.pi / 9, 0.5 - np.pi / 9), "the joint's value + 0.349066"),
    "scaled": ("", "", GENERAL.format('gainprm="100" biasprm="0 -200 -9" ctrlrange="-1 1"'), (-0.5, 0.5),
               "its command is 2 times the joint's value"),
    "constant": ("", "", GENERAL.format('gainprm="200" biasprm="30 -200 -9" ctrlrange="-1 1"'), (-0.85, 1.15),
                 "its command is the joint's value - 0.15"),
    "affine": ("", "", GENERAL.format('gaintype="affine" gainprm="200 0 -3" biasprm="0 -200 -9"'), (-np.inf, np.inf),
               "its gain depends on the pose, which is not read"),
    "integrated": ("", "", '<actuator><intvelocity joint="lift" kp="50" actrange="-2 3" ctrlrange="-1 1"/></actuator>',
                   (-2.0, 3.0), "its limits are those of the commands"),
    "in_parent": ("", "", '<actuator><position jointinparent="lift" kp="50" ctrlrange="-0.2 0.3"/></actuator>',
                  (-0.2, 0.3), "its limits are those of the commands"),
}  # fmt: skip


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_limit_joints_and_are_told_where_they_are_not_its_values(tmp_path, name):
    head, joint, tail, limits, told = COMMANDS[name]
    made, _ = imported(tmp_path, robot(head=head, joint=joint, tail=tail))
    (motor,) = made.character.motors
    assert motor.position_gain > 0.0 and motor.max_torque == np.inf
    own = made.character.joints[motor.joint]
    assert (own.lower, own.upper) == pytest.approx(limits, rel=1e-5)
    notes = [note for note in made.notes if "command" in note or "its gain" in note]
    assert any(told in note for note in notes) if told else not notes


def test_a_bias_that_is_of_no_kind_holds_nothing(tmp_path):
    tail = '<actuator><general joint="lift" gainprm="20" biasprm="0 -40 -3"/></actuator>'
    (motor,) = imported(tmp_path, robot(tail=tail))[0].character.motors
    assert motor.position_gain == 0.0


def test_an_actuator_that_the_converter_does_not_write_makes_its_joint_a_motor(tmp_path):
    dc = '<dcmotor joint="grip" resistance="1" motorconst="1"/>'
    made, _ = imported(tmp_path, robot(tail=f'<actuator><position joint="lift" kp="50"/>{dc}</actuator>'))
    assert [motor.path.rsplit("/", 1)[-1] for motor in made.character.motors] == ["lift", "grip"]
    assert any("only which joints they move is read: grip" in note for note in made.notes)


MOTOR = '<actuator><motor joint="lift" {}/></actuator>'
LIMITS = {
    "ctrlrange": (robot(tail=MOTOR.format('ctrlrange="-2 2" gear="30"')), 60.0),
    "ctrl_not_limited": (robot(tail=MOTOR.format('ctrlrange="-2 2" ctrllimited="false"')), np.inf),
    "forcerange": (robot(tail=POSITION.format('forcerange="-9 12" gear="2"')), 18.0),
    "force_not_limited": (robot(tail=POSITION.format('forcerange="-9 9" forcelimited="false"')), np.inf),
    "actuatorfrcrange": (robot(joint='actuatorfrcrange="-7 7"', tail=POSITION.format('forcerange="-9 9"')), 7.0),
    "narrower_side": (robot(joint='actuatorfrcrange="-3 7"', tail=POSITION.format("")), 3.0),
    "class_forcerange": (
        robot(head='<default><motor forcerange="-0.4 0.4"/></default>', tail=MOTOR.format('ctrlrange="-1 1" gear="5"')),
        2.0,
    ),
    "gain": (robot(tail='<actuator><general joint="lift" gainprm="3" ctrlrange="-1 1"/></actuator>'), 3.0),
}


@pytest.mark.parametrize("name", LIMITS)
def test_limits_of_effort_are_those_of_joint_and_actuator(tmp_path, name):
    text, limit = LIMITS[name]
    made, _ = imported(tmp_path, text)
    (motor,) = made.character.motors
    assert motor.max_torque == pytest.approx(limit)


def test_a_spring_that_is_given_by_its_time_constant_is_the_compiled_one(tmp_path):
    made, model = imported(tmp_path, robot(grip='springdamper="0.2 0.5"', tail=POSITION.format("")))
    spring = made.character.motors[1]
    assert spring.position_gain == pytest.approx(model.jnt_stiffness[1], rel=1e-6)
    assert spring.velocity_gain == pytest.approx(model.dof_damping[1], rel=1e-6)


@pytest.mark.parametrize("joint", ["lift", "grip"])
@pytest.mark.parametrize("ref", [0.0, 0.05])
def test_an_equality_without_a_second_joint_holds_the_first(tmp_path, joint, ref):
    lock = f'<equality><joint joint1="{joint}" polycoef="0.08 0 0 0 0"/></equality>'
    made, _ = imported(tmp_path, robot(head='<compiler angle="radian"/>', grip=f'ref="{ref}"', tail=lock))
    track = made.animation.tracks[[motor.path.endswith(joint) for motor in made.character.motors].index(True)]
    np.testing.assert_allclose(track.values, 0.08, rtol=1e-6)
    assert any(note == f"joints that an equality holds: {joint}" for note in made.notes)


def test_a_motion_of_a_joint_that_an_equality_holds_is_refused(tmp_path):
    (tmp_path / "wave.csv").write_text("time_s,lift\n0,0\n0.1,0.2\n")
    lock = '<equality><joint joint1="lift"/></equality>'
    with pytest.raises(ShotError, match="an equality holds"):
        imported(tmp_path, robot(tail=lock), motion=tmp_path / "wave.csv")


FOLLOWS = '<equality><joint joint1="{}" joint2="{}" polycoef="0 0.1 0 0 0" {}/>{}</equality>'
COUPLINGS = {  # motors, those that follow behind the one that leads
    "leader_driven": (("grip", "lift", "", ""), "lift", [["lift", "grip"]]),
    "follower_driven": (("grip", "lift", "", ""), "grip", [["grip", "lift"]]),
    "both_driven": (("grip", "lift", "", ""), "lift grip", [["lift", "grip"]]),
    "none_driven": (("grip", "lift", "", ""), "", [["lift", "grip"], ["toe"]]),
    "others_driven": (("grip", "lift", "", ""), "toe", [["lift", "grip"], ["toe"]]),
    "not_active": (("grip", "lift", 'active="false"', ""), "lift grip", [["lift"], ["grip"]]),
    "last_of_train": (("grip", "lift", "", '<joint joint1="toe" joint2="grip"/>'), "toe", [["toe", "lift", "grip"]]),
    "middle_of_train": (("grip", "lift", "", '<joint joint1="toe" joint2="grip"/>'), "grip", [["grip", "lift", "toe"]]),
    "two_followers": (("grip", "lift", "", '<joint joint1="toe" joint2="lift"/>'), "toe", [["toe", "lift", "grip"]]),
}


@pytest.mark.parametrize("name", COUPLINGS)
def test_of_coupled_joints_the_driven_one_leads(tmp_path, name):
    coupling, driven, expected = COUPLINGS[name]
    actuators = "".join(f'<motor joint="{joint}"/>' for joint in driven.split())
    toe = '<body name="foot" pos="0 0.1 0"><joint name="toe" axis="0 0 1"/><geom size="0.02" mass="0.1"/></body>'
    text = robot(
        arm=BOX.format('mass="0.17"') + toe, tail=f"<actuator>{actuators}</actuator>{FOLLOWS.format(*coupling)}"
    )
    made, model = imported(tmp_path, text)
    names = [motor.path.rsplit("/", 1)[-1] for motor in made.character.motors]
    follows = [motor.follows for motor in made.character.motors]
    values = {n: 0.1 if f is None else f.offset + 0.1 * f.ratio for n, f in zip(names, follows, strict=True)}
    for k in np.flatnonzero(model.eq_active0):  # between a hinge and a slide too
        one, two = (values[model.joint(of[k]).name] for of in (model.eq_obj1id, model.eq_obj2id))
        assert one == pytest.approx(np.polyval(model.eq_data[k, 4::-1], two), rel=1e-6)
    groups = {name: [name] for name, motor in zip(names, made.character.motors, strict=True) if motor.follows is None}
    for name, motor in zip(names, made.character.motors, strict=True):
        if motor.follows is not None:
            groups[names[motor.follows.leader]].append(name)
    assert sorted(map(in_order, groups.values())) == sorted(map(in_order, expected))


def in_order(group):
    return [group[0], *sorted(group[1:])]


def test_actuators_of_a_group_that_is_switched_off_make_no_motors(tmp_path):
    other = '<motor joint="grip" group="2"/>'
    tail = MOTOR.format("").replace("</actuator>", f"{other}</actuator>")
    made, _ = imported(tmp_path, robot(head='<option actuatorgroupdisable="2"/>', tail=tail))
    assert [motor.path.rsplit("/", 1)[-1] for motor in made.character.motors] == ["lift"]
    assert any("move freely: grip" in note for note in made.notes)


def test_friction_of_a_joint_without_a_motor_is_noted(tmp_path):
    made, _ = imported(tmp_path, robot(grip='frictionloss="0.3"', tail=MOTOR.format("")))
    assert any("joints without motors are not simulated: grip" in note for note in made.notes)


def test_a_damper_of_a_joint_without_a_motor_is_a_drive_that_pulls_nowhere(tmp_path):
    made, model = imported(tmp_path, robot(grip='damping="0.3"', tail=MOTOR.format("")))
    damper = made.character.motors[1]
    assert damper.path.endswith("grip") and damper.damping_on == "joint" and not damper.optimize
    assert damper.velocity_gain == pytest.approx(model.dof_damping[1], rel=1e-6)
    assert 0.0 < damper.position_gain < 1e-4 * damper.velocity_gain
    assert any("dampers of joints without motors are drives" in note and "grip" in note for note in made.notes)


def test_what_mujoco_does_not_load_is_refused_in_its_words(tmp_path):
    with pytest.raises(ShotError, match="A \\+ B >= C"):
        imported(tmp_path, robot(INERTIAL.format('diaginertia="0.001 0.002 0.01"')))


def msh(points, triangles, normals=0, textures=0):
    """A mesh in MuJoCo's own format."""
    counts = np.array([len(points), normals, textures, len(triangles)], "<i4").tobytes()
    return (
        counts + np.asarray(points, "<f4").tobytes() + bytes(12 * normals + 8 * textures)
        + np.asarray(triangles, "<i4").tobytes()
    )  # fmt: skip


TETRAHEDRON = (np.eye(4, 3) * 0.3, [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)])


@pytest.mark.parametrize("sizes", [(0, 0), (4, 4)])
def test_meshes_in_mujocos_own_format_are_those_of_mujoco(tmp_path, sizes):
    (tmp_path / "part.msh").write_bytes(msh(*TETRAHEDRON, *sizes))
    text = robot(head='<asset><mesh file="part.msh" scale="1 1 -1"/></asset>')
    text = text.replace("</body>", '<geom type="mesh" mesh="part"/></body>', 1)
    made, model = imported(tmp_path, text)
    masses = sorted(body.mass.mass for body in made.character.bodies)
    assert masses == pytest.approx(sorted(model.body_mass[1:]), rel=1e-5)
    assert any("become OBJ: part.msh" in note for note in made.notes)
    (tmp_path / "part.msh").write_bytes(msh(*TETRAHEDRON)[:-4])
    with pytest.raises(ShotError, match="no mesh with faces in MuJoCo's own format"):
        imported(tmp_path, text)


def test_a_moving_body_has_any_mass_that_mujoco_takes(tmp_path):
    """As the wrist of an arm of Kinova, whose gripper is to be attached."""
    inertial = '<inertial mass="1e-9" pos="0 0 0" diaginertia="1e-12 1e-12 1e-12"/>'
    text = robot(
        arm=f'{BOX.format("")}<body name="wrist">{inertial}<joint name="turn" axis="0 0 1" armature="1"/></body>'
    )
    made, _ = imported(tmp_path, text)
    (wrist,) = (body for body in made.character.bodies if body.path.endswith("wrist"))
    assert wrist.mass.mass == pytest.approx(1e-9, rel=1e-6)
