"""Calmotion's codeless schemas: their folder, and their registration in USD."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pxr import Plug, Usd

from calmotion.errors import ShotError
from calmotion.support.naming import nearest

CORRECT = "Correct the value, or remove the attribute"  # the usual remedy
NAMES = ("CalmFlexibleBodyAPI", "CalmDampingAPI", "CalmMotorAPI", "CalmTargetAPI", "CalmRetargetAPI")


def plugin_path() -> str:
    """The folder with `plugInfo.json`, for `PXR_PLUGINPATH_NAME` or another application.

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
    """Register the schemas in USD; calling it again does nothing.

    USD reads schemas once, when its schema registry is first used (any stage with a typed prim does that), and
    ignores later ones silently. Call this before a stage is opened; it checks that USD knows the schemas.

    Raises:
        ShotError: Called too late in this process.
    """
    Plug.Registry().RegisterPlugins(plugin_path())
    registry = Usd.SchemaRegistry()
    missing = [name for name in NAMES if registry.FindAppliedAPIPrimDefinition(name) is None]
    if missing:
        raise ShotError(
            "USD read its schemas before Calmotion's were registered, and reads them only once per process",
            found=", ".join(missing),
            remedy="Call calmotion.usd.schemas.register() before any stage is opened, "
            "or put calmotion.usd.schemas.plugin_path() into PXR_PLUGINPATH_NAME before the process starts",
        )


def value(prim: Usd.Prim, schema: str, attribute: str, time: float | None = None) -> Any:
    """The authored value of an attribute of a Calmotion schema, else its fallback.

    Args:
        prim: The Usd.Prim; the schema need not be applied.
        schema: Name of the API schema.
        attribute: Full name, such as `calm:motor:maxTorque`.
        time: Time code, or None for the default time.

    Returns:
        The value, or None where neither an opinion nor a fallback exists.
    """
    authored = prim.GetAttribute(attribute)
    if authored and authored.HasAuthoredValue():
        authored_value = authored.Get() if time is None else authored.Get(time)
        if authored_value is not None:
            return authored_value
    definition = Usd.SchemaRegistry().FindAppliedAPIPrimDefinition(schema)
    return definition.GetAttributeFallbackValue(attribute) if definition else None


def require(holds: bool, prim: Usd.Prim, attribute: str, found: object, problem: str, remedy: str = CORRECT) -> None:
    """Refuse what was found in an attribute, unless it keeps a rule."""
    if not holds:
        raise ShotError(problem, path=str(prim.GetPath()), attribute=attribute, found=found, remedy=remedy)


def choice(
    prim: Usd.Prim, schema: str, attribute: str, allowed: Sequence[str], problem: str, fallback: str = ""
) -> str:
    """The value of an attribute that has one of some names; the fallback where it has none.

    Raises:
        ShotError: Another one; the problem says which kind of name it is.
    """
    found = str(value(prim, schema, attribute) or fallback)
    require(
        found in allowed, prim, attribute, found, problem, f"{nearest(found, allowed)}Use one of {', '.join(allowed)}"
    )
    return found


def automatic(prim: Usd.Prim, schema: str, attribute: str, *, zero: bool = False) -> float | None:
    """The value of an attribute that is positive; None where it is -1, or nothing, for automatic.

    Args:
        zero: Whether it may be 0.

    Raises:
        ShotError: It is neither.
    """
    found = value(prim, schema, attribute)
    if found is None or found == -1:
        return None
    right = math.isfinite(found) and (found > 0.0 or (zero and found == 0.0))
    require(right, prim, attribute, found, "must be positive, or -1 for automatic")
    return float(found)


def is_applied(prim: Usd.Prim, schema: str) -> bool:
    """Whether an API schema is applied, also one that this USD does not know (`GetAppliedSchemas` leaves those out)."""
    return schema in prim.GetPrimTypeInfo().GetAppliedAPISchemas() or schema in prim.GetAppliedSchemas()
