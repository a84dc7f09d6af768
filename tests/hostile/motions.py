"""Hostile motions: time codes that jump, one frame, a hundred thousand, wraps, spikes, gaps, splines, wrong units."""

import math

import numpy as np
import posed_shots
from hostile import DONE, EITHER, REFUSED, USAGE, Case, Edit, layer, optimize, simulate
from pxr import Gf, Sdf, Ts, Usd, UsdGeom, Vt
from shot_edits import attribute, both, retarget, stage_metadata, times
from small_shots import ELBOW, FORE, FRAMES, HAND, SHOULDER, TARGET_POSITION


def track(codes: np.ndarray, values: np.ndarray, path: str = SHOULDER) -> Edit:
    """Other samples for a motor [deg]."""

    def edit(stage: Usd.Stage) -> None:
        own = stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION)
        own.Clear()
        with Sdf.ChangeBlock():
            for code, value in zip(np.atleast_1d(codes), np.atleast_1d(values), strict=True):
                own.Set(float(value), float(code))

    return edit


def span(start: float, end: float, rate: float = 24.0) -> Edit:
    """Both motors swing from a first to a last time code."""
    codes = np.linspace(start, end, 25)
    swing = 20.0 * np.sin(np.linspace(0.0, 2.0 * math.pi, 25))
    return both(
        times(start, end), track(codes, swing), track(codes, swing, ELBOW), stage_metadata("timeCodesPerSecond", rate)
    )


def long_shot(frames: int) -> Edit:
    """A swing that takes as many frames."""
    codes = np.arange(frames + 1.0)
    return both(times(0, frames), track(codes, 20.0 * np.sin(codes / 20.0)), track(codes[:1], np.zeros(1), ELBOW))


def spline(*knots: tuple[float, float], path: str = SHOULDER) -> Edit:
    """A spline in the place of samples."""

    def edit(stage: Usd.Stage) -> None:
        own = stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION)
        own.Clear()
        curve = Ts.Spline("float")
        for code, value in knots:
            curve.SetKnot(Ts.Knot(typeName="float", time=code, value=value, nextInterp=Ts.InterpCurve))
        own.SetSpline(curve)

    return edit


def posed(edit: Edit) -> Edit:
    """Links that are animated by matrices, then edited."""
    return both(posed_shots.posed, edit)


def matrix(code: float, value: Gf.Matrix4d, path: str = FORE) -> Edit:
    return lambda stage: UsdGeom.Xformable(stage.GetPrimAtPath(path)).GetOrderedXformOps()[0].Set(value, code)


def unmoved(stage: Usd.Stage) -> None:
    for path in (SHOULDER, ELBOW):
        own = stage.GetPrimAtPath(path).GetAttribute(TARGET_POSITION)
        own.Clear()
        own.Set(10.0)


def velocity_drive(stage: Usd.Stage) -> None:
    prim = stage.GetPrimAtPath(SHOULDER)
    prim.GetAttribute(TARGET_POSITION).Clear()
    prim.CreateAttribute("drive:angular:physics:targetVelocity", Sdf.ValueTypeNames.Float).Set(90.0)


CODES = np.arange(FRAMES + 1.0)
SWING = 20.0 * np.sin(2.0 * math.pi * CODES / FRAMES)
ZIGZAG = 30.0 * (-1.0) ** CODES
POSITION = f"{SHOULDER}|{TARGET_POSITION}"

CASES: dict[str, Case] = {
    # the range of the shot
    "one frame": simulate(EITHER, times(3, 3), "endTimeCode|frame"),
    "two frames": simulate(DONE, times(3, 4)),
    "a hundredth of a frame": simulate(EITHER, times(3, 3.01), "endTimeCode"),
    "negative time codes": simulate(DONE, span(-100.0, -76.0)),
    "time codes from minus to plus": simulate(DONE, span(-12.0, 12.0)),
    "time codes that are no whole numbers": simulate(DONE, span(0.37, 24.37)),
    "a shot that begins at frame 86400": simulate(DONE, span(86400.0, 86424.0)),
    "a shot that begins at frame a hundred million": simulate(EITHER, span(1e8, 1e8 + 24.0)),
    "an infinite end": simulate(REFUSED, times(0.0, math.inf), "endTimeCode"),
    "a range without samples": simulate(EITHER, times(1000.0, 1024.0)),
    "a range that the samples end in": simulate(DONE, times(12.0, 48.0)),
    "a year of frames": simulate(REFUSED, times(0.0, 24.0 * 3600 * 24 * 365), "memory|time|frames"),
    "ten thousand frames": simulate(DONE, long_shot(10_000), args="--step 20ms", seconds=90),
    "a hundred thousand frames": simulate(DONE, long_shot(100_000), args="--step 40ms", seconds=400),
    "a rate of one thousandth": simulate(EITHER, span(0.0, 0.001, 0.001)),
    "a rate of a million": simulate(EITHER, span(0.0, 24.0, 1e6)),
    "frames at another rate than time codes": simulate(DONE, stage_metadata("framesPerSecond", 30.0)),
    "frames of which a shot has no whole number": simulate(DONE, stage_metadata("framesPerSecond", 23.976)),
    # samples
    "one sample": simulate(DONE, track([0.0], [10.0])),
    "two samples": simulate(DONE, track([0.0, 24.0], [0.0, 30.0])),
    "samples only before the shot": simulate(EITHER, track([-10.0, -5.0], [0.0, 30.0])),
    "samples only after the shot": simulate(EITHER, track([100.0, 110.0], [0.0, 30.0])),
    "time codes that jump": simulate(DONE, track([0, 1, 2, 20, 21, 24], [0, 5, 10, 12, 14, 20])),
    "time codes between the frames": simulate(DONE, track(CODES + 0.5, SWING)),
    "a hundred samples in a frame": simulate(EITHER, track(np.linspace(0, 24, 2401), np.repeat(SWING, 97)[:2401])),
    "a motor that does not move": simulate(DONE, track(CODES, np.full(25, 10.0))),
    "no motor moves": simulate(EITHER, unmoved, TARGET_POSITION + "|moves|still|animat"),
    "all samples are zero": simulate(DONE, track(CODES, 0 * SWING), track(CODES, 0 * SWING, ELBOW)),
    "a spike of one frame": simulate(DONE, track(CODES, np.where(CODES == 12, 80.0, 0.0))),
    "a tremble of 12 Hz": simulate(REFUSED, track(CODES, ZIGZAG), "pre-roll"),
    "a hop of 360 degrees": simulate(EITHER, track(CODES, np.where(CODES < 12, 0.0, 360.0)), POSITION),
    "a flip of sign at 180 degrees": simulate(EITHER, track(CODES, np.where(CODES < 12, 179.0, -179.0)), POSITION),
    "a hundred turns": simulate(EITHER, track(CODES, 1500.0 * CODES)),
    "100 rad/s": simulate(EITHER, track(CODES, np.degrees(100.0 * CODES / 24.0) % 1e9), seconds=60),
    "angles in radians by mistake": simulate(DONE, track(CODES, np.radians(SWING))),
    "angles of a million degrees": simulate(EITHER, track(CODES, 1e6 + SWING)),
    "an angle that floats cannot resolve": simulate(EITHER, track(CODES, 1e9 + SWING)),
    "angles of 1e-30 degrees": simulate(DONE, track(CODES, 1e-30 * SWING)),
    "beyond the limits of the joint": simulate(EITHER, track(CODES, 9.0 * SWING), "limit|range"),
    "wholly beyond the limits of the joint": optimize(EITHER, track(CODES, 200.0 + SWING), "limit|exceed|range"),
    # splines and other sources
    "a spline": simulate(DONE, spline((0, 0), (12, 30), (24, 0))),
    "a spline of one knot": simulate(DONE, spline((0, 10))),
    "a spline outside of the shot": simulate(EITHER, spline((100, 0), (120, 30))),
    "a spline and samples": simulate(EITHER, spline((0, 0), (24, 30)), track(CODES, SWING)),
    "a target of speed": simulate(EITHER, velocity_drive, "targetVelocity|" + POSITION),
    "an animation in half precision": simulate(EITHER, attribute(SHOULDER, TARGET_POSITION, "Half", 10.0)),
    "an animation of doubles": simulate(DONE, attribute(SHOULDER, TARGET_POSITION, "Double", 10.0)),
    "an animation of integers": simulate(EITHER, attribute(SHOULDER, TARGET_POSITION, "Int", 10)),
    "bodies animated by matrices": simulate(DONE, posed_shots.posed),
    "a matrix of zeros": simulate(REFUSED, posed(matrix(5.0, Gf.Matrix4d(0.0))), FORE),
    "a matrix that mirrors": simulate(EITHER, posed(matrix(5.0, Gf.Matrix4d().SetScale(Gf.Vec3d(-1, 1, 1)))), "elbow"),
    "a body that leaves its joint": simulate(
        EITHER, posed(matrix(5.0, Gf.Matrix4d().SetTranslate(Gf.Vec3d(9, 9, 9)))), "elbow|fore"
    ),
    "a body that turns about another axis": simulate(
        EITHER, posed(matrix(5.0, Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(0, 0, 1), 80.0)))), "elbow|fore"
    ),
    "an animated scale": simulate(
        EITHER, lambda s: UsdGeom.Xformable(s.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(2, 2, 2), 5.0), FORE
    ),
    "a target that moves on its body": simulate(
        EITHER,
        lambda s: [
            UsdGeom.Xformable(s.GetPrimAtPath(HAND)).GetOrderedXformOps()[0].Set(Gf.Vec3d(0.4 + 0.01 * k, 0, 0), k)
            for k in range(25)
        ],
        "moves on its body",
    ),
    "an animated mass": simulate(
        EITHER,
        lambda s: s.GetPrimAtPath(FORE).GetAttribute("physics:mass").Set(3.0, 12.0),
        "physics:mass: it is animated",
    ),
    "an animated limit": simulate(
        EITHER,
        lambda s: s.GetPrimAtPath(ELBOW).GetAttribute("physics:upperLimit").Set(3.0, 12.0),
        "upperLimit: it is animated",
    ),
    "a loop whose speeds differ at the seam": simulate(
        EITHER, retarget("cyclic", "Bool", True), track(CODES, 0.1 * CODES * (24 - CODES))
    ),
    "a pre-roll of an hour": simulate(REFUSED, "--pre-roll|time|memory", args="--pre-roll 3600s"),
    "a negative pre-roll": simulate(USAGE, "--pre-roll", args="--pre-roll=-1s"),
    "a motion file that is not there": simulate((1, 2), "gone.bvh", args="--motion gone.bvh"),
    "a clip whose layers jump in time": simulate(
        EITHER,
        make=layer(
            lambda own: own.GetPrimAtPath("/Arm/joints").SetInfo(
                "clips",
                {
                    "default": {
                        "assetPaths": Sdf.AssetPathArray([Sdf.AssetPath("./clip.usda")]),
                        "primPath": "/Arm/joints",
                        "active": Vt.Vec2dArray([(0, 0)]),
                        "times": Vt.Vec2dArray([(0, 0), (12, 24), (12, 0), (24, 12)]),
                    }
                },
            ),
            clip='#usda 1.0\nover "Arm" { over "joints" { over "shoulder" { float drive:angular:physics:targetPosition'
            ".timeSamples = { 0: 0, 12: 30, 24: 0 }\n  }\n }\n}\n",
        ),
    ),
}
