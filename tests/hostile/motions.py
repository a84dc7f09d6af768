"""Hostile motions: time codes that jump, one frame, a hundred thousand, wraps, spikes, gaps, splines, wrong units."""

from __future__ import annotations

import math

import numpy as np
import posed_shots
from hostile import DONE, USAGE, Case, Edit, arm, layer, optimize, simulate
from pxr import Gf, Sdf, Ts, Usd, UsdGeom, Vt
from shot_edits import applied, attribute, both, retarget, stage_metadata, times
from small_shots import ELBOW, FORE, FRAMES, HAND, SHOULDER, TARGET_POSITION

EITHER = (0, 1)


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
    "one frame": simulate("endTimeCode|frame", make=arm(times(3, 3)), statuses=EITHER),
    "two frames": simulate(make=arm(times(3, 4)), statuses=DONE),
    "a hundredth of a frame": simulate("endTimeCode", make=arm(times(3, 3.01)), statuses=EITHER),
    "negative time codes": simulate(make=arm(span(-100.0, -76.0)), statuses=DONE),
    "time codes from minus to plus": simulate(make=arm(span(-12.0, 12.0)), statuses=DONE),
    "time codes that are no whole numbers": simulate(make=arm(span(0.37, 24.37)), statuses=DONE),
    "a shot that begins at frame 86400": simulate(make=arm(span(86400.0, 86424.0)), statuses=DONE),
    "a shot that begins at frame a hundred million": simulate(make=arm(span(1e8, 1e8 + 24.0)), statuses=EITHER),
    "an infinite end": simulate("endTimeCode", make=arm(times(0.0, math.inf))),
    "an end that is no number": simulate("endTimeCode", make=arm(times(0.0, math.nan))),
    "a start that is no number": simulate("startTimeCode", make=arm(times(math.nan, 24.0))),
    "a range without samples": simulate(make=arm(times(1000.0, 1024.0)), statuses=EITHER),
    "a range that the samples end in": simulate(make=arm(times(12.0, 48.0)), statuses=DONE),
    "a year of frames": simulate("memory|time|frames", make=arm(times(0.0, 24.0 * 3600 * 24 * 365))),
    "ten thousand frames": simulate(make=arm(long_shot(10_000)), args="--step 20ms", statuses=DONE, seconds=90),
    "a hundred thousand frames": simulate(make=arm(long_shot(100_000)), args="--step 40ms", statuses=DONE, seconds=400),
    "a rate of one thousandth": simulate(make=arm(span(0.0, 0.001, 0.001)), statuses=EITHER),
    "a rate of a million": simulate(make=arm(span(0.0, 24.0, 1e6)), statuses=EITHER),
    "a rate that is infinite": simulate("timeCodesPerSecond", make=arm(stage_metadata("timeCodesPerSecond", math.inf))),
    "a negative rate": simulate("timeCodesPerSecond", make=arm(stage_metadata("timeCodesPerSecond", -24.0))),
    "frames at another rate than time codes": simulate(
        make=arm(stage_metadata("framesPerSecond", 30.0)), statuses=DONE
    ),
    "frames of which a shot has no whole number": simulate(
        make=arm(stage_metadata("framesPerSecond", 23.976)), statuses=DONE
    ),
    # samples
    "one sample": simulate(make=arm(track([0.0], [10.0])), statuses=DONE),
    "two samples": simulate(make=arm(track([0.0, 24.0], [0.0, 30.0])), statuses=DONE),
    "samples only before the shot": simulate(make=arm(track([-10.0, -5.0], [0.0, 30.0])), statuses=EITHER),
    "samples only after the shot": simulate(make=arm(track([100.0, 110.0], [0.0, 30.0])), statuses=EITHER),
    "time codes that jump": simulate(make=arm(track([0, 1, 2, 20, 21, 24], [0, 5, 10, 12, 14, 20])), statuses=DONE),
    "time codes between the frames": simulate(make=arm(track(CODES + 0.5, SWING)), statuses=DONE),
    "a hundred samples in a frame": simulate(
        make=arm(track(np.linspace(0, 24, 2401), np.repeat(SWING, 97)[:2401])), statuses=EITHER
    ),
    "a motor that does not move": simulate(make=arm(track(CODES, np.full(25, 10.0))), statuses=DONE),
    "no motor moves": simulate(TARGET_POSITION + "|moves|still|animat", make=arm(unmoved), statuses=EITHER),
    "all samples are zero": simulate(make=arm(track(CODES, 0 * SWING), track(CODES, 0 * SWING, ELBOW)), statuses=DONE),
    "a spike of one frame": simulate(make=arm(track(CODES, np.where(CODES == 12, 80.0, 0.0))), statuses=DONE),
    "a tremble of 12 Hz": simulate("pre-roll", make=arm(track(CODES, ZIGZAG))),
    "a hop of 360 degrees": simulate(
        POSITION, make=arm(track(CODES, np.where(CODES < 12, 0.0, 360.0))), statuses=EITHER
    ),
    "a flip of sign at 180 degrees": simulate(
        POSITION, make=arm(track(CODES, np.where(CODES < 12, 179.0, -179.0))), statuses=EITHER
    ),
    "a hundred turns": simulate(make=arm(track(CODES, 1500.0 * CODES)), statuses=EITHER),
    "100 rad/s": simulate(make=arm(track(CODES, np.degrees(100.0 * CODES / 24.0) % 1e9)), statuses=EITHER, seconds=60),
    "angles in radians by mistake": simulate(make=arm(track(CODES, np.radians(SWING))), statuses=DONE),
    "angles of a million degrees": simulate(make=arm(track(CODES, 1e6 + SWING)), statuses=EITHER),
    "an angle that floats cannot resolve": simulate(make=arm(track(CODES, 1e9 + SWING)), statuses=EITHER),
    "angles of 1e-30 degrees": simulate(make=arm(track(CODES, 1e-30 * SWING)), statuses=DONE),
    "the largest float": simulate(POSITION, make=arm(track(CODES, 3.4e38 * np.sign(SWING)))),
    "beyond the limits of the joint": simulate("limit|range", make=arm(track(CODES, 9.0 * SWING)), statuses=EITHER),
    "wholly beyond the limits of the joint": optimize(
        "limit|exceed|range", make=arm(track(CODES, 200.0 + SWING)), statuses=EITHER
    ),
    # splines and other sources
    "a spline": simulate(make=arm(spline((0, 0), (12, 30), (24, 0))), statuses=DONE),
    "a spline of one knot": simulate(make=arm(spline((0, 10))), statuses=DONE),
    "a spline outside of the shot": simulate(make=arm(spline((100, 0), (120, 30))), statuses=EITHER),
    "a spline and samples": simulate(make=arm(spline((0, 0), (24, 30)), track(CODES, SWING)), statuses=EITHER),
    "a target of speed": simulate("targetVelocity|" + POSITION, make=arm(velocity_drive), statuses=EITHER),
    "an animation in half precision": simulate(
        make=arm(attribute(SHOULDER, TARGET_POSITION, "Half", 10.0)), statuses=EITHER
    ),
    "an animation of doubles": simulate(make=arm(attribute(SHOULDER, TARGET_POSITION, "Double", 10.0)), statuses=DONE),
    "an animation of integers": simulate(make=arm(attribute(SHOULDER, TARGET_POSITION, "Int", 10)), statuses=EITHER),
    "an animation of arrays": simulate(
        SHOULDER,
        TARGET_POSITION,
        make=arm(attribute(SHOULDER, TARGET_POSITION, "FloatArray", Vt.FloatArray([1.0, 2.0]))),
    ),
    "bodies animated by matrices": simulate(make=arm(posed_shots.posed), statuses=DONE),
    "a matrix that is no number": simulate(FORE, make=arm(posed(matrix(5.0, Gf.Matrix4d(math.nan))))),
    "a matrix of zeros": simulate(FORE, make=arm(posed(matrix(5.0, Gf.Matrix4d(0.0))))),
    "a matrix that mirrors": simulate(
        "elbow", make=arm(posed(matrix(5.0, Gf.Matrix4d().SetScale(Gf.Vec3d(-1, 1, 1))))), statuses=EITHER
    ),
    "a body that leaves its joint": simulate(
        "elbow|fore", make=arm(posed(matrix(5.0, Gf.Matrix4d().SetTranslate(Gf.Vec3d(9, 9, 9))))), statuses=EITHER
    ),
    "a body that turns about another axis": simulate(
        "elbow|fore",
        make=arm(posed(matrix(5.0, Gf.Matrix4d().SetRotate(Gf.Rotation(Gf.Vec3d(0, 0, 1), 80.0))))),
        statuses=EITHER,
    ),
    "an animated scale": simulate(
        FORE,
        make=arm(lambda s: UsdGeom.Xformable(s.GetPrimAtPath(FORE)).AddScaleOp().Set(Gf.Vec3f(2, 2, 2), 5.0)),
        statuses=EITHER,
    ),
    "a target that moves on its body": simulate(
        "moves on its body",
        make=arm(
            lambda s: [
                UsdGeom.Xformable(s.GetPrimAtPath(HAND)).GetOrderedXformOps()[0].Set(Gf.Vec3d(0.4 + 0.01 * k, 0, 0), k)
                for k in range(25)
            ]
        ),
        statuses=EITHER,
    ),
    "an animated mass": simulate(
        "physics:mass: it is animated",
        make=arm(lambda s: s.GetPrimAtPath(FORE).GetAttribute("physics:mass").Set(3.0, 12.0)),
        statuses=EITHER,
    ),
    "an animated limit": simulate(
        "upperLimit: it is animated",
        make=arm(lambda s: s.GetPrimAtPath(ELBOW).GetAttribute("physics:upperLimit").Set(3.0, 12.0)),
        statuses=EITHER,
    ),
    "weights that are zero at all times": optimize(
        "positionWeight",
        make=arm(
            lambda s: [
                s.GetPrimAtPath(HAND)
                .CreateAttribute("calm:target:positionWeight", Sdf.ValueTypeNames.Float)
                .Set(0.0, k)
                for k in (0, 12, 24)
            ]
        ),
    ),
    "a weight that turns negative": optimize(
        "positionWeight",
        make=arm(
            lambda s: [
                s.GetPrimAtPath(HAND).CreateAttribute("calm:target:positionWeight", Sdf.ValueTypeNames.Float).Set(w, k)
                for k, w in ((0, 1.0), (12, -1.0))
            ]
        ),
    ),
    "a loop of one frame": simulate("cyclic|endTimeCode", make=arm(retarget("cyclic", "Bool", True), times(3, 3))),
    "a loop whose speeds differ at the seam": simulate(
        make=arm(retarget("cyclic", "Bool", True), track(CODES, 0.1 * CODES * (24 - CODES))), statuses=EITHER
    ),
    "motors of which none may change": optimize(
        "calm:motor:optimize",
        make=arm(
            *(
                both(applied(path, "CalmMotorAPI"), attribute(path, "calm:motor:optimize", "Bool", False))
                for path in (SHOULDER, ELBOW)
            )
        ),
    ),
    "a pre-roll of an hour": simulate("--pre-roll|time|memory", make=arm(), args="--pre-roll 3600s"),
    "a negative pre-roll": simulate("--pre-roll", make=arm(), args="--pre-roll=-1s", statuses=USAGE),
    "a motion file that is not there": simulate("gone.bvh", make=arm(), args="--motion gone.bvh", statuses=(1, 2)),
    "a clip whose layers jump in time": simulate(
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
        statuses=EITHER,
    ),
}
