"""Tables fit their width and lose nothing; sentences are wrapped between words."""

import io

import pytest
from calmotion.cli.tables import console_on, print_table, say

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
