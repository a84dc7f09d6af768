"""Progress of a run: the fraction of a stage and the time that it still takes."""

import pytest
from calmotion.workflow import run


def test_the_time_left_follows_from_the_share_that_is_done(monkeypatch):
    now, seen = [100.0], []
    monkeypatch.setattr(run.time, "perf_counter", lambda: now[0])
    listen = run._listener(run.Hooks(progress=seen.append), [])
    for seconds, stage, fraction in (
        (0, "search", 0.0),
        (10, "search", 0.25),
        (30, "search", 0.75),
        (30, "write", 0.5),
    ):
        now[0] = 100.0 + seconds
        listen(stage, fraction, "")
    assert [state.fraction for state in seen] == [0.0, 0.25, 0.75, 0.5]
    assert [state.time_left_s for state in seen] == [None, pytest.approx(30.0), pytest.approx(10.0), None]
