"""Bags of ROS 2: what was written by their own libraries is read with its prims, times and units."""

import numpy as np
import pytest
from calmotion.recordings import read_recordings
from calmotion.testing import host_with
from calmotion.workflow.problems import RunError

START = 1_700_000_000


def messages(times):
    """Joint states of two joints, an inertial sensor and a pose, as (topic, type, stamp, content)."""
    for k, t in enumerate(times):
        stamp = {"sec": START + int(t), "nanosec": round(1e9 * (t - int(t)))}
        header = {"stamp": stamp, "frame_id": ""}
        zero = {"x": 0.0, "y": 0.0, "z": 0.0}
        unit = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
        yield "/joint_states", "sensor_msgs/msg/JointState", {
            "header": header, "name": ["shoulder", "elbow"], "position": [0.1 * k, -0.2 * k], "velocity": [],
            "effort": [1.0 + k, 2.0],
        }  # fmt: skip
        yield "/imu", "sensor_msgs/msg/Imu", {
            "header": header, "orientation": unit, "orientation_covariance": [-1.0] + 8 * [0.0],
            "angular_velocity": zero, "angular_velocity_covariance": 9 * [0.0],
            "linear_acceleration": {"x": 1.0 * k, "y": 0.5, "z": 9.81}, "linear_acceleration_covariance": 9 * [0.0],
        }  # fmt: skip
        yield "/cup/pose", "geometry_msgs/msg/PoseStamped", {
            "header": header, "pose": {"position": {"x": 0.3, "y": 0.01 * k, "z": 1.0}, "orientation": unit},
        }  # fmt: skip


TIMES = np.arange(5) / 50.0
MAP = '[joints]\nshoulder = "/Arm/shoulder"\n[topics]\n"/imu" = "/Arm/Hand/imu"\n"/cup/pose" = "/Arm/Hand/cup"\n'


def typed(store, name, content):
    """A message of rosbags from plain values."""
    kind = store.types[name]
    fields = {}
    for key, (node, detail) in store.fielddefs[name][1]:
        value = content[key]
        if node.name == "NAME":
            value = typed(store, detail, value)
        elif node.name in ("ARRAY", "SEQUENCE") and not (value and isinstance(value[0], str)):
            value = np.array(value, np.float64)
        fields[key] = value
    return kind(**fields)


def write_sqlite(folder):
    rosbag2 = pytest.importorskip("rosbags.rosbag2")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    path = folder / "take"
    with rosbag2.Writer(path, version=8) as writer:
        known = {}
        for k, (topic, name, content) in enumerate(messages(TIMES)):
            if topic not in known:
                known[topic] = writer.add_connection(topic, name, typestore=store)
            raw = store.serialize_cdr(typed(store, name, content), name)
            writer.write(known[topic], 10**9 * START + k, raw)
    return next(path.glob("*.db3"))


def write_mcap(folder):
    writer_of = pytest.importorskip("mcap_ros2.writer")
    typesys = pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    file = folder / "take.mcap"
    with open(file, "wb") as stream:
        writer, known = writer_of.Writer(stream), {}
        for k, (topic, name, content) in enumerate(messages(TIMES)):
            if name not in known:
                known[name] = writer.register_msgdef(name, store.generate_msgdef(name, ros_version=2)[0])
            writer.write_message(topic, known[name], content, log_time=k, publish_time=k)
        writer.finish()
    return file


@pytest.fixture(params=[write_mcap, write_sqlite])
def bag(request, tmp_path):
    return request.param(tmp_path)


def read(repository, name):
    (found,) = read_recordings(host_with(repository / "plugins" / "recording_readers"), [str(name)], {})
    return found


def test_joints_sensors_and_poses_are_read_on_the_clock_of_their_headers(repository, bag):
    bag.with_suffix(".toml").write_text(MAP)
    channels = {channel.name: channel for channel in read(repository, bag).channels}
    assert set(channels) == {
        "angle /Arm/shoulder", "effort /Arm/shoulder", "accelerometer /Arm/Hand/imu", "marker /Arm/Hand/cup",
    }  # fmt: skip
    for channel in channels.values():
        assert channel.times == pytest.approx(TIMES, abs=1e-6)
    assert channels["angle /Arm/shoulder"].values[:, 0] == pytest.approx(0.1 * np.arange(5))
    assert channels["effort /Arm/shoulder"].values[:, 0] == pytest.approx(1.0 + np.arange(5))
    assert channels["accelerometer /Arm/Hand/imu"].values[3] == pytest.approx([3.0, 0.5, 9.81])
    assert channels["marker /Arm/Hand/cup"].values[2] == pytest.approx([0.3, 0.02, 1.0])


@pytest.mark.parametrize(
    ("beside", "match"),
    [
        (None, "nothing says on which prims"),
        ('[topics]\n"/imo" = "/Arm/Hand"', "no such topic"),
        ('[joints]\nshulder = "/Arm/shoulder"', "no state of this joint"),
        ('[joints]\nshoulder = "Arm"', "table of prim paths"),
        ("[joint]", "no such entry"),
    ],
)
def test_wrong_maps_are_refused(repository, tmp_path, beside, match):
    bag = write_mcap(tmp_path)
    if beside is not None:
        bag.with_suffix(".toml").write_text(beside)
    with pytest.raises(RunError, match=match):
        read(repository, bag)


def test_a_file_that_is_no_bag_is_refused(repository, tmp_path):
    for name in ("a.mcap", "a.db3"):
        (tmp_path / name).write_text("no bag")
        with pytest.raises(RunError, match=r"not a bag|metadata\.yaml"):
            read(repository, tmp_path / name)
