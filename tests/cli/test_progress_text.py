"""The remaining time in the display of progress."""

import pytest
from calmotion.cli.progress import time_left


@pytest.mark.parametrize(
    "seconds, text",
    [
        (None, ""), (0.5, ""), (12.3, "about 12 s left"), (99.0, "about 99 s left"), (600.0, "about 10 min left"),
        (7200.0, "about 2.0 h left"),
    ],
)  # fmt: skip
def test_the_remaining_time_has_the_unit_of_its_size(seconds, text):
    assert time_left(seconds) == text
