"""The figures: they show the numbers they name, the renderer sees what is in front, and files are whole or absent."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import synthetic
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.shot.outputs import SystemModes
from calmotion.shot.run import OutputPaths
from calmotion.testing import check_plugin, host_with, run_operator
from calmotion.views.spectrum import error_spectrum
from calmotion.views.viewpoint import choose_viewpoint

PLUGIN = Path(__file__).resolve().parents[2] / "plugins" / "figures"


@pytest.fixture(scope="module")
def figures():
    """The plugin's package, as the host imports it."""
    host = host_with(PLUGIN)
    package = host.operators["figures.plot"].__module__
    __import__(f"{package}.drawing")
    return sys.modules[package]


def draw(folder, result, settings=None):
    values = [synthetic.character(), synthetic.animation(), result, OutputPaths(figures=str(folder))]
    return run_operator(host_with(PLUGIN), "figures.plot", values, settings)[0].paths


def lines_of(axes):
    return {line.get_label().split(":")[0]: line for line in axes.get_lines()}


def test_the_plugin_keeps_to_the_rules():
    assert check_plugin(PLUGIN) == []


def test_an_optimised_result_gives_five_pictures_and_nothing_else(tmp_path):
    paths = draw(tmp_path / "new" / "folder", synthetic.result(), {"figures.plot": {"dpi": 60}})
    names = [Path(path).name for path in paths]
    assert names == ["errors.png", "spectra.png", "motors.png", "convergence.png", "filmstrip.png"]
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == sorted(names)
    for path in paths:
        picture = matplotlib.image.imread(path)
        assert picture.shape[0] > 100 and picture[..., :3].std() > 0.02


def test_a_simulation_alone_has_no_convergence_and_draws_twice_the_same(tmp_path):
    result = synthetic.result(optimized=False)
    first, second = (draw(tmp_path / name, result, {"figures.plot": {"dpi": 60}}) for name in "ab")
    assert [Path(path).name for path in first] == ["errors.png", "spectra.png", "motors.png", "filmstrip.png"]
    for one, other in zip(first, second, strict=True):
        assert Path(one).read_bytes() == Path(other).read_bytes()


def test_errors_are_drawn_in_millimetres_and_degrees_from_the_first_frame_on(figures):
    result = synthetic.result()
    position, rotation = figures.curves.plot_errors(synthetic.character(), result).axes
    first = int(np.searchsorted(result.before.motion.times, -1e-9))
    for name, run in (("before", result.before), ("after", result.after)):
        times, values = lines_of(position)[name].get_data()
        assert times[0] == 0.0
        np.testing.assert_allclose(values, 1e3 * run.position_errors[first:, 0])
        np.testing.assert_allclose(lines_of(rotation)[name].get_ydata(), np.degrees(run.rotation_errors[first:, 0]))
    assert f"largest {1e3 * result.before.position_errors.max():.2f} mm" in lines_of(position)["before"].get_label()
    assert "[mm]" in position.get_ylabel() and "[deg]" in rotation.get_ylabel()
    assert position.get_title(loc="left") == "/Robot/Tip/Target"


def test_spectra_are_drawn_in_millimetres_with_the_modes_marked(figures):
    result, modes = synthetic.result(), SystemModes(np.array([4.0, 900.0]), np.array([0.01, 0.02]))
    (axes,) = figures.spectra.plot_spectra(synthetic.character(), result, modes).axes
    for name, run in (("before", result.before), ("after", result.after)):
        frequencies, amplitudes = error_spectrum(run.motion, result.reference, 0)
        drawn = lines_of(axes)[name].get_data()
        np.testing.assert_allclose(drawn, [frequencies[1:], 1e3 * amplitudes[1:]])
    assert lines_of(axes)["modes in the first pose"].get_xdata() == [4.0, 4.0]
    assert [text.get_text() for text in axes.texts] == ["4.0"], "modes beyond the figure are not marked"
    assert "[mm]" in axes.get_ylabel() and "[Hz]" in axes.get_xlabel()
    (bare,) = figures.spectra.plot_spectra(synthetic.character(), result, None).axes
    assert not bare.texts and set(lines_of(bare)) == {"before", "after"}


def test_labels_too_near_to_stand_apart_are_written_as_one(figures):
    assert figures.spectra.grouped([1.0, 1.4, 1.9, 5.0], 0.6) == [[1.0, 1.4, 1.9], [5.0]]
    assert figures.spectra.grouped([], 1.0) == []


def test_motor_curves_show_limits_and_the_change(figures):
    angle, change = figures.curves.plot_motors(synthetic.character(), synthetic.result(), [0]).axes
    assert "limits -115 to 115 deg" in angle.get_title(loc="right")
    values = change.get_lines()[0].get_ydata()
    assert values.max() == pytest.approx(np.degrees(0.01), rel=1e-3)
    assert lines_of(angle)["before"].get_ydata().max() == pytest.approx(90.0)


def test_of_many_targets_the_figure_shows_the_worst_and_says_so(figures):
    character, result = synthetic.character(), synthetic.result(optimized=False)
    target = character.targets[0]
    targets = tuple(dataclasses.replace(target, path=f"/Robot/T{k}", rotation_weight=0.0) for k in range(12))
    errors = result.before.position_errors * np.arange(1.0, 13.0)
    before = dataclasses.replace(result.before, position_errors=errors, rotation_errors=errors)
    figure = figures.curves.plot_errors(
        dataclasses.replace(character, targets=targets), dataclasses.replace(result, before=before)
    )
    assert [axes.get_title(loc="left") for axes in figure.axes] == [f"/Robot/T{k}" for k in range(4, 12)]
    assert "8 of 12" in figure.get_supxlabel()


def test_the_instants_are_the_worst_of_each_part_of_the_shot(figures):
    animation, result = synthetic.animation(), synthetic.result()
    times = figures.filmstrip.choose_instants(animation, result, 3)
    errors = np.interp(animation.frame_times, result.before.motion.times, result.before.position_errors[:, 0])
    parts = np.array_split(np.arange(synthetic.FRAMES), 3)
    assert times.tolist() == [animation.frame_times[part[np.argmax(errors[part])]] for part in parts]


def test_the_renderer_shows_the_nearer_triangle_and_not_the_back_of_one(figures):
    def triangle(depth, mirrored=False):
        corners = [(1.0, 1.0, depth), (1.0, 15.0, depth), (15.0, 15.0, depth)]
        return corners[::-1] if mirrored else corners

    hits = figures.raster.rasterize(np.array([triangle(5.0), triangle(2.0), triangle(1.0, True)]), 16, 16)
    assert set(np.unique(hits.triangle)) == {-1, 1}
    assert (hits.triangle == 1).sum() == pytest.approx(0.5 * 14 * 14, rel=0.1)
    np.testing.assert_allclose(hits.depth[hits.triangle == 1], 2.0)
    assert np.all(np.isinf(hits.depth[hits.triangle < 0]))
    rows, columns = np.nonzero(hits.triangle == 1)
    middle = hits.shares[rows, columns] @ np.array([(1.0, 1.0), (1.0, 15.0), (15.0, 15.0)])
    np.testing.assert_allclose(middle, np.column_stack([columns, rows]) + 0.5, atol=1e-9)


def test_triangles_that_share_an_edge_leave_no_gap_and_those_outside_are_clipped(figures):
    a, b, c, d = (-30.0, -30.0, 1.0), (-30.0, 50.0, 1.0), (50.0, 50.0, 1.0), (50.0, -30.0, 1.0)
    far = np.array([(100.0, 100.0, 1.0), (100.0, 120.0, 1.0), (120.0, 120.0, 1.0)])
    hits = figures.raster.rasterize(np.array([[a, b, c], [a, c, d], far]), 20, 16)
    assert hits.triangle.shape == (16, 20) and set(np.unique(hits.triangle)) == {0, 1}


def test_the_camera_shows_the_whole_motion_and_up_is_up(figures):
    character, result = synthetic.character(), synthetic.result()
    motion = result.before.motion
    view = choose_viewpoint(character, result.skins, motion)
    cloud = motion.target_positions[:, 0]
    camera = figures.scene.fit_camera(view, cloud, 300, 200)
    pixels = camera.project(cloud)
    assert np.all(pixels[:, :2] >= 0.0) and np.all(pixels[:, :2] <= [300, 200])
    low, high = camera.project(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.1]]))
    assert high[1] < low[1]
    # Seen from its side of the world, what is nearer has the smaller depth.
    assert camera.project(camera.eye + camera.axes[2])[2] == pytest.approx(1.0)


def test_the_bent_link_is_drawn_where_the_simulation_puts_it(figures):
    character, result = synthetic.character(), synthetic.result()
    model = figures.scene.prepare(character, result.skins)
    row = int(np.argmax(result.before.motion.elastic[1][:, 0]))
    corners, normals, owners = figures.scene.pose(model, result.before.motion, row)
    link = corners[owners == 1].reshape(-1, 3)
    far = np.linalg.norm(link, axis=1) > 0.9 * synthetic.LENGTH
    np.testing.assert_allclose(
        np.unique(link[far].round(9), axis=0).mean(axis=0), result.before.motion.target_positions[row, 0], atol=1e-6
    )
    assert len(model.parts) == 3  # the guide is not shown
    np.testing.assert_allclose(np.linalg.norm(normals, axis=-1), 1.0)


def test_it_is_skipped_when_no_figures_are_requested():
    values = [synthetic.character(), synthetic.animation(), synthetic.result(), OutputPaths()]
    with pytest.raises(PluginError, match="--figures"):
        run_operator(host_with(PLUGIN), "figures.plot", values)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ShotError, match="cannot be written"):
        draw(tmp_path / "file" / "figures", synthetic.result())


def test_the_magnifier_keeps_the_straying_target_in_sight(figures):
    character, result = synthetic.character(), synthetic.result()
    motion, reference = result.before.motion, result.reference
    view = choose_viewpoint(character, result.skins, motion)
    camera = figures.scene.fit_camera(view, motion.target_positions[:, 0], 600, 400)
    magnifier = figures.magnifier.choose_magnifier(reference, [motion], np.zeros(len(motion.times), int), camera)
    assert magnifier.useful
    gap = camera.project(motion.target_positions[:, 0])[:, :2] - camera.project(reference.target_positions[:, 0])[:, :2]
    assert magnifier.factor * np.linalg.norm(gap, axis=1).max() <= 0.4 * figures.magnifier.inset_side(camera)


def test_the_box_shows_the_target_that_is_farthest_off_at_that_instant(figures):
    before = synthetic.result().before
    times = before.motion.times
    both = np.stack([np.where(times < 0.5, 2e-3, 1e-3), np.full(len(times), 1.5e-3)], axis=1)
    before = dataclasses.replace(before, position_errors=both)
    found = figures.filmstrip.farthest_targets(before, np.array([0.25, 0.75]))
    assert found.tolist() == [0, 1]
    assert figures.filmstrip.error_at(before, 1, 0.3) == pytest.approx(1.5e-3)
    nothing = dataclasses.replace(before, position_errors=both[:, :0])
    assert len(figures.filmstrip.farthest_targets(nothing, np.array([0.25]))) == 0


def test_the_magnifier_stands_in_the_emptiest_corner_and_not_over_the_target(figures):
    drawn = np.full((100, 200, 3), 255, dtype=np.uint8)
    drawn[60:, :60] = 0
    drawn[:40, :40] = 0
    assert figures.magnifier.emptiest_corner(drawn, 40, np.array([190.0, 90.0])).tolist() == [160, 0]
    assert figures.magnifier.emptiest_corner(drawn, 40, np.array([190.0, 5.0])).tolist() == [160, 60]
