"""The documentation builds without a warning, its pages are short, and a newcomer finds what is asked."""

import html
import os
import re
import subprocess
import sys
import time
from urllib.parse import urljoin

import pytest
from chromium import CHROMIUM, Chromium
from pages import REPOSITORY, needs_every_plugin

pytestmark = needs_every_plugin


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
