"""What robots that others made cost: `calmotion bench robots FILE ...` makes the two longest links of each flexible.

Each FILE is a USD robot without a shot of ours, such as `calmotion import` writes. Its two longest links that a driven
joint carries become flexible (polyamide), all driven joints move for two seconds, as far as their limits allow, and its
last link is the target. The caches of meshes and reductions are empty, kernels are at hand after the first robot, and
no tolerance is asked for. The table has processor seconds by stage, the memory, and the verdict.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from calmotion import ShotError

from ..common.reporting import bench_parser, finish, keep, say
from ..scenes.links import POLYAMIDE, Link, read_links
from .stages import OPERATORS

SECONDS, RATE = 2.0, 60.0  # length of the motion [s], and its frames [1/s]
TURN = 40.0  # of a joint, where its limits allow it [deg]
LINKS = 2
STAGES = ("read", "analyse", "mesh", "reduce", "refine", "search")


@dataclass(frozen=True)
class RobotRow:
    """What a robot cost.

    Attributes:
        robot: Name of its file.
        links: Its flexible links.
        read_s, analyse_s, mesh_s, reduce_s, refine_s, search_s: Processor time of each stage.
        total_s: Of all.
        memory_gb: At most.
        before_mm, after_mm: Largest error as animated, and optimised.
        verdict: Whether the simulation keeps its tolerance, or what went wrong.
    """

    robot: str
    links: str
    read_s: float = np.nan
    analyse_s: float = np.nan
    mesh_s: float = np.nan
    reduce_s: float = np.nan
    refine_s: float = np.nan
    search_s: float = np.nan
    total_s: float = np.nan
    memory_gb: float = np.nan
    before_mm: float = np.nan
    after_mm: float = np.nan
    verdict: str = ""


def measure(file: str, links: int, patience: float) -> RobotRow:
    """The row of a robot; what is wrong with it is its verdict.

    Args:
        file: USD file.
        links: How many of its links become flexible.
        patience: After which it is ended [s].
    """
    from calmotion.support import kernel_folder

    name = Path(file).stem
    with tempfile.TemporaryDirectory() as folder:
        try:
            chosen = compose(file, Path(folder) / "shot.usda", links)
        except ShotError as problem:
            return RobotRow(name, "", verdict=str(problem))
        told = ", ".join(path.rpartition("/")[2] for path in chosen)
        command = [sys.executable, "-m", "calmotion", "optimize", f"{folder}/shot.usda", "-o", f"{folder}/calm.usda"]
        environment = dict(os.environ, CALMOTION_CACHE=f"{folder}/cache", NUMBA_CACHE_DIR=str(kernel_folder()))
        try:
            done = subprocess.run(
                [*command, "--json"], capture_output=True, text=True, env=environment, check=False, timeout=patience
            )
            return _row(name, told, json.loads(done.stdout))
        except subprocess.TimeoutExpired:
            return RobotRow(name, told, verdict=f"not ended after {patience:g} s")
        except (json.JSONDecodeError, KeyError):
            lines = [line for line in done.stderr.splitlines() if not line.startswith(("note:", "  "))]
            return RobotRow(name, told, verdict=f"exit status {done.returncode}: {' '.join(lines[-3:])}")


def _row(name: str, links: str, found: dict[str, Any]) -> RobotRow:
    used = dict.fromkeys(STAGES, 0.0)
    for row in found["operators"]:
        stage = OPERATORS.get(row["operator"], "other")
        used[stage] = used.get(stage, 0.0) + row["processor_s"]
    return RobotRow(
        name,
        links,
        **{f"{stage}_s": used[stage] for stage in STAGES},
        total_s=sum(used.values()),
        memory_gb=found["peak_memory_gb"] or np.nan,
        before_mm=1e3 * found["max_error_before_m"],
        after_mm=1e3 * found["max_error_after_m"],
        verdict="kept" if found["tolerance_kept"] else f"not kept: {found['tolerance_missed_by']}",
    )


def compose(file: str, out: Path, links: int) -> list[str]:
    """Write a shot over a robot, and return the paths of its flexible links.

    Args:
        file: USD file of the robot.
        out: Of the shot.
        links: How many become flexible.

    Raises:
        ShotError: It cannot be read, or no driven joint carries a link with a surface.
    """
    from calmotion.usd import open_stage

    robot = open_stage(file)  # which registers the schemas
    from pxr import Sdf, Usd, UsdGeom, UsdPhysics

    joints = list(_driven(robot))
    solid = {link.body.path: _length(link) for link in read_links(file) if link.body.surfaces}
    carried = sorted({body for _, body in joints} & solid.keys(), key=lambda body: (solid[body], body), reverse=True)
    chosen = carried[:links]
    if not chosen:
        raise ShotError("no driven joint carries a link with a surface", path=file, remedy="Name another robot")
    layer = Sdf.Layer.CreateNew(str(out))
    layer.subLayerPaths = [os.path.abspath(file)]
    stage = Usd.Stage.Open(layer)
    stage.SetDefaultPrim(stage.GetPrimAtPath(robot.GetDefaultPrim().GetPath()))
    UsdGeom.SetStageMetersPerUnit(stage, UsdGeom.GetStageMetersPerUnit(robot))
    UsdPhysics.SetStageKilogramsPerUnit(stage, UsdPhysics.GetStageKilogramsPerUnit(robot))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.GetStageUpAxis(robot))
    stage.SetTimeCodesPerSecond(RATE)
    stage.SetFramesPerSecond(RATE)
    stage.SetStartTimeCode(0)
    stage.SetEndTimeCode(SECONDS * RATE)
    _make_flexible(stage, chosen)
    for path, _ in joints:
        _animate(stage.GetPrimAtPath(path))
    stage.GetPrimAtPath(_farthest(robot, [body for _, body in joints])).ApplyAPI("CalmTargetAPI")
    layer.Save()
    return chosen


def _make_flexible(stage: Any, bodies: Sequence[str]) -> None:
    """Apply the schema to bodies, with polyamide."""
    from pxr import Sdf, UsdShade

    material = UsdShade.Material.Define(stage, stage.GetDefaultPrim().GetPath().AppendChild("BenchPolyamide"))
    prim = material.GetPrim()
    prim.AddAppliedSchema("PhysicsVolumeDeformableMaterialAPI")
    material_of = {"youngsModulus": POLYAMIDE.youngs_modulus, "poissonsRatio": POLYAMIDE.poissons_ratio}
    for name, value in (material_of | {"density": POLYAMIDE.density}).items():
        prim.CreateAttribute(f"physics:{name}", Sdf.ValueTypeNames.Float).Set(value)
    for body in bodies:
        link = stage.GetPrimAtPath(body)
        link.ApplyAPI("CalmFlexibleBodyAPI")
        UsdShade.MaterialBindingAPI.Apply(link).Bind(material, materialPurpose="physics")


def _driven(stage: Any) -> Iterator[tuple[str, str]]:
    """Revolute and prismatic joints that actuators or drives turn, else all, and the body that each carries."""
    from calmotion.usd import actuated_joints
    from pxr import UsdPhysics

    driven = set(actuated_joints(stage)) or {
        str(prim.GetPath()) for prim in stage.Traverse() if any("DriveAPI" in api for api in prim.GetAppliedSchemas())
    }
    for prim in stage.Traverse():
        if driven and str(prim.GetPath()) not in driven:
            continue
        if prim.GetTypeName() not in ("PhysicsRevoluteJoint", "PhysicsPrismaticJoint"):
            continue
        joint = UsdPhysics.Joint(prim)
        bodies = joint.GetBody1Rel().GetTargets()
        if bodies and not joint.GetExcludeFromArticulationAttr().Get():
            yield str(prim.GetPath()), str(bodies[0])


def _farthest(stage: Any, bodies: Sequence[str]) -> str:
    """The body with the most joints between it and the world."""
    from pxr import UsdPhysics

    carriers: dict[str, str] = {}
    for prim in stage.Traverse():
        if prim.IsA(UsdPhysics.Joint):
            joint = UsdPhysics.Joint(prim)
            inner, outer = (relation.GetTargets() for relation in (joint.GetBody0Rel(), joint.GetBody1Rel()))
            if inner and outer:
                carriers.setdefault(str(outer[0]), str(inner[0]))

    def depth(body: str) -> int:
        count = 0
        while body in carriers and count < len(carriers):
            body, count = carriers[body], count + 1
        return count

    return max(bodies, key=depth)


def _length(link: Link) -> float:
    """Longest side of the surfaces of a body, to a micrometre [m]."""
    points = np.concatenate([surface.points for surface in link.body.surfaces])
    return round(float(np.ptp(points, axis=0).max()), 6)


def _animate(prim: Any) -> None:
    """There and back again by a quintic, as far as the limits of the joint allow."""
    from pxr import UsdPhysics

    turns = prim.GetTypeName() == "PhysicsRevoluteJoint"
    api = UsdPhysics.RevoluteJoint(prim) if turns else UsdPhysics.PrismaticJoint(prim)
    low, high = (value.Get() for value in (api.GetLowerLimitAttr(), api.GetUpperLimitAttr()))
    low, high = (v if v is not None and np.isfinite(v) else s * 1e3 for v, s in ((low, -1.0), (high, 1.0)))
    start = float(np.clip(0.0, low, high))
    reach = high - start if high - start >= start - low else low - start
    move = float(np.clip(0.5 * reach, -TURN, TURN)) if turns else 0.5 * reach
    drive = UsdPhysics.DriveAPI.Apply(prim, "angular" if turns else "linear")
    target = drive.CreateTargetPositionAttr()
    for frame in range(round(SECONDS * RATE) + 1):
        s = np.clip(2.0 * abs(frame / (SECONDS * RATE) - 0.5) / 0.8, 0.0, 1.0)
        target.Set(start + move * (1.0 - s**3 * (10.0 - 15.0 * s + 6.0 * s * s)), frame)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; returns the exit status."""
    parser = bench_parser("robots", __doc__)
    parser.add_argument("files", metavar="FILE", nargs="+", help="USD file of a robot")
    parser.add_argument("--links", type=int, default=LINKS, help=f"links that become flexible (default: {LINKS})")
    parser.add_argument("--patience", type=float, default=1800.0, help="after which a robot is ended [s]")
    options = parser.parse_args(arguments)
    rows = []
    for file in options.files:
        rows.append(measure(file, options.links, options.patience))
        say(f"{rows[-1].robot}: {rows[-1].total_s:.1f} s, {rows[-1].verdict}")
        keep(options, RobotRow, rows)
    finish(options, "Robots, processor time", rows)
    return 0
