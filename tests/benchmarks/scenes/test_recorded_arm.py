"""Recordings of benchmarks, as the tables that users have."""

import numpy as np
from calmotion.benchmarks.scenes.recorded_arm import written
from calmotion.host import open_host
from calmotion.shot.calibration.recording import ACCELEROMETER, MARKER, Channel, SensorRecording
from calmotion.workflow.calibration.recordings import read_recordings


def test_a_written_recording_is_read_with_its_gaps(tmp_path):
    times, rng = 0.1 * np.arange(30), np.random.default_rng(0)
    channels = [Channel(MARKER, path, times, rng.standard_normal((30, 3))) for path in ("/Arm/Hand", "/Arm/Tip")]
    channels.append(Channel(ACCELEROMETER, "/Arm/Hand", times, rng.standard_normal((30, 3))))
    channels[1].values[4] = np.nan
    file = written(SensorRecording("a.csv", "a", tuple(channels)), tmp_path / "a.csv")
    (read,) = read_recordings(open_host(()), [file], {})
    found = {(channel.kind, channel.path): channel for channel in read.channels}
    assert len(found) == 3
    for channel in channels:
        own = found[channel.kind, channel.path]
        known = np.isfinite(channel.values[:, 0])
        assert np.allclose(own.times, times[known]) and np.allclose(own.values, channel.values[known], atol=1e-8)
