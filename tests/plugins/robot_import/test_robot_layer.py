"""The layer over a converted robot, read again."""

import functools

import numpy as np
import pytest
from calmotion.catalogs.materials import MATERIALS
from calmotion.errors import ShotError
from calmotion.model import MotorTracks
from calmotion.usd.reading.shot import read_shot
from calmotion_plugins.robot_import.description.descriptions import URDF, Description
from calmotion_plugins.robot_import.options import FlexibleLinks, RobotOptions
from calmotion_plugins.robot_import.robot_layer import robot_layer
from converted_arm import CONVERTED, ELBOW, FORE, MIMIC, PAN, UPPER

ABS = MATERIALS["abs"]
TIMES = np.arange(5) / 20.0


@pytest.fixture
def make(tmp_path):
    def run(edit=lambda text: text, said=(("without_mass", ("fore.arm",)),), **options):
        (tmp_path / "converted.usda").write_text(edit(CONVERTED))
        options = RobotOptions(Description("r.urdf", URDF, **dict(said)), **{"solid": MATERIALS["pla"]} | options)
        layer, notes = robot_layer(str(tmp_path / "converted.usda"), "./converted.usda", options)
        layer.Export(str(tmp_path / "robot.usda"))
        character, animation, _ = read_shot(str(tmp_path / "robot.usda"), still=True)
        return character, animation, notes

    return run


def test_joints_get_motors_that_hold_the_pose_nearest_to_zero(make):
    character, animation, _ = make(
        said={"efforts": {"shoulder-pan": 20.0, "finger": 3.0}, "without_mass": ("fore.arm",)}
    )
    assert [motor.path for motor in character.motors] == [PAN, ELBOW, MIMIC]
    assert animation.tracks[0].values[0] == pytest.approx(np.radians(10.0))
    assert animation.tracks[1].values[0] == 0.0
    assert character.motors[0].max_torque == 20.0 and np.isinf(character.motors[1].max_torque)
    assert character.motors[2].follows is not None and character.motors[2].max_torque == pytest.approx(3.0)
    assert [joint.name for joint in character.joints] == ["shoulder-pan", "elbow", "finger"]


def test_a_motion_becomes_samples_of_the_drives(make):
    values = {"shoulder-pan": 0.5 + TIMES, "elbow": -TIMES}
    motion = MotorTracks("wave.csv", TIMES, values)
    character, animation, _ = make(motion=motion, frames_per_second=20.0)
    np.testing.assert_allclose(animation.frame_times, TIMES)
    for track, expected in zip(animation.tracks, values.values(), strict=False):
        np.testing.assert_allclose(track.values, expected, atol=1e-6)


def test_only_joints_with_actuators_get_motors_where_there_are_actuators(make):
    actuator = 'def MjcActuator "a"\n{\nrel mjc:target = </arm/Physics/elbow>\n}\ndef Scope "Physics"'
    character, _, _ = make(lambda text: text.replace('def Scope "Physics"', actuator))
    assert [motor.path for motor in character.motors] == [ELBOW, MIMIC]


def test_links_bend_by_name_and_material(make):
    links = (FlexibleLinks("*UPPER*", "abs", ABS), FlexibleLinks("fore*", "abs", ABS, 0.003))
    character, _, notes = make(flexible=links)
    bodies = {body.path: body for body in character.bodies}
    material = bodies[UPPER].flexible.material
    assert material.youngs_modulus == pytest.approx(2.1e9) and material.damping_ratio == pytest.approx(0.02)
    assert material.path == "/arm/CalmMaterials/abs" and bodies[FORE].flexible is not None
    assert bodies[UPPER].mass is not None, "the mass of the file stays"
    assert bodies[FORE].flexible.wall_thickness == pytest.approx(0.003) and bodies[UPPER].flexible.wall_thickness == -1


def test_links_without_inertia_have_that_of_their_geometry(make):
    character, _, notes = make()
    fore = next(body for body in character.bodies if body.path == FORE)
    assert fore.mass.mass == pytest.approx(1240.0 * 0.1**3, rel=1e-5) and any("fore.arm" in note for note in notes)
    with pytest.raises(ShotError) as refused:
        make(solid=None)
    assert refused.value.found == "fore.arm" and "--solid" in refused.value.remedy


def test_a_flexible_link_without_inertia_has_the_mass_of_its_material(make):
    character, _, notes = make(flexible=(FlexibleLinks("fore*", "abs", ABS, 0.003),), solid=None)
    fore = next(body for body in character.bodies if body.path == FORE)
    assert fore.mass is None and fore.flexible.material.density == pytest.approx(ABS.density)
    assert any("of their material: fore.arm" in note for note in notes)


def geoms(*authored):
    """The fore arm with cubes of 0.1 m as an MJCF converter writes them, each with one attribute."""
    cube = """def Cube "geom{}" (prepend apiSchemas = ["PhysicsCollisionAPI", "MjcCollisionAPI", "PhysicsMassAPI"])
        {{
            double size = 0.1
            float physics:{}
        }}
        def Xform "tool0\""""
    cubes = [cube.format(k, text) for k, text in enumerate(authored)]
    return lambda text: functools.reduce(lambda t, c: t.replace('def Xform "tool0"', c, 1), cubes, text)


def fore_mass(make, *authored, **options):
    character, _, _ = make(geoms(*authored), said=(), **options)
    mass = next(body.mass for body in character.bodies if body.path == FORE)
    return None if mass is None else mass.mass


@pytest.mark.parametrize("nothing", ["mass = 0", "density = 0"])
def test_a_geom_of_no_mass_weighs_nothing(make, nothing):
    assert fore_mass(make, "mass = 0.5", nothing) == pytest.approx(0.5, rel=1e-6)
    assert fore_mass(make, nothing) == pytest.approx(1e-6), "a link of such geoms alone is a frame"


def test_what_the_geoms_of_a_flexible_link_weigh_is_believed_and_a_default_density_is_not(make):
    links = (FlexibleLinks("fore*", "abs", ABS),)
    assert fore_mass(make, "mass = 0.5", flexible=links) == pytest.approx(0.5)
    assert fore_mass(make, "density = 2700", flexible=links) == pytest.approx(2.7, rel=1e-6)
    assert fore_mass(make, "density = 1000", flexible=links) is None, "the material decides"
    assert fore_mass(make, "mass = 0", flexible=links) is None, "the material decides"


def test_links_of_no_mass_are_frames_of_almost_none(make):
    character, _, notes = make(
        lambda text: text.replace("physics:mass = 0.1", "physics:mass = 0"),
        said={"massless": ("finger",), "without_mass": ("fore.arm",)},
    )
    finger = next(body for body in character.bodies if body.path.endswith("/finger"))
    assert finger.mass.mass == pytest.approx(1e-6) and any("finger" in note for note in notes)


def test_an_inertia_that_no_body_has_is_raised(make):
    wrong = CONVERTED.replace("(0.001, 0.001, 0.001)", "(-4e-22, 2e-23, 0.003)")
    character, _, notes = make(lambda text: wrong)
    finger = next(body for body in character.bodies if body.path.endswith("/finger"))
    np.testing.assert_allclose(np.linalg.eigvalsh(finger.mass.inertia), [3e-5, 3e-5, 3e-3], rtol=1e-5)
    assert any("moments of inertia" in note and "finger" in note for note in notes)


def test_a_negative_inertia_is_told_to_be_wrong(make):
    character, _, notes = make(lambda text: CONVERTED.replace("(0.001, 0.001, 0.001)", "(-0.001, 0.001, 0.001)"))
    finger = next(body for body in character.bodies if body.path.endswith("/finger"))
    assert np.linalg.eigvalsh(finger.mass.inertia).min() == pytest.approx(1e-5, rel=1e-5)
    assert any("negative moments of inertia" in note and "<inertia> of finger" in note for note in notes)


def test_an_inertia_of_nothing_is_that_of_a_ball(make):
    character, _, notes = make(lambda text: CONVERTED.replace("(0.001, 0.001, 0.001)", "(-5e-20, -5e-20, 0)"))
    finger = next(body for body in character.bodies if body.path.endswith("/finger"))
    radius = (0.1 / (1000.0 * 4.0 / 3.0 * np.pi)) ** (1 / 3)
    np.testing.assert_allclose(finger.mass.inertia, 0.4 * 0.1 * radius**2 * np.eye(3), rtol=1e-4, atol=1e-9)
    assert any("finger" in note for note in notes)


def test_targets_are_links_and_frames(make):
    character, _, _ = make(targets=("tool0", "upper-arm"))
    assert [target.path for target in character.targets] == [f"{FORE}/tool0", f"{UPPER}/CalmTarget"]
    np.testing.assert_allclose(character.targets[0].frame.position, [0.3, 0.0, 0.0])
    character, _, _ = make(targets=("upper",))
    assert [target.path for target in character.targets] == [f"{UPPER}/CalmTarget"], "the name that USD has for it"


@pytest.mark.parametrize(
    ("options", "problem", "remedy"),
    [
        ({"flexible": (FlexibleLinks("upperarm", "abs", ABS),)}, "no link", "Did you mean upper-arm?"),
        ({"targets": ("tool1",)}, "no link", "fore.arm"),
        ({"motion": MotorTracks("a.csv", TIMES, {"shoulder_pan": TIMES})}, "no joint", "Did you mean shoulder-pan?"),
        ({"flexible": (FlexibleLinks("*", "abs", ABS),) * 2}, "two patterns", "narrower"),
    ],
)
def test_names_that_nothing_has_are_refused(make, options, problem, remedy):
    with pytest.raises(ShotError) as refused:
        make(**options)
    assert problem in refused.value.problem and remedy in refused.value.remedy


def test_patterns_name_the_joints_that_are_motors(make):
    character, _, _ = make(motors=("ELB*",))
    assert [motor.path for motor in character.motors] == [ELBOW, MIMIC]
    character, _, _ = make(motors=("all",))
    assert {PAN, ELBOW} <= {motor.path for motor in character.motors}
    with pytest.raises(ShotError) as refused:
        make(motors=("elbw",))
    assert refused.value.attribute == "--motors" and "elbow" in refused.value.remedy


@pytest.mark.parametrize(("unit", "ref"), [("degree", 30.0), ("radian", np.radians(30.0))])
def test_limits_of_a_joint_of_mujoco_count_from_the_pose_of_the_file(make, unit, ref):
    joint = 'def PhysicsRevoluteJoint "elbow"\n        {'
    authored = f"uniform double mjc:ref = {ref}\nfloat physics:lowerLimit = -20\nfloat physics:upperLimit = 90\n"
    scene = f'def Scope "Scene"\n{{\nuniform token mjc:compiler:angle = "{unit}"\n}}\n'
    character, _, _ = make(lambda text: text.replace(joint, joint + "\n" + authored) + scene)
    elbow = next(joint for joint in character.joints if joint.path == ELBOW)
    np.testing.assert_allclose(np.degrees([elbow.lower, elbow.upper]), [-50.0, 60.0], rtol=1e-6)
