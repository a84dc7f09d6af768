"""The tests of a plugin, `ID/` or `test_ID.py`, go with its folder: where `plugins/ID` is deleted, they are not run."""

from pathlib import Path

HERE = Path(__file__).parent
PLUGINS = HERE.parents[1] / "plugins"
TESTS = [path for path in HERE.iterdir() if path.is_dir() or path.name.startswith("test_")]

collect_ignore = [path.name for path in TESTS if not (PLUGINS / path.stem.removeprefix("test_")).is_dir()]
