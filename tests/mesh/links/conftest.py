"""The mesher as the host loads it, and a cache of its own for each test."""

import pytest
from calmotion.testing import host_with
from mesher_links import PLUGIN


@pytest.fixture(scope="module")
def host():
    return host_with(PLUGIN)


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "meshes"
