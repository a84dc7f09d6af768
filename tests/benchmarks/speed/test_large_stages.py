"""A set around a shot, to measure how reading grows with it."""

from pathlib import Path

import pytest
from calmotion.benchmarks.speed.large_stages import compare
from calmotion.usd.reading.shot import read_shot
from calmotion.usd.stages import open_stage
from calmotion.usd.writing.still_set import write_large_stage
from one_hinge import ONE_HINGE


def test_the_set_adds_prims_and_changes_nothing_of_the_character(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    large = write_large_stage(tmp_path / "shot.usda", 505, tmp_path)
    stage = open_stage(str(large))
    assert sum(1 for _ in stage.Traverse()) > 500
    assert [body.path for body in read_shot(str(large))[0].bodies] == ["/Robot/Link"]


@pytest.mark.long
def test_a_table_compares_both(tmp_path):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    text = compare(Path(tmp_path / "shot.usda"), 202)
    assert "| alone |" in text and "| with 202 prims |" in text and "| more |" in text
