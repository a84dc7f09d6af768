"""Tables fit their width and lose nothing; sentences are wrapped between words."""

import io
import math

import pytest
from calmotion.cli.tables import (
    about,
    angle,
    console_on,
    counted,
    frequency,
    length,
    measured,
    print_table,
    quantity_in,
    say,
    up_to,
)

HEADS = ["motor", "limits", "peak speed", "may change"]
SHORT = [["/A/Joints/Waist", "-120° .. 120°", "219.4°/s", "yes"], ["/A/Joints/Elbow", "-", "0°/s", "no"]]
DEEP = "/Robot/" + "link/" * 20


@pytest.fixture
def printed(monkeypatch):
    """The lines of a table, or of a sentence, on a terminal of some width."""

    def lines(width, rows, heads=HEADS, sentence=""):
        monkeypatch.setenv("COLUMNS", str(width))
        stream = io.StringIO()
        console = console_on(stream)
        say(console, sentence) if sentence else print_table(console, "Motors", heads, rows)
        return stream.getvalue().splitlines()

    return lines


def test_a_table_that_fits_has_whole_paths(printed):
    lines = printed(80, SHORT)
    assert lines[0] == "Motors" and len(lines) == 5
    assert lines[3].startswith("/A/Joints/Waist  -") and lines[3].endswith("219.4°/s         yes")


@pytest.mark.parametrize("width", [45, 50])
def test_a_narrow_table_has_short_paths_and_says_so(printed, width):
    lines = printed(width, SHORT)
    assert max(map(len, lines)) <= width
    assert sum("…/" in line for line in lines) == 2 and "(… stands for the start" in " ".join(lines)


def test_what_does_not_fit_is_folded_and_never_cut(printed):
    lines = printed(30, [[DEEP + "a" * 40, *SHORT[0][1:]], [DEEP + "b" * 40, *SHORT[1][1:]]])
    text = "".join(lines)
    assert max(map(len, lines)) <= 30
    assert text.count("a") - "".join(SHORT[0] + HEADS).count("a") >= 40 and "120°" in text and "219.4" in text


def test_a_file_has_long_lines(monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    stream = io.StringIO()
    print_table(console_on(stream), "Motors", HEADS, [[DEEP, *SHORT[0][1:]]])
    say(console_on(stream), f"note: {'word ' * 50}")
    assert DEEP in stream.getvalue() and len(stream.getvalue().splitlines()) == 5


def test_a_sentence_is_wrapped_between_words(printed):
    lines = printed(40, [], sentence=f"note: {DEEP} and 3 others: a long-drawn remark about these prims")
    assert f"  {DEEP}" in lines and all(len(line) <= 40 or line == f"  {DEEP}" for line in lines)


def test_markup_is_text(printed):
    assert printed(80, [], sentence="[bold]:smile: /a[0]") == ["[bold]:smile: /a[0]"]
    assert "[red]" in printed(80, [["[red]", ":smile:", "1", "2"]])[3]


def test_nothing_is_printed_without_rows(printed):
    assert printed(80, []) == []


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


def test_a_largest_error_is_up_to_it_or_less_than_can_be_shown():
    assert (up_to(1e-9), up_to(2e-3)) == ("less than 0.0001 mm", "up to 2 mm")


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
)
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
