"""Readers of recordings: tables, motion captures in C3D, bags of ROS 2."""

from typing import ClassVar

from calmotion.host import Property, PropertyValues, registration
from calmotion.recordings import RecordingReader, RecordingRequest, SensorRecording


class ReadRecordedTable(RecordingReader):
    """A CSV table: its header names prims, or a TOML map beside it says what its columns are."""

    idname = "recording.table"
    label = "Read the recording"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt")
    properties: ClassVar[tuple[Property, ...]] = (
        Property("map", str, "", description="TOML map of the columns; without it FILE.toml beside the recording"),
    )

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording."""
        from .tables import read_table

        return read_table(request, properties.map)


class ReadMotionCapture(RecordingReader):
    """The markers of a motion capture in a C3D file; a TOML map beside it says on which prims they sit."""

    idname = "recording.c3d"
    label = "Read the motion capture"
    suffixes: ClassVar[tuple[str, ...]] = (".c3d",)
    properties: ClassVar[tuple[Property, ...]] = (
        Property("map", str, "", description="TOML map of the labels; without it FILE.toml beside the recording"),
    )

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording."""
        from .motion_capture import read_c3d

        return read_c3d(request, properties.map)


class ReadBag(RecordingReader):
    """A bag of ROS 2 with JointState, Imu or PoseStamped; a TOML map beside it says to which prims they belong."""

    idname = "recording.bag"
    label = "Read the bag"
    suffixes: ClassVar[tuple[str, ...]] = (".mcap", ".db3")
    properties: ClassVar[tuple[Property, ...]] = (
        Property("map", str, "", description="TOML map of joints and topics; without it FILE.toml beside the bag"),
    )

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording."""
        from .bags import read_bag

        return read_bag(request, properties.map)


register, unregister = registration(ReadRecordedTable, ReadMotionCapture, ReadBag)
