"""The arm of `small_shots` with generic joints in place of hinges."""

from collections.abc import Mapping

import numpy as np
from pxr import UsdPhysics
from small_shots import FRAMES, TARGET_POSITION


def generic(stage, path: str, free: list[str], locked=(1.0, -1.0)) -> None:
    """Turn a hinge into a generic joint that leaves some directions free; a drive and limits keep their values."""
    prim = stage.GetPrimAtPath(path)
    values = {name: prim.GetAttribute(f"physics:{name}Limit").Get() for name in ("lower", "upper")}
    samples = prim.GetAttribute(TARGET_POSITION)
    times = {code: samples.Get(code) for code in samples.GetTimeSamples()}
    prim.RemoveAppliedSchema("PhysicsDriveAPI:angular")
    prim.RemoveProperty(TARGET_POSITION)
    prim.SetTypeName("PhysicsJoint")
    for name in ("transX", "transY", "transZ", "rotX", "rotY", "rotZ"):
        limit = UsdPhysics.LimitAPI.Apply(prim, name)
        low, high = locked
        if name in free:
            low, high = values["lower"], values["upper"]
        limit.CreateLowAttr(low)
        limit.CreateHighAttr(high)
    if len(free) == 1:
        target = UsdPhysics.DriveAPI.Apply(prim, free[0]).CreateTargetPositionAttr()
        for code, value in times.items():
            target.Set(value, code)


def driven(stage, path: str, curves: Mapping[str, np.ndarray]) -> None:
    """Drives of a generic joint, by the direction: samples at all frames [deg or stage length]."""
    prim = stage.GetPrimAtPath(path)
    for name, values in curves.items():
        target = UsdPhysics.DriveAPI.Apply(prim, name).CreateTargetPositionAttr()
        for code, value in zip(range(FRAMES + 1), values, strict=True):
            target.Set(float(value), code)
