"""From a skinned UsdSkel character without physics to a layer with bodies, joints, motors and targets."""

from .rig import RigOptions, rig_shot

__all__ = ["RigOptions", "rig_shot"]
