"""Logs of accelerometers as Klipper writes them: `#time,accel_x,accel_y,accel_z`, in mm/s^2."""

from __future__ import annotations

import numpy as np
from calmotion.errors import ShotError
from calmotion.recordings import ACCELEROMETER, Channel, RecordingRequest, SensorRecording, hash_of

from .columns import column_of, increasing, read_columns, unit_of
from .maps import axes_of, map_of, noise_in

_KNOWN = ("prim", "axes", "unit", "noise")
_EXAMPLE = 'Write prim = "/PRIM", axes = "y, -x, z", unit = "g" and noise = 0.02 as far as they are needed'


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
    content, beside = map_of(file, "", _KNOWN, _EXAMPLE)
    own: dict[str, object] = {"prim": prim, "axes": axes, "unit": unit, **(content or {})}
    path = request.prim or str(own["prim"])
    if not path.startswith("/"):
        raise ShotError(
            "nothing says where the accelerometer sits",
            path=file,
            remedy=f'Write --recording {file}@/PRIM with a prim below a body, or prim = "/PRIM" into {beside}',
        )
    scale = unit_of(str(own["unit"]), ("mm/s^2", "m/s^2", "g"), beside, "unit")
    columns, _ = read_columns(file)
    parts = [
        sign * column_of(columns, f"accel_{'xyz'[axis]}", file)
        for axis, sign in axes_of(str(own["axes"]), file, "accelerometer")
    ]
    keep = increasing(column_of(columns, "time", file), file, "time")
    values, sigma = scale * np.stack(parts, axis=1)[keep], noise_in(own, scale, beside)
    channel = Channel(ACCELEROMETER, path, columns["time"][keep], values, sigma)
    return SensorRecording(file, hash_of(file), (channel,))
