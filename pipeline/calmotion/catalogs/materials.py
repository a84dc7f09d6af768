"""Materials of links: the table that is shipped, and those of the user."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from os import PathLike
from pathlib import Path
from typing import Any

from calmotion.errors import ShotError, raise_all
from calmotion.support.caching.cache_folder import configuration_folder
from calmotion.support.foreign_files import read_toml
from calmotion.support.naming import nearest

TABLE = Path(__file__).with_suffix(".toml")
USERS_FILE = "materials.toml"  # in the configuration folder
GROUPS = ("plastic", "metal", "composite", "other")
_NUMBERS = {
    "youngs_modulus": (0.0, 2000.0),
    "poissons_ratio": (0.0, 0.5),
    "density": (0.0, 25000.0),
    "damping_ratio": (0.0, 1.0),
}
_REMEDY = (
    "Write youngs_modulus (GPa), poissons_ratio, density (kg/m^3) and damping_ratio; `calmotion materials --toml` "
    "prints examples"
)


@dataclass(frozen=True)
class Material:
    """An isotropic material.

    Attributes:
        youngs_modulus: [Pa].
        poissons_ratio: [-].
        density: [kg/m^3].
        damping_ratio: Fraction of critical damping of each mode.
        title: What it is, for people.
        group: One of `GROUPS`.
        source: Where the values come from.
        aliases: Other names.
    """

    youngs_modulus: float
    poissons_ratio: float
    density: float
    damping_ratio: float
    title: str = ""
    group: str = "other"
    source: str = ""
    aliases: tuple[str, ...] = ()


def known_materials(files: Iterable[str | PathLike[str]] = ()) -> dict[str, Material]:
    """The materials of a user by name: those that are shipped, of the configuration folder, and of given files.

    Args:
        files: TOML files with a table for each material; later ones replace earlier ones of the same name.

    Raises:
        ShotError: A file cannot be read, or a material in it is not complete.
    """
    own = configuration_folder() / USERS_FILE
    return materials([*([own] if own.is_file() else []), *map(str, files)])


def materials(files: Iterable[str | Path] = ()) -> dict[str, Material]:
    """The materials by name: those that are shipped, and those of files, which replace others of the same name.

    Args:
        files: TOML files with a table for each material.

    Raises:
        ShotError: A file cannot be read, or a material in it is not complete.
    """
    found = dict(_shipped())
    for file in files:
        found |= read_materials(file)
    return found


def material_named(name: str, known: Mapping[str, Material]) -> tuple[str, Material]:
    """A material and its own name, by its name or another name of it.

    Raises:
        ShotError: There is none.
    """
    wanted = name.strip().lower().replace("-", "_").replace(" ", "_")
    for own, material in known.items():
        if wanted in (own, *material.aliases):
            return own, material
    names = [*known, *(alias for material in known.values() for alias in material.aliases)]
    raise ShotError(
        "there is no such material",
        found=name,
        remedy=f"{nearest(wanted, names)}Use {', '.join(known)}; or add your own with --materials FILE",
    )


def read_materials(file: str | Path) -> dict[str, Material]:
    """The materials of a TOML file.

    Raises:
        ShotError: It cannot be read, or a material in it is not complete.
    """
    try:
        tables = read_toml(file)
    except (OSError, ValueError) as error:
        found = error.strerror if isinstance(error, OSError) else error
        raise ShotError("the materials cannot be read", path=str(file), found=found, remedy=_REMEDY) from error
    problems: list[ShotError] = []
    read = {}
    for name, table in tables.items():
        try:
            read[name] = _material(str(file), name, table)
        except ShotError as error:
            problems.append(error)
    raise_all(problems)
    return read


def _material(file: str, name: str, table: Any) -> Material:
    if not isinstance(table, dict):
        raise ShotError("must be a table", path=file, attribute=name, found=table, remedy=_REMEDY)
    texts = {"title": name, "group": "other", "source": "the user"}
    wrong = next((key for key in table if key not in (*_NUMBERS, *texts, "aliases")), None)
    if wrong is not None:
        raise ShotError(
            "there is no such property of a material",
            path=file,
            attribute=f"{name}.{wrong}",
            found=wrong,
            remedy=f"{nearest(wrong, _NUMBERS)}{_REMEDY}",
        )
    numbers = {}
    for key, (low, high) in _NUMBERS.items():
        value = table.get(key)
        if not isinstance(value, (int, float)) or isinstance(value, bool) or not low < value < high:
            raise ShotError(
                f"must be a number between {low:g} and {high:g}",
                path=file,
                attribute=f"{name}.{key}",
                found=value,
                remedy=_REMEDY,
            )
        numbers[key] = float(value)
    for key in texts:
        if not isinstance(table.get(key, ""), str):
            raise ShotError("must be a text", path=file, attribute=f"{name}.{key}", found=table[key], remedy=_REMEDY)
    given = texts | {key: table[key] for key in texts if key in table}
    aliases = tuple(map(str, table.get("aliases", ())))
    return Material(
        1e9 * numbers["youngs_modulus"], numbers["poissons_ratio"], numbers["density"], numbers["damping_ratio"],
        given["title"], given["group"], given["source"], aliases,
    )  # fmt: skip


@cache
def _shipped() -> dict[str, Material]:
    return read_materials(TABLE)


MATERIALS = _shipped()
