"""The documentation: every path and module that it names exists, and it builds without a warning."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[1]
PACKAGE = REPOSITORY / "pipeline" / "calmotion"
PAGES = sorted([*REPOSITORY.glob("docs/**/*.md"), *REPOSITORY.glob("*.md"), REPOSITORY / "samples" / "README.md"])
PLACES = (REPOSITORY, PACKAGE, PACKAGE / "multibody", REPOSITORY / "docs", REPOSITORY / "samples")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(REPOSITORY)))
def test_every_path_on_a_page_exists(page):
    named = re.findall(r"`([\w./-]+(?:\.py|/))`", page.read_text())
    made = ("speed_watch/", "build/")  # by commands on these pages
    assert [name for name in named if "/" in name and not name.startswith(made) and not _exists(name)] == []


def _exists(name: str) -> bool:
    alone = [path for path in PACKAGE.rglob(name) if path.is_dir()] if name.count("/") == 1 else []
    return bool(alone) or any((place / name).exists() for place in PLACES)


def test_the_pages_of_the_architecture_name_every_room():
    page = (REPOSITORY / "docs" / "architecture.md").read_text()
    rooms = [path.name for path in PACKAGE.iterdir() if (path / "__init__.py").exists()]
    assert [room for room in rooms if f"| `{room}/` |" not in page] == []


def test_the_floors_are_those_that_are_checked():
    from test_architecture import FLOORS

    page = (REPOSITORY / "docs" / "architecture.md").read_text()
    listed = re.findall(r"^\d+\. (.*)$", page, re.MULTILINE)
    floor = {name.removesuffix(".py"): n for n, line in enumerate(listed) for name in re.findall(r"`([\w.]+)`", line)}
    rooms = [name for names in FLOORS for name in names if name in floor]
    assert len(rooms) > 15
    checked = {name: n for n, names in enumerate(FLOORS) for name in names}
    order = sorted(rooms, key=lambda name: -checked[name])
    assert [floor[name] for name in order] == sorted(floor[name] for name in order)


def test_the_documentation_builds_without_a_warning(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", tmp_path],
        cwd=REPOSITORY, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    formulas = (tmp_path / "formulation" / "index.html").read_text()
    assert formulas.count("<math") > 50 and "arithmatex" not in formulas
