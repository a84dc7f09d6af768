"""Logs of accelerometers as Klipper writes them: `#time,accel_x,accel_y,accel_z`, in mm/s^2."""

from __future__ import annotations

import os

import numpy as np
from calmotion.errors import ShotError
from calmotion.recordings import ACCELEROMETER, Channel, RecordingRequest, SensorRecording, hash_of
from calmotion.support import read_toml

from .columns import UNITS, column_of, increasing, read_columns

AXES = ("x", "y", "z")
_KNOWN = ("prim", "axes", "unit", "noise")


def read_log(request: RecordingRequest, prim: str, axes: str, unit: str) -> SensorRecording:
    """A recording from the log of an accelerometer.

    FILE.toml beside the log may have `prim`, `axes`, `unit` and `noise`; they are stronger than the arguments, and the
    prim of the request is the strongest.

    Args:
        request: Its file, and where the accelerometer sits.
        prim: Where it sits, unless the request says so.
        axes: Its axes along x, y and z of the prim.
        unit: Of the log.

    Raises:
        ShotError: The log cannot be read, or nothing says where the accelerometer sits.
    """
    file = request.file
    beside = f"{os.path.splitext(file)[0]}.toml"
    own: dict[str, object] = {"prim": prim, "axes": axes, "unit": unit, "noise": None}
    if os.path.isfile(beside):
        try:
            content = read_toml(beside)
        except (OSError, ValueError) as error:
            raise ShotError("the map of the recording cannot be read", path=beside, found=error) from error
        wrong = next((key for key in content if key not in _KNOWN), None)
        if wrong is not None:
            raise ShotError(
                "the map of an accelerometer has no such entry", path=beside, attribute=wrong,
                remedy=f"Use {', '.join(_KNOWN)}",
            )  # fmt: skip
        own |= content
    path = request.prim or str(own["prim"])
    if not path.startswith("/"):
        raise ShotError(
            "nothing says where the accelerometer sits", path=file,
            remedy=f"Write --recording {file}@/PRIM with a prim below a body, or prim = \"/PRIM\" into {beside}",
        )  # fmt: skip
    if own["unit"] not in ("mm/s^2", "m/s^2", "g"):
        raise ShotError(
            "this unit does not fit", path=beside, attribute="unit", found=own["unit"], remedy="Use mm/s^2, m/s^2 or g"
        )
    columns, _ = read_columns(file)
    scale = UNITS[str(own["unit"])]
    values = scale * np.stack([column_of(columns, name, file) for name in _columns(str(own["axes"]), file)], axis=1)
    keep = increasing(column_of(columns, "time", file), file, "time")
    noise = own["noise"]
    if noise is not None and (isinstance(noise, bool) or not isinstance(noise, (int, float)) or not noise > 0.0):
        raise ShotError(
            "must be the standard deviation of the noise, in the unit of the log", path=beside, attribute="noise",
            found=noise, remedy="Write a positive number, or leave it out",
        )  # fmt: skip
    sigma = scale * float(noise) if isinstance(noise, (int, float)) else None
    channel = Channel(ACCELEROMETER, path, columns["time"][keep], values[keep], sigma)
    return SensorRecording(file, hash_of(file), (channel,))


def _columns(axes: str, file: str) -> list[str]:
    """Columns for x, y and z of the prim, with their signs."""
    names = [name.strip().lower() for name in axes.split(",")]
    plain = [name.lstrip("+-") for name in names]
    if sorted(plain) != sorted(AXES):
        raise ShotError(
            "must name each axis of the accelerometer once", path=file, attribute="axes", found=axes,
            remedy="Write those along x, y and z of the prim, such as y, -x, z",
        )  # fmt: skip
    return [f"{'-' if name.startswith('-') else ''}accel_{own}" for name, own in zip(names, plain, strict=True)]
