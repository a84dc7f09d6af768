"""From a skinned UsdSkel character, or animated parts, to a layer with bodies, joints, motors and targets."""

from calmotion.usd.rigging.rig import RigOptions, rig_shot

__all__ = ["RigOptions", "rig_shot"]
