"""Files of a folder that are robots or characters: shots in USD, and robots in URDF and MJCF."""

from __future__ import annotations

import xml.etree.ElementTree as xml
from pathlib import Path

_USD = (".usd", ".usda", ".usdc", ".usdz")


def shots_in(folder: Path) -> list[Path]:
    """The USD files of a folder but for those that one beside or above them opens."""
    from calmotion.usd import dependencies

    files = sorted(path for path in folder.rglob("*") if path.suffix in _USD)
    parts: set[Path] = set()
    for path in files:
        named = (Path(name).resolve() for name in dependencies.files_named_by(str(path)))
        parts |= {file for file in named if file.is_relative_to(path.resolve().parent)}
    return [path for path in files if path.resolve() not in parts]


def descriptions_in(folder: Path) -> list[Path]:
    """The URDF and MJCF files of a folder but for those that another MJCF file includes, and scenes without joints."""
    found = sorted(folder.rglob("*.urdf"))
    models: list[tuple[Path, xml.Element]] = []
    for path in sorted(folder.rglob("*.xml")):
        try:
            root = xml.parse(path).getroot()  # nosec B314  # expat limits the expansion of entities
        except (xml.ParseError, OSError):
            continue
        if root.tag == "mujoco":
            models.append((path, root))
    included = {
        (path.parent / node.get("file", "")).resolve() for path, root in models for node in root.iter("include")
    }
    # a scene that includes a robot adds a floor and lights; the robot is what counts
    robots = {path.resolve() for path, root in models if root.find(".//joint[@name]") is not None}
    kept = [path for path, _ in models if path.resolve() in robots and not _is_part(path, included, models)]
    return sorted([*found, *kept])


def _is_part(path: Path, included: set[Path], models: list[tuple[Path, xml.Element]]) -> bool:
    """Whether a file is a piece of another robot: it is included by one that has joints of its own."""
    if path.resolve() not in included:
        return False
    for other, root in models:
        names = {(other.parent / node.get("file", "")).resolve() for node in root.iter("include")}
        if path.resolve() in names and root.find(".//joint[@name]") is not None:
            return True
    return False
