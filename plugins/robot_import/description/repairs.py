"""Repairs of robots that others read and the converters refuse: a copy of a URDF, and of meshes, is converted instead.

Repaired are prefixes that nothing declares, a robot without a name, joints that follow (mimic) a later one or none, and
OBJ meshes with points, normals or texture coordinates that no face, or not every face, refers to. MuJoCo's own meshes
(MSH) become OBJ. A root that floats,
or slides on a plane, becomes fixed: a shot moves a root by its transform. Capsules, which newer URDFs have, become
meshes.
"""

import math
import os
import re
import shutil
import xml.etree.ElementTree as xml
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from calmotion.errors import ShotError

from .packages import MODEL, PACKAGE, in_package


class JointFrame(NamedTuple):
    """Where a joint of a URDF is in its parent: position [m], roll, pitch, yaw [rad], axis, names of both links."""

    position: tuple[float, ...]
    angles: tuple[float, ...]
    axis: tuple[float, ...]
    parent: str
    child: str


_FOREIGN = "urn:undeclared:"
_PREFIX = re.compile(r"(?:</?|\s)([A-Za-z_][\w.-]*):[A-Za-z_][\w.-]*(?=[\s/>=])")
_ROOT = re.compile(r"<(robot|mujoco)(?=[\s/>])")
_OF_CAPSULES = ("radius", "length")
_SEGMENTS = 64  # around a capsule: its volume is 0.3% too small
_KEPT = ("usemtl", "o", "g")  # lines of an OBJ that stay as they are


def parsed(text: str) -> tuple[xml.Element, tuple[str, ...]]:
    """The root of an XML robot, its undeclared prefixes declared, and those prefixes.

    Raises:
        xml.ParseError: It is damaged in another way.
    """
    try:
        return xml.fromstring(text), ()  # nosec B314  # expat limits the expansion of entities
    except xml.ParseError as error:
        if "unbound prefix" not in str(error):
            raise
    bare = re.sub(r"<!--.*?-->|<\?.*?\?>", "", text, flags=re.DOTALL)
    declared = set(re.findall(r"xmlns:([\w.-]+)\s*=", bare)) | {"xml", "xmlns"}
    prefixes = sorted(set(_PREFIX.findall(bare)) - declared)
    names = "".join(f' xmlns:{prefix}="{_FOREIGN}{prefix}"' for prefix in prefixes)
    whole = _ROOT.sub(lambda match: match.group(0) + names, bare, count=1)
    return xml.fromstring(whole), tuple(prefixes)  # nosec B314


def faults(root: xml.Element, prefixes: Sequence[str]) -> tuple[str, ...]:
    """What of a URDF is repaired, as sentences for the user."""
    found = []
    if prefixes:
        names = ", ".join(f"{prefix}:" for prefix in prefixes)
        found.append(f"elements with the prefixes {names}, which nothing declares, are left out")
    if not root.get("name"):
        found.append("the robot has no name, and gets that of its file")
    late = [joint.get("name", "") for joint in _late_followers(root)]
    if late:
        found.append(f"joints that follow a later one are moved behind it: {', '.join(late)}")
    lost = [joint.get("name", "") for joint in _followers_of_none(root)]
    if lost:
        found.append(f"joints that follow one that is not there move by themselves: {', '.join(lost)}")
    meshes = [node.get("filename", "") for node in root.iter("mesh")]
    if any(name.startswith(f"{PACKAGE}/") for name in meshes):
        found.append(f"meshes are named with {PACKAGE}/, a slash too many")
    if any(name.startswith(PACKAGE) and not in_package(name)[1] for name in meshes):
        found.append(f"meshes that are named with {PACKAGE} and no package are those beside the robot")
    if any(name.startswith(MODEL) for name in meshes):
        found.append(f"folders of meshes that are named with {MODEL} are looked for as those of packages")
    round_ended = [link.get("name", "") for link in root.findall("link") if any(_capsules(link))]
    if round_ended:
        found.append(f"capsules become meshes: {', '.join(round_ended)}")
    loose = [joint.get("name", "") for joint in root_joints(root)]
    if loose:
        found.append(
            f"the root stands where it is: {', '.join(loose)} becomes fixed; to move it, animate the transform of the "
            "robot's first body"
        )
    return tuple(found)


def has_volume(geometry: xml.Element) -> bool:
    """Whether it is a mesh, or a shape none of whose sizes is 0: a box of no size marks a frame."""
    sizes = " ".join(shape.get(name, "") for shape in geometry for name in ("size", *_OF_CAPSULES)).split()
    return not any(re.fullmatch(r"-?0*\.?0*", size) for size in sizes)


def root_joints(root: xml.Element) -> list[xml.Element]:
    """Floating and planar joints of a URDF by which its root moves in the world."""
    children = {child.get("link") for child in root.findall("joint/child")}
    return [
        joint
        for joint in root.findall("joint")
        if joint.get("type") in ("floating", "planar")
        and (parent := joint.find("parent")) is not None
        and parent.get("link") not in children
    ]


def repaired_copy(root: xml.Element, path: str, folder: str, mesh_file: Callable[[str], str]) -> str:
    """Write a repaired URDF.

    Args:
        root: Of the robot, as `parsed` gives it; it is changed.
        path: The robot's file.
        folder: Where the copy is written.
        mesh_file: The file that the name of a mesh or texture means.

    Returns:
        The copy, which names its meshes by their whole paths.
    """
    _leave_out_foreign(root)
    _mesh_capsules(root, folder)
    for joint in root_joints(root):
        joint.set("type", "fixed")
    for joint in _followers_of_none(root):
        joint[:] = [node for node in joint if node.tag != "mimic"]
    if not root.get("name"):
        root.set("name", re.sub(r"\W", "_", Path(path).stem))
    order = {id(joint): k for k, joint in enumerate(_leaders_first(root))}
    joints = [node for node in root if node.tag == "joint"]
    places = [k for k, node in enumerate(root) if node.tag == "joint"]
    for place, joint in zip(places, sorted(joints, key=lambda node: order[id(node)]), strict=True):
        root[place] = joint
    for node in (*root.iter("mesh"), *root.iter("texture")):
        name = node.get("filename", "")
        if name and os.path.isfile(mesh_file(name)):
            node.set("filename", os.path.abspath(mesh_file(name)))
    copy = os.path.join(folder, os.path.basename(path))
    xml.ElementTree(root).write(copy, encoding="unicode")
    return copy


def _capsules(node: xml.Element) -> Iterator[tuple[xml.Element, float, float]]:
    """The geometry of each capsule below an element, with its radius and the length between its round ends [m]."""
    for geometry in node.iter("geometry"):
        capsule = geometry.find("capsule")
        try:
            radius, length = (float("nan" if capsule is None else capsule.get(name, "nan")) for name in _OF_CAPSULES)
        except ValueError:
            continue
        if 0.0 < radius < math.inf and 0.0 < length < math.inf:
            yield geometry, radius, length


def _mesh_capsules(root: xml.Element, folder: str) -> None:
    from trimesh.creation import capsule

    for number, (geometry, radius, length) in enumerate(list(_capsules(root))):
        file = os.path.abspath(os.path.join(folder, f"capsule_{number}.stl"))
        capsule(length, radius, (_SEGMENTS, _SEGMENTS)).export(file)  # about the origin, along z
        geometry[:] = [xml.Element("mesh", {"filename": file})]


def _leave_out_foreign(root: xml.Element) -> None:
    for node in root.iter():
        for child in [child for child in node if str(child.tag).startswith(f"{{{_FOREIGN}")]:
            node.remove(child)
        for name in [name for name in node.attrib if name.startswith(f"{{{_FOREIGN}")]:
            del node.attrib[name]


def _late_followers(root: xml.Element) -> list[xml.Element]:
    """Joints that follow one further down in the file."""
    joints = root.findall("joint")
    place = {joint.get("name"): k for k, joint in enumerate(joints)}
    return [joint for k, joint in enumerate(joints) if place.get(leader(joint), -1) > k]


def _followers_of_none(root: xml.Element) -> list[xml.Element]:
    """Joints that follow one that the robot does not have."""
    names = {joint.get("name") for joint in root.findall("joint")}
    return [joint for joint in root.findall("joint") if joint.find("mimic") is not None and leader(joint) not in names]


def leader(joint: xml.Element) -> str | None:
    """The joint that one follows (mimics); None where it moves by itself."""
    mimic = joint.find("mimic")
    return None if mimic is None else mimic.get("joint")


def joint_frames(root: xml.Element) -> dict[str, JointFrame]:
    """Those of the joints of a URDF whose numbers are right; the converter refuses others."""
    found = {}
    for joint in root.findall("joint"):
        origin, axis = joint.find("origin"), joint.find("axis")
        try:
            numbers = (_three(origin, "xyz"), _three(origin, "rpy"), _three(axis, "xyz", "1 0 0"))
        except ValueError:
            continue
        ends = [node.get("link", "") for tag in ("parent", "child") if (node := joint.find(tag)) is not None]
        turns = any(numbers[2]) or joint.get("type") == "fixed"
        if all(len(part) == 3 for part in numbers) and turns and len(ends) == 2:
            found[joint.get("name", "")] = JointFrame(*numbers, *ends)
    return found


def _three(node: xml.Element | None, name: str, default: str = "0 0 0") -> tuple[float, ...]:
    return tuple(float(word) for word in (default if node is None else node.get(name, default)).split())


def _leaders_first(root: xml.Element) -> Iterator[xml.Element]:
    """The joints of a robot, each behind the one that it follows, otherwise in their order."""
    joints = {joint.get("name"): joint for joint in root.findall("joint")}
    done: set[int] = set()
    for joint in root.findall("joint"):
        chain: list[xml.Element] = []
        node: xml.Element | None = joint
        while node is not None and id(node) not in done:
            chain.append(node)
            done.add(id(node))
            node = joints.get(leader(node))
        yield from reversed(chain)


def with_joined_meshes(root: xml.Element, home: str, names: Sequence[str], folder: str) -> None:
    """Let an MJCF name clean copies of OBJ meshes, each in one part: of several, a converter takes the first. MSH
    meshes, which it does not read, become OBJ.

    Args:
        root: Of the robot; it is changed.
        home: The folder of its file.
        names: Of these meshes, with or without folders.
        folder: Where the copies are written.
    """
    given = [node.get(name, "") for node in root.iter("compiler") for name in ("meshdir", "assetdir") if node.get(name)]
    meant, found = {os.path.basename(name) for name in names}, [node.get("file", "") for node in root.iter("mesh")]

    def file(name: str) -> str:
        return os.path.join(home, *given[:1], name)

    with_clean_meshes(
        root, [file(name) for name in found if os.path.basename(name) in meant or is_msh(name)], folder, file, "file",
        ("usemtl",),
    )  # fmt: skip


def with_clean_meshes(
    root: xml.Element, broken: Sequence[str], folder: str, mesh_file: Callable[[str], str],
    attribute: str = "filename", kept: Sequence[str] = _KEPT,
) -> None:  # fmt: skip
    """Let a robot name clean copies of OBJ meshes.

    Args:
        root: Of the robot; it is changed.
        broken: The meshes that cannot be converted, as files.
        folder: Where the copies are written.
        mesh_file: The file that the name of a mesh means.
        attribute: That names it.
        kept: Lines of a mesh that stay as they are.
    """
    wrong = {os.path.realpath(path) for path in broken}
    copies: dict[str, str] = {}
    for node in root.iter("mesh"):
        source = os.path.realpath(mesh_file(node.get(attribute, "")))
        if source not in wrong:
            continue
        if source not in copies:
            # a folder for each: names repeat, and materials are found beside the mesh
            place = os.path.join(folder, f"mesh_{len(copies)}")
            os.makedirs(place)
            if is_msh(source):
                copies[source] = os.path.join(place, f"{Path(source).stem}.obj")
                Path(copies[source]).write_text(obj_of_msh(source), encoding="utf-8")
                node.set(attribute, copies[source])
                continue
            copies[source] = os.path.join(place, os.path.basename(source))
            text = Path(source).read_text(encoding="utf-8", errors="replace")
            Path(copies[source]).write_text(clean_obj(text, kept), encoding="utf-8")
            for library in re.findall(r"^\s*mtllib\s+(.+?)\s*$", text, flags=re.MULTILINE):
                materials = os.path.join(os.path.dirname(source), library)
                if os.path.isfile(materials):
                    shutil.copy(materials, os.path.join(place, os.path.basename(library)))
        node.set(attribute, copies[source])


def is_msh(name: str) -> bool:
    """Whether a mesh of an MJCF is in MuJoCo's own format."""
    return name.lower().endswith(".msh")


def msh_names(roots: Iterable[xml.Element]) -> list[str]:
    """Names of the meshes of an MJCF's files that are in MuJoCo's own format."""
    names = (node.get("file", "") for root in roots for node in root.iter("mesh"))
    return [os.path.basename(name) for name in names if is_msh(name)]


def obj_of_msh(path: str) -> str:
    """The points and faces of a mesh in MuJoCo's own format, as an OBJ.

    Source: MuJoCo, XML reference, mesh: numbers of points, normals, texture coordinates and faces (int32); then these.

    Raises:
        ShotError: It is none.
    """
    data = Path(path).read_bytes()
    counts = np.frombuffer(data[:16], "<i4") if len(data) >= 16 else np.zeros(4, np.int32)
    points, normals, textures, faces = (int(count) for count in counts)
    expected = 16 + 4 * (3 * points + 3 * normals + 2 * textures + 3 * faces)
    if counts.min() < 0 or points == 0 or faces == 0 or len(data) != expected:
        raise ShotError(
            "this is no mesh with faces in MuJoCo's own format (MSH)",
            path=path,
            found=f"{len(data)} bytes for {points} points and {faces} faces",
            remedy="Write it as .stl or .obj, and name that in the robot",
        )
    corners = np.frombuffer(data, "<f4", 3 * points, 16).reshape(-1, 3)
    triangles = np.frombuffer(data[-12 * faces :], "<i4").reshape(-1, 3) + 1
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners.tolist()]
    return clean_obj("\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in triangles.tolist())]))


def clean_obj(text: str, kept: Sequence[str] = _KEPT) -> str:
    """An OBJ with the same faces and materials, whose points all belong to faces, without normals and textures."""
    points: list[str] = []
    numbers: dict[int, int] = {}
    lines: list[str] = []
    for line in text.replace("\\\n", " ").splitlines():
        kind, _, rest = line.strip().partition(" ")
        if kind == "v":
            points.append(" ".join(rest.split()[:3]))
        elif kind == "f":
            corners = [int(word.split("/")[0]) for word in rest.split()]
            corners = [corner - 1 if corner > 0 else len(points) + corner for corner in corners]
            if len(set(corners)) > 2 and all(0 <= corner < len(points) for corner in corners):
                lines.append("f " + " ".join(str(numbers.setdefault(c, len(numbers) + 1)) for c in corners))
        elif kind == "mtllib":
            lines.insert(0, f"mtllib {os.path.basename(rest.strip())}")
        elif kind in kept:
            lines.append(line.strip())
    return "\n".join([*(f"v {points[index]}" for index in numbers), *lines]) + "\n"
