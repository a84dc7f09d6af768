"""A strain gauge behind a filter, of unknown gain and offset, on an arm that swings already when its shot begins."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.character import Frame, Target
from calmotion.model.run import RunSettings
from calmotion.multibody.model.topology import span_tree
from calmotion.recordings import STRAIN, Channel, LowPass, SensorRecording
from calmotion.simulation.bodies import reduce_bodies
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.calibration import CalibrationSettings, calibrate_shots
from calmotion_plugins.calibration.identification.robots import robot_with
from calmotion_plugins.calibration.identification.signals import signals_of
from recorded import PLASTIC
from scipy.signal import lsim, lti

ENDS, PLACE = ("/Arm/Link0/a", "/Arm/Link0/b"), (1, 2)
FILTER = LowPass(5.0, 0.8)
GAIN, OFFSET, LATER = 20.0, 0.4, 0.55
TRUTH = {("modulus", PLASTIC, -1): 2.15e9, ("damping", PLASTIC, -1): 0.02}


@pytest.fixture(scope="module")
def shots():
    """The whole performance, and what of it is the shot: it begins while the arm still swings."""
    character, meshes = beam_arm(length=0.35, thickness=0.018, youngs_modulus=1.8e9, elasticity="linear", modes=3)
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    gauge = tuple(
        Target(path, 0, Frame(np.array([x, 0.0, 0.009]), upright)) for path, x in zip(ENDS, (0.03, 0.06), strict=True)
    )
    character = dataclasses.replace(character, targets=(*character.targets, *gauge))
    bodies = reduce_bodies(character, span_tree(character), meshes)
    before, away = quintic(0.5, 0.2, 0.05), quintic(0.7, 0.25, 0.2)
    whole = shot_of(lambda t: before(t) + away(np.asarray(t) - LATER), 1.75, rate=100.0)
    part = shot_of(lambda t: before(t + LATER) + away(t), 1.2, rate=100.0)
    return tuple(compile_shot(character, animation, bodies) for animation in (whole, part))


def test_a_filter_is_that_of_its_transfer_function(shots):
    signals = signals_of(robot_with(shots[0], {}), RunSettings(step=1 / 960))
    raw, found = (signals.at(STRAIN, PLACE, signals.times, low_pass=f)[:, 0] for f in (None, FILTER))
    w = 2.0 * np.pi * FILTER.frequency
    exact = lsim(lti([w * w], [1.0, 2.0 * FILTER.damping * w, w * w]), raw - raw[0], signals.times)[1]
    assert np.ptp(raw) > 1e-2
    assert np.abs(found - raw[0] - exact).max() < 2e-3 * np.ptp(exact)


@pytest.mark.parametrize("real", [FILTER, LowPass(5.4, 0.62)], ids=["", "another filter"])
def test_a_gauge_tells_modulus_and_damping_of_an_arm_that_swings_when_its_shot_begins(shots, real):
    whole, part = shots
    signals = signals_of(robot_with(whole, TRUTH), RunSettings(step=1 / 960))
    times = np.arange(0.0, 1.2, 1 / 200)
    values = GAIN * signals.at(STRAIN, PLACE, times + LATER, low_pass=real) + OFFSET
    values = values + 2e-3 * np.ptp(values) * np.random.default_rng(0).standard_normal(values.shape)
    channel = Channel(STRAIN, ENDS[0], times, values, to=ENDS[1], low_pass=FILTER)
    settings = CalibrationSettings(("modulus", "damping"), {"clock_offset": 1e-3}, halvings=0)
    found = calibrate_shots(
        [(part, [SensorRecording("gauge.csv", "", (channel,))])], settings, RunSettings(step=1 / 240)
    )
    estimates = {item.name: item for item in found.estimates}
    assert estimates[f"modulus {PLASTIC}"].value == pytest.approx(2.15e9, rel=0.02)
    assert estimates[f"damping {PLASTIC}"].value == pytest.approx(0.02, rel=0.2)
    assert estimates[f"gain {ENDS[0]}"].value == pytest.approx(GAIN, rel=0.03)
    assert estimates[f"filter_frequency {ENDS[0]}"].value == pytest.approx(real.frequency, rel=0.02)
    assert estimates[f"filter_damping {ENDS[0]}"].value == pytest.approx(real.damping, rel=0.04)
    assert found.channels[0].validation_rms < 0.01 * np.ptp(values)
    assert any("moves already when its recording begins" in note for note in found.notes)
