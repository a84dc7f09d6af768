"""Motions from CSV and NPZ tables."""

import zipfile

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.host import Host
from calmotion.model import MotorTracks
from calmotion.model.run import Source
from calmotion.support import memory
from calmotion.testing import host_with, run_operator
from calmotion.usd import JointNames, tracks_of_joints

TIMES = np.array([2.0, 2.5, 3.0])
PAN, LIFT = np.array([0.0, 0.1, 0.3]), np.array([1.0, 0.5, 0.2])


@pytest.fixture
def read(repository, tmp_path):
    def run(name, content, **settings):
        file = tmp_path / name
        if isinstance(content, dict):
            np.savez(file, **content)
        elif content is not None:
            file.write_text(content)
        host = host_with(repository / "plugins" / "motion_table")
        (found,) = run_operator(
            host, "motion.read", [Source("", "import", motion=str(file))], {"motion.read": settings}
        )
        assert isinstance(found, MotorTracks)
        return found

    return run


def table(head="time_s,pan,lift", times=TIMES, scale=1.0):
    rows = np.stack([*([] if times is None else [times]), scale * PAN, scale * LIFT], axis=1)
    return "\n".join([*([head] if head else []), *(",".join(f"{value:.9g}" for value in row) for row in rows)]) + "\n"


@pytest.mark.parametrize(
    ("name", "content", "settings"),
    [
        ("a.csv", table(), {}),
        ("a.csv", "\ufeff# a comment\n# units: angle deg\n" + table(scale=180.0 / np.pi), {}),
        ("a.csv", "# Units: angle Deg\n" + table(scale=180.0 / np.pi), {}),
        ("a.csv", "# units: degrees\n" + table(scale=180.0 / np.pi), {}),
        ("a.csv", table(scale=180.0 / np.pi), {"angles": "deg"}),
        ("a.csv", "# units: angle deg\n" + table(), {"angles": "rad"}),
        ("a.csv", table(times=1e3 * TIMES), {"times": "ms"}),
        ("a.csv", table(times=1e6 * TIMES), {"times": "us"}),
        ("a.npz", {"time_s": (1e9 * TIMES).astype(int) + 10**15, "pan": PAN, "lift": LIFT}, {"times": "ns"}),
        ("a.csv", table("time,pan,lift"), {}),
        ("a.csv", table("time_s,pan,lift\n[s],[deg],[deg]", scale=180.0 / np.pi), {}),
        ("a.csv", table("time,pan,lift\nms,,rad", 1e3 * TIMES), {}),
        ("a.npz", {"fps": np.array([2]), "pan": PAN, "lift": LIFT}, {}),
        ("a.csv", table("Timestamp (ms),pan,lift", 1e3 * TIMES), {}),
        ("a.csv", table("header.stamp,pan,lift", 1e9 * TIMES), {}),
        ("a.csv", table("elapsed_us,pan,lift", 1e3 * TIMES), {"times": "ms"}),
        ("a.csv", table(",pan,lift"), {}),
        ("a.csv", "# time,pan,lift\n" + table(None), {}),
        ("a.csv", table("when,pan,lift", [0.0, 1.0, 2.0]), {"rate": 2.0, "joints": "-,pan,lift"}),
        ("a.csv", table("frame,pan,lift", [0.0, 1.0, 2.0]), {"rate": 2.0}),
        ("a.csv", table("time,j1,j2"), {"joints": "-,pan,lift"}),
        ("a.csv", table("time,pan,lift", [0.0, 0.0, 1.0]), {"rate": 2.0, "joints": "-,pan,lift"}),
        ("a.npz", {"timestamps": 1e9 * TIMES, "pan": PAN, "lift": LIFT}, {}),
        ("a.csv", table("pan,lift", None), {"rate": 2.0}),
        ("a.csv", table(None, None), {"rate": 2.0, "joints": "pan, lift"}),
        ("a.csv", table().replace(",", ";"), {}),
        ("a.csv", table().replace(",", ";").replace(".", ","), {}),
        ("a.csv", 'time_s,pan,lift\n"0,0","0,0","1,0"\n"0,5","0,1","0,500"\n"1,0","0,3","0,2"\n', {}),
        ("a.csv", table().replace(",", "\t"), {}),
        ("a.csv", table().replace(",", "  "), {}),
        ("a.csv", "time_s,pan [deg],lift (rad)\n0,0,1\n.5,5.729577951,.5\n1,17.188733854,.2\n", {}),
        ("a.csv", "# units: angle deg\ntime_s,pan [deg],lift (rad)\n0,0,1\n.5,5.729577951,.5\n1,17.188733854,.2\n", {}),
        ("a.csv", "date,pan,lift\n2024-05-17T10:00:02Z,0,1\n2024-05-17T10:00:02.5Z,.1,.5\n"
         "2024-05-17T10:00:03Z,.3,.2\n", {}),
        ("a.csv", "time;pan;lift\n10:00:59,5;0;1\n10:01:00,0;0,1;0,5\n10:01:00,5;0,3;0,2\n", {}),
        ("a.csv", "time_s,pan,lift,state\n0,0,1,go\n.5,.1,.5,go\n1,.3,.2,on\n", {"joints": "time_s,pan,lift,-"}),
        ("a.csv", "time_s,pan,lift,\n0,0,1,\n.5,.1,.5,\n1,.3,.2,\n", {}),
        ("a.csv", "timestamp,frame_index,episode_index,pan,lift\n0,0,4,0,1\n.5,1,4,.1,.5\n1,2,4,.3,.2\n", {}),
        ("a.npz", {"time_s": TIMES, "pan": PAN, "lift": LIFT}, {}),
        ("a.npz", {"fps": 2.0, "joint_names": ["pan", "lift"], "positions": np.stack([PAN, LIFT], axis=1)}, {}),
        ("a.npz", {"fps": 2.0, "joint_names": [b"pan", b"lift"], "positions": np.stack([PAN, LIFT], axis=1)}, {}),
        ("a.NPZ", {"fps": 2.0, "units": "deg", "pan": np.degrees(PAN), "lift": np.degrees(LIFT)}, {}),
        ("a.npz", {"time_s": TIMES, "positions": np.stack([PAN, LIFT], axis=1)}, {"joints": "pan,lift"}),
        ("a.npz", {"fps": [2], "joint_pos": np.stack([PAN, LIFT], axis=1), "body_pos_w": np.zeros((3, 4, 3))},
         {"joints": "pan,lift"}),
        ("a.npz", {"fps": 2, "dof_positions": np.stack([LIFT, PAN], axis=1)[:, ::-1], "dof_names": ["pan", "lift"],
                   "dof_velocities": np.zeros((3, 2))}, {}),
    ],
)  # fmt: skip
def test_forms_of_a_motion(read, tmp_path, name, content, settings):
    if name == "a.NPZ":
        np.savez(tmp_path / "b.npz", **content)
        (tmp_path / "b.npz").rename(tmp_path / name)
        content = None
    found = read(name, content, **settings)
    np.testing.assert_allclose(found.times, TIMES - TIMES[0], atol=1e-9)
    of_joints, notes = tracks_of_joints(found, {f"/{name}": JointNames((name,)) for name in ("pan", "lift")})
    assert list(of_joints.values) == ["/pan", "/lift"] and not notes
    np.testing.assert_allclose(of_joints.values["/pan"], PAN, atol=1e-9)
    np.testing.assert_allclose(of_joints.values["/lift"], LIFT, atol=1e-8)


def test_settings_that_a_table_with_times_and_names_does_not_need_are_told(repository, tmp_path):
    (tmp_path / "a.csv").write_text(table())
    host = host_with(repository / "plugins" / "motion_table")
    source = Source("", "import", motion=str(tmp_path / "a.csv"))

    def told(**settings):
        run = Host.run(host, [source], (MotorTracks,), settings={"motion.read": settings}).finish()
        return [record.text for record in run.results[-1].records if "not used" in record.text]

    assert told() == told(rate=2.0, joints="pan,lift") == []
    rate, joints = told(rate=60.0, joints="a,b")
    assert "motion.read.rate" in rate and "motion.read.joints" in joints


def test_columns_may_be_left_out(read):
    assert list(read("a.csv", table(None, None), rate=2.0, joints="-,lift").values) == ["lift"]


REFUSED = {
    "no file": (None, "cannot be read"),
    "an empty table": ("# nothing\n", "empty"),
    "no names": (table(None), "no names of joints"),
    "no times": (table("pan,lift", None), "no times"),
    "no joints": ("time_s\n0\n1\n", "no joints"),
    "a text": (table().replace("0.5", "half", 1), "line 3"),
    "a short row": (table() + "4,1\n", "line 5"),
    "a number that is none": (table().replace("0.1", "nan"), "not finite"),
    "times that go back": (table(times=TIMES[::-1]), "times must increase"),
    "one row": ("time_s,pan\n0,1\n", "two rows"),
    "a column twice": (table("time_s,pan,pan"), "same name"),
    "a column of texts": (table("time_s,pan,lift").replace("0.3", "off"), "line 4"),
    "a number that may be a thousand": ('time_s,pan\n"0,5",0\n"1,500",0\n', "line 3"),
    "a cell without end": ("time_s,pan\n0," + "1" * 200_000 + "\n1,0\n", "no table"),
    "a quotation mark without end": ('time_s,"pan\n0,1\n1,2\n', "no table"),
    "a table of results": (table("time_s,/R/j.input,/R/j.output"), "--csv wrote"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_motion_is_refused(read, name):
    content, problem = REFUSED[name]
    with pytest.raises(ShotError) as refused:
        read("a.csv", content)
    assert problem in refused.value.message() and "a.csv" in refused.value.message() and refused.value.remedy


def test_joints_whose_names_end_like_columns_of_results_are_joints(read):
    assert list(read("a.csv", table("time_s,hip.x,valve.output")).values) == ["hip.x", "valve.output"]


def test_a_column_of_texts_is_left_out_as_the_error_says(read):
    content = "time_s,frame,pan,state\n0,base,0,go\n.5,base,.1,go\n1,base,.3,on\n"
    with pytest.raises(ShotError, match="line 2") as refused:
        read("a.csv", content)
    joints = refused.value.remedy.partition("motion.read.joints=")[2]
    assert list(read("a.csv", content, joints=joints).values) == ["pan"]


@pytest.mark.parametrize(
    "content", [{"time_s": TIMES, "pan": PAN[:2]}, {"time_s": TIMES, "positions": np.zeros((3, 2)), "joint_names": "a"},
                {"time_s": TIMES, "names": np.array(["a", "b", "c"])}, {"time_s": TIMES},
                {"fps": "abc", "pan": PAN}, {"fps": 2.0, "positions": np.zeros((2, 2)), "joint_names": ["pan", "pan"]},
                {"fps": np.nan, "pan": PAN}, {"fps": np.ones(2), "pan": PAN},
                {"fps": 24.0, "positions": np.array([["a"], ["b"]]), "joint_names": ["pan"]},
                {"time_s": ["a", "b"], "positions": np.zeros((2, 1)), "joint_names": ["pan"]},
                {"time_s": 3.0, "positions": np.zeros((2, 1)), "joint_names": ["pan"]},
                {"time_s": TIMES, "pan": PAN + 1j}, {"time_s": TIMES, "pan": PAN > 0.0}]
)  # fmt: skip
def test_arrays_that_do_not_fit_are_refused(read, content):
    with pytest.raises(ShotError, match="a.npz"):
        read("a.npz", content)


def test_a_matrix_of_all_joints_under_another_name_is_refused_with_its_name(read):
    with pytest.raises(ShotError) as refused:
        read("a.npz", {"fps": 30, "trans": np.zeros((3, 2))})
    assert "`positions`" in refused.value.remedy and refused.value.attribute == "trans"


def test_names_that_a_matrix_or_a_table_lacks_are_asked_for(read):
    with pytest.raises(ShotError, match="no names of joints") as refused:
        read("a.npz", {"fps": 30, "joint_pos": np.zeros((3, 2))})
    assert refused.value.found == "2 columns" and "motion.read.joints" in refused.value.remedy
    with pytest.raises(ShotError, match="line 1") as refused:
        read("a.csv", "0,0,1\n.5,.1,.5\n1,.3,.2\n", rate=2.0, joints="pan,lift")
    assert "Name all 3 columns" in refused.value.remedy


def test_a_file_that_is_no_npz_is_refused(read, tmp_path):
    with pytest.raises(ShotError, match="not an NPZ file"):
        read("a.npz", "hello")


def archive(path, shape, content=b""):
    """An NPZ file whose array claims a shape."""
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({shape},), }}".encode().ljust(117) + b"\n"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("pan.npy", b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + content)


def test_arrays_that_would_fill_the_memory_are_not_made(read, tmp_path, monkeypatch):
    archive(tmp_path / "claims.npz", 10**11)
    with pytest.raises(ShotError, match="not an NPZ file"):
        read("claims.npz", None)
    archive(tmp_path / "holds.npz", 10**6, bytes(8 * 10**6))
    monkeypatch.setattr(memory, "free_memory", lambda: 1e6)
    with pytest.raises(ShotError, match="GB are free"):
        read("holds.npz", None, rate=24.0)


@pytest.mark.parametrize("name", ["a.csv", "a.npz"])
def test_a_pointer_of_git_lfs_is_no_motion(read, name):
    with pytest.raises(ShotError, match="Git LFS pointer") as refused:
        read(name, "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1048584\n")
    assert refused.value.path.endswith(name) and "git lfs pull" in refused.value.remedy


@pytest.mark.parametrize(
    ("unit", "step"), [("ns", 1e6), ("ns", 1e7), ("ns", 5e8), ("us", 1e3), ("us", 2e4), ("us", 1e5), ("ms", 50.0)]
)
def test_a_motion_of_days_is_refused_with_the_setting_that_reads_it(read, unit, step):
    arrays = {"time_s": step * np.arange(3000), "pan": np.linspace(0.0, 1.0, 3000)}
    with pytest.raises(ShotError, match="too long") as refused:
        read("a.npz", arrays)
    assert f"motion.read.times={unit}" in refused.value.remedy and "3000 rows" in refused.value.found
    assert read("a.npz", arrays, times=unit).times[-1] == pytest.approx(
        2999 * step * {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    )
