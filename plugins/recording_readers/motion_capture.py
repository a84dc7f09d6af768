"""Markers of a motion capture in C3D files."""

import numpy as np
from calmotion.errors import ShotError
from calmotion.recordings import MARKER, Channel, RecordingRequest, SensorRecording, hash_of
from calmotion.support import nearest

from .columns import UNITS
from .maps import axes_of, map_of, prims_in

EXAMPLE = 'Write [markers] with lines such as Cup1 = "/Arm/Hand/cup", and axes = "x, z, -y" above it if axes differ'
LENGTHS = ("m", "cm", "mm", "in")


def read_c3d(request: RecordingRequest, map_file: str) -> SensorRecording:
    """The markers of a C3D file.

    Args:
        request: Its file.
        map_file: TOML map from labels to prims; empty: FILE.toml beside it; without one, labels are prim paths.

    Raises:
        ShotError: The file or the map cannot be read, or do not fit.
    """
    file = request.file
    try:
        from ezc3d import c3d
    except ImportError as error:
        raise ShotError(
            "C3D files need the library ezc3d", path=file, remedy="Run pip install ezc3d, or export a table"
        ) from error
    try:
        content = c3d(file)
    except Exception as error:  # of a library in C++, which has no classes of its own
        raise ShotError(
            "this is not a C3D file, or it is damaged", path=file, found=error, remedy="Export it again"
        ) from error
    parameters = content["parameters"]["POINT"]
    names, rates = (np.ravel(parameters.get(name, {}).get("value", ())) for name in ("LABELS", "RATE"))
    labels = [str(name).strip() for name in names]
    unit = str((parameters.get("UNITS", {}).get("value") or ["mm"])[0]).strip() or "mm"
    rate = float(rates[0]) if len(rates) else 0.0
    if unit not in LENGTHS or not rate > 0.0:
        raise ShotError(
            "the file has a unit or a rate that does not fit",
            path=file,
            attribute="POINT:UNITS and POINT:RATE",
            found=f"{unit} and {rate:g}",
            remedy=f"Export it again in {', '.join(LENGTHS)}",
        )
    markers, axes = _map(file, map_file, labels)
    points = np.asarray(content["data"]["points"], np.float64)[:3]
    lost = np.asarray(content["data"]["meta_points"]["residuals"])[0] < 0.0
    points[:, lost] = np.nan
    times = np.arange(points.shape[2]) / rate
    channels = []
    for label, path in markers.items():
        values = UNITS[unit] * np.stack([sign * points[axis, labels.index(label)] for axis, sign in axes], axis=1)
        rows = np.isfinite(values).all(axis=1)
        if rows.any():
            channels.append(Channel(MARKER, path, times[rows], values[rows]))
    if not channels:
        raise ShotError("no marker has a sample", path=file, found=", ".join(markers), remedy=EXAMPLE)
    return SensorRecording(file, hash_of(file), tuple(channels))


def _map(file: str, map_file: str, labels: list[str]) -> tuple[dict[str, str], list[tuple[int, float]]]:
    """Prim paths by label, and the column and sign of each axis of the world."""
    content, beside = map_of(file, map_file, (), EXAMPLE)
    if content is None:
        paths = {label: label for label in labels if label.startswith("/")}
        if not paths:
            raise ShotError(
                "nothing says on which prims the markers sit",
                path=file,
                found=", ".join(labels[:8]),
                remedy=f"Write {beside}. {EXAMPLE}",
            )
        return paths, axes_of("x, y, z", file, "recording")
    markers = prims_in({"markers": None} | content, "markers", beside, EXAMPLE)
    for label in markers:
        if label not in labels:
            raise ShotError(
                "the recording has no marker of this label",
                path=beside,
                attribute=f"markers.{label}",
                remedy=f"{nearest(label, labels)}Its labels are {', '.join(labels)}",
            )
    return markers, axes_of(str(content.get("axes", "x, y, z")), beside, "recording")
