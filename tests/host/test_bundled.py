"""Every bundled plugin keeps the rules that authors of plugins are held to."""

import os
import subprocess
import sys

import pytest
from calmotion.host.discovery import bundled_folder
from calmotion.testing import check_plugin

NAMES = sorted(manifest.parent.name for manifest in bundled_folder().glob("*/plugin.toml"))


@pytest.mark.parametrize("name", NAMES)
def test_bundled_plugin_conforms(repository, name):
    assert check_plugin(repository / "plugins" / name) == []


def test_registering_them_all_imports_nothing_heavy(repository):
    code = (
        "import sys; from calmotion.host import open_host; host = open_host(); assert not host.failures();"
        "print(*{'scipy', 'pxr', 'rerun', 'numba', 'matplotlib', 'trimesh', 'skfem'} & set(sys.modules))"
    )
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.strip() == "", done.stdout + done.stderr
