"""The pages of the documentation."""

from pathlib import Path

import pytest
from calmotion.cli.commands.table import BROUGHT_BY

REPOSITORY = Path(__file__).resolve().parents[3]
PACKAGE = REPOSITORY / "pipeline" / "calmotion"
PAGES = sorted([*REPOSITORY.glob("docs/**/*.md"), *REPOSITORY.glob("*.md"), REPOSITORY / "samples" / "README.md"])
ABSENT = sorted({plugin for plugin in BROUGHT_BY.values() if not (REPOSITORY / "plugins" / plugin).is_dir()})
needs_every_plugin = pytest.mark.skipif(
    bool(ABSENT), reason=f"the pages name what these plugins have: {', '.join(ABSENT)}"
)


def name_of(page: Path) -> str:
    """Its path in the repository."""
    return str(page.relative_to(REPOSITORY))
