"""What `make release-check` found stands in docs/evidence/systems.md."""

import runpy
import sys
from pathlib import Path

import pytest

JUNIT = '<testsuites><testsuite name="pytest" errors="1" failures="2" skipped="3" tests="10"/></testsuites>'


@pytest.fixture(scope="module")
def script(repository):
    return runpy.run_path(str(repository / ".ci" / "release_check.py"))


def test_the_rows_of_the_page_are_those_of_the_last_run(script, repository, tmp_path):
    (tmp_path / "junit.xml").write_text(JUNIT)
    counts = script["Counts"].of(tmp_path / "junit.xml")
    assert (counts.passed, counts.failed, counts.skipped) == (4, 3, 3)
    row = script["row"]("lowest", Path(sys.executable), counts)
    assert "numpy 2." in row and "| 4 | 3 | 3 |" in row
    page = (repository / "docs" / "evidence" / "systems.md").read_text(encoding="utf-8")
    once = script["written"](page, [row])
    assert row in once and script["written"](once, []) == script["written"](page, [])
    assert once.partition(script["BEGIN"])[0] == page.partition(script["BEGIN"])[0]
    assert once.partition(script["END"])[2] == page.partition(script["END"])[2]
