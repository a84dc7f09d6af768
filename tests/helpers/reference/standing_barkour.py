"""Barkour (Google DeepMind's quadruped) on its feet: motions of its motors by inverse kinematics, and its contacts."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from calmotion.usd import schemas
from pxr import Gf, Usd, UsdGeom, UsdPhysics
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

schemas.register()

RATE = 50  # frames a second
HEIGHT, HALF_TRACK = 0.26, 0.12  # of hips above the toes, and of toes beside the middle [m]
LEGS = ("front_right", "front_left", "hind_right", "hind_left")
AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Hinge:
    """A hinge of a leg, with its frames in both bodies."""

    path: str
    place0: np.ndarray
    turn0: Rotation
    place1: np.ndarray
    turn1: Rotation
    axis: np.ndarray
    limits: tuple[float, float]  # [rad]


class Leg:
    """The three hinges of a leg below the chassis."""

    def __init__(self, stage: Usd.Stage, name: str) -> None:
        self.name = name
        joints = [prim for prim in stage.Traverse() if prim.IsA(UsdPhysics.RevoluteJoint)]
        named = {prim.GetName(): UsdPhysics.RevoluteJoint(prim) for prim in joints}
        self.hinges = [_hinge(named[f"{kind}_{name}"]) for kind in ("abduction", "hip", "knee")]
        self.shank = stage.GetPrimAtPath(self.hinges[2].path).GetParent()
        foot = UsdGeom.Mesh(self.shank.GetChild("foot"))
        local = np.array(UsdGeom.Xformable(foot).GetLocalTransformation())
        points = np.array(foot.GetPointsAttr().Get()) @ local[:3, :3] + local[3, :3]
        far = points[np.linalg.norm(points, axis=1).argmax()]
        self.toe = points[np.linalg.norm(points - far, axis=1) < 0.01].mean(axis=0)
        hip = self.place(np.zeros(2), np.zeros(3))
        self.stance = np.array([hip[0], np.sign(hip[1]) * HALF_TRACK, hip[2] - HEIGHT])

    def place(self, angles: np.ndarray, point: np.ndarray) -> np.ndarray:
        """Where a point of the last body is, seen from the chassis [m]."""
        place, turn = np.zeros(3), Rotation.identity()
        for hinge, angle in zip(self.hinges, angles, strict=False):
            place = place + turn.apply(hinge.place0)
            turn = turn * hinge.turn0 * Rotation.from_rotvec(hinge.axis * angle) * hinge.turn1.inv()
            place = place - turn.apply(hinge.place1)
        return place + turn.apply(point)

    def angles(self, places: np.ndarray) -> np.ndarray:
        """Angles that have the toe at places [m], shape [n, 3], seen from the chassis."""
        bounds = tuple(np.array([hinge.limits for hinge in self.hinges]).T)
        found, angles = [], np.array([0.0, 0.7, 1.0])
        for place in places:
            solved = least_squares(
                lambda tried, place=place: self.place(tried, self.toe) - place, angles, bounds=bounds,
                xtol=1e-15, ftol=1e-15, gtol=1e-15,
            )  # fmt: skip
            assert np.abs(solved.fun).max() < 1e-10
            angles = solved.x
            found.append(angles)
        return np.array(found)


def stand(source: Path, folder: Path, chassis, toes=None, away=None, flexible=()) -> Path:
    """A shot of the robot whose chassis moves over its feet, on the gains of its own file.

    Args:
        source: The robot.
        folder: Where the shot is written.
        chassis: Where the chassis goes from its pose at the first frame [m], shape [n, 3].
        toes: Where toes go, by leg.
        away: Frames at which a foot leaves the ground and is back, by leg.
        flexible: As `calmotion import --flexible` has it.
    """
    toes, away = toes or {}, away or {}
    legs = [Leg(Usd.Stage.Open(str(source)), name) for name in LEGS]
    columns = {"time_s": np.arange(len(chassis)) / RATE}
    for leg in legs:
        angles = leg.angles(leg.stance - chassis + toes.get(leg.name, 0.0))
        for hinge, values in zip(leg.hinges, angles.T, strict=True):
            columns[hinge.path.rsplit("/", 1)[-1]] = values
    np.savez(folder / "motion.npz", **columns)
    layer = folder / "standing.usda"
    robots = pytest.importorskip("calmotion_plugins.robot_import")
    robots.import_robot(source, layer=layer, motion=folder / "motion.npz", targets=["chassis"], flexible=list(flexible))
    stage = Usd.Stage.Open(str(layer))
    for leg in legs:
        toe = UsdGeom.Xform.Define(stage, leg.shank.GetPath().AppendChild("Toe"))
        toe.AddTranslateOp().Set(Gf.Vec3d(*leg.toe.tolist()))
        prim = toe.GetPrim()
        prim.ApplyAPI("CalmContactAPI")
        prim.GetAttribute("calm:contact:kind").Set("point")
        prim.GetAttribute("calm:contact:friction").Set(0.8)
        if leg.name in away:
            active = prim.GetAttribute("calm:contact:active")
            for frame, held in zip((0, *away[leg.name]), (True, False, True), strict=True):
                active.Set(held, frame)
            prim.ApplyAPI("CalmTargetAPI")
        for hinge in leg.hinges:
            joint = stage.GetPrimAtPath(hinge.path)
            joint.ApplyAPI("CalmMotorAPI")
            joint.GetAttribute("calm:motor:model").Set("drive")
    stage.GetRootLayer().Save()
    return layer


def ease(start: float, end: float, frames: int) -> np.ndarray:
    """From 0 to 1 between two times [s] with zero rates and accelerations at the ends, shape [frames, 1]."""
    s = np.clip((np.arange(frames)[:, None] / RATE - start) / (end - start), 0.0, 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def _hinge(joint: UsdPhysics.RevoluteJoint) -> Hinge:
    turns = [
        Rotation.from_quat([*turn.GetImaginary(), turn.GetReal()])
        for turn in (joint.GetLocalRot0Attr().Get(), joint.GetLocalRot1Attr().Get())
    ]
    places = [np.array(place.Get(), float) for place in (joint.GetLocalPos0Attr(), joint.GetLocalPos1Attr())]
    limits = np.radians([joint.GetLowerLimitAttr().Get(), joint.GetUpperLimitAttr().Get()])
    axis = np.array(AXES[joint.GetAxisAttr().Get()])
    return Hinge(str(joint.GetPath()), places[0], turns[0], places[1], turns[1], axis, tuple(limits))
