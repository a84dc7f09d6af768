"""`make audit` fails where it has not audited."""

import runpy

import pytest

SOUND = {"name": "a", "version": "1", "vulns": []}
WEAK = {"name": "b", "version": "2", "vulns": [{"id": "CVE-1", "fix_versions": ["3"]}]}
UNKNOWN = {"name": "c", "skip_reason": "Dependency not found on PyPI and could not be audited: c (1)"}
OWN = {"name": "calmotion", "skip_reason": "distribution marked as editable"}


@pytest.mark.parametrize(
    ("dependencies", "status", "told"),
    [
        ([SOUND, OWN], 0, "1 dependencies audited, 0 known weaknesses"), ([SOUND, WEAK], 1, "b 2: CVE-1, mended in 3"),
        ([SOUND, UNKNOWN, OWN], 2, "NOT AUDITED, 1 dependencies for which there is no data: c"),
        ([WEAK, UNKNOWN], 1, "NOT AUDITED"), ([OWN], 2, "NOT AUDITED"), ([], 2, "NOT AUDITED"),
    ],
)  # fmt: skip
def test_what_was_not_audited_is_no_success(repository, dependencies, status, told):
    found, lines = runpy.run_path(str(repository / ".ci" / "audit.py"))["judged"](dependencies)
    assert found == status and told in "\n".join(lines)
