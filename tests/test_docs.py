"""The documentation: every path and module that it names exists, and it builds without a warning."""

from __future__ import annotations

import argparse
import ast
import html
import json
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path
from urllib.parse import urljoin

import pytest
from calmotion.cli.commands.table import BROUGHT_BY
from chromium import CHROMIUM, Chromium
from floors import FLOORS, REQUIRED_PLUGINS
from prose import messages, sentences, sentences_through_code

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = REPOSITORY / "pipeline" / "calmotion"
PAGES = sorted([*REPOSITORY.glob("docs/**/*.md"), *REPOSITORY.glob("*.md"), REPOSITORY / "samples" / "README.md"])
ABSENT = sorted({plugin for plugin in BROUGHT_BY.values() if not (REPOSITORY / "plugins" / plugin).is_dir()})
pytestmark = pytest.mark.skipif(bool(ABSENT), reason=f"the pages name what these plugins have: {', '.join(ABSENT)}")
PLACES = (REPOSITORY, PACKAGE, PACKAGE / "multibody", REPOSITORY / "docs", REPOSITORY / "samples")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_path_on_a_page_exists(page):
    named = re.findall(r"`([\w./-]+(?:\.py|/))`", page.read_text())
    made = ("speed_watch/", "build/", "calm/")  # by commands on these pages
    assert [name for name in named if "/" in name and not name.startswith(made) and not _exists(name)] == []


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
    "page",
    [page for page in PAGES if page.parent.name != "decisions" and page.name != "CHANGELOG.md"],
    ids=lambda page: str(page.relative_to(REPOSITORY)),
)
def test_the_sentences_of_a_page_are_short_and_plain(page):
    text = page.read_text()
    long = [f"{len(found.split())} words: {found}" for found in sentences(text) if len(found.split()) > 30]
    assert long == [], f"{page}: sentences over 30 words"
    twice = [(riddle, found) for found in sentences(text) for riddle in RIDDLES if re.search(riddle, found, re.I)]
    assert twice == [], f"{page}: phrases that have to be read twice"
    assert sentences_through_code(text) == [], f"{page}: a sentence begins before a block of code and ends behind it"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
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
    from calmotion.cli.main import build_parser

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
    from calmotion.cli.main import build_parser

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


# Pages for reading are short; references are looked up.
SCREEN = (1920, 1080)  # pixels
FONTS = 1.1  # fonts of other machines may be larger
KINDS = ("Tutorials", "How to", "Concepts", "Reference", "Evidence")
LOOKED_UP = {"formulation.md"}


def pages_of_the_navigation():
    """Pages by the tab that has them, at most two clicks away."""
    import yaml

    class Loader(yaml.SafeLoader):
        """Reads the names of extensions, which are Python's, as texts."""

    Loader.add_multi_constructor("tag:yaml.org,2002:python/", lambda loader, suffix, node: suffix)
    nav = yaml.load((REPOSITORY / "mkdocs.yml").read_text(), Loader=Loader)["nav"]

    def names(entry):
        page = entry if isinstance(entry, str) else next(iter(entry.values()))
        return [page] if isinstance(page, str) else page

    found = {}
    for entry in nav:
        ((title, pages),) = entry.items()
        inside = [pages] if isinstance(pages, str) else [inner for row in pages for inner in names(row)]
        found[title] = [inner if isinstance(inner, str) else next(iter(inner.values())) for inner in inside]
    return found


def test_the_navigation_has_a_page_of_each_kind_within_two_clicks():
    kinds = pages_of_the_navigation()
    assert list(kinds) == ["Home", *KINDS, "Development"]
    assert [name for pages in kinds.values() for name in pages if not isinstance(name, str)] == [], "three clicks"


def test_no_page_for_reading_is_over_two_screens(site, tmp_path):
    if CHROMIUM is None:
        pytest.skip("there is no Chromium")
    kinds = pages_of_the_navigation()
    names = [name for kind in kinds if kind != "Reference" for name in kinds[kind] if name not in LOOKED_UP]
    assert len(names) > 60
    heights = {}
    with Chromium(tmp_path) as browser:
        browser.call(
            "Emulation.setDeviceMetricsOverride", width=SCREEN[0], height=SCREEN[1], deviceScaleFactor=1, mobile=False
        )
        for name in names:
            page = site / (name if name == "index.md" else f"{name.removesuffix('.md').removesuffix('index')}/index.md")
            uri = page.with_suffix(".html").resolve().as_uri()
            browser.call("Page.navigate", url=uri)
            ready = (
                f"document.URL === '{uri}' && document.readyState === 'complete' && !!document.querySelector('article')"
            )
            end = time.monotonic() + 20.0
            while not browser.value(ready):
                assert time.monotonic() < end, f"{name} is not shown"
                time.sleep(0.01)
            heights[name] = browser.value("document.querySelector('article').getBoundingClientRect().height")
    long = {name: height for name, height in heights.items() if height > 2 * FONTS * SCREEN[1]}
    assert long == {}, "over two screens: divide these, or move numbers to Evidence"


BECOME = r"([\d.]+) mm (?:of error )?become ([\d.]+) mm"


@pytest.mark.parametrize(
    ("page", "pattern", "count"),
    [
        ("README.md", f"(){BECOME}", 1),
        ("README.md", r"\| (cup|elbow), position \| ([\d.]+) mm \| ([\d.]+) mm", 2),
        ("docs/quickstart.md", f"(){BECOME}", 2),
        ("docs/concepts/motors.md", rf"(lamp)\b[^:]*: {BECOME}", 1),
        ("docs/gallery.md", rf"\*\*(Bartender|Lamp|Drummer|Boxer|Rapper|Dancer)\b[^\n]*?{BECOME}", 6),
        ("docs/gallery_robots.md", rf"A (KUKA)\b[^\n]*?{BECOME}", 1),
        ("samples/README.md", r"\| `(\w+)` \|.*\| ([\d.]+) mm \| ([\d.]+) mm", 6),
    ],
)
def test_errors_on_pages_are_the_kept_ones_of_make_golden_rounded(page, pattern, count):
    kept = json.loads((REPOSITORY / "tests" / "golden" / "golden.json").read_text())
    found = re.findall(pattern, (REPOSITORY / page).read_text())
    assert len(found) == count
    for name, before, after in found:
        errors = kept.get(name.lower(), kept["bartender"])["errors_m"].values()
        pairs = [[_rounds_to(told, row[f"max_error_{when}_m"]) for told, when in ((before, "before"), (after, "after"))]
                 for row in errors]  # fmt: skip
        assert [True, True] in pairs, (name, before, after)


def _rounds_to(told: str, metres: float) -> bool:
    """Whether a number on a page [mm] is a length, rounded to the digits that it has."""
    unit = 10.0 ** -len(told.partition(".")[2])
    return abs(float(told) - 1e3 * metres) <= 0.5001 * unit


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "CHANGELOG.md"], ids=lambda page: page.name)
def test_no_page_installs_the_program_from_where_it_is_not(page):
    assert not re.search(r"pip install '?calmotion(?![\w./-]*[-_/])", page.read_text()), "it is on no package index"


def _exists(name: str) -> bool:
    alone = [path for path in PACKAGE.rglob(name) if path.is_dir()] if name.count("/") == 1 else []
    return bool(alone) or any((place / name).exists() for place in PLACES)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_link_and_picture_of_a_page_exists(page):
    # mkdocs checks those within docs/ as well, but not README.md, which leads there; it makes reference/ and images/
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)):
        name, _, anchor = target.partition("#")
        if (
            "://" in name
            or name.split("/")[-2:-1] == ["images"]
            or name.endswith(("schemas.md", "commands.md", "python.md"))
        ):
            continue
        file = (page.parent / name) if name else page
        assert file.exists(), target
        if anchor:
            assert anchor in {
                _anchor(heading) for heading in re.findall(r"^#+ (.*)$", file.read_text(), re.MULTILINE)
            }, target


def _anchor(heading: str) -> str:
    """The anchor of a heading, as GitHub and mkdocs write it."""
    return re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", heading.lower()).strip())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_make_command_on_a_page_exists(page):
    targets = set(re.findall(r"^([\w-]+):(?!=)", (REPOSITORY / "Makefile").read_text(), re.MULTILINE))
    text = page.read_text()
    named = re.findall(r"`make ([a-z-]+)|^ {4}make ([a-z-]+)", text, re.MULTILINE)
    assert {name for pair in named for name in pair if name} <= targets


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_operator_on_a_page_exists(page):
    sources = page.read_text() + "".join(path.read_text() for path in REPOSITORY.glob("plugins/**/*.py"))
    operators = {*re.findall(r'^    idname = "([\w.]+)"', sources, re.MULTILINE), "speed_watch.report"}
    named = re.findall(r"(?:--set |--run |--)([a-z_]+\.[a-z_]+)(?=[.\s`-])", page.read_text())
    assert set(named) - {"operator.property"} <= operators


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_calmotion_command_on_a_page_is_accepted(page, capsys):
    from calmotion.cli.commands.table import Absent, all_commands
    from calmotion.cli.main import build_parser

    parser, commands = build_parser(), all_commands()
    for line in re.findall(r"^ {4}(calmotion [a-z].+)$", page.read_text(), re.MULTILINE):
        if "  " in line:  # a table of commands, in columns
            continue
        if isinstance(commands.get(line.split()[1]), Absent):
            continue
        try:
            parser.parse_args(shlex.split(line)[1:])
        except SystemExit as stop:
            assert stop.code == 0, f"{line}: {capsys.readouterr().err}"


def test_every_video_is_small():
    videos = [*REPOSITORY.glob("samples/*/*.webp"), *REPOSITORY.glob("docs/**/*.webp")]
    assert len(videos) >= 8 and [video.name for video in videos if video.stat().st_size >= 1_000_000] == []


def test_every_message_of_the_page_is_one_of_the_program():
    page = (REPOSITORY / "docs" / "reference" / "messages.md").read_text()
    messages = [row.split("|")[1].strip() for row in re.findall(r"^\| [^-].*$", page, re.MULTILINE)]
    messages = [message for message in messages if message != "message"]
    sources = [*PACKAGE.rglob("*.py"), *REPOSITORY.glob("plugins/**/*.py")]
    text = re.sub(r'"\s*\n\s*f?"', "", "".join(path.read_text() for path in sources))
    assert len(messages) > 15 and [message for message in messages if message not in text] == []


def test_every_symbol_of_the_formulation_is_in_the_module_that_is_named():
    page = (REPOSITORY / "docs" / "formulation.md").read_text()
    rows = re.findall(r"^\| \$.*\| (`[^|]+`) \| `([\w/]+\.py)` \|$", page, re.MULTILINE)
    assert len(rows) > 15
    for names, module in rows:
        for name in re.findall(r"`([\w.]+)`", names):
            assert _defines((PACKAGE / module).read_text(), *name.split(".")), f"{module} has no {name}"


def _defines(source: str, name: str, field: str = "") -> bool:
    nodes = [node for node in ast.walk(ast.parse(source)) if getattr(node, "name", "") == name]
    return bool(nodes) and (
        not field or re.search(rf"^    (def )?{field}\b", ast.unparse(nodes[0]), re.MULTILINE) is not None
    )


def test_the_architecture_has_every_room_on_its_floor():
    page = (REPOSITORY / "docs" / "architecture.md").read_text()
    rows = re.findall(r"^\| (\d+) \| (.*?) \|", page, re.MULTILINE)
    floors = [{name.removesuffix(".py") for name in re.findall(r"`([\w.]+)/?`", names)} for _, names in rows]
    assert [int(number) for number, _ in rows] == list(range(len(FLOORS), 0, -1))
    assert floors == [set(names) for names in reversed(FLOORS)]


def test_the_architecture_has_every_bundled_plugin():
    page = (REPOSITORY / "docs" / "architecture.md").read_text()
    table = page.split("| bundled plugins |")[1].split("\n\n")[0]
    first, *others = [set(re.findall(r"`(\w+)`", row.split("|")[1])) for row in table.splitlines()[2:]]
    assert first == set(REQUIRED_PLUGINS)
    assert first.union(*others) >= {manifest.parent.name for manifest in REPOSITORY.glob("plugins/*/plugin.toml")}


def test_the_guide_of_plugins_has_every_public_package():
    page = (REPOSITORY / "docs" / "reference" / "plugins.md").read_text()
    named = set(re.findall(r"^\| `calmotion\.(\w+)` \|", page, re.MULTILINE))
    fronts = {path.parent.name for path in PACKAGE.glob("*/__init__.pyi")}
    assert named == fronts | {"arrays", "errors", "public_names"}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site as `make docs` builds it."""
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", folder],
        cwd=REPOSITORY, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0 and not done.stderr, done.stderr
    return folder


def test_the_documentation_builds_without_a_warning(site):
    schemas = (site / "reference" / "schemas" / "index.html").read_text().replace("<wbr>", "")
    assert (
        "calm:target:rotationWeight" in schemas
        and "usage: calmotion optimize" in (site / "reference" / "commands" / "index.html").read_text()
    )
    assert "open_shot" in (site / "reference" / "python" / "index.html").read_text()
    formulas = (site / "formulation" / "index.html").read_text()
    assert formulas.count("<math") > 50 and "arithmatex" not in formulas
    pages = "".join(path.read_text() for path in site.rglob("*.html"))
    assert re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(?:https?:)?//[^"]*"', pages) == []


# What newcomers asked, the clicks from the front page, and words of the answer where the last click leads.
QUESTIONS = (
    ("In which unit is Young's modulus in a stage in centimetres?", ("reference/schemas/#units",), "2.1e7"),
    ("Why a rotation weight of 0.05?", ("reference/schemas/#which-weight",), "lever arm from the wrist"),
    ("In which unit are the columns of the CSV table?", ("reference/outputs/#csv-csv",), "N m"),
    ("What does 'sag' mean?", ("glossary/",), "offset of a target at rest, under gravity"),
    ("How do I keep a motor as it is?", ("how_to/#keep-a-motor-as-it-is",), "calm:motor:optimize"),
    ("How do I bring my URDF?", ("tutorials/", "tutorials/urdf/"), "calmotion import arm.urdf"),
    (
        "Which command of my robot's controller plays the result?",
        ("exporting/#formats",),
        "joint_trajectory_controller",
    ),
    (
        "The simulation does not keep the tolerance. And now?",
        ("troubleshooting/",),
        "The report names the largest part",
    ),
    ("How do I stop a long run and go on later?", ("how_to/running/#stop-a-run-and-go-on",), "Press Ctrl-C once"),
    ("Does it run on Windows?", ("installation/#systems",), "plugins without POSIX"),
    ("What will it not do?", ("concepts/limits/",), "collision"),
    ("What does maxTorque do, and what is its default?", ("reference/schemas/",), "calm:motor:maxTorque"),
)


@pytest.mark.parametrize(("clicks", "words"), [row[1:] for row in QUESTIONS], ids=[row[0] for row in QUESTIONS])
def test_a_question_of_a_newcomer_is_answered_within_two_clicks(site, clicks, words):
    assert len(clicks) <= 2
    page = site / "index.html"
    for click in clicks:
        article = re.search(r"<article.*?</article>", page.read_text(), re.DOTALL).group()  # not the menus
        target, _, anchor = click.partition("#")
        links = {
            urljoin(str(page.parent) + "/", link.partition("#")[0]) for link in re.findall(r'href="([^"]+)"', article)
        }
        assert str(site / target) + "/" in links, f"{click} is not linked from {page.relative_to(site)}"
        page = site / target / "index.html"
    text = page.read_text()
    if anchor:
        level, start = re.search(rf'<h(\d) id="{anchor}">(?s:.*)', text).group(1), text.index(f'id="{anchor}"')
        text = re.split(rf"<h[1-{level}] id=", text[start:])[0]
    assert words in html.unescape(re.sub(r"<[^>]+>", "", text))
