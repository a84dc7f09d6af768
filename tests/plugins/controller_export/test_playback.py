"""The loss by played commands, against an independent replay and known delays."""

import numpy as np
import pytest
from calmotion.model import Track
from calmotion.model.curves import commanded_curves
from calmotion.model.run import RunSettings
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.simulate import simulate_shot
from calmotion.testing import small_shot
from calmotion_plugins.controller_export.commands import CUBIC, LINEAR, Commands, MotorCurves, instants
from calmotion_plugins.controller_export.playback import Playback


def curves_of(character, animation):
    return MotorCurves(
        "arm.usda", float(animation.frame_times[-1]), character.retarget.cyclic, character.motors, ("a", "b"),
        np.tile([-np.inf, np.inf], (2, 1)), commanded_curves(character, animation, None),
    )  # fmt: skip


@pytest.fixture(scope="module")
def rigid():
    character, animation = small_shot()
    return compile_shot(character, animation), curves_of(character, animation)


def sampled(curves, rate, interpolation=LINEAR):
    times = instants(curves, rate)
    return Commands(interpolation, times, curves.at(times), curves.at(times, 1))


def test_a_late_start_costs_speed_times_delay(rigid):
    shot, curves = rigid
    playback = Playback(shot, RunSettings(), curves)
    loss = playback.loss(sampled(curves, 500.0, CUBIC), 1 / 480, delay=0.002)
    np.testing.assert_allclose(loss.distances, 0.002 * playback.fastest(1 / 480), rtol=1e-2)


def test_lines_cost_an_eighth_of_the_acceleration_times_the_square_of_the_period(rigid):
    shot, curves = rigid
    playback = Playback(shot, RunSettings(), curves)
    coarse, fine = (playback.loss(sampled(curves, rate), 1 / 480).distances[0] for rate in (20.0, 40.0))
    # the tip is 0.8 m from the shoulder and 0.4 m from the elbow, which turns against it by half as much
    fastest = 0.25 * (2.0 * np.pi) ** 2
    assert coarse == pytest.approx(0.05**2 / 8.0 * fastest * 0.6, rel=0.25)
    assert coarse / fine == pytest.approx(4.0, rel=0.2)


def test_the_loss_on_a_flexible_arm_is_that_of_an_independent_replay(arm, animation, bodies):
    shot, curves = compile_shot(arm, animation, bodies), curves_of(arm, animation)
    commands, playback = sampled(curves, 23.0), Playback(shot, RunSettings(), curves)
    found = playback.loss(commands, playback.step_for(1 / 23)).distances[0]
    lines = [Track(commands.times, column, commands.times) for column in commands.positions.T]
    options = RunSettings(step=1 / 1920)
    runs = [simulate_shot(s, options, lambda *_: None).before.motion for s in (shot, shot.with_tracks(lines))]
    judged = runs[0].judged
    off = np.linalg.norm(runs[0].target_positions - runs[1].target_positions, axis=2)[judged]
    assert found == pytest.approx(off[:, 0].max(), rel=0.1) and found > 1e-4
