"""Fixtures for the tests of plugins; pytest finds them once Calmotion is installed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from calmotion.host import Host
    from calmotion.model import Animation, Character


@pytest.fixture
def calmotion_host() -> Callable[..., Host]:
    """Makes a host with the plugins of the folders it is given, and no others."""

    def make(*folders: str | Path) -> Host:
        from calmotion.testing import host_with

        return host_with(*folders)

    return make


@pytest.fixture
def calmotion_shot() -> tuple[Character, Animation]:
    """A rigid arm with two motors that swings for a second."""
    from calmotion.testing import small_shot

    return small_shot()


@pytest.fixture
def calmotion_flexible_shot() -> tuple[Character, Animation]:
    """The same with a forearm that bends."""
    from calmotion.testing import small_shot

    return small_shot(flexible=True)


@pytest.fixture
def calmotion_config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A configuration folder of the test's own, so that what the user has disabled plays no part."""
    folder = tmp_path / "calmotion-config"
    monkeypatch.setenv("CALMOTION_CONFIG", str(folder))
    return folder
