"""The remaining time in the display of progress."""

import pytest
from calmotion.cli import progress
from calmotion.cli.bars import time_left
from calmotion.cli.progress import ProgressDisplay
from calmotion.host import OperatorResult, Outcome
from calmotion.host.operators import Record
from calmotion.workflow.run import Progress


@pytest.mark.parametrize(
    "seconds, text",
    [
        (None, ""), (0.5, ""), (12.3, "about 12 s left"), (99.0, "about 99 s left"), (600.0, "about 10 min left"),
        (7200.0, "about 2.0 h left"),
    ],
)  # fmt: skip
def test_the_remaining_time_has_the_unit_of_its_size(seconds, text):
    assert time_left(seconds) == text


@pytest.mark.parametrize("verbose", [False, True])
def test_details_are_for_those_who_ask(verbose, capsys):
    records = (Record("detail", "413 points"), Record("info", "no target"))
    ProgressDisplay(False, verbose=verbose).done(OperatorResult("a.b", "Make it", "a", Outcome.DONE, records=records))
    told = capsys.readouterr().err
    assert "note: no target" in told and ("note: 413 points" in told) == verbose


def test_a_log_tells_how_long_a_stage_takes_and_what_it_does_where_that_takes_long(capsys, monkeypatch):
    clock = iter([0.0, 1.0, 2.0, 30.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(clock))
    with progress.ProgressDisplay(False) as display:
        for stage, message in (("Film", "about 12 s for 9 frames"), ("Mesh", "/a"), ("Mesh", "/b"), ("Mesh", "/c")):
            display(Progress(stage, 0.0, message))
    assert capsys.readouterr().err.splitlines() == ["Film: about 12 s for 9 frames", "Mesh: /c"]
