"""Which channel drives which motor: `channel=motor*factor+offset`, with commas between."""

import re
from dataclasses import dataclass

import numpy as np
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.host import SettingError, has_no_unit, nearest, parse_quantity
from calmotion.model import MotorTracks

from .bvh import BvhMotion

_ENTRY = re.compile(
    r"(?P<channel>[^=]+)=(?P<motor>[^*+]+?)(\*(?P<factor>[-+.\deE]+?))?(\+(?P<offset>-?[.\d]+ ?[a-z]*))?"
)
_LEAST_TURN = 1.0  # that is told where no motor has it [deg]


@dataclass(frozen=True)
class Entry:
    """Motor = factor * channel + offset, the offset in rad or m."""

    channel: str
    motor: str
    factor: float
    offset: float


def read_mapping(text: str, motion: BvhMotion) -> list[Entry]:
    """The entries of a mapping.

    Raises:
        SettingError: It is empty, or an entry is not of that form, or names a channel that the file does not have.
    """
    entries = [part.strip() for part in text.split(",") if part.strip()]
    if not entries:
        raise _wrong("no motor is driven by this motion", None, f"The channels are {', '.join(motion.channels)}")
    return [_entry(part, motion) for part in entries]


def _entry(text: str, motion: BvhMotion) -> Entry:
    match = _ENTRY.fullmatch(text.replace(" ", ""))
    if not match:
        raise _wrong("this is not an entry of a mapping", text, "Write it like RightArm.Zrotation=shoulder*-1+90deg")
    channel, motor = match["channel"], match["motor"]
    channel = next((name for name in motion.channels if name.replace(" ", "") == channel), channel)
    if channel not in motion.channels:
        known = ", ".join(motion.channels)
        raise _wrong(
            "the motion has no such channel", channel, f"{nearest(channel, motion.channels)}The channels are {known}"
        )
    turns = channel.endswith("rotation")
    try:
        factor = float(match["factor"] or 1.0)
        offset = parse_quantity(match["offset"] or "0", "rad" if turns else "m")
    except (ValueError, ShotError) as error:
        raise _wrong("this is not an entry of a mapping", text, str(error)) from None
    if offset and has_no_unit(match["offset"]):
        units = ("deg", "rad") if turns else ("mm", "m")
        written = " or ".join(f"{match['offset']}{unit}" for unit in units)
        raise _wrong("the offset has no unit", text, f"Write {written}, whichever it is")
    return Entry(channel, motor, factor, offset)


def notes_on(motion: BvhMotion, entries: list[Entry], unit: float) -> list[str]:
    """What a user should know of a mapping: turns of a joint that it leaves out, the order in which the channels of a
    joint apply, and the unit of positions [m]."""
    notes, used = [], [entry.channel for entry in entries]
    for joint in dict.fromkeys(channel.rpartition(".")[0] for channel in used if channel.endswith("rotation")):
        turns = [name for name in motion.channels if name.rpartition(".")[0] == joint and name.endswith("rotation")]
        columns = {name: np.unwrap(motion.frames[:, motion.channels.index(name)], period=360.0) for name in turns}
        left = {name: float(np.ptp(column)) for name, column in columns.items() if name not in used}
        left = {name: turned for name, turned in left.items() if turned > _LEAST_TURN}
        if left:
            shown = " and ".join(f"{turned:.3g} deg of {name}" for name, turned in left.items())
            notes.append(f"the mapping leaves out {shown}, so that {joint} does not point where the capture has it")
        if len(order := [name.rpartition(".")[2] for name in turns if name in used]) > 1:
            notes.append(f"{joint} turns by {', then '.join(order)}: its motors must follow each other in this order")
    if any(not channel.endswith("rotation") for channel in used):
        notes.append(f"positions are in units of {unit:g} m (bvh.read.unit)")
    return notes


def _wrong(problem: str, found: str | None, remedy: str) -> SettingError:
    return SettingError(problem, path="bvh.read.map", found=found, remedy=remedy)


def mapped_tracks(motion: BvhMotion, entries: list[Entry], *, unit: float, start: float) -> MotorTracks:
    """The tracks of the motors that a mapping names.

    Angles are unwrapped, since a file may jump by a turn where an angle passes 180 degrees.

    Args:
        unit: Length of the file's unit [m].
        start: Time in the file at which the shot begins [s].

    Raises:
        ShotError: The motion ends before the shot begins.
    """
    times = np.arange(len(motion.frames), dtype=np.float64) * motion.frame_time - start
    if times[-1] <= 0.0:
        raise ShotError(
            "the motion ends before the shot begins",
            path=motion.path,
            attribute="bvh.read.start",
            found=f"{start:g} s, and it lasts {times[-1] + start:.4g} s",
            remedy="Begin earlier",
        )
    values: dict[str, Array] = {}
    for entry in entries:
        column = motion.frames[:, motion.channels.index(entry.channel)]
        turns = entry.channel.endswith("rotation")
        channel_values = np.unwrap(np.radians(column)) if turns else unit * column
        if entry.motor in values:
            raise SettingError("two channels drive one motor", path="bvh.read.map", found=entry.motor)
        values[entry.motor] = entry.factor * channel_values + entry.offset
    return MotorTracks(motion.path, times, values)
