"""URDF and MJCF files before they are converted."""

import os

import pytest
from calmotion.errors import ShotError
from calmotion_plugins.robot_import.description.descriptions import read_description

BOX = '<geometry><box size="1 1 1"/></geometry>'
MASS = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
JOINT = (
    '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><limit lower="-1" upper="1" effort="7" '
    'velocity="2"/></joint>'
)


def urdf(mesh=BOX, inertial=MASS, joint=JOINT):
    link = f'<link name="b"><visual>{mesh}</visual>{inertial}</link>'
    return f'<robot name="r"><link name="a"/>{link}{joint}</robot>'


@pytest.fixture
def read(tmp_path):
    def run(text, packages=None, folder="my_robot/urdf"):
        file = tmp_path / folder / "robot.urdf"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return read_description(str(file), packages or {})

    return run


def mesh(name):
    return f'<geometry><mesh filename="{name}"/></geometry>'


def test_efforts_and_links_without_inertia_are_found(read):
    found = read(urdf(inertial=""))
    assert found.kind == "urdf" and found.efforts == {"j": 7.0} and found.without_mass == ("b",)
    assert read(urdf(joint=JOINT.replace('"7"', '"0"'))).efforts == {}
    assert read(urdf(inertial=MASS.replace('value="1"', 'value="0.0"'))).massless == ("a", "b")
    assert found.massless == ("a",), "a frame"
    assert read(urdf('<geometry><box size="0 0 0"/></geometry>', inertial="")).massless == ("a", "b"), "of no size"
    assert read('<mujoco model="m"><worldbody/></mujoco>').kind == "mjcf"
    assert read(urdf(inertial=MASS + MASS)).massless == ("a",), "said twice in the same way"


@pytest.mark.parametrize("name", ["package://my_robot/meshes/b.stl", "../meshes/b.stl", "file://../meshes/b.stl"])
def test_meshes_are_found_beside_the_file_and_in_its_package(read, tmp_path, name):
    (tmp_path / "my_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "my_robot" / "meshes" / "b.stl").touch()
    packages = read(urdf(mesh(name))).packages
    assert packages == ({"my_robot": str(tmp_path / "my_robot")} if "package" in name else {})


def test_a_package_stands_beside_a_folder_above_or_is_named(read, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "b.stl").touch()
    text = urdf(mesh("package://parts/b.stl"))
    assert read(text).packages == {"parts": str(tmp_path / "parts")}
    text = text.replace("parts", "others")
    assert read(text, {"others": str(tmp_path / "parts")}).packages == {"others": str(tmp_path / "parts")}
    with pytest.raises(ShotError) as refused:
        read(text)
    assert "--package others=FOLDER" in refused.value.remedy
    with pytest.raises(ShotError, match="no folder"):
        read(text, {"others": str(tmp_path / "none")})


@pytest.mark.parametrize("variable", ["", "ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"])
def test_a_package_is_known_by_its_manifest_and_by_ros(read, tmp_path, monkeypatch, variable):
    """An archive from GitHub unpacks to another folder, and a workspace may be elsewhere."""
    place = {"": "arm-main", "ROS_PACKAGE_PATH": "ws/arm-main", "AMENT_PREFIX_PATH": "ws/share/arm"}[variable]
    (tmp_path / place).mkdir(parents=True)
    (tmp_path / place / "b.stl").touch()
    (tmp_path / place / "package.xml").write_text("<package><name> arm </name></package>")
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "package.xml").write_text("<package><name>arm")
    if variable:
        monkeypatch.setenv(variable, f"{tmp_path / 'none'}{os.pathsep}{tmp_path / 'ws'}")
    assert read(urdf(mesh("package://arm/b.stl"))).packages == {"arm": str(tmp_path / place)}


REFUSED = {
    "two inertias of one link": (urdf(inertial=MASS + MASS.replace('mass value="1"', 'mass value="3"')), "inertial"),
    "two axes of one joint": (
        urdf(joint=JOINT.replace("<limit", '<axis xyz="0 0 1"/><axis xyz="1 0 0"/><limit')), "axis"),
    "a mesh that is missing": (urdf(mesh("b.stl")), "b.stl of b"),
    "a xacro": (urdf().replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"').replace(
        '<link name="a"/>', '<xacro:arm/><link name="a"/>'), "<xacro:arm>"),
    "what xacro has not found": (urdf(mesh("$(find arm)/b.stl")), "Run `xacro"),
    "a link that no joint ties": (urdf().replace("</robot>", '<link name="c"/></robot>'), "a, c"),
    "a joint that follows itself": (urdf(joint=JOINT.replace("<limit", '<mimic joint="j"/><limit')), "j -> j"),
    "joints that follow each other": (
        urdf(joint=JOINT.replace("<limit", '<mimic joint="k"/><limit') + JOINT.replace('"j"', '"k"').replace(
            '"b"', '"c"').replace("<limit", '<mimic joint="j"/><limit') + '<link name="c"/>'), "j -> k -> j"),
    "another file": ("<svg/>", "neither a URDF nor an MJCF"),
    "no XML": ("hello", "no XML file"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_converted_is_refused(read, name):
    text, problem = REFUSED[name]
    with pytest.raises(ShotError) as refused:
        read(text)
    assert problem in refused.value.message() and refused.value.remedy


def test_a_file_that_is_missing_is_refused(tmp_path):
    with pytest.raises(ShotError, match="cannot be read"):
        read_description(str(tmp_path / "none.urdf"), {})


@pytest.mark.posix
@pytest.mark.parametrize(
    "where", ["beside", "in a folder of meshes", "in a file that is included", "as the included file"]
)
def test_a_pipe_in_the_place_of_a_file_of_an_mjcf_robot_is_refused(tmp_path, where):
    (tmp_path / "meshes").mkdir()
    for folder in (tmp_path, tmp_path / "meshes"):
        os.mkfifo(folder / "pipe.stl")
    asset = '<asset><mesh name="m" file="pipe.stl"/></asset>'
    texts = {
        "beside": asset,
        "in a folder of meshes": f'<compiler meshdir="meshes"/>{asset.replace("pipe", "./pipe")}',
        "in a file that is included": '<include file="part.xml"/>',
        "as the included file": '<include file="pipe.stl"/>',
    }
    (tmp_path / "part.xml").write_text(f'<mujoco><include file="robot.xml"/>{asset}</mujoco>')
    (tmp_path / "robot.xml").write_text(f"<mujoco>{texts[where]}</mujoco>")
    with pytest.raises(ShotError, match="named pipe"):
        read_description(str(tmp_path / "robot.xml"), {})


def test_files_of_an_mjcf_robot_are_allowed_also_if_they_include_each_other(tmp_path):
    (tmp_path / "robot.xml").write_text('<mujoco><include file="robot.xml"/><include file="none.xml"/></mujoco>')
    assert read_description(str(tmp_path / "robot.xml"), {}).kind == "mjcf"


def test_a_shot_in_the_place_of_a_robot_needs_no_import(tmp_path):
    (tmp_path / "shot.usda").write_text('#usda 1.0\ndef Xform "Robot" {}\n')
    with pytest.raises(ShotError, match="It needs no import"):
        read_description(str(tmp_path / "shot.usda"), {})


def test_a_named_pipe_is_refused(tmp_path):
    os.mkfifo(tmp_path / "robot.urdf")
    with pytest.raises(ShotError) as error:
        read_description(str(tmp_path / "robot.urdf"), {})
    assert "named pipe" in error.value.message()


LFS = "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n"
MJCF = '<mujoco model="m">{}<worldbody><body><geom type="mesh" mesh="b"/></body></worldbody></mujoco>'
ASSET = '<asset><mesh name="b" file="b.stl"/></asset>'
COMPILER = '<compiler meshdir="../meshes"/>'


@pytest.mark.parametrize(
    ("text", "pointer"),
    [
        (urdf(mesh("../meshes/b.stl")), "meshes/b.stl"),
        (urdf(mesh("package://my_robot/meshes/b.dae")), "meshes/b.dae"),
        (urdf(mesh("b.obj")).replace("visual>", "collision>"), "urdf/b.obj"),
        (MJCF.format(ASSET), "urdf/b.stl"),
        (MJCF.format(COMPILER + ASSET), "meshes/b.stl"),
        (MJCF.format('<compiler assetdir="../meshes"/>' + ASSET.replace("stl", "obj")), "meshes/b.obj"),
        (MJCF.format('<asset><hfield name="b" file="b.png"/></asset>'), "urdf/b.png"),
        (MJCF.format('<include file="inner.xml"/>'), "urdf/inner.xml"),
        (MJCF.format(f'{COMPILER}<include file="assets.xml"/>'), "meshes/b.stl"),
        (LFS, "urdf/robot.urdf"),
    ],
)
def test_pointers_of_git_lfs_are_refused(read, tmp_path, text, pointer):
    file = tmp_path / "my_robot" / pointer
    for folder in (file.parent, tmp_path / "my_robot" / "urdf"):
        folder.mkdir(parents=True, exist_ok=True)
    (tmp_path / "my_robot" / "urdf" / "assets.xml").write_text(f"<mujocoinclude>{ASSET}</mujocoinclude>")
    file.write_text(LFS)
    with pytest.raises(ShotError, match="Git LFS pointer") as refused:
        read(text)
    assert file.name in f"{refused.value.found} {refused.value.path}" and "git lfs pull" in refused.value.remedy


def test_a_picture_that_is_a_pointer_of_git_lfs_changes_no_motion(read, tmp_path):
    (tmp_path / "my_robot" / "urdf").mkdir(parents=True)
    (tmp_path / "my_robot" / "urdf" / "wood.png").write_text(LFS)
    assert read(MJCF.format('<asset><texture type="2d" file="wood.png"/></asset>')).kind == "mjcf"
