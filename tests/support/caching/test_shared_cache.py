"""Meshes and reduced bodies may lie in a folder that several machines share; compiled kernels do not."""

import numpy as np
from calmotion.support.caching.cache_folder import (
    KERNELS,
    MESHES,
    REDUCTIONS,
    SHARED_VARIABLE,
    cache_folder,
    folder_of,
)
from calmotion.support.caching.caches import entries, store_arrays, stored_arrays


def test_only_meshes_and_reductions_are_shared(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "own"))
    assert folder_of(MESHES) == cache_folder() / MESHES
    monkeypatch.setenv(SHARED_VARIABLE, str(tmp_path / "shared"))
    assert folder_of(MESHES) == tmp_path / "shared" / MESHES and folder_of(REDUCTIONS).parent == tmp_path / "shared"
    assert folder_of(KERNELS) == tmp_path / "own" / KERNELS


def test_what_one_machine_stores_another_one_reads(tmp_path, monkeypatch):
    monkeypatch.setenv(SHARED_VARIABLE, str(tmp_path / "shared"))
    monkeypatch.setenv("CALMOTION_CACHE_KEY", "of the farm")
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "one"))
    store_arrays(MESHES, "0" * 64, {"points": np.arange(3.0)})
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "two"))
    found = stored_arrays(MESHES, "0" * 64)
    np.testing.assert_array_equal(found["points"], np.arange(3.0))
    assert len(entries(MESHES)) == 1 and not (tmp_path / "one").exists()
