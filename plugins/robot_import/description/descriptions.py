"""URDF and MJCF files before they are converted: what a converter would leave out silently is refused here."""

import os
import xml.etree.ElementTree as xml
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from calmotion.errors import ShotError, raise_all
from calmotion.support import nearest, refuse_lfs_pointers, refuse_special, remedy_for

from .attributes import Element, judged
from .mjcf import (
    elements,
    locks,
    nested_copy,
    parts,
    refuse_missing_meshes,
    refuse_other_compilers,
    several_joints,
)
from .packages import in_package, mesh_file, package_folder
from .repairs import (
    JointFrame,
    faults,
    has_volume,
    joint_frames,
    leader,
    msh_names,
    parsed,
    repaired_copy,
    root_joints,
    with_clean_meshes,
)

URDF, MJCF, USD = "urdf", "mjcf", "usd"
_JOINTS = ("revolute", "continuous", "prismatic", "fixed")
_ONCE = ("inertial", "parent", "child", "origin", "axis", "limit", "mimic", "dynamics", "safety_controller")
_SHOWN = 4  # missing files in a message


@dataclass(frozen=True)
class Description:
    """A robot's file.

    Attributes:
        path: The file.
        kind: `URDF`, `MJCF` or `USD`.
        packages: Folders of the ROS packages that it names.
        efforts: Largest effort of each joint of a URDF, where it is positive [N m or N].
        without_mass: Links of a URDF with geometry and without inertia.
        massless: Links of a URDF whose mass is 0, and those with neither inertia nor geometry: frames.
        centred: Links of a URDF whose inertia has no origin: their centre of mass is that of the link's frame.
        frames: Of each joint of a URDF.
        unread: What of the robot is not read, as sentences for the user.
        locks: Joints of an MJCF that an equality holds at one value [rad or m].
        soft_limits: Narrower limits of joints of a URDF, which its safety controllers keep [rad or m].
        original: The file of which this one is a repaired copy; empty where it is none.
        faults: What is repaired in a copy before it is converted, as sentences for the user.
    """

    path: str
    kind: str
    packages: Mapping[str, str] = field(default_factory=dict)
    efforts: Mapping[str, float] = field(default_factory=dict)
    without_mass: tuple[str, ...] = ()
    massless: tuple[str, ...] = ()
    centred: tuple[str, ...] = ()
    frames: Mapping[str, JointFrame] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    unread: tuple[str, ...] = ()
    locks: Mapping[str, float] = field(default_factory=dict)
    soft_limits: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    original: str = ""

    @property
    def shown(self) -> str:
        """The file that the user knows."""
        return self.original or self.path


def read_description(path: str, packages: Mapping[str, str]) -> Description:
    """Read and check the file of a robot.

    Args:
        path: A .urdf or .xml file.
        packages: Folders of ROS packages by name; others are looked for above the file.

    Raises:
        ShotError: It is neither URDF nor MJCF, is a xacro, or a mesh is missing or a pointer of Git LFS.
    """
    root, prefixes = _root(path)
    if root.tag == "mujoco":
        files = parts(root, path, lambda file: _root(file)[0])
        listed = elements(files)
        unread = judged(MJCF, listed)
        refuse_missing_meshes(files)
        refuse_other_compilers(files)
        told = {
            "joints of one body are those of bodies one inside the other": several_joints(files),
            "meshes in MuJoCo's own format become OBJ": msh_names(part.root for part in files),
        }
        changes = tuple(f"{what}: {', '.join(names)}" for what, names in told.items() if names)
        return Description(path, MJCF, unread=unread, locks=locks(listed), faults=changes)
    if root.tag != "robot":
        raise ShotError(
            "this is neither a URDF nor an MJCF robot",
            path=path,
            found=f"<{root.tag}>",
            remedy="Name a .urdf file, an .xml file of MuJoCo, or a USD file",
        )
    name = os.path.basename(path)
    made = "robot.urdf" if name != "robot.urdf" else "expanded.urdf"  # never over what is read
    macro = next((text for node in root.iter() if (text := _macro(node))), None)
    if macro is not None:
        raise ShotError(
            "this is a xacro, from which a URDF is made first",
            path=path,
            found=macro,
            remedy=f"Run `xacro {name} > {made}`, and import {made}",
        )
    if root.find("link") is None:
        raise ShotError(
            "the robot has no links",
            path=path,
            found="<robot> without <link>",
            remedy="Name the file that describes the whole robot; from a .xacro, `xacro FILE > robot.urdf` makes it",
        )
    _refuse_repeated(root, path)
    _refuse_other_joints(root, path)
    _refuse_several_roots(root, path)
    _refuse_circular_followers(root, path)
    found = _packages(root, path, packages)
    _refuse_missing_meshes(root, path, found)
    refuse_lfs_pointers((mesh_file(name, path, found) for _, name in _meshes(root)), path=path, attribute="mesh")
    links = root.findall("link")
    shaped = {link for link in links if any(map(has_volume, link.iter("geometry")))}
    without = {link for link in links if link.find("inertial") is None}
    centred = {link for link in links if link.find("inertial") is not None and link.find("inertial/origin") is None}
    weightless = {link for link in links if _number(link.find("inertial/mass"), "value", 1.0) == 0.0}
    return Description(
        path, URDF, found, _efforts(root), _names(without & shaped), _names(weightless | (without - shaped)),
        _names(centred), joint_frames(root), faults(root, prefixes), judged(URDF, _elements(root, path)),
        soft_limits=_soft_limits(root),
    )  # fmt: skip


def repaired(description: Description, folder: str, broken_meshes: Sequence[str] = ()) -> Description:
    """A description of a repaired copy of a URDF, or of an MJCF with several joints in a body.

    Args:
        description: The robot.
        folder: An empty one, for the copy.
        broken_meshes: OBJ files that cannot be converted as they are.
    """
    root, _ = _root(description.path)
    given = description.shown
    if description.kind == MJCF:
        copy = nested_copy(root, description.path, folder, lambda file: _root(file)[0], broken_meshes)
        return replace(description, path=copy, original=given)

    def file(name: str) -> str:
        return mesh_file(name, description.path, description.packages)

    with_clean_meshes(root, broken_meshes, folder, file)
    return replace(description, path=repaired_copy(root, description.path, folder, file), original=given)


def _macro(node: xml.Element) -> str | None:
    """What of an element a xacro has and a URDF has not: its own tag, or an expression in an attribute."""
    if "xacro" in str(node.tag):
        return f"<xacro:{str(node.tag).rpartition('}')[2].rpartition(':')[2]}>"
    return next((f'{name}="{value}"' for name, value in node.items() if "${" in value or "$(" in value), None)


def _refuse_repeated(root: xml.Element, path: str) -> None:
    """Refuse what a link or a joint says twice in different ways: readers of URDF differ in which one counts."""
    problems = []
    for owner in (*root.findall("link"), *root.findall("joint")):
        for tag in dict.fromkeys(str(part.tag) for part in owner):
            given = (
                {xml.canonicalize(xml.tostring(part), strip_text=True) for part in owner.findall(tag)}
                if tag in _ONCE
                else set()
            )
            if len(given) > 1:
                found = f"{len(given)} of {owner.get('name')}"
                problems.append(
                    ShotError(f"a {owner.tag} has several", path=path, attribute=tag, found=found, remedy="Leave one")
                )
    raise_all(problems)


def _refuse_other_joints(root: xml.Element, path: str) -> None:
    """Refuse joints that no motor of Calmotion can be, and which a converter drops."""
    loose = root_joints(root)
    problems = [
        ShotError(
            f"a {joint.get('type')} joint is not supported",
            path=path,
            attribute=joint.get("name", "joint"),
            found=joint.get("type"),
            remedy=f"Write one of {', '.join(_JOINTS)}",
        )
        for joint in root.findall("joint")
        if joint.get("type") not in _JOINTS and joint not in loose
    ]
    raise_all(problems)


def _refuse_several_roots(root: xml.Element, path: str) -> None:
    """Refuse links that no joint ties to the first root, and which a converter drops with all that they carry."""
    children = {child.get("link") for child in root.findall("joint/child")}
    roots = [name for link in root.findall("link") if (name := link.get("name", "")) not in children]
    if len(roots) > 1:
        raise ShotError(
            "the robot has several roots, of which only one would be kept",
            path=path,
            attribute="link",
            found=", ".join(roots[:_SHOWN]) + (", ..." if len(roots) > _SHOWN else ""),
            remedy="Tie them to each other by fixed joints, or write a file for each robot",
        )


def _refuse_circular_followers(root: xml.Element, path: str) -> None:
    """Refuse joints that follow (mimic) themselves, directly or by others: nothing would move them."""
    leaders = {joint.get("name"): leader(joint) for joint in root.findall("joint")}
    for name in leaders:
        chain = [name]
        while (following := leaders.get(chain[-1])) is not None and following not in chain:
            chain.append(following)
        if following == name:
            raise ShotError(
                "joints follow each other in a circle",
                path=path,
                attribute="mimic",
                found=" -> ".join(str(joint) for joint in (*chain, name)),
                remedy="Remove the <mimic> of the joint that the others follow",
            )


def _root(path: str) -> tuple[xml.Element, tuple[str, ...]]:
    """The root, and prefixes that nothing declares."""
    try:
        refuse_special(path)
        try:
            return xml.parse(path).getroot(), ()  # nosec B314  # expat limits the expansion of entities
        except xml.ParseError as error:
            if "unbound prefix" not in str(error):
                raise
            return parsed(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise ShotError(
            "the robot cannot be read", path=path, found=error.strerror, remedy="Check the path of the file"
        ) from error
    except (xml.ParseError, UnicodeDecodeError, ValueError) as error:
        raise ShotError(
            "the robot is no XML file, or it is damaged",
            path=path,
            found=error,
            remedy=remedy_for(path, URDF) or "Name a .urdf file, or an .xml file of MuJoCo",
        ) from error


def _meshes(root: xml.Element) -> Iterator[tuple[str, str]]:
    """Link and file name of each mesh."""
    for link in root.findall("link"):
        for mesh in link.iter("mesh"):
            yield link.get("name", ""), mesh.get("filename", "")


def _elements(node: xml.Element, path: str, place: str = "", about: str = "") -> Iterator[Element]:
    """The elements of a URDF; a parameter is named by its name."""
    for child in node:
        tag = child.get("name", "") if child.tag == "param" else str(child.tag)
        here = f"{place}/{tag}".lstrip("/")
        name = about or child.get("name") or child.get("reference") or ""
        yield Element(here, name, path, child.attrib)
        yield from _elements(child, path, here, name)


def _soft_limits(root: xml.Element) -> dict[str, tuple[float, float]]:
    found = {}
    for joint in root.findall("joint"):
        node = joint.find("safety_controller")
        low, high = (_number(node, f"soft_{end}_limit", 0.0) for end in ("lower", "upper"))
        if low < high:
            found[joint.get("name", "")] = (low, high)
    return found


def _packages(root: xml.Element, path: str, given: Mapping[str, str]) -> dict[str, str]:
    """The packages that meshes name, each with its folder.

    Raises:
        ShotError: One is given that is no folder, or one is not found.
    """
    named = {package for package, rest in (in_package(name) for _, name in _meshes(root)) if rest}
    problems, found = [], {}
    for name in sorted(named):
        folder = given.get(name) or package_folder(name, path)
        if folder is None or not os.path.isdir(folder):
            problems.append(
                ShotError(
                    "the folder of a ROS package is not known" if folder is None else "this is no folder",
                    path=path,
                    attribute=f"package://{name}",
                    found=folder,
                    remedy=f"{nearest(name, given)}Name it: --package {name}=FOLDER",
                )
            )
        else:
            found[name] = os.path.abspath(folder)
    raise_all(problems)
    return found


def _refuse_missing_meshes(root: xml.Element, path: str, packages: Mapping[str, str]) -> None:
    missing = [(link, name) for link, name in _meshes(root) if not os.path.isfile(mesh_file(name, path, packages))]
    if missing:
        shown = "; ".join(f"{name} of {link}" for link, name in missing[:_SHOWN])
        more = f"; {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else ""
        raise ShotError(
            "meshes of the robot are missing",
            path=path,
            attribute="mesh",
            found=shown + more,
            remedy="Put the files there, or name the folder of their package: --package NAME=FOLDER",
        )


def _efforts(root: xml.Element) -> dict[str, float]:
    efforts = {}
    for joint in root.findall("joint"):
        effort = _number(joint.find("limit"), "effort", 0.0)
        if 0.0 < effort < float("inf"):
            efforts[joint.get("name", "")] = effort
    return efforts


def _names(links: Iterable[xml.Element]) -> tuple[str, ...]:
    return tuple(sorted(link.get("name", "") for link in links))


def _number(node: xml.Element | None, name: str, default: float) -> float:
    """The value of an attribute; the default where there is none, or no number."""
    try:
        return default if node is None else float(node.get(name, default))
    except ValueError:
        return default
