"""The dancer with slower motors: `python samples/dancer/slower.py FILE`. They cannot dance to 120 beats a minute as she
is animated; `calmotion optimize FILE -o calm.usda --retime` keeps every second beat, and is faster where it can.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

from pxr import Sdf, Usd

HERE = Path(__file__).resolve().parent
MOST = 250.0  # of each motor [degrees/s]; the animation asks for 230 to 315
BEATS = range(8, 155, 30)  # time codes of every second one
FASTEST = 0.85


def write(output: Path) -> None:
    """Write the layer, which opens the dancer."""
    dancer = HERE / "dancer.usda"
    stage = Usd.Stage.CreateNew(str(output))
    root, shot = stage.GetRootLayer(), Sdf.Layer.FindOrOpen(str(dancer))
    root.subLayerPaths = [Path(os.path.relpath(dancer, output.resolve().parent)).as_posix()]
    for name in ("metersPerUnit", "upAxis", "kilogramsPerUnit"):
        if shot.pseudoRoot.HasInfo(name):
            root.pseudoRoot.SetInfo(name, shot.pseudoRoot.GetInfo(name))
    root.timeCodesPerSecond, root.framesPerSecond = shot.timeCodesPerSecond, shot.framesPerSecond
    root.startTimeCode, root.endTimeCode, root.defaultPrim = shot.startTimeCode, shot.endTimeCode, shot.defaultPrim
    for prim in stage.Traverse():
        if prim.GetTypeName() == "PhysicsRevoluteJoint":
            prim.AddAppliedSchema("CalmMotorAPI")
            prim.CreateAttribute("calm:motor:maxVelocity", Sdf.ValueTypeNames.Float, False).Set(MOST)
    character = stage.GetDefaultPrim()
    character.AddAppliedSchema("CalmRetargetAPI")
    character.CreateAttribute("calm:retime:pinned", Sdf.ValueTypeNames.DoubleArray, False).Set(
        [float(b) for b in BEATS]
    )
    character.CreateAttribute("calm:retime:fastest", Sdf.ValueTypeNames.Float, False).Set(FASTEST)
    stage.Save()


if __name__ == "__main__":
    write(Path(sys.argv[1]))
