"""An animation at another tempo: what is a function of its time s is one of s(t), sampled where the performance is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.arrays import Array
from calmotion.model.animation import Animation, FreeTrack, MovingFrame, Track
from calmotion.model.character import Character
from calmotion.model.curves import held_curve, root_at
from calmotion.model.retiming.tempo import TimeMap

MOST_PARTS = 16  # samples of a track in a frame
NEAR = 1e-4  # [rad or m], by which a cubic through samples may be off between them


def retimed(animation: Animation, tempo: TimeMap, frame_times: Array) -> Animation:
    """An animation at a tempo. Tracks have samples at the performance's frames, and between them where it takes more to
    be as the animation was.

    Args:
        animation: As it was made.
        tempo: Its times and the performance's.
        frame_times: Of the performance [s], shape [f], first 0.
    """
    end = float(animation.frame_times[-1])

    def curve(track: Track, parts: int = 1) -> Track:
        times = _divided(frame_times, parts)
        corners = tempo.performed(track.corners)
        corners = corners[(corners > 0.0) & (corners < frame_times[-1])]
        times, whole = _with_corners(times, corners), held_curve(track, end)
        found = Track(times, whole(tempo.animated(times), 0), corners)
        between = _divided(frame_times, 2 * parts)
        off = held_curve(found, float(frame_times[-1]))(between, 0) - whole(tempo.animated(between), 0)
        return curve(track, 2 * parts) if np.max(np.abs(off)) > NEAR and parts < MOST_PARTS else found

    def frame(moving: MovingFrame) -> MovingFrame:
        axes = [curve(Track(moving.times, column)) for column in moving.positions.T]
        times = max((axis.times for axis in axes), key=len)
        there = tempo.animated(times)
        position = [held_curve(Track(moving.times, column), end)(there, 0) for column in moving.positions.T]
        return MovingFrame(moving.joint, times, np.stack(position, axis=1), _continuous(root_at(moving, there)))

    tracks = tuple(curve(track) for track in animation.tracks)
    current = tracks if animation.current is animation.tracks else tuple(curve(track) for track in animation.current)
    return Animation(
        frame_times, tracks, current, tuple(frame(moving) for moving in animation.moving),
        tuple(replace(weight, times=tempo.performed(weight.times)) for weight in animation.weights),
        tuple(FreeTrack(track.motor, tempo.performed(track.times), track.free) for track in animation.free), tempo,
    )  # fmt: skip


def with_contacts_at(character: Character, tempo: TimeMap) -> Character:
    """The character whose feet come and go at a tempo."""
    joints = tuple(
        joint if joint.contact is None
        else replace(joint, contact=replace(joint.contact, times=tempo.performed(joint.contact.times)))
        for joint in character.joints
    )  # fmt: skip
    return replace(character, joints=joints)


def _divided(frames: Array, parts: int) -> Array:
    """Times of frames, and of others between them: so many in each."""
    return np.asarray(np.linspace(frames[0], frames[-1], (len(frames) - 1) * parts + 1))


def _with_corners(times: Array, corners: Array) -> Array:
    """The times and those of corners, in place of any within a quarter of a sample of them."""
    if not len(corners):
        return times
    inner = times[1:-1]
    near = np.min(np.abs(inner[:, None] - corners), axis=1) < 0.25 * (times[1] - times[0])
    return np.asarray(np.union1d(np.concatenate([times[:1], inner[~near], times[-1:]]), corners))


def _continuous(rotations: Rotation) -> Array:
    """Quaternions (w, x, y, z) of which neighbours have the same sign, shape [k, 4]."""
    found: Array = np.roll(rotations.as_quat(), 1, axis=1)
    turns = np.where(np.sum(found[1:] * found[:-1], axis=1) < 0.0, -1.0, 1.0)
    found[1:] *= np.cumprod(turns)[:, None]
    return found
