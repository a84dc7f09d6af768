"""The recording, read back: what it holds, at which times, and with which values."""

from __future__ import annotations

import dataclasses
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import synthetic
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.shot.outputs import Recording, SystemModes
from calmotion.shot.run import OutputPaths
from calmotion.testing import check_plugin, host_with, run_operator
from calmotion.views.playback import sample_motion, world_points
from calmotion.views.spectrum import error_spectrum
from recordings import read_recording

ROOT = Path(__file__).resolve().parents[2]
PLUGIN = ROOT / "plugins" / "rerun_logger"


def write(path, result, settings=None):
    values = [synthetic.character(), synthetic.animation(), result, OutputPaths(rrd=str(path))]
    return run_operator(host_with(PLUGIN), "rerun.log", values, settings)


def tensor_of(cell):
    """The numbers of a tensor as it stands in a column."""
    return cell["buffer"]


@pytest.fixture(scope="module")
def columns(tmp_path_factory):
    path = tmp_path_factory.mktemp("recording") / "out.rrd"
    assert write(path, synthetic.result()) == (Recording(str(path)),)
    return read_recording(path)


def test_the_plugin_keeps_to_the_rules():
    assert check_plugin(PLUGIN) == []


def test_every_visible_mesh_is_there_once_for_each_motion_under_its_prim_path(columns):
    meshes = sorted(entity for entity, name in columns if name == "Mesh3D:triangle_indices")
    moving = ["/Robot/Link/Beam", "/Robot/Tip/Ball"]
    expected = [f"/{root}{mesh}" for root in ("input", "optimized") for mesh in ["/Robot/Base/Box", *moving]]
    # What is never off has no ghost, and guide geometry is not shown.
    ghosts = [f"/reference/{root}{mesh}" for root in ("input", "optimized") for mesh in moving]
    assert meshes == sorted(expected + ghosts)
    for mesh in meshes:
        times, values = columns[mesh, "Mesh3D:triangle_indices"]
        assert times is None and len(values) == 1 and len(values[0]) == 12


def test_bodies_move_at_the_frames_of_the_shot_and_never_before_them(columns):
    result = synthetic.result()
    frames = synthetic.animation().frame_times
    for root, motion in (
        ("input", result.before.motion),
        ("optimized", result.after.motion),
        ("reference/input", result.reference),
        ("reference/optimized", result.reference),
    ):
        times, places = columns[f"/{root}/Robot/Tip", "Transform3D:translation"]
        np.testing.assert_allclose(times, frames, atol=2e-9)
        expected = [np.interp(frames, motion.times, motion.positions[:, 2, axis]) for axis in range(3)]
        np.testing.assert_allclose(np.array(places)[:, 0], np.transpose(expected), atol=1e-6)
        quaternion = np.array(columns[f"/{root}/Robot/Link", "Transform3D:quaternion"][1])[:, 0]
        angle = 2.0 * np.arctan2(quaternion[:, 2], quaternion[:, 3])
        np.testing.assert_allclose(angle, np.interp(frames, motion.times, motion.motor_values[:, 0]), atol=1e-5)


def test_vertices_of_a_flexible_body_follow_its_modes_and_rigid_ones_stay(columns):
    result = synthetic.result()
    frames = synthetic.animation().frame_times
    times, shapes = columns["/input/Robot/Link/Beam", "Mesh3D:vertex_positions"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    shapes = np.array(shapes)
    assert shapes.shape == (len(frames), 24, 3)  # a box has three normals at each of its eight corners
    tip = np.isclose(shapes[0, :, 0], synthetic.LENGTH)
    bend = np.interp(frames, result.before.motion.times, result.before.motion.elastic[1][:, 0])
    middle = shapes[:, tip, 1].mean(axis=1)
    np.testing.assert_allclose(middle, bend, atol=1e-6)
    assert np.abs(bend).max() > 0.02
    np.testing.assert_allclose(shapes[:, ~tip], np.broadcast_to(shapes[0, ~tip], shapes[:, ~tip].shape), atol=1e-7)
    times, shapes = columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_positions"]
    assert times is None and len(shapes) == 1


def test_what_is_off_takes_the_color_of_the_input_and_what_is_not_keeps_its_own(columns):
    result, frames = synthetic.result(), synthetic.animation().frame_times
    character = synthetic.character()
    motions = [sample_motion(motion, frames) for motion in (result.before.motion, result.reference)]

    def off(body):
        places = [
            np.array(
                [world_points(character.bodies[body], body, result.skins[body], m, k)[0] for k in range(len(frames))]
            )
            for m in motions
        ]
        return np.linalg.norm(places[0] - places[1], axis=2)

    scale = max(off(body).max() for body in range(len(character.bodies)))
    times, colors = columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_colors"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    found = np.array([[(c >> 24, c >> 16 & 255, c >> 8 & 255) for c in row] for row in colors], dtype=float)
    own, strongest = found[0].min(axis=0), np.array([213.0, 94.0, 0.0])
    share = off(2).mean(axis=1) / scale
    expected = own + share[:, None] * (strongest - own)
    assert share.max() > 0.8 and np.abs(found.mean(axis=1) - expected).max() < 3.0
    assert ("/input/Robot/Tip/Ball", "Mesh3D:albedo_factor") not in columns, "it would be multiplied in"
    assert ("/input/Robot/Base/Box", "Mesh3D:albedo_factor") in columns, "what stands still is never off"
    assert ("/input/Robot/Base/Box", "Mesh3D:vertex_colors") not in columns


def test_normals_of_a_box_are_those_of_its_faces(columns):
    normals = np.array(columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_normals"][1][0])
    points = np.array(columns["/input/Robot/Tip/Ball", "Mesh3D:vertex_positions"][1][0])
    assert sorted(np.abs(normals).max(axis=1).tolist()) == pytest.approx([1.0] * 24)
    assert np.all(np.sum(normals * points, axis=1) > 0.0)


def test_errors_and_motor_curves_have_the_units_they_are_named_by(columns):
    result = synthetic.result()
    first = int(np.searchsorted(result.before.motion.times, -1e-9))
    for root, simulation in (("input", result.before), ("optimized", result.after)):
        times, values = columns[f"/errors/position_mm/{root}/Robot/Tip/Target", "Scalars:scalars"]
        assert times[0] == 0.0 and times[-1] == pytest.approx(1.0)
        np.testing.assert_allclose(np.ravel(values), 1e3 * simulation.position_errors[first:, 0])
        values = columns[f"/errors/rotation_deg/{root}/Robot/Tip/Target", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), np.degrees(simulation.rotation_errors[first:, 0]))
        values = columns[f"/motors/Robot/Joints/Swing/angle_deg/{root}", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), np.degrees(simulation.motion.motor_values[first:, 0]))
        values = columns[f"/motors/Robot/Joints/Swing/torque_Nm/{root}", "Scalars:scalars"][1]
        np.testing.assert_allclose(np.ravel(values), simulation.motion.motor_efforts[first:, 0])
        for name, reaction in (
            ("force_N", simulation.motion.joint_forces),
            ("moment_Nm", simulation.motion.joint_moments),
        ):
            values = columns[f"/reactions/{name}/Robot/Joints/Weld/{root}", "Scalars:scalars"][1]
            np.testing.assert_allclose(np.ravel(values), np.linalg.norm(reaction[first:, 2], axis=1))
    change = np.ravel(columns["/changes_deg/Robot/Joints/Swing", "Scalars:scalars"][1])
    assert change.max() == pytest.approx(np.degrees(0.01), rel=1e-3)


def test_spectra_are_bars_in_millimetres_over_hertz(columns):
    result = synthetic.result()
    for root, simulation in (("input", result.before), ("optimized", result.after)):
        entity = f"/spectra/{root}/Robot/Tip/Target"
        frequencies, amplitudes = error_spectrum(simulation.motion, result.reference, 0)
        (bars,), (abscissa,) = (columns[entity, f"BarChart:{name}"][1][0] for name in ("values", "abscissa"))
        values = np.array(tensor_of(bars))
        assert 10 < len(values) < len(frequencies)
        np.testing.assert_allclose(values, 1e3 * amplitudes[1 : len(values) + 1])
        np.testing.assert_allclose(tensor_of(abscissa), frequencies[1 : len(values) + 1])


def test_progress_is_a_series_over_iterations(columns):
    times, values = columns["/optimizer/log10_objective", "Scalars:scalars"]
    assert times.tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(np.ravel(values), [-2.0, -3.0, -4.0, -5.0])


def test_trails_end_at_the_target_and_show_its_last_moments_smoothly(columns):
    frames, result = synthetic.animation().frame_times, synthetic.result()
    times, trails = columns["/trails/input/Robot/Tip/Target", "LineStrips3D:strips"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    motion = result.before.motion
    places = np.stack([np.interp(frames, motion.times, x) for x in motion.target_positions[:, 0].T], axis=1)
    np.testing.assert_allclose([trail[-1][-1] for trail in trails], places, atol=1e-6)
    whole = np.array(trails[-1])
    np.testing.assert_allclose(whole[1:, 0], whole[:-1, -1], err_msg="pieces join")
    start = sample_motion(motion, frames[-1:] - 0.8).target_positions[0, 0]
    np.testing.assert_allclose(whole[0, 0], start, atol=1e-6)
    assert len({tuple(point) for piece in whole for point in piece}) > 2 * 0.8 * synthetic.FRAME_RATE
    colors = columns["/trails/input/Robot/Tip/Target", "LineStrips3D:colors"][1][0]
    fade = [abs((c >> 24) - 213) + abs((c >> 16 & 255) - 94) + abs(c >> 8 & 255) for c in colors]
    assert fade == sorted(fade, reverse=True) and fade[-1] < 3


def test_the_intended_trail_is_drawn_only_where_it_can_be_told_from_the_other(columns):
    result, frames = synthetic.result(), synthetic.animation().frame_times
    meant = sample_motion(result.reference, frames).target_positions[:, 0]
    drawn, off = {}, {}
    for root, run in (("input", result.before), ("optimized", result.after)):
        _, pieces = columns[f"/trails/reference/{root}/Robot/Tip/Target", "LineStrips3D:strips"]
        _, dots = columns[f"/trails/reference/{root}/Robot/Tip/Target/now", "Points3D:positions"]
        last = np.array([len(trail[-1]) > 0 for trail in pieces])
        np.testing.assert_array_equal(last, [len(dot) > 0 for dot in dots], err_msg="the dot ends its trail")
        drawn[root] = last
        off[root] = np.linalg.norm(sample_motion(run.motion, frames).target_positions[:, 0] - meant, axis=1)
    largest = off["input"].max()
    for root, last in drawn.items():
        assert last.any() and not last.all()
        assert off[root][~last].max() < 0.04 * largest and off[root][last].max() > 0.03 * largest


def test_the_ghost_lies_inside_the_body_where_nothing_is_off(columns):
    (own,), (ghost,) = (
        np.array(columns[f"/{root}/Robot/Tip/Ball", "Mesh3D:vertex_positions"][1])
        for root in ("input", "reference/input")
    )
    assert 0.0 < np.abs(own).max() - np.abs(ghost).max() < 0.1 * np.abs(own).max()
    assert np.all(np.abs(ghost) <= np.abs(own) + 1e-9)


@pytest.mark.parametrize("root", ["input", "optimized"])
def test_the_ghost_is_seen_only_while_its_body_is_off(columns, root):
    result, frames, character = synthetic.result(), synthetic.animation().frame_times, synthetic.character()
    run = {"input": result.before, "optimized": result.after}[root]
    motions = [sample_motion(motion, frames) for motion in (run.motion, result.before.motion, result.reference)]
    places = [
        np.array([world_points(character.bodies[2], 2, result.skins[2], motion, k)[0] for k in range(len(frames))])
        for motion in motions
    ]
    off, most = (np.linalg.norm(place - places[2], axis=2).max(axis=1) for place in places[:2])
    times, colors = columns[f"/reference/{root}/Robot/Tip/Ball", "Mesh3D:albedo_factor"]
    np.testing.assert_allclose(times, frames, atol=2e-9)
    opacity = np.array([row[0] & 255 for row in colors])
    assert np.all(opacity[off < 0.11 * most.max()] == 0) and np.all(opacity[off > 0.31 * most.max()] == 90)
    assert np.all(np.diff(opacity[np.argsort(off)]) >= 0)


def test_curves_can_be_read_on_dark_and_light_themes():
    host = host_with(PLUGIN)
    package = host.operators["rerun.log"].__module__
    __import__(f"{package}.layout")
    module = sys.modules[package]
    for style in module.layout.STYLES.values():
        for count in (1, 2, 5, 24):
            shades = [style.shade(k, count) for k in range(count)]
            assert len(set(shades)) == count
            for shade in shades:
                assert min(module.colors.contrast(shade, other) for other in ((255, 255, 255), (13, 16, 17))) >= 3.0


def test_the_summary_lists_simplifications_and_errors(columns):
    text = columns["/summary", "TextDocument:text"][1][0][0]
    result = synthetic.result()
    assert "modes above 40 Hz" in text and "0.02 mm" in text
    assert f"{1e3 * result.before.position_errors.max():.2f} mm" in text
    assert f"{1e3 * result.after.position_errors.max():.2f} mm" in text


def test_a_simulation_alone_has_neither_before_nor_after(tmp_path):
    write(tmp_path / "out.rrd", replace(synthetic.result(), after=None, steps=()))
    columns = read_recording(tmp_path / "out.rrd")
    text = columns["/summary", "TextDocument:text"][1][0][0]
    assert "| target | largest | rms |" in text and "before" not in text
    names = [str(values[0]) for (_, name), (_, values) in columns.items() if name == "SeriesLines:names"]
    assert any("as animated [mm]" in name for name in names) and not any("before" in name for name in names)


def test_the_summary_names_the_characters_frequencies_where_they_are_known(tmp_path):
    modes = SystemModes(np.array([3.25, 12.5]), np.array([0.01, 0.02]))
    given = [synthetic.character(), synthetic.animation(), synthetic.result(), modes]
    run_operator(host_with(PLUGIN), "rerun.log", [*given, OutputPaths(rrd=str(tmp_path / "out.rrd"))])
    text = read_recording(tmp_path / "out.rrd")["/summary", "TextDocument:text"][1][0][0]
    assert "in its first pose: 3.2, 12.5 Hz" in text


def test_the_recording_contains_its_layout(tmp_path):
    from rerun.chunk import RrdReader

    write(tmp_path / "out.rrd", synthetic.result())
    assert len(RrdReader(str(tmp_path / "out.rrd")).blueprints()) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["out.rrd"]


def test_a_simulation_alone_logs_nothing_as_optimised(tmp_path):
    write(tmp_path / "out.rrd", synthetic.result(optimized=False))
    entities = {entity for entity, _ in read_recording(tmp_path / "out.rrd")}
    assert not [e for e in entities if "optimize" in e or "change" in e]
    assert "/input/Robot/Link/Beam" in entities and "/reference/input/Robot/Link/Beam" in entities


def test_long_curves_are_thinned_and_the_frames_kept(tmp_path):
    write(tmp_path / "out.rrd", synthetic.result(), {"rerun.log": {"samples_per_plot": 50}})
    columns = read_recording(tmp_path / "out.rrd")
    times = columns["/errors/position_mm/input/Robot/Tip/Target", "Scalars:scalars"][0]
    assert 25 < len(times) <= 50
    assert len(columns["/input/Robot/Tip", "Transform3D:translation"][0]) == synthetic.FRAMES


def test_it_is_skipped_when_no_recording_is_requested():
    values = [synthetic.character(), synthetic.animation(), synthetic.result(), OutputPaths()]
    with pytest.raises(PluginError, match="--rrd"):
        run_operator(host_with(PLUGIN), "rerun.log", values)


def test_a_folder_that_cannot_be_written_is_reported_and_nothing_is_left(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(ShotError, match="cannot be written"):
        write(tmp_path / "file" / "out.rrd", synthetic.result())
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.skipif(os.name == "nt", reason="no limit of the size of files")
@pytest.mark.parametrize("size", [0, 96, 20_000])
def test_a_full_disk_is_reported_and_leaves_the_old_recording(tmp_path, size):
    """At once or later, where rerun by itself waits for ever in some of the runs."""
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")
    code = (
        "import resource, sys; sys.path[:0] = sys.argv[1:4]\n"
        "import test_rerun_logger as t, synthetic\n"
        "from calmotion.errors import ShotError\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[5]),) * 2)\n"
        "try:\n"
        "    t.write(sys.argv[4], synthetic.result())\n"
        "except ShotError as error:\n"
        "    print(error)\n"
    )
    folders = [str(ROOT / "pipeline"), str(Path(__file__).parent), str(ROOT / "tests" / "helpers" / "plugins")]
    done = subprocess.run([sys.executable, "-c", code, *folders, str(path), str(size)], capture_output=True, text=True)
    assert "cannot be written" in done.stdout and "File too large" in done.stdout, done.stderr
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_a_failure_of_rerun_is_reported_and_leaves_the_old_recording(tmp_path, monkeypatch):
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")

    def fail(stream):
        raise RuntimeError("File-writer thread shut down prematurely")  # what rerun's thread then raises

    monkeypatch.setattr("rerun.RecordingStream.flush", fail)
    with pytest.raises(ShotError, match="cannot be written"):
        write(path, synthetic.result())
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_a_recording_without_its_end_is_refused(tmp_path, monkeypatch):
    save = rr.RecordingStream.save
    monkeypatch.setattr("rerun.RecordingStream.save", lambda stream, path: save(stream, os.devnull))
    with pytest.raises(ShotError, match="its end could not be written"):
        write(tmp_path / "out.rrd", synthetic.result())
    assert list(tmp_path.iterdir()) == []


def test_a_failure_half_way_leaves_the_old_recording(tmp_path):
    path = tmp_path / "out.rrd"
    path.write_bytes(b"old")
    broken = dataclasses.replace(synthetic.result(), steps=(None,))
    with pytest.raises(AttributeError):
        write(path, broken)
    assert path.read_bytes() == b"old" and [p.name for p in tmp_path.iterdir()] == ["out.rrd"]


def test_writing_a_recording_leaves_no_trace_in_the_home_folder(tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    code = (
        "import sys; sys.path[:0] = sys.argv[1:4]\n"
        "import test_rerun_logger as t, synthetic\n"
        "t.write(sys.argv[4], synthetic.result())\n"
    )
    folders = [str(ROOT / "pipeline"), str(Path(__file__).parent), str(ROOT / "tests" / "helpers" / "plugins")]
    environment = {key: value for key, value in os.environ.items() if not key.startswith("XDG_")} | {"HOME": str(home)}
    subprocess.run(
        [sys.executable, "-c", code, *folders, str(tmp_path / "out.rrd")], env=environment, check=True, timeout=600
    )
    assert (tmp_path / "out.rrd").is_file() and not list(home.rglob("*rerun*"))


def test_the_summary_lists_operators_that_ran_and_that_were_skipped(tmp_path):
    from calmotion.host import OperatorResult, Outcome

    steps = (
        OperatorResult("usd.read", "Read the shot", "usd_reader", Outcome.DONE, duration=1.25, progress=1.0),
        OperatorResult("fe.mesh", "Mesh", "fe_mesher", Outcome.LEFT_OUT, reason="no body is flexible"),
    )
    module = host_with(PLUGIN).plugin("rerun_logger").module
    recording = __import__(f"{module.__name__}.recording", fromlist=["write_recording"])
    path = str(tmp_path / "run.rrd")
    recording.write_recording(path, synthetic.character(), synthetic.animation(), synthetic.result(), operators=steps)
    text = str(
        next(
            value
            for (entity, _), (_, value) in read_recording(path).items()
            if entity == "/summary" and "## Run" in str(value)
        )
    )
    assert "| `usd.read` | usd_reader | done | 1.25 s |  |" in text
    assert "| `fe.mesh` | fe_mesher | left out |  | no body is flexible |" in text


def test_each_shot_has_a_layout_of_its_own(tmp_path):
    from rerun.chunk import RrdReader

    names = set()
    for name in ("first", "second"):
        write(tmp_path / f"{name}.rrd", synthetic.result())
        reader = RrdReader(str(tmp_path / f"{name}.rrd"))
        (layout,), (recording,) = reader.blueprints(), reader.recordings()
        assert layout.application_id == recording.application_id
        names.add(layout.application_id)
    assert len(names) == 2, "the viewer keeps one camera for each application"
