"""The figures: they show the numbers they name, the renderer sees what is in front, and files are whole or absent."""

import dataclasses
import sys
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
import synthetic
from calmotion.errors import ShotError
from calmotion.host import PluginError
from calmotion.model.limits.use import LimitUse
from calmotion.model.outputs import ExceededLimits, SystemModes, Tempo
from calmotion.model.run import OutputPaths
from calmotion.model.uncertainty import Robustness
from calmotion.testing import host_with, run_operator
from calmotion.views.spectrum import error_spectrum

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


def test_a_performance_at_another_tempo_has_its_tempo_with_reasons(tmp_path, figures):
    character, result = synthetic.character(), synthetic.retimed_result()
    paths = draw(tmp_path, result, {"figures.plot": {"dpi": 60}})
    assert "tempo.png" in [Path(path).name for path in paths]
    axes = sys.modules[f"{figures.__name__}.tempo"].plot_tempo(character, result.retimed).axes[0]
    line = axes.get_lines()[0]
    assert line.get_xdata()[-1] == pytest.approx(1.1) and line.get_ydata()[-1] == pytest.approx(100.0 / 1.2)
    assert [text.get_text() for text in axes.texts] == [f"velocity of {character.motors[0].path}"]


def test_the_tempo_that_a_robot_needs_is_drawn_where_limits_are_exceeded(tmp_path, figures):
    times = np.linspace(0.0, 1.0, 11)
    stretch = np.where((times > 0.3) & (times < 0.7), 1.25, 1.0)
    tempo = Tempo(1.25, 0.25, 0.1, times, stretch)
    exceeded = ExceededLimits((LimitUse(0, "velocity", 1.0, 1.25, 1.25, 0.5, 0.25),), tempo)
    values = [synthetic.character(), exceeded, OutputPaths(figures=str(tmp_path))]
    (drawn,) = run_operator(host_with(PLUGIN), "figures.tempo", values, {"figures.tempo": {"dpi": 60}})
    assert Path(drawn.path) == tmp_path / "tempo.png" and Path(drawn.path).stat().st_size > 5000
    axes = sys.modules[f"{figures.__name__}.tempo"].plot_needed_tempo(synthetic.character(), exceeded).axes[0]
    assert axes.get_lines()[0].get_ydata() == pytest.approx(100.0 / stretch)
    (told,) = (text.get_text() for text in axes.texts)
    assert told.startswith("velocity of") and told.endswith("+25%")
    with pytest.raises(PluginError, match="exceeds no limit"):
        kept = dataclasses.replace(exceeded, tempo=None)
        run_operator(host_with(PLUGIN), "figures.tempo", [values[0], kept, values[2]])


def test_errors_are_drawn_in_millimetres_and_degrees_from_the_first_frame_on(figures):
    result = synthetic.result()
    position, after, rotation, _ = figures.curves.plot_errors(synthetic.character(), result).axes
    first = int(np.searchsorted(result.before.motion.times, -1e-9))
    for name, run in (("before", result.before), ("after", result.after)):
        times, values = lines_of(position)[name].get_data()
        assert times[0] == 0.0
        np.testing.assert_allclose(values, 1e3 * run.position_errors[first:, 0])
        np.testing.assert_allclose(lines_of(rotation)[name].get_ydata(), np.degrees(run.rotation_errors[first:, 0]))
    assert f"largest {1e3 * result.before.position_errors.max():.3g} mm" in lines_of(position)["before"].get_label()
    assert "[mm]" in position.get_ylabel() and "[deg]" in rotation.get_ylabel()
    assert position.get_title(loc="left") == "/Robot/Tip/Target"
    assert rotation.get_title(loc="left") == "/Robot/Tip/Target, rotation"
    assert set(lines_of(after)) == {"after"} and after.get_title(loc="left").startswith("after")
    assert [axes.get_yscale() for axes in (position, after)] == ["linear"] * 2, "the win is seen"


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
    assert [axes.get_title(loc="left") for axes in figure.axes] == [f"/Robot/T{k}" for k in range(11, 3, -1)]
    assert "8 of 12" in figure.get_supxlabel()


def test_it_is_skipped_when_no_figures_are_requested():
    values = [synthetic.character(), synthetic.animation(), synthetic.result(), OutputPaths()]
    with pytest.raises(PluginError, match="--figures"):
        run_operator(host_with(PLUGIN), "figures.plot", values)


def test_a_folder_that_cannot_be_made_is_reported(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(ShotError, match="cannot be written"):
        draw(tmp_path / "file" / "figures", synthetic.result())


def test_convergence_begins_with_the_motion_as_animated(figures):
    result = synthetic.result()
    axes = figures.curves.plot_convergence(result).axes[0]
    work, objective = axes.get_lines()[0].get_data()
    assert list(work) == [1, 2, 23, 44], "simulations, and the sweeps that came before each iterate"
    assert list(objective) == [step.objective for step in result.search.steps] and axes.get_xlim()[0] == 0.0


def robustness():
    """One target; a robot in ten could not be simulated with the nominal curves."""
    errors = np.linspace(1e-3, 20e-3, 20)[:, None, None] * np.ones(2)
    drawn = {name: scale * errors for name, scale in (("before", 5.0), ("robust", 0.5))}
    drawn["nominal"] = np.where(np.arange(20)[:, None, None] % 10 == 9, np.inf, errors)
    nominal = {name: np.full((1, 2), v) for name, v in (("before", 60e-3), ("nominal", 1e-3), ("robust", 2e-3))}
    return Robustness("worst", (), nominal, drawn)


def test_robustness_is_drawn_as_shares_of_robots_beside_the_error_of_the_model(figures, tmp_path):
    found = robustness()
    (shares,) = figures.drawing.plot_robustness(synthetic.character(), found).axes
    errors, share = lines_of(shares)["robust"].get_data()
    assert np.allclose(errors, 1e3 * found.drawn["robust"][:, 0, 0]) and share[-1] == 100.0 and share[0] == 5.0
    errors, share = lines_of(shares)["optimised for the model"].get_data()
    assert len(errors) == 18 and share[-1] == 90.0  # two robots are missing
    points = {float(line.get_xdata()[0].round(9)) for line in shares.get_lines() if len(line.get_xdata()) == 1}
    assert points == {60.0, 1.0, 2.0}
    result = dataclasses.replace(synthetic.result(), robustness=found)
    assert "robustness.png" in [Path(path).name for path in draw(tmp_path, result, {"figures.plot": {"dpi": 60}})]


def test_the_motors_that_change_most_come_first(figures):
    character, result = synthetic.character(), synthetic.result()
    three = dataclasses.replace(character, motors=3 * character.motors[:1])

    def with_motors(simulation, factors):
        values = simulation.motion.motor_values[:, :1] + np.outer(np.arange(len(simulation.motion.times)), factors)
        return dataclasses.replace(simulation, motion=dataclasses.replace(simulation.motion, motor_values=values))

    before = with_motors(result.before, [0.0, 0.0, 0.0])
    moved = dataclasses.replace(result, before=before, after=with_motors(result.after, [1e-3, -1.0, 0.5]))
    assert figures.curves.most_changed(three, moved) == [1, 2, 0]
    assert figures.curves.most_changed(three, dataclasses.replace(moved, after=None)) == [0, 1, 2]
