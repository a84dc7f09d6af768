"""Conversion between stage units and SI; seconds are the same in both."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeVar

from pxr import Usd, UsdGeom, UsdPhysics

from calmotion.arrays import Array
from calmotion.errors import ShotError

Quantity = TypeVar("Quantity", float, Array)

EARTH_GRAVITY = 9.81  # m/s^2
SMALLEST, LARGEST = 1e-9, 1e9  # nanometres, and far more than kilometres or tonnes
_USUAL = {
    "metersPerUnit": "1 for metres, 0.01 for centimetres, 0.001 for millimetres",
    "kilogramsPerUnit": "1 for kilograms, 0.001 for grams",
}


@dataclass(frozen=True)
class StageUnits:
    """Units of a stage; each method converts a value, or array, in stage units to SI.

    Attributes:
        meters: Metres per unit of length.
        kilograms: Kilograms per unit of mass.
    """

    meters: float
    kilograms: float

    def length(self, value: Quantity) -> Quantity:
        """To m."""
        return value * self.meters

    def mass(self, value: Quantity) -> Quantity:
        """To kg."""
        return value * self.kilograms

    def density(self, value: Quantity) -> Quantity:
        """Mass / length^3, to kg/m^3."""
        return value * (self.kilograms / self.meters**3)

    def inertia(self, value: Quantity) -> Quantity:
        """Mass length^2, to kg m^2."""
        return value * (self.kilograms * self.meters**2)

    def pressure(self, value: Quantity) -> Quantity:
        """Mass / (length s^2), to Pa."""
        return value * (self.kilograms / self.meters)

    def torque(self, value: Quantity) -> Quantity:
        """Mass length^2 / s^2, to N m."""
        return value * (self.kilograms * self.meters**2)

    def force(self, value: Quantity) -> Quantity:
        """Mass length / s^2, to N."""
        return value * (self.kilograms * self.meters)

    def acceleration(self, value: Quantity) -> Quantity:
        """Length / s^2, to m/s^2."""
        return value * self.meters


def units_of(stage: Usd.Stage) -> StageUnits:
    """The units of a stage, with USD's fallbacks (0.01 m, 1 kg).

    Raises:
        ShotError: A unit that is not positive, or that nobody measures in.
    """
    units = StageUnits(UsdGeom.GetStageMetersPerUnit(stage), UsdPhysics.GetStageKilogramsPerUnit(stage))
    for name, value in (("metersPerUnit", units.meters), ("kilogramsPerUnit", units.kilograms)):
        if SMALLEST <= value <= LARGEST:
            continue
        positive = math.isfinite(value) and value > 0.0
        what = "is not one that lengths or masses are measured in" if positive else "must be positive"
        raise ShotError(
            f"the unit of the stage {what}",
            path=stage.GetRootLayer().identifier,
            attribute=name,
            found=value,
            remedy=f"Author a positive {name} in the root layer: {_USUAL[name]}",
        )
    up = str(UsdGeom.GetStageUpAxis(stage))
    if up not in ("X", "Y", "Z"):
        raise ShotError(
            "unknown up axis",
            path=stage.GetRootLayer().identifier,
            attribute="upAxis",
            found=up or "an empty name",
            remedy="Author Y or Z in the root layer",
        )
    return units


def other_units(stage: Usd.Stage, prims: Iterable[Usd.Prim]) -> list[ShotError]:
    """Units of layers with some prims that are not those of the stage, which USD takes from its root layer alone.

    Args:
        prims: Those of bodies; others that are not valid are passed over.

    Returns:
        A warning for each unit; of the up axis for sublayers alone, since what is referenced can be turned.
    """
    root, stack = stage.GetRootLayer(), stage.GetLayerStack(False)
    layers = list(dict.fromkeys(spec.layer for prim in prims if prim for spec in prim.GetPrimStack()))
    found = []
    for name in (*_USUAL, "upAxis"):
        here = stage.GetMetadata(name)
        for layer in layers:
            there = layer.pseudoRoot.GetInfo(name) if layer.pseudoRoot.HasInfo(name) else here
            same = there == here or (name in _USUAL and math.isclose(there, here, rel_tol=1e-6))
            if layer == root or same or (name == "upAxis" and layer not in stack):
                continue
            of_stage = "" if root.pseudoRoot.HasInfo(name) else " (the default of USD)"
            found.append(
                ShotError(
                    f"the robot comes from a layer with another {name} than the shot",
                    path=root.GetDisplayName(),
                    attribute=name,
                    found=f"{there} in {layer.GetDisplayName()}, {here} in the root layer{of_stage}",
                    remedy=f"Author {name} = {there} in the root layer, unless all values of the robot, with its "
                    "masses and materials, suit that of the shot",
                )
            )
            break
    return found
