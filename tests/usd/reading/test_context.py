"""Notes for the user."""

from calmotion.usd.reading.context import grouped


def test_equal_notes_on_several_prims_are_merged():
    notes = ["/a/b: it holds 3: still", "the shot has no scene; gravity: down", "/c: it holds 3: still", "/d: moves"]
    assert grouped(notes) == (
        "/a/b and 1 other: it holds 3: still", "the shot has no scene; gravity: down", "/d: moves"
    )  # fmt: skip
