"""Ellipsoids of an MJCF robot, which the converter leaves out: spheres that are scaled along their axes."""

from collections.abc import Mapping, Sequence
from typing import Any

from calmotion.usd import StageUnits
from pxr import Gf, Usd, UsdGeom, UsdPhysics


def author_ellipsoids(
    stage: Usd.Stage, units: StageUnits, bodies: Sequence[Usd.Prim], found: Sequence[Mapping[str, Any]]
) -> None:
    """Author the ellipsoids of a robot below its bodies, those of the world below the robot.

    Args:
        stage: Where they are authored, over the conversion.
        units: Of the stage.
        bodies: In the order of the file.
        found: As `converters.compiled_values` gives them: of each its body, place in the body's frame [m], rotation
            (w, x, y, z), half axes [m], and what the file states of its mass [kg] or density [kg/m^3].
    """
    for ellipsoid in found:
        above = bodies[ellipsoid["body"]] if ellipsoid["body"] >= 0 else stage.GetDefaultPrim()
        sphere = UsdGeom.Sphere.Define(stage, _free_path(above))
        sphere.CreateRadiusAttr(1.0)
        sphere.CreateExtentAttr([(-1.0, -1.0, -1.0), (1.0, 1.0, 1.0)])
        sphere.AddTranslateOp().Set(Gf.Vec3d(*ellipsoid["position"]) / units.length(1.0))
        sphere.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(*ellipsoid["rotation"]))
        sphere.AddScaleOp().Set(Gf.Vec3f(*ellipsoid["half_axes"]) / units.length(1.0))
        prim = sphere.GetPrim()
        if not ellipsoid["collides"]:
            continue
        UsdPhysics.CollisionAPI.Apply(prim)
        prim.AddAppliedSchema("MjcCollisionAPI")  # which `geoms_of` looks for
        mass = UsdPhysics.MassAPI.Apply(prim)
        if ellipsoid["mass"] is None:
            mass.CreateDensityAttr(ellipsoid["density"] / units.density(1.0))
        else:
            mass.CreateMassAttr(ellipsoid["mass"] / units.mass(1.0))


def _free_path(above: Usd.Prim) -> Any:
    """A path for the next ellipsoid below a prim."""
    names = {child.GetName() for child in above.GetChildren()}
    number = next(k for k in range(len(names) + 1) if f"Ellipsoid{k or ''}" not in names)
    return above.GetPath().AppendChild(f"Ellipsoid{number or ''}")
