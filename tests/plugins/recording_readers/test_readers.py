"""Readers of recordings."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.recordings import RecordingRequest, SensorRecording, measured_prims, read_recordings, requested
from calmotion.testing import host_with

HEAD = "time_s,/Arm/Hand.x,/Arm/Hand.y,/Arm/Hand.z,/Arm/Hand.ax,/Arm/Hand.ay,/Arm/Hand.az,/Arm/Elbow.angle"
LOG = "#time,accel_x,accel_y,accel_z\n10.00,100,200,9810\n10.01,110,,9800\n10.02,120,220,9790\n"


@pytest.fixture
def read(repository, tmp_path):
    def run(content, name="a.csv", beside=None, prim="", **settings):
        file = tmp_path / name
        file.write_text(content)
        if beside is not None:
            file.with_suffix(".toml").write_text(beside)
        host = host_with(repository / "plugins" / "recording_readers")
        (found,) = read_recordings(host, [f"{file}@{prim}" if prim else str(file)], settings)
        assert isinstance(found, SensorRecording)
        return found

    return run


GAUGE = '[[channel]]\nkind = "strain"\nprim = "/Arm/a"\ncolumns = ["volts"]\n'


def test_a_strain_gauge_has_two_ends_and_a_filter(read):
    table = "time_s,volts\n0.0,0.1\n0.01,0.2\n"
    found = read(table, beside=GAUGE + 'to = "/Arm/b"\nlow_pass = { frequency = 2.0, damping = 0.9 }\n')
    (channel,) = found.channels
    assert (channel.kind, channel.path, channel.to) == ("strain", "/Arm/a", "/Arm/b")
    assert (channel.low_pass.frequency, channel.low_pass.damping) == (2.0, 0.9)
    assert channel.values[:, 0].tolist() == [0.1, 0.2] and measured_prims([found]) == ("/Arm/a", "/Arm/b")
    first = read(table, "first.csv", beside=GAUGE + 'to = "/Arm/b"\nlow_pass = { frequency = 2 }\n')
    assert first.channels[0].low_pass.damping is None


@pytest.mark.parametrize(
    ("more", "attribute"),
    [
        ("", "channel[0].to"), ('to = "b"\n', "channel[0].to"),
        ('to = "/Arm/b"\nlow_pass = 2.0\n', "channel[0].low_pass"),
        ('to = "/Arm/b"\nlow_pass = { frequency = -2.0 }\n', "channel[0].low_pass"),
        ('to = "/Arm/b"\nlow_pass = { frequency = 2.0, order = 2 }\n', "channel[0].low_pass"),
    ],
)  # fmt: skip
def test_a_gauge_without_its_other_end_or_with_another_filter_is_refused(read, more, attribute):
    with pytest.raises(ShotError) as caught:
        read("time_s,volts\n0.0,0.1\n0.01,0.2\n", beside=GAUGE + more)
    assert caught.value.attribute == attribute


def test_columns_are_named_after_prims_and_empty_cells_are_missing(read):
    found = read(f"# a comment\n{HEAD}\n0.0,1,2,3,,,,0.5\n0.01,,,,4,5,6,\n0.02,1.5,2,,4,5,7,0.6\n")
    marker, sensor, angle = found.channels
    assert [(c.kind, c.path) for c in found.channels] == [
        ("marker", "/Arm/Hand"), ("accelerometer", "/Arm/Hand"), ("angle", "/Arm/Elbow"),
    ]  # fmt: skip
    assert marker.times.tolist() == [0.0, 0.02] and marker.values[0].tolist() == [1.0, 2.0, 3.0]
    assert np.isnan(marker.values[1, 2]) and sensor.times.tolist() == [0.01, 0.02]
    assert angle.values[:, 0].tolist() == [0.5, 0.6] and len(found.sha256) == 64
    assert measured_prims([found]) == ("/Arm/Hand",)


def test_degrees_tables_of_results_and_doubled_rows(read):
    text = (
        "# units: angle deg\ntime_s,/A.angle,/A.output,/A.error,/J.force.x\n0,90,1,2,3\n0.1,180,1,2,3\n0.1,180,1,2,3\n"
    )
    found = read(text)
    (angle,) = found.channels
    assert angle.values[:, 0] == pytest.approx(np.radians([90.0, 180.0]))
    assert len(found.notes) == 2 and "time of the row before" in found.notes[0] and "not measurements" in found.notes[1]


def test_a_map_gives_prims_kinds_units_signs_and_noise(read):
    beside = """
[time]
column = "t"
unit = "ms"
[[channel]]
prim = "/Arm/Hand"
kind = "marker"
columns = ["X", "Z", "-Y"]
unit = "mm"
noise = 0.5
[[channel]]
prim = "/Arm/Elbow"
kind = "angle"
columns = "q"
unit = "deg"
"""
    marker, angle = read("t;X;Y;Z;q\n0;1;2;3;90\n10;4;5;6;0\n", beside=beside).channels
    assert marker.times.tolist() == [0.0, 0.01] and marker.sigma == pytest.approx(5e-4)
    assert marker.values == pytest.approx(1e-3 * np.array([[1.0, 3.0, -2.0], [4.0, 6.0, -5.0]]))
    assert angle.values[:, 0] == pytest.approx([np.pi / 2, 0.0]) and angle.sigma is None


def test_a_rate_replaces_times(read):
    beside = '[time]\nrate = 100.0\n[[channel]]\nprim = "/A"\nkind = "effort"\ncolumns = ["tau"]\nunit = "N mm"\n'
    (effort,) = read("tau\n1000\n2000\n", beside=beside).channels
    assert effort.times.tolist() == [0.0, 0.01] and effort.values[:, 0].tolist() == [1.0, 2.0]


def test_the_log_of_a_printer_is_in_millimetres_and_its_axes_are_chosen(read):
    beside = '[time]\ncolumn = "time"\n[[channel]]\nkind = "accelerometer"\nprim = "/B"\nunit = "mm/s^2"\nnoise = 80\n'
    (sensor,) = read(LOG, beside=beside + 'columns = ["accel_y", "-accel_x", "accel_z"]\n').channels
    assert sensor.path == "/B" and sensor.kind == "accelerometer" and sensor.sigma == pytest.approx(0.08)
    assert sensor.values[0] == pytest.approx([0.2, -0.1, 9.81]) and np.isnan(sensor.values[1, 0])
    assert sensor.times.tolist() == [10.0, 10.01, 10.02]


@pytest.mark.parametrize(
    ("content", "match"),
    [
        ("", "empty"), ("time_s,/A.x\n", "no row"),
        ("time_s,/A.x\n0,a\n", "line 2"), ("time_s,/A.x\n0,1,2\n", "line 2"),
        ('time_s,/A.x\n"0\n",1\n', "line 2"), ("when,/A.x\n0,1\n", "time_s"),
        ("time_s,/A.q\n0,1\n", "no column of a recording"), ("time_s,/A.x,/A.x\n0,1,1\n", "same name"),
        ("time_s,/A.x\n1,1\n0,1\n", "must not go back"), ("time_s,/A.x\n,1\n", "no time"),
        ("0,1\n1,2\n", "does not name its columns"), ("time_s,/A.error\n0,1\n", "no channel"),
        (LOG, "no column of a recording"), ("time_s,/A.x\n0,inf\n", "line 2.*not hold 2 numbers"),
        ("time_s,/A.x\n0,0,5\n", "decimal commas by semicolons"),
    ],
)  # fmt: skip
def test_wrong_tables_are_refused_with_their_place(read, content, match):
    with pytest.raises(ShotError, match=match):
        read(content)


def test_tables_of_spreadsheets_have_decimal_commas(read):
    found = read("\ufefftime_s;/Arm/Hand.x;/Arm/Hand.y\r\n0,0;1,25;-3e-2\r\n0,5;;1.5\r\n")
    (marker,) = found.channels
    assert marker.times.tolist() == [0.0, 0.5] and marker.values[0, :2].tolist() == [1.25, -0.03]
    assert np.isnan(marker.values[1, 0]) and marker.values[1, 1] == 1.5


def test_a_prim_behind_a_table_that_names_its_own_is_refused(read):
    with pytest.raises(ShotError, match="names the prims of its channels itself"):
        read("time_s,/Arm/Hand.x\n0,1\n1,2\n", prim="/Arm/Elbow")


def test_a_table_that_is_not_utf_8_says_so(repository, tmp_path):
    (tmp_path / "a.csv").write_bytes("time_s,/A.x\n0,1\n".encode("utf-16"))
    with pytest.raises(ShotError, match="Save it as"):
        read_recordings(host_with(repository / "plugins" / "recording_readers"), [str(tmp_path / "a.csv")], {})


@pytest.mark.parametrize(
    ("beside", "match"),
    [
        ("x = [", "cannot be read"), ("", "no channels"), ('[[channel]]\nkind = "marke"\n', "marker"),
        ('[[channel]]\nkind = "angle"\nprim = "A"\n', "prim path"),
        ('[[channel]]\nkind = "marker"\nprim = "/A"\ncolumns = ["a"]\n', "3 columns"),
        ('[[channel]]\nkind = "angle"\nprim = "/A"\ncolumns = ["b"]\n', "no such column"),
        ('[[channel]]\nkind = "angle"\nprim = "/A"\ncolumns = ["a"]\nunit = "N"\n', "unit does not fit"),
        ('[[channel]]\nkind = "angle"\nprim = "/A"\ncolumns = ["a"]\nnoise = -1\n', "noise"),
        ('[[channel]]\nkind = "angle"\nprim = "/A"\ncolum = ["a"]\n', "columns"), ("[time]\nrate = 0\n", "rate"),
    ],
)  # fmt: skip
def test_wrong_maps_are_refused_with_their_place(read, beside, match):
    with pytest.raises(ShotError, match=match):
        read("time_s,a\n0,1\n1,2\n", beside=beside)


def test_files_without_a_reader_and_missing_ones_are_wrong_arguments(read, repository, tmp_path):
    host = host_with(repository / "plugins" / "recording_readers")
    other = tmp_path / "a.xyz"
    other.write_text("?")
    for names, match in (
        ([str(tmp_path / "none.csv")], "does not exist"), ([str(other)], "no plugin reads"), ([], "no recording"),
    ):  # fmt: skip
        with pytest.raises(SettingError, match=match):
            read_recordings(host, names, {})


def test_a_prim_may_follow_the_file():
    assert requested("a@b.csv") == RecordingRequest("a@b.csv", "")
    assert requested("a@b.csv@/Arm/Hand") == RecordingRequest("a@b.csv", "/Arm/Hand")


@pytest.fixture
def capture(tmp_path):
    """A C3D file of two markers, the second of which is lost in the middle."""
    ezc3d = pytest.importorskip("ezc3d")
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    content["parameters"]["POINT"]["LABELS"]["value"] = ["Cup1", "/Arm/Fore"]
    content["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    points = np.ones((4, 2, 5))
    points[:3, 0] = np.arange(15.0).reshape(3, 5)
    points[:3, 1, 2] = np.nan
    content["data"]["points"] = points
    file = tmp_path / "take.c3d"
    content.write(str(file))
    return file


def test_markers_of_a_capture_have_prims_by_their_labels_or_by_a_map(repository, capture):
    host = host_with(repository / "plugins" / "recording_readers")
    (found,) = read_recordings(host, [str(capture)], {})
    (fore,) = found.channels
    assert fore.path == "/Arm/Fore" and fore.times.tolist() == [0.0, 0.01, 0.03, 0.04]
    assert fore.values == pytest.approx(1e-3 * np.ones((4, 3)))
    capture.with_suffix(".toml").write_text('axes = "x, -z, y"\n[markers]\nCup1 = "/Arm/Hand/cup"\n')
    (found,) = read_recordings(host, [str(capture)], {})
    (cup,) = found.channels
    assert cup.path == "/Arm/Hand/cup" and cup.kind == "marker"
    assert cup.values[1] == pytest.approx(1e-3 * np.array([1.0, -11.0, 6.0]))


@pytest.mark.parametrize(
    ("beside", "match"),
    [
        ('[markers]\nCup = "/A"\n', "Cup1"), ("[markers]\nCup1 = 3\n", "prim paths"), ("x = [", "cannot be read"),
        ('axes = "x, x, z"\n[markers]\nCup1 = "/A"\n', "each axis"),
    ],
)  # fmt: skip
def test_wrong_maps_of_a_capture_are_refused(repository, capture, beside, match):
    capture.with_suffix(".toml").write_text(beside)
    with pytest.raises(ShotError, match=match):
        read_recordings(host_with(repository / "plugins" / "recording_readers"), [str(capture)], {})


def test_a_file_that_is_no_capture_is_refused(repository, tmp_path):
    pytest.importorskip("ezc3d")
    (tmp_path / "a.c3d").write_text("no capture")
    with pytest.raises(ShotError, match="not a C3D file"):
        read_recordings(host_with(repository / "plugins" / "recording_readers"), [str(tmp_path / "a.c3d")], {})
