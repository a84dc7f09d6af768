"""Bags of ROS 2 (MCAP, SQLite): states of joints, inertial sensors, poses; on the clock of their headers."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from calmotion.errors import ShotError
from calmotion.recordings import (
    ACCELEROMETER,
    ANGLE,
    EFFORT,
    MARKER,
    Channel,
    RecordingRequest,
    SensorRecording,
    hash_of,
)
from calmotion.support import nearest

from .maps import map_of, prims_in

JOINTS, IMU, POSE = "sensor_msgs/JointState", "sensor_msgs/Imu", "geometry_msgs/PoseStamped"
EXAMPLE = (
    'Write [joints] with lines such as shoulder = "/Arm/joints/shoulder", and [topics] with lines such as '
    '"/imu/data" = "/Arm/Hand/sensor"'
)
Message = tuple[str, str, float, Any]  # topic, type, time at which it was stored [s], content


@dataclass
class _Samples:
    times: list[float] = field(default_factory=list)
    values: list[tuple[float, ...]] = field(default_factory=list)


def read_bag(request: RecordingRequest, map_file: str) -> SensorRecording:
    """The channels of a bag.

    Args:
        request: Its file: of MCAP, or the `.db3` file in the folder of a bag.
        map_file: TOML map from joints and topics to prims; empty: FILE.toml beside it; without one, names of joints are
            prim paths, and all sensors of a bag sit at the prim of the request.

    Raises:
        ShotError: A library is missing, or the bag or the map cannot be read, or do not fit.
    """
    file = request.file
    messages = _mcap if file.lower().endswith(".mcap") else _sqlite
    joints, topics = _map(file, map_file)
    found: dict[tuple[str, str], _Samples] = {}
    seen: dict[str, str] = {}
    for topic, kind, stored, message in messages(file):
        if kind not in (JOINTS, IMU, POSE):
            continue
        seen[topic] = kind
        try:
            stamp = _stamp(message, stored)
            rows = list(_values(kind, topic, message, joints, topics, request.prim))
        except (AttributeError, LookupError, TypeError, ValueError) as error:  # the bag itself says what fields it has
            raise _damaged(file, f"a message of {topic} is no {kind}: {error}") from error
        for of, path, row in rows:
            samples = found.setdefault((of, path), _Samples())
            samples.times.append(stamp)
            samples.values.append(row)
    _check(file, joints, topics, seen, found)
    channels, notes = [], []
    for (kind, path), samples in found.items():
        times, values = np.array(samples.times), np.array(samples.values, np.float64)
        order = np.argsort(times, kind="stable")
        times, values = times[order], values[order]
        kept = np.concatenate([[True], np.diff(times) > 0.0])
        if not kept.all():
            notes.append(f"{np.count_nonzero(~kept)} samples of {kind} {path} have the time of the one before")
        channels.append(Channel(kind, path, times[kept], values[kept]))
    begin = min(float(channel.times[0]) for channel in channels)
    channels = [Channel(c.kind, c.path, c.times - begin, c.values) for c in channels]  # of 1e9 s since 1970
    return SensorRecording(file, hash_of(file), tuple(channels), tuple(notes))


def _values(
    kind: str, topic: str, message: Any, joints: Mapping[str, str] | None, topics: Mapping[str, str] | None, prim: str
) -> Iterator[tuple[str, str, tuple[float, ...]]]:
    """Kind of channel, prim path and values of what a message tells."""
    if kind == JOINTS:
        for k, name in enumerate(message.name):
            path = (joints or {}).get(name, name if name.startswith("/") else "")
            if path and len(message.position) > k:
                yield ANGLE, path, (float(message.position[k]),)
            if path and len(message.effort) > k:
                yield EFFORT, path, (float(message.effort[k]),)
        return
    path = (topics or {}).get(topic, "" if topics else prim)
    if not path:
        return
    if kind == IMU:
        v = message.linear_acceleration
        # ROS says -1 in the first covariance of what a sensor does not measure
        if float(message.linear_acceleration_covariance[0]) != -1.0:
            yield ACCELEROMETER, path, (float(v.x), float(v.y), float(v.z))
    else:
        v = message.pose.position
        yield MARKER, path, (float(v.x), float(v.y), float(v.z))


def _stamp(message: Any, stored: float) -> float:
    """Time of a message [s]: of its header, or when it was stored where the header has none."""
    stamp = message.header.stamp
    time = stamp.sec + 1e-9 * stamp.nanosec
    return float(time) if time else stored


def _map(file: str, map_file: str) -> tuple[dict[str, str] | None, dict[str, str] | None]:
    """Prim paths by the name of a joint and by topic; None where nothing is said."""
    content, path = map_of(file, map_file, ("joints", "topics"), EXAMPLE)
    joints, topics = (
        prims_in(content, name, path, EXAMPLE) if content and name in content else None for name in ("joints", "topics")
    )
    return joints, topics


def _check(
    file: str,
    joints: Mapping[str, str] | None,
    topics: Mapping[str, str] | None,
    seen: Mapping[str, str],
    found: Mapping[tuple[str, str], _Samples],
) -> None:
    if not seen:
        raise ShotError(
            "the bag has no message of a joint, an inertial sensor or a pose",
            path=file,
            remedy=f"Record a topic of {JOINTS}, {IMU} or {POSE}",
        )
    for topic in topics or {}:
        if topic not in seen:
            raise ShotError(
                "the bag has no such topic",
                path=file,
                attribute=f"topics.{topic}",
                remedy=f"{nearest(topic, list(seen))}Its topics are {', '.join(seen)}",
            )
    for name, path in (joints or {}).items():
        if (ANGLE, path) not in found and (EFFORT, path) not in found:
            raise ShotError(
                "no state of this joint is in the bag", path=file, attribute=f"joints.{name}", remedy="Correct its name"
            )
    if not found:
        raise ShotError(
            "nothing says on which prims the sensors sit",
            path=file,
            found=", ".join(seen),
            remedy=f"Write {os.path.splitext(file)[0]}.toml. {EXAMPLE}; or name a single sensor as FILE@/PRIM",
        )


def _mcap(file: str) -> Iterator[Message]:
    """All messages of an MCAP file."""
    reader = _library(lambda: __import__("mcap_ros2.reader", fromlist=["reader"]), file, "mcap-ros2-support")
    with open(file, "rb") as stream:
        try:
            for found in reader.read_ros2_messages(stream):
                yield found.channel.topic, _kind(found.schema.name), 1e-9 * found.log_time_ns, found.ros_msg
        except Exception as error:  # of two libraries, which also seek where no file can have a byte
            raise _damaged(file, error) from error


def _sqlite(file: str) -> Iterator[Message]:
    """All messages of the bag in whose folder a file lies."""
    library = _library(lambda: __import__("rosbags.highlevel", fromlist=["highlevel"]), file, "rosbags")
    stores = __import__("rosbags.typesys", fromlist=["typesys"])
    folder = Path(os.path.abspath(file)).parent
    if not (folder / "metadata.yaml").is_file():
        raise ShotError(
            "the folder of the bag has no metadata.yaml",
            path=file,
            remedy="Name the .db3 file in the folder that ros2 bag wrote, or run ros2 bag reindex",
        )
    try:
        store = stores.get_typestore(stores.Stores.ROS2_HUMBLE)
        with library.AnyReader([folder], default_typestore=store) as reader:
            for connection, stored, raw in reader.messages():
                kind = _kind(connection.msgtype)
                if kind in (JOINTS, IMU, POSE):
                    message = reader.deserialize(raw, connection.msgtype)
                    yield connection.topic, kind, 1e-9 * stored, message
    except OSError:
        raise
    except Exception as error:  # the library has several classes of its own
        raise _damaged(file, error) from error


def _kind(name: str) -> str:
    """`sensor_msgs/Imu` for `sensor_msgs/msg/Imu`."""
    return name.replace("/msg/", "/")


def _damaged(file: str, error: object) -> ShotError:
    return ShotError("this is not a bag of ROS 2, or it is damaged", path=file, found=error, remedy="Record it again")


def _library(load: Callable[[], Any], file: str, name: str) -> Any:
    try:
        return load()
    except ImportError as error:
        raise ShotError(
            f"this recording needs the library {name}", path=file, remedy=f"Run pip install {name}"
        ) from error
