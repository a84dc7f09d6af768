"""Tests that take longer than the rest are marked `long`, and run with `pytest -m long tests/reference`."""

import pytest


def pytest_configure(config):
    config.addinivalue_line("markers", "long: takes half a minute or more; run with -m long")


def pytest_collection_modifyitems(config, items):
    if "long" in (config.getoption("-m") or ""):
        return
    for item in items:
        if item.get_closest_marker("long"):
            item.add_marker(pytest.mark.skip(reason="long; run with -m long"))
