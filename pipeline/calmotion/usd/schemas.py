"""Calmotion's codeless schemas: where they are, and telling USD about them in time."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from calmotion.errors import ShotError

if TYPE_CHECKING:
    from pxr import Usd

NAMES = ("CalmFlexibleBodyAPI", "CalmDampingAPI", "CalmMotorAPI", "CalmTargetAPI", "CalmRetargetAPI")


def plugin_path() -> str:
    """The folder with `plugInfo.json`, for `PXR_PLUGINPATH_NAME` or another application; does not import pxr.

    Returns:
        Path of the folder inside the installed package, else of the one in the repository.

    Raises:
        ShotError: The installation has no schemas.
    """
    package = Path(__file__).resolve().parents[1]
    candidates = (
        package / "bundled" / "usd_schemas" / "calmotion",
        package.parents[1] / "usd_schemas" / "calmotion",
    )
    for folder in candidates:
        if (folder / "plugInfo.json").is_file():
            return str(folder)
    raise ShotError(
        "the USD schemas of Calmotion are missing from the installation",
        path=str(candidates[0]),
        remedy="Install calmotion again",
    )


def register() -> None:
    """Make USD know the schemas; calling it again does nothing.

    USD reads schemas once, when its schema registry is first used (any stage with a typed prim does that), and
    takes no notice of later ones, without a word. So this is called before a stage is opened, and checks.

    Raises:
        ShotError: Called too late in this process.
    """
    from pxr import Plug, Usd

    Plug.Registry().RegisterPlugins(plugin_path())
    registry = Usd.SchemaRegistry()
    missing = [name for name in NAMES if registry.FindAppliedAPIPrimDefinition(name) is None]
    if missing:
        raise ShotError(
            "USD was used in this process before Calmotion's schemas were registered, and it reads schemas once",
            found=", ".join(missing),
            remedy="Call calmotion.usd.schemas.register() before any stage is opened, "
            "or put calmotion.usd.schemas.plugin_path() into PXR_PLUGINPATH_NAME before the process starts",
        )


def value(prim: Usd.Prim, schema: str, attribute: str, time: float | None = None) -> Any:
    """The value of an attribute of our schemas, authored or fallback.

    Args:
        prim: The Usd.Prim; the schema need not be applied.
        schema: Name of the API schema.
        attribute: Full name, such as `calm:motor:maxTorque`.
        time: Time code, or None for the default time.

    Returns:
        The value, or None where neither an opinion nor a fallback exists.
    """
    from pxr import Usd

    authored = prim.GetAttribute(attribute)
    if authored and authored.HasAuthoredValue():
        found = authored.Get() if time is None else authored.Get(time)
        if found is not None:
            return found
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(schema)
    return definition.GetAttributeFallbackValue(attribute) if definition else None


def is_applied(prim: Usd.Prim, schema: str) -> bool:
    """Whether an API schema is applied, also one that this USD does not know (`GetAppliedSchemas` leaves those out)."""
    return schema in prim.GetPrimTypeInfo().GetAppliedAPISchemas() or schema in prim.GetAppliedSchemas()
