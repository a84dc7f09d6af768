"""The page about reading USD has the attributes of other programs that the code has."""

import math
import os
import re

import pytest
from calmotion.usd import dialects
from calmotion.usd.reading.unread import OF_BODIES, OF_JOINTS, OF_SCHEMAS

WRITES = "CALMOTION_WRITE_PAGES"  # set it, and the test writes the page
SPELLED = {
    "limit of effort": dialects.EFFORT_LIMIT,
    "limit of speed": dialects.VELOCITY_LIMIT,
    "position gain of a drive": dialects.GAINS[0],
    "velocity gain of a drive": dialects.GAINS[1],
    "inertia of a rotor": dialects.ARMATURE,
    "friction of a rotor": dialects.FRICTION,
    "viscous friction of a rotor": dialects.VISCOUS_FRICTION,
}


@pytest.fixture
def page(repository):
    return repository / "docs" / "reading_usd.md"


def shown(name):
    return name.replace("{drive}", "…")


@pytest.mark.parametrize("quantity", SPELLED)
def test_each_quantity_has_its_names_in_the_order_in_which_they_count(page, quantity):
    (row,) = re.findall(rf"^\| {quantity} \|.*$", page.read_text(), re.MULTILINE)
    places = [row.find(f"`{shown(spelling.attribute)}`") for spelling in SPELLED[quantity]]
    assert -1 not in places and places == sorted(places)


def unused_table():
    """Attributes that have an effect in their program, and none here."""
    lines = ["| attribute | without effect there | here |", "| --- | --- | --- |"]
    for name, low, high, why in (*OF_BODIES, *OF_JOINTS):
        harmless = f"{low:g}" if low == high else f"{low:g} and more" if math.isinf(high) else f"{low:g} to {high:g}"
        lines.append(f"| `{shown(name)}` | {harmless} | {why} |")
    lines += [f"| schemas `{begin}…` | | {why} |" for begin, why in OF_SCHEMAS]
    return "\n".join(lines)


def test_the_page_shows_what_is_not_used(page):
    text = page.read_text()
    begin, end = "<!-- not used -->\n", "\n<!-- end of not used -->"
    made = re.sub(f"(?<={begin}).*?(?={end})", lambda _: unused_table(), text, flags=re.DOTALL)
    if os.environ.get(WRITES):
        page.write_text(made)
        text = made
    assert begin in text and made == text, f"docs/reading_usd.md shows an older table: run this test with {WRITES}=1"
