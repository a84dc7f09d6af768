"""Times that benchmarks take: how often what is timed is called."""

import pytest
from calmotion_plugins.benchmarks.common import timing
from calmotion_plugins.benchmarks.common.timing import median_time


@pytest.mark.parametrize(("arguments", "calls"), [({}, 6), ({"warm": True}, 5), ({"warm": True, "enough": 0.015}, 2)])
def test_it_is_called_until_enough_is_known(arguments, calls, monkeypatch):
    now, made = [0.0], []
    monkeypatch.setattr(timing.time, "perf_counter", lambda: now[0])

    def action():
        made.append(None)
        now[0] += 0.01

    assert median_time(action, 5, **arguments) == pytest.approx(0.01)
    assert len(made) == calls
