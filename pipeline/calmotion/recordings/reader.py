"""Readers of recordings: operators of plugins that read what sensors recorded of a robot."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

from calmotion.errors import ShotError
from calmotion.host import NotAsked, Operator, PropertyValues, RunContext
from calmotion.recordings.recording import RecordingRequest, SensorRecording
from calmotion.support.files import refuse_special
from calmotion.support.foreign_files import refuse_lfs_pointers


class RecordingReader(Operator):
    """Base of the readers of `calmotion calibrate --recording FILE`.

    Attributes:
        suffixes: Of the files that it reads, with the dot, in lower case.
    """

    suffixes: ClassVar[tuple[str, ...]] = ()
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
        try:
            refuse_special(request.file)
            refuse_lfs_pointers([request.file])
            recording = self.read(request, context.properties)
        except OSError as error:
            raise ShotError(
                "the recording cannot be read", path=request.file, found=error.strerror, remedy="Name another file"
            ) from error
        for note in recording.notes:
            context.report("info", note)
        return (recording,)

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording in a file.

        Raises:
            OSError: It cannot be read.
            ShotError: It is wrong; the message names the place in the file and what to do.
        """
        raise NotImplementedError


def hash_of(file: str) -> str:
    """SHA-256 of a file.

    Raises:
        OSError: It cannot be read.
    """
    with open(file, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def first_line(file: str) -> str:
    """The first line of a file that is not empty, up to 4 kB of it; empty where it cannot be read."""
    try:
        refuse_special(file)
        with open(file, encoding="utf-8", errors="replace") as stream:
            lines = stream.read(4096).lstrip("\ufeff").splitlines()
    except OSError:
        return ""
    return next((line for line in lines if line.strip()), "")
