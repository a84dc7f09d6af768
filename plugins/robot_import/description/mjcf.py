"""The elements of an MJCF robot: those of the files that it includes too, each with what its default class gives it."""

import os
import xml.etree.ElementTree as xml
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from calmotion.errors import ShotError
from calmotion.support import is_special, refuse_lfs_pointers

from .attributes import Element
from .repairs import with_joined_meshes

_JOINTS = ("joint", "freejoint")
_PLACES = ("pos", "quat", "axisangle", "xyaxes", "zaxis", "euler")
_LIGHT, _LIGHT_INERTIA = "1e-9", "1e-13"  # of a body between two joints [kg], [kg m^2]
_INNER = ("body", "frame", "replicate")  # what contains bodies
_FOLDERS = ("meshdir", "texturedir", "assetdir")
_ANGLES = {"angle": "degree", "eulerseq": "xyz"}  # what a compiler says of angles, and takes where it says nothing
_SHOWN = 4  # missing files in a message
_MAIN = "main"  # the default class of what names none
_ACTUATOR = "general"
_ACTUATORS = (
    "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion", "dcmotor", "pid",
    "orientation",
)  # fmt: skip
_SECTIONS = {"actuator": _ACTUATOR, "equality": "equality", "tendon": "tendon"}  # tags of the defaults of what is there
_WITH_CLASS = ("body", "body/frame", "body/replicate", "asset", "contact")

Settings = dict[str, dict[str, str]]  # attributes by tag


@dataclass(frozen=True)
class Part:
    """A file of a robot: its own, or one that it includes."""

    root: xml.Element
    path: str


def parts(root: xml.Element, path: str, parse: Callable[[str], xml.Element]) -> list[Part]:
    """The files of a robot, each included one behind the one that includes it.

    Args:
        root: Of the robot.
        path: Its file.
        parse: Gives the root of another file.

    Raises:
        ShotError: A named pipe or the like, for which a converter would wait for ever; a pointer of Git LFS.
    """
    return list(_parts(root, path, parse, frozenset(), ()))


def _parts(
    root: xml.Element, path: str, parse: Callable[[str], xml.Element], seen: frozenset[str], outer: Sequence[str]
) -> Iterator[Part]:
    """Those of a file.

    Args:
        seen: Files that include this one.
        outer: Folders where these look for files.
    """
    yield Part(root, path)
    here = os.path.dirname(os.path.abspath(path))
    own = [here, *(os.path.join(here, node.get(name, "")) for node in root.iter("compiler") for name in _FOLDERS)]
    folders, files = [*own, *outer], []
    for node in root.iter():
        for name in (value for key, value in node.items() if key == "file" or key.startswith("file")):
            for file in dict.fromkeys(os.path.join(folder, name) for folder in folders):
                if is_special(file):
                    raise ShotError(
                        "this is not a file but a named pipe, a socket or a device",
                        path=path,
                        attribute=f"{node.tag}.file",
                        found=name,
                        remedy="Name a file",
                    )
                if node.tag != "texture":  # a picture changes no motion
                    files.append(file)
                if node.tag in ("include", "model") and os.path.isfile(file) and file not in seen:
                    yield from _parts(parse(file), file, parse, seen | {file}, folders)
    refuse_lfs_pointers(files, path=path, attribute="file")


def refuse_missing_meshes(found: Sequence[Part]) -> None:
    """Refuse meshes whose files are in none of the folders that a robot names.

    Raises:
        ShotError: With the files.
    """
    compilers = [(part, node) for part in found for node in part.root.iter("compiler")]
    bare = any(node.get("strippath") == "true" for _, node in compilers)
    named = [node.get(name, "") for _, node in compilers for name in _FOLDERS]
    homes = dict.fromkeys(os.path.dirname(os.path.abspath(part.path)) for part in found)
    folders = [os.path.join(home, folder) for home in homes for folder in ("", *named)]
    files = {
        os.path.basename(file) if bare else file: part
        for part in found
        for node in part.root.iter("mesh")
        if (file := node.get("file"))
    }
    lost = [file for file in files if not any(os.path.exists(os.path.join(folder, file)) for folder in folders)]
    if lost:
        more = f"; {len(lost) - _SHOWN} more" if len(lost) > _SHOWN else ""
        raise ShotError(
            "meshes of the robot are missing",
            path=files[lost[0]].path,
            attribute="mesh.file",
            found="; ".join(lost[:_SHOWN]) + more,
            remedy=f"Put the files into {next(filter(None, named), 'the folder of the robot')}, or correct meshdir of "
            "<compiler>",
        )


def refuse_other_compilers(found: Sequence[Part]) -> None:
    """Refuse robots within a robot that count angles in another way: a converter reads them as those of the first file.

    Raises:
        ShotError: There is one, or its meshes are in another folder, where the converter does not look for them.
    """
    models = _models(found)
    for part in found[1:]:
        if os.path.basename(part.path) not in models:
            continue
        first, own = _compiler(found[0]), _compiler(part)
        other = [f'{name}="{own[name]}"' for name in _ANGLES if own[name].lower() != first[name].lower()]
        if any(node.get("file") for node in part.root.iter("mesh")) and own["folder"] != first["folder"]:
            other.append(f"meshes in {own['folder']}")
        if other:
            raise ShotError(
                "a robot within the robot is read with the compiler of the file around it, which is another one",
                path=part.path,
                attribute="compiler",
                found=", ".join(other),
                remedy="Give both files the same angle and eulerseq, and one folder for their meshes; or write the "
                "robot in one file",
            )


def _compiler(part: Part) -> dict[str, str]:
    """How a file counts angles, and the folder of its meshes."""
    found = dict(_ANGLES)
    for node in part.root.iter("compiler"):
        found |= node.attrib
    folder = found.get("meshdir", found.get("assetdir", ""))
    return found | {"folder": os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(part.path)), folder))}


def elements(found: Sequence[Part]) -> list[Element]:
    """The elements of a robot's files, with their defaults; equalities that are switched off have no effect."""
    classes: dict[str, Settings] = {_MAIN: {}}
    for part in found:
        for node in part.root.findall("default"):
            _collect(node, classes, {})
    files = {os.path.basename(part.path): part for part in found[1:]}
    models = _models(found)
    return [
        element
        for part in found
        if part is found[0] or os.path.basename(part.path) in models
        for section in part.root
        for element in _below(section, "", _MAIN, classes, part.path, files)
    ]


def _models(found: Sequence[Part]) -> set[str]:
    """Names of the files of robots within a robot."""
    return {os.path.basename(node.get("file", "")) for part in found for node in part.root.iter("model")}


def locks(listed: Sequence[Element]) -> dict[str, float]:
    """Joints that an equality holds at one value [rad or m], counted from the pose of the file."""
    return {
        element.values["joint1"]: float((element.values.get("polycoef", "0").split() or ["0"])[0])
        for element in listed
        if element.place == "equality/joint" and "joint1" in element.values and not element.values.get("joint2")
    }


def several_joints(found: Sequence[Part]) -> list[str]:
    """Names of the bodies of a robot that have several joints.

    MuJoCo moves them one after the other, and a converter ties each of them to the same two bodies, so that together
    they hold what they should move: `nested_copy` gives each a body of its own.

    Raises:
        ShotError: One of them is free, or inertias follow from geometry alone, of which these bodies have none.
    """
    names = []
    by_geometry = any(c.get("inertiafromgeom") == "true" for part in found for c in part.root.iter("compiler"))
    for part in found:
        for body in part.root.iter("body"):
            joints = _joints_of(body)
            if len(joints) < 2:
                continue
            free = any(node.tag == "freejoint" or node.get("type") == "free" for node in joints)
            if free or by_geometry:
                raise ShotError(
                    "a body with several joints is not supported" + ("" if free else " where inertiafromgeom is true"),
                    path=part.path,
                    attribute=f"body {body.get('name', '')}",
                    found=", ".join(node.get("name", node.tag) for node in joints),
                    remedy="Give each joint a body of its own, one inside the other, with a small mass in between",
                )
            names.append(body.get("name", "") or "without a name")
    return names


def nested_copy(
    root: xml.Element, path: str, folder: str, parse: Callable[[str], xml.Element], joined: Sequence[str]
) -> str:
    """Write a copy of a robot in one file, in which no body has several joints.

    Args:
        root: Of the robot; it is changed.
        path: Its file.
        folder: Where the copy is written.
        parse: Gives the root of another file.
        joined: OBJ meshes that are named by clean copies, see `with_joined_meshes`.

    Returns:
        The copy, which names folders by their whole paths.
    """
    home = os.path.dirname(os.path.abspath(path))
    _expand(root, home, parse)
    for node in root.iter("compiler"):
        for name in _FOLDERS:
            if name in node.attrib:
                node.set(name, os.path.join(home, node.get(name, "")))
    if not any(node.get(name) for node in root.iter("compiler") for name in ("meshdir", "assetdir")):
        root.insert(0, xml.Element("compiler", {"meshdir": home}))
    outermost: dict[str, str] = {}  # which of its bodies stands for one of a robot within this one
    for number, model in enumerate(root.iter("model")):
        file, own = os.path.join(home, model.get("file", "")), os.path.join(folder, f"model_{number}")
        within = parse(file)
        outermost |= {b.get("name", ""): _name(b, _joints_of(b)[0]) for b in within.iter("body") if _has_several(b)}
        os.mkdir(own)
        model.set("file", nested_copy(within, file, own, parse, joined))
    for attached in root.iter("attach"):
        attached.set("body", outermost.get(attached.get("body", ""), attached.get("body", "")))
    for parent in list(root.iter()):
        for place, body in enumerate(parent):
            if body.tag == "body" and _has_several(body):
                parent[place] = _nested(body)
    with_joined_meshes(root, home, joined, folder)
    copy = os.path.join(folder, os.path.basename(path))
    xml.ElementTree(root).write(copy, encoding="utf-8")
    return copy


def _expand(node: xml.Element, home: str, parse: Callable[[str], xml.Element]) -> None:
    """Put the content of included files in the place of what includes them; MuJoCo looks for them beside the robot."""
    for child in list(node):
        if child.tag == "include":
            place = list(node).index(child)
            own = parse(os.path.join(home, child.get("file", "")))
            _expand(own, home, parse)
            node[place : place + 1] = list(own)
        else:
            _expand(child, home, parse)


def _nested(body: xml.Element) -> xml.Element:
    """Bodies within each other, each with one joint of a body; the first joint is that of the outermost."""
    placed = {name: body.attrib.pop(name) for name in _PLACES if name in body.attrib}
    joints, outer, inner = _joints_of(body), None, None
    for joint in joints[:-1]:
        body.remove(joint)
        light = xml.Element("body", {"name": _name(body, joint)})
        if "childclass" in body.attrib:
            light.set("childclass", body.attrib["childclass"])
        moments = " ".join([_LIGHT_INERTIA] * 3)
        light.extend([xml.Element("inertial", {"pos": "0 0 0", "mass": _LIGHT, "diaginertia": moments}), joint])
        if inner is not None:
            inner.append(light)
        outer, inner = outer if outer is not None else light, light
    assert outer is not None and inner is not None
    inner.append(body)
    outer.attrib.update(placed)
    return outer


def _name(body: xml.Element, joint: xml.Element) -> str:
    """Of the body that one of several joints of a body gets."""
    return f"{body.get('name', 'body')}_{joint.get('name', len(body))}"


def _has_several(body: xml.Element) -> bool:
    return len(_joints_of(body)) > 1


def _joints_of(body: xml.Element) -> list[xml.Element]:
    return [node for node in body if node.tag in _JOINTS]


def _collect(node: xml.Element, classes: dict[str, Settings], inherited: Settings) -> None:
    """The settings of a default class, those of the class around it included, and of the classes in it."""
    own = classes.setdefault(node.get("class", _MAIN), {})
    for tag, values in inherited.items():
        own[tag] = values | own.get(tag, {})
    for child in node:
        if child.tag != "default":
            tag = _ACTUATOR if child.tag in _ACTUATORS else str(child.tag)
            own[tag] = own.get(tag, {}) | child.attrib
    for child in node.findall("default"):
        _collect(child, classes, own)


def _below(
    node: xml.Element,
    above: str,
    default: str,
    classes: Mapping[str, Settings],
    file: str,
    files: Mapping[str, Part],
    about: str = "",
) -> Iterator[Element]:
    """An element and those in it.

    Args:
        above: Place of the element around it.
        default: Class of those in a body that name none.
        files: Those that may be included, by name.
        about: Name of the element around it.
    """
    tag = str(node.tag)
    if tag == "include":
        name = os.path.basename(node.get("file", ""))
        others = {key: part for key, part in files.items() if key != name}  # files may include each other
        for child in files[name].root if name in files else ():
            yield from _below(child, above, default, classes, files[name].path, others, about)
    if tag in ("include", "default"):
        return
    place = f"{above}/{tag}".lstrip("/")
    if tag in ("worldbody", *_INNER):
        place = (
            f"body/{tag}/{tag}"
            if tag == "frame" and above == "body/frame"
            else "body" + f"/{tag}" * (tag in _INNER[1:])
        )
    settings = classes.get(node.get("class", default), {})
    values = settings.get(_SECTIONS.get(above, tag if above in _WITH_CLASS else ""), {}) | node.attrib
    if above == "equality" and values.get("active") == "false":
        return
    name = node.get("name") or node.get("joint1") or node.get("joint") or about
    yield Element(place, name, file, values)
    for child in node:
        inner = place if tag not in _INNER or child.tag == "frame" else "body"
        yield from _below(child, inner, node.get("childclass", default), classes, file, files, name if above else "")
