"""The sentences of pages, help and messages are short and plain."""

import argparse
import ast
import re

import pytest
from calmotion.cli.main import build_parser
from pages import PACKAGE, PAGES, REPOSITORY, name_of, needs_every_plugin
from prose import messages, sentences, sentences_through_code

pytestmark = needs_every_plugin


# Turns of phrase that a reader has to read twice.
RIDDLES = (
    r"\bwhat\b[^.?(]*\bwhat\b",
    r"\bwhat is left\b",
    r"\bwhat was meant\b",
    r"\bwhere to where\b",
    r"\bas far off .* as the one before\b",
    r"\bact against the last\b",
    r"\bby so much\b",
    r"\bso much later\b",
    r"\bmotors? that gives?\b",
    r"\bwhich is noted\b",
    r"\band is told\b",
    r"\bhas no say in\b",
    r"\btells? (?:it|what|which)\b",
    r"\bis to expect\b",
    r"\bno \w+ to be \w+ against\b",
    r"\bmust not leave the house\b",
    r"\bwinds around\b",
    r"\bhow much .* holds of it\b",
    r"\bis not its first again\b",
    r"\banything needs\b",
    r"\bwhat stands\b",
    r"\bwhere it says nothing\b",
)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page.parent.name != "decisions" and page.name != "CHANGELOG.md"], ids=name_of
)
def test_the_sentences_of_a_page_are_short_and_plain(page):
    text = page.read_text()
    long = [f"{len(found.split())} words: {found}" for found in sentences(text) if len(found.split()) > 30]
    assert long == [], f"{page}: sentences over 30 words"
    twice = [(riddle, found) for found in sentences(text) for riddle in RIDDLES if re.search(riddle, found, re.I)]
    assert twice == [], f"{page}: phrases that have to be read twice"
    assert sentences_through_code(text) == [], f"{page}: a sentence begins before a block of code and ends behind it"


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_tables_and_lists_of_a_page_end_where_they_seem_to(page):
    """A text right below a table is a row of it, and a number right below an indented text is a part of that."""
    lines = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL).splitlines()
    swallowed = [
        below for above, below in zip(lines, lines[1:], strict=False)
        if (above.startswith("|") and below.strip() and not below.startswith(("|", "<!--")))
        or (re.match(r"    \S", above) and re.match(r"(?:\d+\.|[-*]) ", below))
    ]  # fmt: skip
    assert swallowed == []


def test_the_sentences_of_the_help_are_short():
    parsers, long = [build_parser()], []
    while parsers:
        parser = parsers.pop()
        for action in parser._actions:
            parsers += action.choices.values() if isinstance(action, argparse._SubParsersAction) else []
            long += [(parser.prog, found) for found in sentences(action.help or "") if len(found.split()) > 30]
    assert long == []


def test_the_messages_of_the_program_are_short_and_plain():
    """Reports, notes and errors are texts of the code; what is filled in is one word."""
    wrong = []
    for path in [*PACKAGE.rglob("*.py"), *REPOSITORY.glob("plugins/*/**/*.py")]:
        for line, text in messages(ast.parse(path.read_text())):
            for found in sentences(text):
                riddles = [riddle for riddle in RIDDLES if re.search(riddle, found, re.I)]
                if len(found.split()) > 30 or riddles:
                    wrong.append(f"{path.relative_to(REPOSITORY)}:{line}: {riddles or 'over 30 words'}: {found}")
    assert wrong == []


def test_tolerance_is_the_accuracy_of_the_simulation_and_goal_the_error_that_is_accepted():
    """In every command: another word is needed for another thing (`--allowed-loss` of `export`)."""
    parsers, meanings = [build_parser()], {"--tolerance": set(), "--goal": set()}
    while parsers:
        for action in parsers.pop()._actions:
            parsers += action.choices.values() if isinstance(action, argparse._SubParsersAction) else []
            for option in meanings.keys() & set(action.option_strings):
                meanings[option].add(re.split(r", with a unit", action.help)[0])
    assert meanings == {
        "--tolerance": {"accuracy of the simulation at the targets"},
        "--goal": {"error at the targets that is accepted after optimising"},
    }
