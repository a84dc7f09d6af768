"""Writing a Result: a layer with the curves, and a root layer."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from pxr import Sdf

from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Motor, MotorCurve, Provenance, Result, Track
from calmotion.usd import stages
from calmotion.usd.clock import Clock
from calmotion.usd.layers import refuse_input_as_output, write_layer
from calmotion.usd.reading.motors.tracks import MOST as MAX_SAMPLES
from calmotion.usd.writing import bake, metadata
from calmotion.usd.writing.curves import author_curves, ensure_drives, sample_times, with_authored
from calmotion.usd.writing.root import keeps_earlier_curves, root_path, write_root
from calmotion.usd.writing.scene import author_map, author_scene
from calmotion.usd.writing.skeletal import author_skeletons
from calmotion.usd.writing.splines import author_splines

BAKES = ("none", "motors", "simulated")


@dataclass(frozen=True)
class WriteOptions:
    """How a result is written.

    Attributes:
        samples_per_second: Density of the motor samples [1/s]; None: the shot's frames, and between them what the
            animation needs.
        splines: Whether motor curves are written as splines instead of samples.
        bake: `none`, `motors` (body transforms of a rigid robot with the new curves) or `simulated` (the predicted
            motion, deformed meshes included).
        retime_scene: Whether all that moves in the stage follows the tempo of the performance, or the character alone.
    """

    samples_per_second: float | None = None
    splines: bool = False
    bake: str = "none"
    retime_scene: bool = True


def write_result(
    character: Character,
    animation: Animation,
    provenance: Provenance,
    result: Result,
    output: str,
    options: WriteOptions | None = None,
) -> tuple[str, str]:
    """Write a result over its shot.

    An optimisation writes the curves that changed, and what is baked. A simulation writes the predicted motion of the
    bodies (with their deformed meshes for `bake="simulated"`).

    Args:
        output: The layer to write; the root layer goes beside it as `<stem>_root.usda`.

    Returns:
        Paths of the layer and of the root layer.

    Raises:
        ShotError: The output is an input, cannot be written, or cannot be baked.
    """
    options = options or WriteOptions()
    refuse_options(options, motors_that_may_change(character) if result.after else ())
    refuse_inputs(provenance, output)
    role = stages.MOTION if result.after is None else stages.CURVES
    animation = result.performed_animation(animation)
    provenance = _at_tempo(provenance, animation)
    clock = Clock(
        provenance.start_time_code,
        provenance.end_time_code,
        provenance.time_codes_per_second,
        provenance.frames_per_second,
    )
    layer = Sdf.Layer.CreateAnonymous(".usda")
    metadata.author_stage_metadata(layer, provenance)
    metadata.author_origin(
        layer,
        role,
        provenance,
        settings=metadata.settings_of(character, result, options.bake, options.samples_per_second, options.splines),
        errors=metadata.errors_of(character, result),
    )
    muted = stages.earlier_layers(stages.open_stage(provenance.shot)) if provenance.earlier_layers else ()
    shot = _Shot(stages.open_stage(provenance.shot, muted=muted), character, animation, clock, provenance)
    if role == stages.CURVES:
        _write_curves(layer, shot, result, options)
    _bake(layer, shot, result, options)
    if animation.tempo is not None and role == stages.CURVES:
        author_map(layer, character.path, animation.tempo, clock)
        within = "/" if options.retime_scene else character.path
        author_scene(layer, shot.stage, animation.tempo, clock, animation.frame_times, within)
    write_layer(layer, output)
    return output, write_root(output, provenance, role)


def _at_tempo(provenance: Provenance, animation: Animation) -> Provenance:
    """The provenance with the end of a performance at another tempo."""
    if animation.tempo is None:
        return provenance
    codes = float(animation.frame_times[-1]) * provenance.time_codes_per_second
    return replace(provenance, end_time_code=provenance.start_time_code + codes)


def refuse_options(options: WriteOptions, motors: Sequence[Motor], seconds: float = 0.0) -> None:
    """Refuse options that do not fit each other, or none of the motors whose curves may be written.

    Args:
        options: How curves are written.
        motors: Those whose curves may be.
        seconds: Length of the shot [s].
    """
    if options.splines and options.samples_per_second is not None:
        raise ShotError(
            "curves can be written as splines or as samples, not as both",
            attribute="--splines",
            found="--samples-per-second as well",
            remedy="Remove one of the two options",
        )
    if motors and seconds * (options.samples_per_second or 0.0) > MAX_SAMPLES:
        raise ShotError(
            f"a curve would have more than {MAX_SAMPLES:,} samples",
            path=motors[0].path,
            attribute="--samples-per-second",
            found=f"{options.samples_per_second:g} in each of {seconds:g} s",
            remedy=f"Use {MAX_SAMPLES / seconds:.3g} or less",
        )
    elsewhere = sampled_at_frames(options, motors)
    if elsewhere and len(elsewhere) == len(motors):
        raise ShotError(
            "this motor is animated by the transforms of its bodies or by a skeleton, where curves are samples at the "
            "frames",
            path=elsewhere[0].path,
            attribute=elsewhere[0].attribute,
            found="--splines" if options.splines else "--samples-per-second",
            remedy="Remove the option, or animate the motor by its drive",
        )


def motors_that_may_change(character: Character) -> list[Motor]:
    """Motors whose curves a search may change; those that are geared to others follow by themselves."""
    return [motor for motor in character.motors if motor.optimize and motor.follows is None]


def sampled_at_frames(options: WriteOptions, motors: Sequence[Motor]) -> list[Motor]:
    """Motors whose curves remain samples at the frames although the options ask for others: transforms of bodies, and
    for splines also those of a skeleton."""
    sources = {"bodies"} if options.splines or options.samples_per_second is not None else set()
    sources |= {"skeleton"} if options.splines else set()
    return [motor for motor in motors if motor.source in sources]


def refuse_bake(options: WriteOptions, motors: Sequence[Motor]) -> None:
    """Refuse the predicted motion of a robot whose new curves are transforms of its bodies.

    Raises:
        ShotError: It is requested, and a motor is animated by its bodies.
    """
    posed = next((motor for motor in motors if motor.source == "bodies"), None)
    if posed is not None and options.bake == "simulated":
        raise ShotError(
            "this motor is animated by its bodies, whose transforms the predicted motion would replace",
            path=posed.path,
            attribute=posed.attribute,
            found="--bake=simulated",
            remedy="Remove the option, and then run `calmotion simulate --bake=simulated` on the root layer",
        )


def refuse_inputs(provenance: Provenance, output: str) -> None:
    """Refuse an output that would overwrite a layer of the shot, with itself or with its root layer.

    Raises:
        ShotError: The output is an input, or has no extension of a USD layer.
    """
    folder = os.path.dirname(os.path.realpath(provenance.shot))
    inputs = [os.path.join(folder, layer.path) for layer in provenance.layers]
    inputs += [os.path.join(folder, layer) for layer in provenance.earlier_layers]
    for name in (output, root_path(output)):
        refuse_input_as_output(name, inputs)


def _curves_to_write(shot: _Shot, result: Result) -> tuple[MotorCurve, ...]:
    """The curves that changed, all of them where the tempo did or curves of an earlier result would show through; never
    those of motors that are geared to others, which follow by themselves."""
    write_all = shot.animation.tempo is not None or keeps_earlier_curves(shot.provenance)
    independent = (curve for curve in result.curves if shot.character.motors[curve.motor].follows is None)
    return tuple(curve for curve in independent if curve.changed or write_all)


@dataclass(frozen=True, eq=False)
class _Shot:
    """The shot that a result is written over: its stage, with earlier results muted, and what was read from it."""

    stage: Any
    character: Character
    animation: Animation
    clock: Clock
    provenance: Provenance

    @property
    def meters(self) -> float:
        return self.provenance.meters_per_unit


def _write_curves(layer: Sdf.Layer, shot: _Shot, result: Result, options: WriteOptions) -> None:
    """Author motor curves where they came from."""
    character, animation, clock = shot.character, shot.animation, shot.clock
    curves: dict[str, tuple[MotorCurve, ...]] = {"drive": (), "bodies": (), "skeleton": ()}
    for curve in _curves_to_write(shot, result):
        curves[character.motors[curve.motor].source] += (curve,)
    ensure_drives(layer, shot.stage, [character.motors[curve.motor] for curve in curves["drive"]])
    rate = options.samples_per_second
    # what was authored with corners keeps them: samples would be read back without
    cornered = tuple(curve for curve in curves["drive"] if len(animation.tracks[curve.motor].corners))
    splines = curves["drive"] if options.splines else cornered
    author_splines(layer, character, animation, splines, clock, shot.meters)
    samples = tuple(curve for curve in curves["drive"] if curve not in splines)
    author_curves(layer, character, animation, samples, rate, clock, shot.meters)
    if curves["skeleton"]:
        times = sample_times(animation.frame_times, rate, _tracks(shot, "skeleton"))
        author_skeletons(layer, shot.stage, character, animation, curves["skeleton"], times, clock)
    if curves["bodies"] and options.bake != "motors":
        bake.bake_bodies(layer, shot.stage, character, _performed(shot, result), clock, shot.meters, changed=True)


def _tracks(shot: _Shot, source: str) -> list[Track]:
    """The animation of all motors of a source."""
    return [t for motor, t in zip(shot.character.motors, shot.animation.tracks, strict=True) if motor.source == source]


def _performed(shot: _Shot, result: Result) -> bake.BakedMotion:
    """The rigid robot at the frames; at all steps where its bodies are animated between frames, by splines or by denser
    samples: read back at the frames alone, it would move otherwise than it was simulated."""
    if result.performed is None:
        raise ShotError(
            "a rigid robot cannot perform these curves: its linkage does not close",
            path=shot.character.path,
            attribute="bake",
            remedy="Use --bake=simulated",
        )
    times = shot.animation.frame_times
    if len(with_authored(times, _tracks(shot, "bodies"))) > len(times):
        times = result.performed.times[result.performed.judged]
    return bake.simulated_motion(result.performed, times)


def _bake(layer: Sdf.Layer, shot: _Shot, result: Result, options: WriteOptions) -> None:
    """Author what is baked into the layer; see `WriteOptions.bake`."""
    if options.bake not in BAKES:
        raise ShotError("unknown bake", found=options.bake, remedy=f"Use one of {', '.join(BAKES)}")
    simulated_only = result.after is None
    if options.bake == "none" and not simulated_only:
        return
    if not simulated_only:
        refuse_bake(options, shot.character.motors)
    if options.bake == "motors":
        motion = _performed(shot, result)
    else:
        motion = bake.simulated_motion((result.after or result.before).motion, shot.animation.frame_times)
    bake.bake_bodies(layer, shot.stage, shot.character, motion, shot.clock, shot.meters)
    if options.bake == "simulated":
        bake.bake_points(layer, shot.stage, shot.character, result.skins, motion, shot.clock, shot.meters)
