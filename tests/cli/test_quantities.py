import math

import pytest
from calmotion.cli.tables import about, angle, counted, frequency, length, measured, quantity_in


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
    "value, deviation, unit, texts",
    [
        (1.59932e9, 4.9e6, "Pa", ("1.5993 GPa", "0.0049 GPa")),
        (2.56e-5, 4.0e-5, "s", ("0.026 ms", "0.040 ms")),
        (-3e-9, 1.2e-5, "m", ("0.000 mm", "0.012 mm")),
        (0.0391, 0.0018, "", ("0.0391", "0.0018")),
        (1234.5, 67.0, "N m/rad", ("1234 N m/rad", "67 N m/rad")),
        (math.radians(2.0), math.radians(0.25), "rad", ("2.00°", "0.25°")),
        (0.2, 0.0, "kg", ("0.2 kg", "-")),
        (0.2, math.inf, "kg", ("0.2 kg", "-")),
    ],
)  # fmt: skip
def test_an_estimate_has_the_digits_of_its_standard_deviation(value, deviation, unit, texts):
    assert measured(value, deviation, unit) == texts


@pytest.mark.parametrize(
    "value, unit, text",
    [(2.1e9, "Pa", "2.1 GPa"), (950.0, "Pa", "950 Pa"), (6.7e-16, "s", "0 ms"), (-0.004, "m", "-4 mm"), (1.0, "", "1")],
)
def test_a_quantity_has_the_unit_that_suits_its_size(value, unit, text):
    assert quantity_in(value, unit) == text


def test_estimates_have_two_digits_and_frequencies_no_powers_of_ten():
    assert (about(3.825e-4), about(None), about(0.0)) == ("0.38 mm", "-", "0 mm")
    assert [frequency(value) for value in (7.80213, 2160.4, 46123.0)] == ["7.802", "2160", "46120"]
