"""The comparison of a calmed stream with shapers, on an arm whose motors give."""

from dataclasses import replace

import numpy as np
import pytest
from calmotion.simulation import compile_shot
from calmotion.testing import small_shot
from calmotion_plugins.benchmarks.motors.live import compare


def test_a_stream_leaves_less_than_the_animation_and_shapers():
    character, animation = small_shot()
    gives = {"model": "drive", "position_gain": 180.0, "velocity_gain": 0.4}
    motors = tuple(replace(motor, **gives) for motor in character.motors)
    shot = compile_shot(replace(character, motors=motors, gravity=np.zeros(3)), animation)
    rows = {row.method: row for row in compare("arm", shot, (1.0,))}
    live = rows["live, 0.4 of the period"]
    others = [row.rms_mm for name, row in rows.items() if not name.startswith("live")]
    assert len(others) == 11 and 0.0 < live.best_mm <= live.rms_mm < 0.5 * min(others)
    assert rows["gaussian"].delay_s == pytest.approx(live.delay_s, abs=0.03), "at equal delay"
    assert max(rows["gaussian"].rms_mm, rows["low-pass"].rms_mm) < 2.0 * rows["as animated"].rms_mm
    assert 0.0 < live.tick_ms <= live.tick_99_ms and live.delay_s > 0.01
