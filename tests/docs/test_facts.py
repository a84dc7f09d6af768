"""What pages name exists: paths, links, commands, operators, numbers, messages, rooms."""

import ast
import json
import re
import shlex

import pytest
from calmotion.cli.commands.table import Absent, all_commands
from calmotion.cli.main import build_parser
from floors import FLOORS, REQUIRED_PLUGINS
from pages import PACKAGE, PAGES, REPOSITORY, name_of, needs_every_plugin

pytestmark = needs_every_plugin


PLACES = (REPOSITORY, PACKAGE, PACKAGE / "multibody", REPOSITORY / "docs", REPOSITORY / "samples")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_path_on_a_page_exists(page):
    named = re.findall(r"`([\w./-]+(?:\.py|/))`", page.read_text())
    made = ("speed_watch/", "build/", "calm/")  # by commands on these pages
    assert [name for name in named if "/" in name and not name.startswith(made) and not _exists(name)] == []


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


@pytest.mark.parametrize("page", PAGES, ids=name_of)
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


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_make_command_on_a_page_exists(page):
    targets = set(re.findall(r"^([\w-]+):(?!=)", (REPOSITORY / "Makefile").read_text(), re.MULTILINE))
    text = page.read_text()
    named = re.findall(r"`make ([a-z-]+)|^ {4}make ([a-z-]+)", text, re.MULTILINE)
    assert {name for pair in named for name in pair if name} <= targets


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_operator_on_a_page_exists(page):
    sources = page.read_text() + "".join(path.read_text() for path in REPOSITORY.glob("plugins/**/*.py"))
    operators = {*re.findall(r'^    idname = "([\w.]+)"', sources, re.MULTILINE), "speed_watch.report"}
    named = re.findall(r"(?:--set |--run |--)([a-z_]+\.[a-z_]+)(?=[.\s`-])", page.read_text())
    assert set(named) - {"operator.property"} <= operators


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_calmotion_command_on_a_page_is_accepted(page, capsys):
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
