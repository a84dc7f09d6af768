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
from calmotion.model.outputs import SystemModes
from calmotion.model.result import OptimizerStep
from calmotion.model.robust.robots import Compromise, Robustness
from calmotion.model.run import OutputPaths
from calmotion.testing import check_plugin, host_with, run_operator
from calmotion.views.rendering import fit_camera
from calmotion.views.spectrum import error_spectrum
from calmotion.views.style import titles as titles_of
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
    # the label "24.9–27.7 (3)" begins at 27.7 and is 13 letters long
    assert figures.spectra.grouped([24.9, 26.0, 27.7, 30.2], 2.4) == [[24.9, 26.0, 27.7], [30.2]]
    assert figures.spectra.grouped([24.9, 26.0, 27.7, 30.2], 2.4, 0.3) == [[24.9, 26.0, 27.7, 30.2]]
    # there is no room for "24.7" behind its line, and none between the lines for both labels
    assert figures.spectra.grouped([6.0, 23.2, 24.7], 1.0, 0.2, 25.3) == [[6.0], [23.2, 24.7]]
    assert figures.spectra.grouped([6.0, 20.2, 24.7], 1.0, 0.2, 25.3) == [[6.0], [20.2], [24.7]]
    assert figures.spectra.label_of([18.6, 18.7]) == "18.6, 18.7"
    assert figures.spectra.label_of([3.2, 3.4, 9.4]) == "3.2–9.4 (3)"


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
    camera = fit_camera(view, motion.target_positions[:, 0], 600, 400)
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


def test_the_magnifier_covers_no_line_and_the_least_of_the_character(figures):
    covered = np.zeros((100, 200), dtype=bool)
    covered[60:, :60] = covered[:40, :40] = True
    place = figures.magnifier.emptiest_place
    assert place(covered, 40, [np.array([[190.0, 90.0]])]) == (160, 4), "a little below the title"
    assert place(covered, 40, [np.array([[190.0, 5.0]])]) == (160, 60)
    trail = np.column_stack([np.full(50, 180.0), np.linspace(0.0, 100.0, 50)])
    left, top = place(covered, 40, [trail])
    assert left + 40 < 180 - 5 and not covered[top : top + 40, left : left + 40].any()


def test_errors_after_are_readable_beside_those_before(figures):
    result = synthetic.result()
    axes = figures.curves.plot_errors(synthetic.character(), result).axes[0]
    low, high = axes.get_ylim()
    largest = [1e3 * run.position_errors.max() for run in (result.before, result.after)]
    share = np.log(np.array(largest) / low) / np.log(high / low)
    assert axes.get_yscale() == "log" and share[0] < 1.0 and share[1] > 0.3
    alone = figures.curves.plot_errors(synthetic.character(), synthetic.result(optimized=False)).axes[0]
    assert alone.get_yscale() == "linear" and alone.get_ylim()[0] == 0.0


def test_convergence_begins_with_the_motion_as_animated(figures):
    result = synthetic.result()
    axes = figures.curves.plot_convergence(result).axes[0]
    work, objective = axes.get_lines()[0].get_data()
    assert list(work) == [1, 2, 23, 44], "simulations, and the sweeps that came before each iterate"
    assert list(objective) == [step.objective for step in result.steps] and axes.get_xlim()[0] == 0.0


def test_convergence_of_a_search_that_starts_elsewhere_and_goes_on_in_a_finer_simulation(figures):
    objectives = (4e-7, 3e-7, 6e-7, 3.5e-7)  # the third one is that of the second one's curves, simulated finer
    steps = tuple(OptimizerStep(value, 1e-3, 10 + k, 20 * k) for k, value in enumerate(objectives))
    result = dataclasses.replace(synthetic.result(), steps=steps, objective_before=1e-3)
    axes = figures.curves.plot_convergence(result).axes[0]
    lines = [list(line.get_ydata()) for line in axes.get_lines()]
    assert lines == [[4e-7, 3e-7], [6e-7, 3.5e-7], [1e-3, 4e-7]]
    assert {text.get_text() for text in axes.texts} == {"as animated", "finer simulation"}


def robustness():
    """One target; a robot in ten could not be simulated with the nominal curves."""
    drawn = {name: scale * np.linspace(1e-3, 20e-3, 20)[:, None] for name, scale in (("before", 5.0), ("robust", 0.5))}
    drawn["nominal"] = np.where(np.arange(20)[:, None] % 10 == 9, np.inf, np.linspace(1e-3, 20e-3, 20)[:, None])
    nominal = {name: np.array([v]) for name, v in (("before", 60e-3), ("nominal", 1e-3), ("robust", 2e-3))}
    return Robustness("worst", (), nominal, drawn, (Compromise(0.5, 4e-3, np.array([3.8e-3]), 0.4 * drawn["before"]),))


def test_robustness_is_drawn_as_shares_of_robots_and_as_what_the_model_pays(figures, tmp_path):
    found = robustness()
    shares, paid = figures.drawing.plot_robustness(synthetic.character(), found).axes
    errors, share = lines_of(shares)["robust"].get_data()
    assert np.allclose(errors, 1e3 * found.drawn["robust"][:, 0]) and share[-1] == 100.0 and share[0] == 5.0
    errors, share = lines_of(shares)["optimised for the model"].get_data()
    assert len(errors) == 18 and share[-1] == 90.0  # two robots are missing
    points = {tuple(np.round(line.get_xydata()[0], 9)) for line in paid.get_lines() if len(line.get_xdata()) == 1}
    assert points == {(1.0, 19.0), (2.0, 10.0), (3.8, 40.0)}
    assert [text.get_text() for text in paid.texts] == ["within 4 mm"]
    result = dataclasses.replace(synthetic.result(), robustness=found)
    assert "robustness.png" in [Path(path).name for path in draw(tmp_path, result, {"figures.plot": {"dpi": 60}})]


def test_spectra_name_the_pose_of_the_modes(figures):
    modes = SystemModes(np.array([4.0]), np.array([0.01]), 0.25)
    (axes,) = figures.spectra.plot_spectra(synthetic.character(), synthetic.result(), modes).axes
    assert "modes in the pose at 0.25 s (largest error)" in lines_of(axes)


def long_paths(character):
    """The character with a second target; both have long paths, and the same name."""
    target = character.targets[0]
    deep = "/Robot/" + "/".join(f"link_of_the_arm_{k}" for k in range(6))
    two = tuple(dataclasses.replace(target, path=f"{deep}/{side}/Hand") for side in ("left_wrist", "right_wrist"))
    return dataclasses.replace(character, targets=two)


def test_titles_are_whole_paths_where_they_fit_and_ends_that_differ_where_not(figures):
    assert titles_of(["/Arm/Hand", "/Arm/Elbow"]) == {"/Arm/Hand": "/Arm/Hand", "/Arm/Elbow": "/Arm/Elbow"}
    paths = [target.path for target in long_paths(synthetic.character()).targets]
    assert list(titles_of(paths).values()) == ["left_wrist/Hand", "right_wrist/Hand"]
    assert titles_of([]) == {}


def test_titles_of_the_filmstrip_that_would_meet_take_two_lines(figures):
    result, times = synthetic.result(), np.linspace(0.1, 0.9, 5)
    runs = [result.before, result.after]
    short, _ = figures.filmstrip.panel_titles(synthetic.character(), runs, np.zeros(5, dtype=int), times)
    assert short[0].startswith("0.10 s, Target ") and short[0].endswith(" mm")
    wide = long_paths(synthetic.character())
    titles = figures.filmstrip.panel_titles(wide, runs, np.zeros(5, dtype=int), times)
    assert len(titles) == 2 and all(title.endswith(" mm\nleft_wrist/Hand") for row in titles for title in row)
    assert figures.filmstrip.panel_titles(wide, runs[:1], np.empty(0, dtype=int), times)[0][0] == "0.10 s"


def test_the_filmstrip_has_the_whole_trails(figures, monkeypatch):
    monkeypatch.setattr(figures.filmstrip, "choose_instants", lambda animation, result, count: np.array([0.6]))
    character, animation, result = synthetic.character(), synthetic.animation(), synthetic.result()
    figure = figures.filmstrip.draw_filmstrip(character, animation, result, 1)
    trails = [line for axes in figure.axes for line in axes.get_lines() if len(line.get_xdata()) > 1]
    assert len(trails) == 4  # two in the panel of each row
    for line in trails:
        (left, right), (bottom, top) = line.axes.get_xlim(), line.axes.get_ylim()
        assert np.all((line.get_xdata() >= left) & (line.get_xdata() <= right))
        assert np.all((line.get_ydata() >= top) & (line.get_ydata() <= bottom))
