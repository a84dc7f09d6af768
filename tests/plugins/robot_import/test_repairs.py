"""Repairs of what converters refuse: the copies say the same as the robot."""

import os
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
import pytest
import trimesh
from calmotion.errors import ShotError
from calmotion_plugins.robot_import import robot as importing
from calmotion_plugins.robot_import.converters import BrokenMeshes
from calmotion_plugins.robot_import.description.descriptions import read_description, repaired
from calmotion_plugins.robot_import.description.repairs import clean_obj, parsed
from converted_arm import CONVERTED

LINK = '<link name="{0}"><visual><geometry><mesh filename="{1}"/></geometry></visual>'
LINK += '<inertial><mass value="1"/></inertial></link>'
JOINT = '<joint name="{0}" type="continuous"><parent link="{1}"/><child link="{2}"/>{3}</joint>'
MIMIC = '<mimic joint="{0}" multiplier="2"/>'
CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
OBJ = {
    "loose points": "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 2 4 3\nf 2 3 5\nf 3 4 5\nf 4 2 5\n",
    "normals of some faces": f"{CORNERS}vn 0 0 -1\nf 1//1 3//1 2//1\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    "counted from the end": f"{CORNERS}f -4 -2 -3\nf -4 -3 -1\nf -3 -2 -1\nf -2 -4 -1\n",
    "faces that are lines": f"{CORNERS}f 1 2\nf 1 3 2\nf 1 1 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nl 1 2\n",
}


def written(tmp_path, body, name='name="arm"'):
    (tmp_path / "part.obj").write_text(OBJ["loose points"])
    robot = tmp_path / "arm.urdf"
    robot.write_text(f"<robot {name}>{body}</robot>")
    return robot


def chain():
    """Followers stand before their leaders: c follows b, which follows a."""
    links = "".join(LINK.format(name, "part.obj") for name in "uvwx")
    joints = (("c", "w", "x", MIMIC.format("b")), ("b", "v", "w", MIMIC.format("a")), ("a", "u", "v", ""))
    return links + "".join(JOINT.format(*joint) for joint in joints)


def copy_of(robot: Path, folder: Path, broken=()):
    description = read_description(str(robot), {})
    folder.mkdir()
    return description, xml.parse(repaired(description, str(folder), broken).path).getroot()


def test_joints_stand_behind_those_that_they_follow(tmp_path):
    description, root = copy_of(written(tmp_path, chain()), tmp_path / "copy")
    assert [joint.get("name") for joint in root.findall("joint")] == ["a", "b", "c"]
    assert "c, b" in description.faults[0]
    mesh = root.find("link/visual/geometry/mesh").get("filename")
    assert os.path.isabs(mesh) and os.path.samefile(mesh, tmp_path / "part.obj")


def test_a_joint_that_follows_one_that_is_not_there_moves_by_itself(tmp_path):
    body = chain().replace('mimic joint="b"', 'mimic joint="gone"')
    description, root = copy_of(written(tmp_path, body), tmp_path / "copy")
    assert [joint.get("name") for joint in root.findall("joint") if joint.find("mimic") is not None] == ["b"]
    assert any("not there" in fault and fault.endswith(": c") for fault in description.faults)


@pytest.mark.parametrize(
    ("prefix", "told"),
    [
        ("package:///FOLDER/", "a slash too many"),
        ("model://FOLDER/", "as those of packages"),
        ("package://", "and no package are those beside the robot"),
    ],
)
def test_a_package_with_a_slash_too_many_of_gazebo_or_without_a_name_is_found(tmp_path, prefix, told):
    robot = written(tmp_path, LINK.format("a", f"{prefix.replace('FOLDER', tmp_path.name)}part.obj"))
    description, root = copy_of(robot, tmp_path / "copy")
    assert told in description.faults[0]
    assert os.path.samefile(root.find("link/visual/geometry/mesh").get("filename"), tmp_path / "part.obj")


def test_a_robot_without_links_is_refused(tmp_path):
    with pytest.raises(ShotError, match="has no links"):
        read_description(str(written(tmp_path, "")), {})


def test_a_robot_gets_the_name_of_its_file(tmp_path):
    description, root = copy_of(written(tmp_path, LINK.format("a", "part.obj"), ""), tmp_path / "copy")
    assert root.get("name") == "arm" and "no name" in description.faults[0]


def test_elements_with_a_prefix_that_nothing_declares_are_left_out(tmp_path):
    body = f'<drake:diff/>{LINK.format("a", "part.obj")}<!-- odd:one --><joint name="j" drake:x="1" type="fixed"/>'
    description, root = copy_of(written(tmp_path, body), tmp_path / "copy")
    assert "drake:" in description.faults[0] and "odd" not in description.faults[0]
    assert [node.tag for node in root] == ["link", "joint"] and set(root.find("joint").attrib) == {"name", "type"}


@pytest.mark.parametrize("kind", ["floating", "planar"])
def test_a_root_that_floats_becomes_fixed_but_no_other_joint(tmp_path, kind):
    body = chain().replace('name="a" type="continuous"', f'name="a" type="{kind}"')
    description, root = copy_of(written(tmp_path, body), tmp_path / "copy")
    assert [joint.get("type") for joint in root.findall("joint")] == ["fixed", "continuous", "continuous"]
    assert any("a becomes fixed" in fault for fault in description.faults)
    inner = chain().replace('name="c" type="continuous"', f'name="c" type="{kind}"')
    with pytest.raises(ShotError, match=f"a {kind} joint is not supported"):
        read_description(str(written(tmp_path, inner)), {})


def test_capsules_become_meshes_of_their_size(tmp_path):
    capsule = '<link name="c"><visual><geometry><capsule radius="0.02" length="0.2"/></geometry></visual></link>'
    description, root = copy_of(written(tmp_path, capsule), tmp_path / "copy")
    assert any("capsules become meshes: c" in told for told in description.faults)
    mesh = trimesh.load_mesh(root.find("link/visual/geometry/mesh").get("filename"))
    assert mesh.bounds == pytest.approx(np.array([(-0.02, -0.02, -0.12), (0.02, 0.02, 0.12)]), abs=1e-8)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(np.pi * 0.02**2 * 0.2 + 4 / 3 * np.pi * 0.02**3, rel=3e-3)


def test_a_damaged_file_is_not_repaired():
    with pytest.raises(xml.ParseError):
        parsed("<robot><link></robot>")


def test_nothing_is_repaired_of_a_sound_robot(tmp_path):
    assert read_description(str(written(tmp_path, LINK.format("a", "part.obj"))), {}).faults == ()


@pytest.mark.parametrize("name", OBJ)
def test_a_clean_mesh_is_the_same_solid(name):
    text = clean_obj(OBJ[name])
    mesh = trimesh.load(trimesh.util.wrap_as_stream(text), file_type="obj", process=False)
    assert mesh.volume == pytest.approx(1 / 6) and len(mesh.vertices) == 4 and len(mesh.faces) == 4
    assert "vn" not in text and text.count("v ") == 4


def test_a_clean_mesh_keeps_its_materials_and_polygons():
    text = clean_obj(f"mtllib some/colors.mtl\n{CORNERS}v 1 1 0\nusemtl red\nf 1/1 2/2 5/3 3/4\n")
    assert text.splitlines()[0] == "v 0 0 0" and "mtllib colors.mtl" in text and "usemtl red\nf 1 2 3 4" in text


def test_a_robot_is_converted_again_with_clean_meshes(tmp_path, monkeypatch):
    robot, seen = written(tmp_path, chain()), []

    def convert(description, output, python):
        root = xml.parse(description.path).getroot()
        meshes = {mesh.get("filename") for mesh in root.iter("mesh")}
        seen.append(meshes)
        Path(output).mkdir()
        if any(os.path.samefile(mesh, tmp_path / "part.obj") for mesh in meshes):
            raise BrokenMeshes(description.path, [str(tmp_path / "part.obj")])
        assert all(len(trimesh.load(mesh).vertices) == 4 for mesh in meshes)
        Path(output, "arm.usda").write_text(CONVERTED)
        return str(Path(output, "arm.usda")), ()

    monkeypatch.setattr(importing, "convert", convert)
    monkeypatch.setattr(importing, "converter_python", lambda named, tell: "python")
    made = importing.import_robot(robot, layer=tmp_path / "shot.usda", solid="abs")
    assert len(seen) == 2 and any("part.obj" in note for note in made.notes)
    assert any("moved behind it" in note for note in made.notes)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["arm.urdf", "part.obj", "shot.usda", "shot_robot"]
