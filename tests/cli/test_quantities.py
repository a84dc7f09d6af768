import math

import pytest
from calmotion.cli.quantities import angle, counted, length, memory


@pytest.mark.parametrize(
    "meters, text",
    [
        (0.0, "0 mm"), (1.392e-15, "< 0.0001 mm"), (9.9e-8, "< 0.0001 mm"), (1.2e-7, "0.00012 mm"),
        (0.0593, "59.3 mm"), (9.9994, "9999 mm"), (9.9999, "10 m"), (123.456, "123.5 m"), (None, "-"),
        (float("inf"), "-"),
    ],
)  # fmt: skip
def test_lengths_have_no_powers_of_ten(meters, text):
    assert length(meters) == text


@pytest.mark.parametrize(
    "degrees, text",
    [
        (0.0, "0°"), (1.9e-15, "0°"), (-9.9e-15, "0°"), (0.001, "0.001°"), (30.0, "30°"), (-219.44, "-219.4°"),
        (123456.0, "123456°"), (math.nan, "-"),
    ],
)  # fmt: skip
def test_angles_have_no_powers_of_ten(degrees, text):
    assert angle(math.radians(degrees)) == text


def test_one_thing_has_no_plural():
    assert [counted(number, "frame") for number in (0, 1, 2)] == ["0 frames", "1 frame", "2 frames"]


@pytest.mark.parametrize(
    "size, text",
    [
        (2.6e4, "less than 1 MB"), (9.99e5, "1 MB"), (3.14e7, "31 MB"), (9.94e8, "990 MB"), (9.96e8, "1 GB"),
        (1.23e9, "1.2 GB"), (1.234e12, "1230 GB"),
    ],
)  # fmt: skip
def test_memory_has_two_digits(size, text):
    assert memory(size) == text
