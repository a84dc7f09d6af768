"""Reading a shot: a file becomes a Character, an Animation and a Provenance."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdSkel

from calmotion.errors import raise_all
from calmotion.model import Animation, Character, MotorTracks, MovingFrame, Provenance, Track
from calmotion.model.curves import retimed, with_schedules_at
from calmotion.support.naming import as_written, grouped_notes
from calmotion.usd import stages
from calmotion.usd.clock import Clock, clock_of, still_clock
from calmotion.usd.diagnostics import quiet, with_places
from calmotion.usd.masks import masked
from calmotion.usd.reading.animated import carriers, codes_of, hold_constants, retime_map, tempo_of
from calmotion.usd.reading.character import Skeleton, build_character, read_skeleton
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_of
from calmotion.usd.reading.doubtful_motions import limit_doubts, motion_doubts
from calmotion.usd.reading.joints.joint_prims import joint_prims
from calmotion.usd.reading.joints.roots import moving_frames
from calmotion.usd.reading.motors.driven_motors import BODIES, CONSTANT, DRIVE, GIVEN, Drive, to_si
from calmotion.usd.reading.motors.given_tracks import given_tracks, length_note
from calmotion.usd.reading.motors.holds import held
from calmotion.usd.reading.motors.motor_limits import free_tracks, with_power
from calmotion.usd.reading.motors.posed_motors import joint_motions, pose_codes, posed_track
from calmotion.usd.reading.motors.skeletal_motors import HingeStack, hinge_stacks, performed_on, skeletal_tracks
from calmotion.usd.reading.motors.tracks import read_track, sample_codes, swings
from calmotion.usd.reading.motors.turns import unwrapped
from calmotion.usd.reading.motors.undriven_joints import target_positions
from calmotion.usd.reading.provenance import notes_of_results, provenance_of
from calmotion.usd.reading.targets import weight_tracks
from calmotion.usd.reading.unread import misplaced_schemas, unread_attributes
from calmotion.usd.reading.variants import naming_variants, physics_elsewhere
from calmotion.usd.reading.well_formed import broken_transforms, wrong_types
from calmotion.usd.units import other_units, units_of

_PARTS = 8  # of a frame, at which bodies that splines pose are read


def read_shot(
    path: str, *, still: bool = False, given: MotorTracks | None = None, measured: Sequence[str] = ()
) -> tuple[Character, Animation, Provenance]:
    """Read a shot.

    Layers that Calmotion wrote earlier are muted to read the character and the intended motion; the motion with them
    is in `Animation.current`.

    Args:
        path: A .usda, .usdc, .usd or .usdz file.
        still: Whether a character that nothing animates is read as well; its animation is then one frame.
        given: Tracks given in addition to the shot, which replace those of the motors that they name.
        measured: Prims at which sensors measured: they are targets as well.

    Returns:
        The character, its animation, and what a writer must know.

    Raises:
        ShotError: The shot cannot be processed; with prim path, attribute and remedy. A `ShotErrors` where several
            things are wrong.
    """
    with quiet() as messages:
        composed = stages.open_stage(path)
        stages.refuse_result_layer(composed, path)
        earlier = stages.earlier_layers(composed)
        stage = stages.open_stage(path, muted=earlier) if earlier else composed
        codes = retime_map(composed) if earlier else None
        part = masked(stage, earlier)
        read = read_stage(part, still, given, measured, stage, None if codes is None else float(codes[-1, 0]))
        reading, clock, character, tracks = read.reading, read.clock, read.character, read.tracks
        tempo, shown = tempo_of(clock, codes)
        current = tracks
        if earlier:
            # predicted motions are not animation; optimised curves of bodies and skeletons are
            motions = stages.earlier_layers(composed, (stages.MOTION,))
            result = stages.open_stage(path, muted=motions) if motions else composed
            result = result if part is stage else masked(result, motions)
            of_motors = Reading(result, reading.units, clock.start)
            standing = hinge_stacks(reading, read.skeleton.drives)
            current = motor_tracks(of_motors, read.skeleton.drives, shown, read.given, standing)
            raise_all(of_motors.problems)
        provenance = provenance_of(path, stage, shown, earlier)
        of_results = notes_of_results(composed, path, earlier, provenance.layers)
        weights = weight_tracks(part, character.targets, clock)
        free = free_tracks(part, character.motors, clock)
        character = with_power(part, character, clock)
        unread = grouped_notes([error.message() for error in (*unread_attributes(part), *misplaced_schemas(part))])
    notes = (f"{place}: {message}" for place, message in with_places(messages, part, prims_of(part)))
    told = (*character.notes, *of_results, *unread, *notes)
    character = dataclasses.replace(character, notes=tuple(as_written(note, provenance.names) for note in told))
    animation = Animation(clock.frame_times(), tracks, current, read.moving, weights, free)
    if tempo is not None:
        made = retimed(dataclasses.replace(animation, current=tracks), tempo, shown.frame_times())
        character, animation = with_schedules_at(character, tempo), dataclasses.replace(made, current=current)
    return character, animation, provenance


@dataclass(frozen=True, eq=False)
class StageReading:
    """The content of one stage."""

    reading: Reading
    clock: Clock
    skeleton: Skeleton
    character: Character
    tracks: tuple[Track, ...]
    moving: tuple[MovingFrame, ...]
    given: MotorTracks | None


def read_stage(
    stage: Usd.Stage, still: bool = False, given: MotorTracks | None = None, measured: Sequence[str] = (),
    whole: Usd.Stage | None = None, end: float | None = None,
) -> StageReading:  # fmt: skip
    """Read a composed stage; arguments and errors as for `read_shot`.

    Args:
        whole: The stage with all of its prims, of which `stage` is a part; None: it is whole.
        end: Time code of the last frame where the stage has that of a performance at another tempo.
    """
    with stages.refused_by_usd(stage), naming_variants(whole or stage):
        raise_all(list(wrong_types(stage)))
        raise_all(list(broken_transforms(stage)))
        animated = hold_constants(stage)
        units = units_of(stage)
        clock = shot_clock(stage, given)
        if end is not None:
            clock = dataclasses.replace(clock, end=end)
        reading = Reading(stage, units, clock.start, whole=whole)
        reading.notes += animated
        if given is not None:
            given, told = given_tracks(stage, given)
            reading.notes += filter(None, (*told, length_note(given, clock.frame_times())))
        skeleton = read_skeleton(reading, clock, still, () if given is None else tuple(given.values), measured)
        for warning in other_units(stage, map(stage.GetPrimAtPath, skeleton.poses)):
            reading.warn(warning)
        tracks = motor_tracks(reading, skeleton.drives, clock, given)
        moving = moving_frames(reading, skeleton.joints, skeleton.poses, clock)
        _note_dense_samples(tracks, clock, reading)
        character = build_character(reading, skeleton)
        notes = (*character.notes, *limit_doubts(character), *motion_doubts(character, tracks))
        if not character.motors and (chosen := physics_elsewhere(whole or stage)):
            notes += (f"another variant has more physics. {chosen}",)
        character = dataclasses.replace(character, notes=notes)
        return StageReading(reading, clock, skeleton, character, tracks, moving, given)


def shot_clock(stage: Usd.Stage, given: MotorTracks | None) -> Clock:
    """The clock of a shot: its range is that of the stage, else of the samples of its drives, else of those of bodies
    and skeletons; one frame where nothing is animated."""
    codes = [c for prim in joint_prims(stage) for drive in target_positions(prim) for c in sample_codes(drive)]
    if given is not None:
        rate, start = stage.GetTimeCodesPerSecond(), stage.GetStartTimeCode()
        codes += [start + rate * t for t in given.times[[0, -1]]]
    if not codes:
        for prim in prims_of(stage):
            if is_rigid_body(prim):
                codes += [code for carrier in carriers(prim) for code in codes_of(carrier)]
            elif prim.IsA(UsdSkel.Animation):
                codes += prim.GetAttribute("rotations").GetTimeSamples()
    if not codes:
        return still_clock(stage)
    return clock_of(stage, np.array(codes, dtype=np.float64))


def motor_tracks(
    reading: Reading,
    drives: Sequence[Drive],
    clock: Clock,
    given: MotorTracks | None = None,
    standing: Sequence[HingeStack] | None = None,
) -> tuple[Track, ...]:
    """The tracks of the motors, each read from its source.

    Args:
        reading: The stage to read; receives problems and notes.
        standing: Where that stage carries curves of ours, the skeletons' joints as the bodies stand without them; then
            a motor that held still may be animated.
    """
    stage = reading.stage
    tracks: dict[str, Track] = {}
    posed = [d for d in drives if d.source == BODIES or (d.source == CONSTANT and d.constant is None)]
    bodies = [drive.joint for drive in posed]
    codes = pose_codes(stage, bodies, clock, _PARTS)
    if len(codes) == 0:
        codes = np.unique([clock.start, clock.end])
    for joint, motion in zip(bodies, joint_motions(reading, bodies, codes), strict=True):
        tracks[joint.path] = posed_track(motion, joint, codes, clock, reading)
    stacks = hinge_stacks(reading, drives) if standing is None else performed_on(standing, stage)
    for stack in stacks:
        with reading.collecting_problems():
            tracks |= skeletal_tracks(stack, clock, reading)
    for drive in drives:
        unit, path = to_si(drive.joint.kind, reading.units), drive.joint.path
        attribute = drive.attribute(stage)
        with reading.collecting_problems():
            if drive.source == DRIVE or (standing is not None and attribute and len(sample_codes(attribute))):
                tracks[path] = read_track(attribute, clock, reading, unit)
            elif drive.source == GIVEN and given is not None:
                tracks[path] = Track(given.times, given.values[path])
            elif drive.source == CONSTANT and drive.constant is not None:
                ends = np.unique([clock.start, clock.end])
                tracks[path] = Track(clock.seconds(ends), np.full(len(ends), drive.constant))
    frame = 1.0 / clock.frames_per_second
    for drive in (drive for drive in drives if drive.joint.path in tracks):
        joint, attribute = drive.joint, drive.attribute(stage)
        tracks[joint.path] = held(unwrapped(tracks[joint.path], joint, reading), frame, joint, reading)
        if drive.source == DRIVE and attribute.GetNumTimeSamples():
            reading.notes.extend(
                swings(attribute.GetPath(), tracks[joint.path], clock, to_si(joint.kind, reading.units))
            )
    for drive in drives:
        if drive.gear is not None and drive.gear.leader in tracks:
            led = tracks[drive.gear.leader]
            tracks[drive.joint.path] = Track(led.times, drive.gear.offset + drive.gear.ratio * led.values, led.corners)
    return tuple(tracks[drive.joint.path] for drive in drives if drive.joint.path in tracks)


def _note_dense_samples(tracks: tuple[Track, ...], clock: Clock, reading: Reading) -> None:
    """Note that the animation is sampled more densely than the frames."""
    frame = 1.0 / clock.frames_per_second
    if any(len(track.times) > 1 and np.median(np.diff(track.times)) < 0.75 * frame for track in tracks):
        reading.note(
            f"the animation has more samples than its {clock.frames_per_second:g} frames a second; curves are written "
            "with those of them that they need, unless --samples-per-second gives a number"
        )
