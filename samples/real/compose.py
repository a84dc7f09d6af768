"""Puts a layer of ours over a shot that somebody else made: `python compose.py OVERS SHOT OUT [--seconds N]`.

OUT gets the shot's time range and units (those of OVERS where the motion is there), and sublayers OVERS over SHOT with
paths relative to it. The robots that such layers are for are not part of this repository; `g1_arms.usda` is for a
Unitree G1 upper body converted from MJCF, `iiwa_reach.usda` for a KUKA LBR iiwa 14,
`so101_arms.usda` and `so101_servos.usda` for an SO-101 converted from URDF.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from calmotion.usd import schemas

schemas.register()

from pxr import Sdf, Usd, UsdGeom, UsdPhysics  # noqa: E402  (schemas register before USD is used)


def compose(overs: Path, shot: Path, out: Path, seconds: float | None = None) -> Path:
    """Write OUT, with the first so many seconds of the motion or all of it; returns its path."""
    stage = Usd.Stage.Open(str(shot))
    layer = Sdf.Layer.CreateAnonymous(".usda")
    layer.defaultPrim = stage.GetRootLayer().defaultPrim
    own = Usd.Stage.Open(str(overs), Usd.Stage.LoadNone)
    timed = own if own.HasAuthoredTimeCodeRange() else stage
    layer.startTimeCode, layer.endTimeCode = timed.GetStartTimeCode(), timed.GetEndTimeCode()
    layer.timeCodesPerSecond, layer.framesPerSecond = timed.GetTimeCodesPerSecond(), timed.GetFramesPerSecond()
    if seconds is not None:
        layer.endTimeCode = min(layer.endTimeCode, layer.startTimeCode + round(seconds * layer.timeCodesPerSecond))
    composed = Usd.Stage.Open(layer)
    UsdGeom.SetStageMetersPerUnit(composed, UsdGeom.GetStageMetersPerUnit(stage))
    UsdPhysics.SetStageKilogramsPerUnit(composed, UsdPhysics.GetStageKilogramsPerUnit(stage))
    UsdGeom.SetStageUpAxis(composed, UsdGeom.GetStageUpAxis(stage))
    # last, since the paths are relative to a file that is not there yet
    del composed
    layer.subLayerPaths = [os.path.relpath(path.resolve(), out.resolve().parent) for path in (overs, shot)]
    out.parent.mkdir(parents=True, exist_ok=True)
    layer.Export(str(out))
    return out


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("overs", "shot", "out"):
        parser.add_argument(name, type=Path)
    parser.add_argument("--seconds", type=float, help="only the first so many seconds of the motion")
    arguments = parser.parse_args()
    print(compose(arguments.overs, arguments.shot, arguments.out, arguments.seconds))
