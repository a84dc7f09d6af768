"""The reader's table of contents: a file becomes a Character, an Animation and a Provenance."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...errors import ShotError
from ...shot import Animation, Character, Provenance, Track
from .. import stages
from ..clock import Clock, clock_of
from ..units import StageUnits, units_of
from .character import Skeleton, animated_attributes, build_character, read_skeleton
from .context import Reading
from .motors import ATTRIBUTE, free_tracks
from .roots import moving_frames
from .targets import weight_tracks
from .tracks import read_track, sample_codes


def read_shot(path: str) -> tuple[Character, Animation, Provenance]:
    """Read a shot.

    Layers that Calmotion wrote earlier are muted for the character and for the intent; what they composed to is
    in `Animation.current`.

    Args:
        path: A .usda, .usdc, .usd or .usdz file.

    Returns:
        The character, its animation, and what a writer must know.

    Raises:
        ShotError: The shot cannot be processed; with prim path, attribute and remedy.
    """
    composed = stages.open_stage(path)
    stages.refuse_own_layer(composed, path)
    earlier = stages.earlier_layers(composed)
    stage = stages.open_stage(path, muted=earlier) if earlier else composed
    with stages.quiet():
        reading, clock = _start_reading(stage)
        skeleton = read_skeleton(reading)
        tracks = _tracks(stage, skeleton, clock, reading.notes, reading.units)
        moving = moving_frames(reading, skeleton, clock)
        _note_dense_samples(tracks, clock, reading)
        character = build_character(reading, skeleton)
        current = tracks
        if earlier:
            current = _tracks(composed, skeleton, clock, [], reading.units)
            names = ", ".join(stages.display_name(layer, path) for layer in earlier)
            note = f"the shot carries results of Calmotion ({names}); the intent is the animation beneath them"
            character = dataclasses.replace(character, notes=(*character.notes, note))
    provenance = _provenance(path, stage, reading, clock, earlier)
    weights = weight_tracks(stage, character.targets, clock)
    free = free_tracks(stage, character.motors, clock)
    return character, Animation(clock.frame_times(), tracks, current, moving, weights, free), provenance


def _start_reading(stage) -> tuple[Reading, Clock]:
    """The reading context at the first frame, and the clock of the shot."""
    units = units_of(stage)
    codes = [sample_codes(attribute) for attribute in animated_attributes(stage)]
    every = np.concatenate(codes) if codes else np.zeros(0)
    if len(every) == 0:
        # Nothing is animated, so there is no shot; let the skeleton say precisely what is missing.
        read_skeleton(Reading(stage, units, float(stage.GetStartTimeCode())))
        raise ShotError("nothing is animated", path=stage.GetRootLayer().identifier, attribute=ATTRIBUTE)
    clock = clock_of(stage, every)
    return Reading(stage, units, clock.start), clock


def _tracks(stage, skeleton: Skeleton, clock: Clock, notes: list[str], units: StageUnits) -> tuple[Track, ...]:
    found = []
    for drive in skeleton.drives:
        attribute = stage.GetAttributeAtPath(drive.attribute.GetPath())
        to_si = units.length(1.0) if drive.joint.kind == "prismatic" else np.deg2rad(1.0)
        found.append(read_track(attribute, clock, notes, float(to_si)))
    return tuple(found)


def _note_dense_samples(tracks: tuple[Track, ...], clock: Clock, reading: Reading) -> None:
    """Say so where the animation has more detail than the frames, at which curves are written."""
    frame = 1.0 / clock.frames_per_second
    if any(len(track.times) > 1 and np.median(np.diff(track.times)) < 0.75 * frame for track in tracks):
        reading.note(
            f"the animation is sampled more densely than its {clock.frames_per_second:g} frames a second, at which "
            "curves are written unless more samples are asked for"
        )


def _provenance(path: str, stage, reading: Reading, clock: Clock, earlier: tuple[str, ...]) -> Provenance:
    from pxr import UsdGeom

    default = stage.GetDefaultPrim()
    return Provenance(
        shot=path,
        layers=stages.input_layers(stage, path),
        meters_per_unit=reading.units.meters,
        kilograms_per_unit=reading.units.kilograms,
        up_axis=str(UsdGeom.GetStageUpAxis(stage)),
        time_codes_per_second=clock.time_codes_per_second,
        frames_per_second=clock.frames_per_second,
        start_time_code=clock.start,
        end_time_code=clock.end,
        default_prim=default.GetName() if default else "",
        earlier_layers=tuple(stages.display_name(layer, path) for layer in earlier),
    )
