"""Motor curves as time samples of the attributes that they came from."""

from collections.abc import Iterable

import numpy as np
from pxr import Sdf, Usd

from calmotion.arrays import Array
from calmotion.model import Animation, Character, Motor, MotorCurve, Track
from calmotion.model.curves import held_curve, optimized_curve
from calmotion.usd.clock import Clock
from calmotion.usd.schemas import is_applied

SAME = 1e-6  # times that are closer are one [s]
NEAR = 1e-5  # a curve that is nearer to what was authored is the same [rad or m]


def sample_times(frame_times: Array, samples_per_second: float | None, tracks: Iterable[Track] = ()) -> Array:
    """Times of the samples [s]: the frames, or a uniform grid that is at least that dense and has the frames.

    Args:
        frame_times: Shape [f].
        samples_per_second: None for the frames, and what the tracks need between.
        tracks: The animation of what is written.
    """
    if samples_per_second is None:
        return with_authored(frame_times, tracks)
    frame = float(frame_times[1] - frame_times[0])
    parts = max(1, int(np.ceil(frame * samples_per_second - 1e-9)))
    steps = np.arange((len(frame_times) - 1) * parts + 1)
    times: Array = frame_times[0] + steps * (frame / parts)
    return times


def with_authored(times: Array, tracks: Iterable[Track]) -> Array:
    """Times of samples together with those of tracks between which a curve through the samples alone would leave: there
    something was authored between the frames, or the curvature of a spline jumps.

    Args:
        times: [s], ascending, shape [n].
        tracks: The animation of what is written.
    """
    end = float(times[-1])
    for track in tracks:
        inside = (track.times > times[0] + SAME) & (track.times < end - SAME)
        own, values = track.times[inside], track.values[inside]
        if not len(own):
            continue
        whole = held_curve(track, end)
        while True:
            error = np.abs(held_curve(Track(times, whole(times, 0)), end)(own, 0) - values)
            after = np.searchsorted(times, own)
            apart = np.minimum(own - times[after - 1], times[after] - own)
            far = np.flatnonzero((error > NEAR) & (apart > SAME))
            if not len(far):
                break
            # the worst of each interval: what is left is often near enough then
            far = far[np.argsort(-error[far])]
            times = np.union1d(times, own[far[np.unique(after[far], return_index=True)[1]]])
    return times


def curve_values(animation: Animation, curve: MotorCurve, times: Array, cyclic: bool) -> Array:
    """A motor's curve [rad or m] at times within the shot."""
    if times is animation.frame_times:
        return curve.frame_values
    return optimized_curve(animation, curve, cyclic)(times, 0)


def author_curves(
    layer: Sdf.Layer,
    character: Character,
    animation: Animation,
    curves: tuple[MotorCurve, ...],
    samples_per_second: float | None,
    clock: Clock,
    meters: float,
) -> None:
    """Author each curve as an over with time samples, degrees or stage length.

    Args:
        curves: Those to write.
        samples_per_second: Their density [1/s]; None: at the frames, and between where the animation needs them.
        meters: Metres in the stage's unit of length.
    """
    for curve in curves:
        times = sample_times(animation.frame_times, samples_per_second, [animation.tracks[curve.motor]])
        codes = clock.time_codes(times)
        motor = character.motors[curve.motor]
        spec = attribute_spec(layer, f"{motor.prim_path}.{motor.attribute}", Sdf.ValueTypeNames.Float)
        unit = meters if motor.linear else np.deg2rad(1.0)
        values = curve_values(animation, curve, times, character.retarget.cyclic)
        for code, value in zip(codes, values / unit, strict=True):
            layer.SetTimeSample(spec.path, float(code), float(value))


def ensure_drives(layer: Sdf.Layer, stage: Usd.Stage, motors: Iterable[Motor]) -> None:
    """Apply the drives that motors' attributes belong to, where the shot has none (motors that an actuator of another
    dialect makes)."""
    for motor in motors:
        drive = f"PhysicsDriveAPI:{motor.attribute.split(':')[1]}"
        if not is_applied(stage.GetPrimAtPath(motor.prim_path), drive):
            schemas = Sdf.TokenListOp()
            schemas.prependedItems = [drive]
            Sdf.CreatePrimInLayer(layer, motor.prim_path).SetInfo("apiSchemas", schemas)


def attribute_spec(layer: Sdf.Layer, path: str, kind: Sdf.ValueTypeName, uniform: bool = False) -> Sdf.AttributeSpec:
    """The spec of an attribute in a layer, made with overs above it where needed."""
    sdf = Sdf.Path(path)
    spec = layer.GetAttributeAtPath(sdf)
    if spec is not None:
        return spec
    prim = Sdf.CreatePrimInLayer(layer, sdf.GetPrimPath())
    variability = Sdf.VariabilityUniform if uniform else Sdf.VariabilityVarying
    return Sdf.AttributeSpec(prim, sdf.name, kind, variability)
