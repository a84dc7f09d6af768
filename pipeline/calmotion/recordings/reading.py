"""Readers of recordings: operators of plugins that read what sensors recorded of a robot."""

import hashlib
import os
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from calmotion.errors import ShotError, file_access, raise_all
from calmotion.host import Host, NotAsked, Operator, PropertyValues, RunContext, SettingError, Settings
from calmotion.model import Character
from calmotion.recordings.recording import ANGLE, EFFORT, RecordingRequest, SensorRecording, turned_on
from calmotion.support.files import refuse_special
from calmotion.support.foreign_files import refuse_lfs_pointers
from calmotion.support.naming import nearest
from calmotion.workflow.problems import value_of


class RecordingReader(Operator, ABC):
    """Base of the readers of `calmotion calibrate --recording FILE`.

    Attributes:
        suffixes: Of the files that it reads, with the dot, in lower case.
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
    named = ("suffixes",)
    requires = (RecordingRequest,)
    provides = (SensorRecording,)

    @classmethod
    def reads(cls, request: RecordingRequest) -> bool:
        """Whether it reads a file; by its suffix, unless a reader looks into it."""
        return request.file.lower().endswith(cls.suffixes)

    @classmethod
    def poll(cls, data: Mapping[type, Any]) -> str | None:
        """Only for files that it reads."""
        request = data.get(RecordingRequest)
        return None if request is not None and cls.reads(request) else NotAsked("the recording has another format")

    def execute(self, context: RunContext) -> Sequence[object]:
        """Read the file."""
        request = context.get(RecordingRequest)
        with file_access("the recording cannot be read", request.file, "Name another file"):
            refuse_special(request.file)
            refuse_lfs_pointers([request.file])
            recording = self.read(request, context.properties)
        for note in recording.notes:
            context.report("info", note)
        return (recording,)

    @abstractmethod
    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording in a file.

        Raises:
            OSError: It cannot be read.
            ShotError: It is wrong; the message names the place in the file and what to do.
        """


def hash_of(file: str) -> str:
    """SHA-256 of a file.

    Raises:
        OSError: It cannot be read.
    """
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


AT = "@/"  # FILE@/PRIM: where the sensor of a file sits


def requested(text: str) -> RecordingRequest:
    """A recording as the user names it: FILE, or FILE@/PRIM for a sensor whose file does not name its prim."""
    file, at, prim = text.rpartition(AT)
    return RecordingRequest(file, f"/{prim}") if at and not os.path.exists(text) else RecordingRequest(text)


def readers(host: Host) -> list[type[RecordingReader]]:
    """The readers that plugins add."""
    return [cls for cls in host.providers(SensorRecording) if issubclass(cls, RecordingReader)]


def read_recordings(host: Host, names: Sequence[str], settings: Settings) -> tuple[SensorRecording, ...]:
    """Read recordings.

    Args:
        host: With the readers.
        names: FILE or FILE@/PRIM of each.

    Raises:
        SettingError: There are none, one is named twice, or no reader reads it.
        RunError: One cannot be read.
    """
    if not names:
        raise SettingError("no recording is given", path="--recording", remedy="Name a file, such as shake.csv.")
    found = []
    requests = [requested(name) for name in names]
    for k, request in enumerate(requests):
        if any(os.path.realpath(request.file) == os.path.realpath(other.file) for other in requests[:k]):
            raise SettingError(
                "this recording is given twice", path="--recording", found=request.file, remedy="Name it once."
            )
        able = [cls for cls in readers(host) if cls.reads(request)]
        if os.path.exists(request.file) and not able:
            suffixes = sorted({suffix for cls in readers(host) for suffix in cls.suffixes})
            raise SettingError(
                "no plugin reads this recording",
                path="--recording",
                found=request.file,
                remedy=f"Use a file that ends in {', '.join(suffixes)}, or a plugin with a reader (--plugins).",
            )
        if not os.path.isfile(request.file):
            raise SettingError(
                "the recording does not exist", path="--recording", found=request.file, remedy="Check the path."
            )
        run = host.run([request], [SensorRecording], settings=settings).finish()
        found.append(turned_on(value_of(run, SensorRecording)))
    return tuple(found)


def measured_prims(recordings: Sequence[SensorRecording]) -> tuple[str, ...]:
    """Prims at which sensors sit, each once."""
    channels = [channel for recording in recordings for channel in recording.channels]
    return tuple(dict.fromkeys(path for channel in channels for path in channel.prims))


def refuse_unknown_channels(character: Character, recordings: Sequence[SensorRecording]) -> None:
    """Refuse channels of prims that the robot does not have.

    Raises:
        ShotError: There are some.
    """
    targets, motors = [t.path for t in character.targets], [m.path for m in character.motors]
    problems = []
    for recording in recordings:
        for channel in recording.channels:
            known = motors if channel.kind in (ANGLE, EFFORT) else targets
            for path in [path for path in channel.prims or (channel.path,) if path not in known]:
                problems.append(
                    ShotError(
                        f"the recording has a channel ({channel.kind}) of a prim that the robot does not have",
                        path=recording.file,
                        attribute=path,
                        found="no such " + ("motor" if known is motors else "prim below a body"),
                        remedy=f"{nearest(path, known)}Correct the column, or its row in the TOML map",
                    )
                )
    raise_all(problems)
