"""Files that a robot names by the ROS package that holds them."""

import os
import xml.etree.ElementTree as xml
from collections.abc import Mapping
from pathlib import Path

PACKAGE, MODEL = "package://", "model://"  # of ROS and of Gazebo


def in_package(name: str) -> tuple[str, str]:
    """The ROS package that the name of a mesh begins with, and the path in it; else the name, and nothing."""
    if not name.startswith((PACKAGE, MODEL)):
        return name, ""
    package, _, rest = name.removeprefix(PACKAGE).removeprefix(MODEL).lstrip("/").partition("/")
    return package, rest


def package_folder(name: str, path: str) -> str | None:
    """The folder of a package: one that contains the file or stands beside one that does, else one that ROS knows.

    A folder has the package's name, or its `package.xml` says so: an archive from GitHub unpacks to `NAME-main`.
    """
    above = Path(path).resolve().parents
    for folder in above:
        if folder.name == name:
            return str(folder)
        if (folder / name).is_dir():
            return str(folder / name)
    workspaces = [Path(text) for text in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if text]
    prefixes = [Path(text) for text in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if text]
    for folder in [*above, *workspaces]:
        for manifest in [folder / "package.xml", *sorted(folder.glob("*/package.xml"))]:
            if _package_name(manifest) == name:
                return str(manifest.parent)
    known = [*(folder / name for folder in workspaces), *(prefix / "share" / name for prefix in prefixes)]
    return next((str(folder) for folder in known if folder.is_dir()), None)


def _package_name(manifest: Path) -> str | None:
    try:
        root = xml.parse(manifest).getroot()  # nosec B314  # expat limits the expansion of entities
    except (OSError, xml.ParseError):
        return None
    return (root.findtext("name") or "").strip()


def mesh_file(name: str, path: str, packages: Mapping[str, str]) -> str:
    """The file that a mesh of a URDF names."""
    package, rest = in_package(name)
    if rest:
        return os.path.join(packages[package], rest)
    return os.path.join(os.path.dirname(os.path.abspath(path)), package.removeprefix("file://"))
