"""What the bartender alone is held to: its size, and margins that are tighter than those of all samples."""

from pathlib import Path

import numpy as np
import pytest
from pxr import Usd, UsdPhysics

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "bartender" / "bartender.usda"


@pytest.fixture(scope="module")
def stage():
    return Usd.Stage.Open(str(SAMPLE))


def joints_of(stage):
    return [UsdPhysics.Joint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Joint)]


def test_it_lasts_four_seconds_and_has_eight_joints_and_two_flexible_links(stage):
    assert (stage.GetEndTimeCode() - stage.GetStartTimeCode()) / stage.GetTimeCodesPerSecond() == 4.0
    assert stage.GetDefaultPrim().GetPath() == "/Bartender"
    assert len(joints_of(stage)) == 8
    flexible = [p for p in stage.Traverse() if "CalmFlexibleBodyAPI" in p.GetPrimTypeInfo().GetAppliedAPISchemas()]
    assert len(flexible) == 2


def test_the_motion_starts_at_rest_and_keeps_the_servo_limits_with_a_margin(stage):
    frames = np.arange(stage.GetStartTimeCode(), stage.GetEndTimeCode() + 1)
    rate = stage.GetTimeCodesPerSecond()
    driven = [joint for joint in joints_of(stage) if joint.GetPrim().IsA(UsdPhysics.RevoluteJoint)]
    assert len(driven) == 5
    for joint in driven:
        prim = joint.GetPrim()
        attribute = UsdPhysics.DriveAPI.Get(prim, "angular").GetTargetPositionAttr()
        assert attribute.GetTimeSamples() == frames.tolist()
        curve = np.array([attribute.Get(frame) for frame in frames], dtype=float)
        assert np.ptp(curve[:6]) == 0.0 and np.ptp(curve[-12:]) == 0.0, prim.GetPath()
        assert prim.GetAttribute("physics:lowerLimit").Get() + 10.0 < curve.min()
        assert curve.max() + 10.0 < prim.GetAttribute("physics:upperLimit").Get()
        assert np.abs(np.diff(curve)).max() * rate < 0.7 * prim.GetAttribute("calm:motor:maxVelocity").Get()
        assert np.abs(np.diff(curve, 2)).max() * rate**2 < 0.5 * prim.GetAttribute("calm:motor:maxAcceleration").Get()
