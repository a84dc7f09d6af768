"""What recordings say of a robot with a closed chain: what encoders alone tell, and no guess beyond it."""

import numpy as np
import pytest
from calmotion.multibody import span_tree
from calmotion.recordings import ANGLE, MARKER, Channel, SensorRecording
from calmotion.simulation import compile_shot, reduce_bodies
from calmotion_plugins.diagnosis import diagnosis_of, situation_of
from linkage_arm import linkage_arm, performance

STEP, COUNT = 2.5e-4, 2.0 * np.pi / 4096


@pytest.fixture(scope="module")
def arm():
    character, meshes = linkage_arm()
    return compile_shot(character, performance(), reduce_bodies(character, span_tree(character), meshes))


def recording(arm, encoders):
    """Encoders of loops that ring at 5 Hz, and a marker at the hand, whose place nothing can be compared with."""
    times, omega, damping = np.arange(0.0, 4.0, STEP), 2.0 * np.pi * 5.0, 0.1
    asked = np.stack([np.interp(times, track.times, track.values) for track in arm.animation.current], axis=1)
    values, y, v = np.zeros_like(asked), asked[0].copy(), np.zeros(asked.shape[1])
    for n, goal in enumerate(asked):
        v += STEP * (omega**2 * (goal - y) - 2.0 * damping * omega * v)
        y = y + STEP * v
        values[n] = y
    at = times[::20]
    channels = [Channel(MARKER, "/Rapper/Hand/Palm", at, 0.3 + 0.1 * np.stack([np.sin(at * k) for k in (1, 2, 3)], 1))]
    if encoders:
        rounded = COUNT * np.round(values[::20] / COUNT)
        channels += [Channel(ANGLE, m.path, at, rounded[:, [k]]) for k, m in enumerate(arm.character.motors)]
    return SensorRecording("take.csv", "", tuple(channels))


def test_encoders_of_a_closed_chain_tell_a_loop_that_rings(arm):
    found = diagnosis_of(situation_of(arm, [recording(arm, True)]))
    first = found.causes[0]
    assert first.cause == "servo_gains" and first.share > 0.9
    values = [row["value"] for row in first.parameters if row["name"] == "frequency"]
    np.testing.assert_allclose(values, 5.0, rtol=0.03)
    assert any("close chains" in note for note in found.notes)
    assert any("/Rapper/Hand/Palm is not used" in note for note in found.notes)


def test_a_marker_of_a_closed_chain_alone_has_no_cause(arm):
    first = diagnosis_of(situation_of(arm, [recording(arm, False)])).causes[0]
    assert first.cause == "unknown" and "encoders" in first.remedy
