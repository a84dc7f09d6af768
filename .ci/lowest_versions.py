"""Print the lowest supported version of each dependency, as constraints for pip: `numpy==2`, one a line.

`make test-lowest` installs these, so that each lower bound of pyproject.toml is one with which the tests pass.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"
REQUIREMENT = re.compile(r"^(?P<name>[A-Za-z0-9._-]+)(?:\[[^]]*\])?>=(?P<version>[0-9][0-9A-Za-z.]*)(?:,.*)?$")


def lowest(requirement: str) -> str:
    """The constraint for the lower bound of a requirement.

    Raises:
        ValueError: The requirement has no lower bound.
    """
    match = REQUIREMENT.match(requirement.replace(" ", ""))
    if match is None:
        raise ValueError(f"{requirement}: name a lower bound first, as in `numpy>=2,<3`")
    return f"{match['name']}=={match['version']}"


if __name__ == "__main__":
    try:
        print(*map(lowest, tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]["dependencies"]), sep="\n")
    except ValueError as error:
        sys.exit(f"error: {error}")
