"""Every bundled plugin keeps the rules that authors of plugins are held to."""

import pytest
from calmotion.testing import check_plugin


@pytest.mark.parametrize(
    "name",
    [
        "fe_mesher",
        "figures",
        "mode_shapes",
        "rerun_logger",
        "skel_rigger",
        "table_writer",
        "usd_reader",
        "usd_writer",
        "vibration_optimizer",
    ],
)
def test_bundled_plugin_conforms(repository, name):
    assert check_plugin(repository / "plugins" / name) == []


def test_no_bundled_plugin_is_missing_here(repository):
    found = {manifest.parent.name for manifest in (repository / "plugins").glob("*/plugin.toml")}
    assert found == set(test_bundled_plugin_conforms.pytestmark[0].args[1])
