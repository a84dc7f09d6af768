"""Every bundled plugin keeps the rules that authors of plugins are held to."""

import os
import subprocess
import sys

import pytest
from calmotion.testing import check_plugin


@pytest.mark.parametrize(
    "name",
    [
        "animation_formats",
        "body_reduction",
        "bvh_reader",
        "calibration",
        "controller_formats",
        "fe_mesher",
        "figures",
        "mode_shapes",
        "model_analysis",
        "motion_table",
        "recording_readers",
        "rerun_logger",
        "robot_import",
        "skel_rigger",
        "table_writer",
        "usd_reader",
        "usd_writer",
        "vibration_optimizer",
        "video",
    ],
)
def test_bundled_plugin_conforms(repository, name):
    assert check_plugin(repository / "plugins" / name) == []


def test_no_bundled_plugin_is_missing_here(repository):
    found = {manifest.parent.name for manifest in (repository / "plugins").glob("*/plugin.toml")}
    assert found == set(test_bundled_plugin_conforms.pytestmark[0].args[1])


def test_registering_them_all_imports_nothing_heavy(repository):
    code = (
        "import sys; from calmotion.host import open_host; host = open_host(); assert not host.failures();"
        "print(*{'scipy', 'pxr', 'rerun', 'numba', 'matplotlib', 'trimesh', 'skfem'} & set(sys.modules))"
    )
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.strip() == "", done.stdout + done.stderr
