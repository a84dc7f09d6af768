"""Tables fit their width, and keep names whole."""

import io

import pytest
from calmotion.cli.tables import console_on, paths_in, print_table, say, short_paths
from rich.console import Console

HEADS = ["motor", "limits", "peak speed", "may change"]
SHORT = [["/A/Joints/Waist", "-120° .. 120°", "219.4°/s", "yes"], ["/A/Joints/Elbow", "-", "0°/s", "no"]]
DEEP = "/Robot/" + "link/" * 20


def printed(width, rows, heads=HEADS, texts=1):
    stream = io.StringIO()
    print_table(Console(file=stream, width=width), "Motors", heads, rows, texts)
    return stream.getvalue().splitlines()


def test_paths_get_an_ellipsis_and_stay_distinct():
    names = short_paths([DEEP + "left/hand", DEEP + "right/hand", DEEP + "head", "/x"])
    assert sorted(names.values()) == ["/x", "…/head", "…/left/hand", "…/right/hand"]


def test_a_table_that_fits_has_whole_paths():
    lines = printed(80, SHORT)
    assert lines[0] == "Motors" and len(lines) == 5
    assert lines[3].startswith("/A/Joints/Waist  -") and lines[3].endswith("219.4°/s         yes")


def test_heads_are_wrapped_before_names_are_shortened():
    lines = printed(48, SHORT)
    assert any("/A/Joints/Waist" in line for line in lines) and max(map(len, lines)) <= 48


@pytest.mark.parametrize("width", [42, 45])
def test_a_narrow_table_has_short_paths_and_says_so(width):
    lines = printed(width, SHORT)
    assert max(map(len, lines)) <= width
    assert sum("…/" in line for line in lines) == 2 and "(… stands for the start" in " ".join(lines)


def test_a_table_that_does_not_fit_is_a_list_with_whole_paths():
    rows = [[DEEP + "a" * 40, *SHORT[0][1:]], [DEEP + "b" * 40, *SHORT[1][1:]]]
    lines = printed(40, rows)
    assert f"  {DEEP}{'a' * 40}" in lines and "    limits -120° .. 120°; peak speed" in lines
    assert all(len(line) <= 40 or line.strip() in (rows[0][0], rows[1][0]) for line in lines)


def test_cells_are_wrapped_after_commas_alone():
    rows = [["/A/b", "49.84, 49.89, 385.1, 430.1, ... Hz"]]
    lines = printed(24, rows, ["body", "frequencies"])
    assert [line.strip() for line in lines[3:]] == ["/A/b       49.84, 49.89,", "385.1, 430.1,", "... Hz"]


def test_long_paths_in_sentences_are_shortened_where_they_stay_distinct():
    stream = io.StringIO()
    file = "wrote /home/somebody/a/very/long/folder/of/results/calm.usda"
    hands = [f"{DEEP}left/hand: rigid", f"{DEEP}right/hand: rigid", f"/x/y and {DEEP}left/handle"]
    console = console_on(stream, paths_in([*hands[:2], "/x/y"]))
    for sentence in (*hands, file):
        say(console, sentence)
    lines = ["…/left/hand: rigid", "…/right/hand: rigid", hands[2], file]
    assert stream.getvalue().splitlines() == lines


def test_nothing_is_printed_without_rows():
    assert printed(80, []) == []
