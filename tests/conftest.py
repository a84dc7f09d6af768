"""What tests of several rooms share: the repository, the command line in a process, and plugins made on the spot."""

import io
import os
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

# Workers of pytest-xdist have this: in several processes, threads of linear algebra wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
pytest_plugins = ["arm_fixtures", "finite_element_fixtures", "flexible_tree_fixture"]
REPOSITORY = Path(__file__).resolve().parents[1]

MANIFEST = {
    "version": "0.1.0",
    "name": "A plugin",
    "tagline": "Made for a test",
    "maintainer": "Calmotion",
    "license": "Apache-2.0",
    "tags": [],
    "calmotion": ">=0.1",
    "requires": [],
}


@pytest.fixture(scope="session", autouse=True)
def no_width() -> None:
    """Reports are wrapped where a test says so alone: workers of pytest-xdist have the width of the terminal."""
    os.environ.pop("COLUMNS", None)


@pytest.fixture(scope="session")
def repository() -> Path:
    """The checkout."""
    return REPOSITORY


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Robots that are not part of the repository; a test that needs them is skipped where they are absent."""
    folder = Path(os.environ.get("CALMOTION_DATA", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip("the shared robots are not here; name their folder with CALMOTION_DATA")
    return folder


@pytest.fixture(scope="session")
def calmotion() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs `calmotion` in this process, which spares its start; the status and what it printed."""
    from calmotion.cli.main import main

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        texts = list(map(str, arguments))
        with redirect_stdout(io.StringIO()) as out, redirect_stderr(io.StringIO()) as err:
            status = main(texts)
        return subprocess.CompletedProcess(texts, status, out.getvalue(), err.getvalue())

    return run


@pytest.fixture(scope="session")
def calmotion_process() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Runs `calmotion` in a process of its own, from the checkout."""

    def run(*arguments: object, **options: object) -> subprocess.CompletedProcess[str]:
        path = os.pathsep.join([str(REPOSITORY / "pipeline"), os.environ.get("PYTHONPATH", "")])
        environment = os.environ | {"PYTHONPATH": path.rstrip(os.pathsep)}
        command = [sys.executable, "-m", "calmotion", *map(str, arguments)]
        settings: dict = {"env": environment, "capture_output": True, "text": True, "timeout": 600} | options
        return subprocess.run(command, **settings)

    return run


@pytest.fixture
def make_plugin(tmp_path: Path) -> Callable[..., Path]:
    """Makes the folder of a plugin: id, source of its module, and fields of its manifest that differ."""

    def make(plugin_id: str, source: str, **fields: object) -> Path:
        folder = tmp_path / "plugins" / plugin_id
        folder.mkdir(parents=True)
        values = {"id": plugin_id} | MANIFEST | fields
        lines = [f"{key} = {toml(value)}" for key, value in values.items() if value is not None]
        (folder / "plugin.toml").write_text("\n".join(lines))
        (folder / "__init__.py").write_text(textwrap.dedent(source))
        return folder

    return make


def toml(value: object) -> str:
    """A text, number, list or table as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + "}"
    return "[" + ", ".join(toml(item) for item in value) + "]" if isinstance(value, list) else repr(value)


def pytest_configure(config):
    """Tests that take longer than the rest are marked `long`, and run with `pytest -m long`; what the user of this
    machine has disabled plays no part."""
    choices = Path(tempfile.gettempdir()) / "no-calmotion-config-here"
    os.environ["CALMOTION_CONFIG"] = str(choices)
    config.addinivalue_line("markers", "long: takes half a minute or more; run with -m long")


# While one of two processes compiles the kernels, the other does what needs none of them: each begins with an eighth of
# all tests. Two that need the same kernel at once would both compile it.
COMPILING = "multibody"
WITHOUT_KERNELS = {
    "host", "refusals", "catalogs", "rigging", "views", "usd", "mesh", "linear_algebra", "reduction", "support",
}  # fmt: skip
WITH_KERNELS = {
    "test_equivalence.py", "test_length_motors_and_roots.py", "test_sources_end_to_end.py", "test_template.py",
    "test_compilation.py", "test_kernel_cache.py", "test_cubature.py", "test_choice.py",
}  # fmt: skip


def _ordered(items):
    """The tests that compile, as many as one process begins with; then those without kernels; then all others."""
    first, middle, last = [], [], []
    for item in items:
        room, name = item.path.relative_to(REPOSITORY / "tests").parts[0], item.path.name
        if room == COMPILING and len(first) < len(items) // 8 - 1:
            first.append(item)
        elif room in WITHOUT_KERNELS and name not in WITH_KERNELS:
            middle.append(item)
        else:
            last.append(item)
    return first + middle + last


def pytest_collection_modifyitems(config, items):
    """Put tests in order, and skip the long ones unless they are asked for, and what this system lacks."""
    items[:] = _ordered(items)
    left_out = {}
    if "long" not in (config.getoption("-m") or ""):
        left_out["long"] = "long; run with -m long"
    if not hasattr(os, "symlink"):
        left_out["posix"] = "this system has no links, owners, pipes or signals of POSIX"
    for item in items:
        for marker, reason in left_out.items():
            if item.get_closest_marker(marker):
                item.add_marker(pytest.mark.skip(reason=reason))
