"""Known weaknesses of the installed dependencies, by pip-audit: `python .ci/audit.py`, or `make audit`.

pip-audit ends with exit status 0 also where it has data on none of the dependencies, as behind a mirror without them.
Here each dependency must have been looked up: exit status 1 after a weakness, 2 where something was not audited.
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

WEAK, NOT_AUDITED = 1, 2
_OWN = "distribution marked as editable"  # why pip-audit leaves this package out


def judged(dependencies: list[dict[str, Any]]) -> tuple[int, list[str]]:
    """The exit status, and what to tell.

    Args:
        dependencies: Those of pip-audit's JSON: `name`, `version`, `vulns`, or `name` and `skip_reason`.
    """
    skipped = [one for one in dependencies if "skip_reason" in one and one["skip_reason"] != _OWN]
    audited = [one for one in dependencies if "skip_reason" not in one]
    lines = [
        f"{one['name']} {one['version']}: {weakness['id']}, mended in "
        + (", ".join(weakness["fix_versions"]) or "no version")
        for one in audited
        for weakness in one["vulns"]
    ]
    weak = len(lines)
    lines.append(f"{len(audited)} dependencies audited, {weak} known weaknesses")
    if skipped or not audited:
        names = ", ".join(one["name"] for one in skipped)
        lines.append(f"error: NOT AUDITED, {len(skipped)} dependencies for which there is no data: {names}")
    return WEAK if weak else NOT_AUDITED if skipped or not audited else 0, lines


def main() -> int:
    """The command."""
    command = [sys.executable, "-m", "pip_audit", "--skip-editable", "--format", "json", "--progress-spinner", "off"]
    done = subprocess.run(command, capture_output=True, text=True)
    try:
        dependencies = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        print(done.stderr.strip(), "error: NOT AUDITED, pip-audit gave no result", sep="\n")
        return NOT_AUDITED
    status, lines = judged(dependencies)
    print(*lines, sep="\n")
    return status


if __name__ == "__main__":
    sys.exit(main())
