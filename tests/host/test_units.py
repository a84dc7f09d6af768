import math

import numpy as np
import pytest
from calmotion.host import SettingError, has_no_unit, parse_quantity, quantity_of


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("5mm", "m", 0.005),
        ("3 cm", "m", 0.03),
        ("0.1", "m", 0.1),
        ("-1", "m", -1.0),
        ("90deg", "rad", math.pi / 2),
        ("2ms", "s", 0.002),
        ("20um", "m", 2e-5),
        ("20 \u00b5m", "m", 2e-5),
        ("20\u03bcs", "s", 2e-5),
        (".5s", "s", 0.5),
        ("1.5e3Hz", "Hz", 1500.0),
        ("2.1GPa", "Pa", 2.1e9),
        ("70MPa", "Pa", 70e6),
        ("5", "mm", 5.0),
        ("1m", "mm", 1000.0),
        ("12", "", 12.0),
    ],
)
def test_a_quantity_is_converted_to_the_requested_unit(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=1e-15)


def test_millimetres_give_the_float_a_person_would_write():
    assert [parse_quantity(f"{n}mm", "m") for n in range(1, 100)] == [float(f"{n}e-3") for n in range(1, 100)]


@pytest.mark.parametrize(("text", "unit"), [("5s", "m"), ("5furlongs", "m"), ("5mm", ""), ("five", "m"), ("", "m")])
def test_a_unit_of_another_kind_is_refused_with_the_ones_that_fit(text, unit):
    with pytest.raises(SettingError) as refused:
        parse_quantity(text, unit)
    assert ("mm" in refused.value.remedy) == (unit == "m")


@pytest.mark.parametrize(("text", "unit", "meant"), [("1MM", "m", "mm"), ("5MS", "s", "ms"), ("2khz", "Hz", "kHz")])
def test_a_unit_that_is_misspelt_gets_the_nearest(text, unit, meant):
    with pytest.raises(SettingError) as refused:
        parse_quantity(text, unit)
    assert refused.value.remedy.startswith(f"Did you mean {meant}? ")


@pytest.mark.parametrize(
    ("text", "bare"), [("5", True), (" 1e-3 ", True), ("5mm", False), ("1mm1", False), ("", False)]
)
def test_a_number_without_a_unit_is_told_from_what_is_no_number(text, bare):
    assert has_no_unit(text) == bare


@pytest.mark.parametrize("text", ["1e9999999999999999999", "8" * 90 + "E" + "8" * 300, "-1e99999999999999999999mm"])
def test_a_number_that_no_computer_holds_is_refused_briefly(text):
    with pytest.raises(SettingError, match="beyond what can be represented|not a number") as error:
        parse_quantity(text, "m")
    assert len(str(error.value)) < 400


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (None, "m", None), ("1mm", "m", 1e-3), (1, "s", 1.0), (np.float32(0.5), "m", 0.5), (np.int64(2), "s", 2.0),
        ("2", "s", 2.0), ("180deg", "rad", np.pi),
    ],
)  # fmt: skip
def test_numbers_are_in_si_and_texts_have_units(value, unit, expected):
    found = quantity_of(value, unit)
    assert found == (None if expected is None else pytest.approx(expected, rel=1e-12))
    assert found is None or type(found) is float


@pytest.mark.parametrize(
    ("value", "unit", "problem"),
    [
        ("1", "m", "no unit"), ("1s", "m", "unit does not fit"), (True, "s", "a number or a text"),
        (1j, "s", "a number or a text"), (np.array(1.0), "m", "a number or a text"), (np.inf, "s", "finite"),
        (float("nan"), "m", "finite"), ("inf", "s", "finite|not a number"),
    ],
)  # fmt: skip
def test_anything_else_is_refused_by_its_name(value, unit, problem):
    with pytest.raises(SettingError, match=problem):
        quantity_of(value, unit, "tolerance")
