"""Readers of recordings: tables, accelerometer logs of 3D printers, motion captures in C3D, bags of ROS 2."""

from __future__ import annotations

from typing import ClassVar

from calmotion.host import Property, PropertyValues, registration
from calmotion.recordings import RecordingReader, RecordingRequest, SensorRecording, first_line

PRINTER_HEAD = "#time,accel_x,accel_y,accel_z"


class ReadRecordedTable(RecordingReader):
    """A CSV table: its header names prims, or a TOML map beside it says what its columns are."""

    idname = "recording.table"
    label = "Read the recording"
    suffixes: ClassVar[tuple[str, ...]] = (".csv", ".tsv", ".txt")
    properties: ClassVar[tuple[Property, ...]] = (
        Property("map", str, "", description="TOML map of the columns; without it FILE.toml beside the recording"),
    )

    @classmethod
    def reads(cls, request: RecordingRequest) -> bool:
        """Tables that are no accelerometer log."""
        return super().reads(request) and not _of_printer(request)

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording."""
        from .tables import read_table

        return read_table(request, properties.map)


class ReadPrinterAccelerometer(RecordingReader):
    """The log of an accelerometer as Klipper writes it (`#time,accel_x,accel_y,accel_z`, mm/s^2)."""

    idname = "recording.accelerometer"
    label = "Read the accelerometer"
    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    properties: ClassVar[tuple[Property, ...]] = (
        Property("prim", str, "", description="Prim at which the accelerometer sits, in whose axes it measures"),
        Property(
            "axes",
            str,
            "x, y, z",
            description="Axes of the accelerometer that lie along x, y and z of the prim, such as y, -x, z",
        ),
        Property("unit", str, "mm/s^2", choices=("mm/s^2", "m/s^2", "g"), description="Unit of the log"),
    )

    @classmethod
    def reads(cls, request: RecordingRequest) -> bool:
        """Tables with the head that printers write."""
        return super().reads(request) and _of_printer(request)

    def read(self, request: RecordingRequest, properties: PropertyValues) -> SensorRecording:
        """The recording."""
        from .printers import read_log

        return read_log(request, properties.prim, properties.axes, properties.unit)


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


def _of_printer(request: RecordingRequest) -> bool:
    return first_line(request.file).replace(" ", "").lower().startswith(PRINTER_HEAD)


register, unregister = registration(ReadRecordedTable, ReadPrinterAccelerometer, ReadMotionCapture, ReadBag)
