"""The whole suite with the lowest and with the newest versions of all dependencies, before a release.

`make release-check`; `release_check.py TESTS ...` for a part of the suite. The rows of the table in
docs/evidence/systems.md are written anew; those of a part say so. The exit status is 1 where a test failed.
"""

from __future__ import annotations

import datetime
import json
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "evidence" / "systems.md"
BEGIN, END = "<!-- release-check: begin -->", "<!-- release-check: end -->"
HEAD = "| versions | Python | of | passed | failed | skipped | on |\n| --- | --- | --- | --- | --- | --- | --- |\n"
PYTHONS = ("3.14", "3.13", "3.12", "3.11")  # of which the newest versions are run with the first that is here
LOWEST = "3.11"
TOLD = ("numpy", "scipy", "numba", "usd-core", "rerun-sdk", "trimesh", "manifold3d", "pytetwild", "scikit-fem")
_VERSIONS = "import importlib.metadata as m, json, sys; print(json.dumps([m.version(name) for name in sys.argv[1:]]))"


@dataclass(frozen=True)
class Counts:
    """Results of a suite: passed, failed and skipped tests."""

    passed: int
    failed: int
    skipped: int

    @classmethod
    def of(cls, junit: Path) -> Counts:
        """Of a file that `pytest --junitxml` wrote."""
        suite = ET.parse(junit).getroot().find("testsuite")  # nosec B314  # our own file
        assert suite is not None
        tests, failed, errors, skipped = (
            int(suite.get(name, 0)) for name in ("tests", "failures", "errors", "skipped")
        )
        return cls(tests - failed - errors - skipped, failed + errors, skipped)


def is_here(number: str) -> bool:
    """Whether a Python can be run; names that pyenv has for others are on the PATH, too."""
    python = shutil.which(f"python{number}")
    return python is not None and subprocess.run([python, "--version"], capture_output=True).returncode == 0


def installed(name: str, python: str) -> Path:
    """The interpreter of an environment with the lowest or newest versions."""
    folder = ROOT / f".venv-{name}"
    own = folder / "bin" / "python"
    if name == "lowest":
        subprocess.run(["make", f"{folder.name}/.installed"], cwd=ROOT, check=True)
    else:
        subprocess.run([python, "-m", "venv", "--clear", folder], check=True)
        command = [own, "-m", "pip", "install", "--quiet", "--upgrade", "--editable", ".[dev]"]
        subprocess.run(command, cwd=ROOT, check=True)
    return own


def row(name: str, python: Path, counts: Counts, part: str = "") -> str:
    """A row of the table."""
    done = subprocess.run([python, "-c", _VERSIONS, *TOLD], check=True, capture_output=True, text=True)
    versions = ", ".join(f"{name} {version}" for name, version in zip(TOLD, json.loads(done.stdout), strict=True))
    asked = [python, "-c", "import platform; print(platform.python_version())"]
    number = subprocess.run(asked, check=True, capture_output=True, text=True).stdout.strip()
    cells = (name + part, number, versions, counts.passed, counts.failed, counts.skipped, datetime.date.today())
    return "| " + " | ".join(map(str, cells)) + " |\n"


def written(page: str, rows: list[str]) -> str:
    """A page with other rows between the two marks."""
    before, _, rest = page.partition(BEGIN)
    return f"{before}{BEGIN}\n{HEAD}{''.join(rows)}{END}{rest.partition(END)[2]}"


def main(tests: list[str]) -> int:
    """Run both; the exit status."""
    newest = next((number for number in PYTHONS if is_here(number)), None)
    if newest is None or not is_here(LOWEST):
        print(f"error: Python {LOWEST} is needed on the PATH", file=sys.stderr)
        return 1
    rows, failed = [], 0
    (ROOT / "build").mkdir(exist_ok=True)
    for name, number in (("lowest", LOWEST), ("newest", newest)):
        python, junit = installed(name, f"python{number}"), ROOT / "build" / f"release_{name}.xml"
        command = [python, "-m", "pytest", "-n", "2", "-q", f"--junitxml={junit}", *(tests or ["tests"])]
        subprocess.run(command, cwd=ROOT)
        counts = Counts.of(junit)
        rows.append(row(name, python, counts, f" ({' '.join(tests)} alone)" if tests else ""))
        failed += counts.failed
    if newest != PYTHONS[0]:
        rows.append(f"| newest | {PYTHONS[0]} | not checked: it was not here | | | | {datetime.date.today()} |\n")
    PAGE.write_text(written(PAGE.read_text(encoding="utf-8"), rows), encoding="utf-8")
    print("".join(rows), end="")
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
