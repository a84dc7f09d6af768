"""An object store that workers share: what one made another one reads, and nothing that is not signed is used."""

import numpy as np
import pytest
from calmotion.errors import ShotError
from calmotion.support.caching import object_store
from calmotion.support.caching.cache_folder import KERNELS, MESHES, SHARED_VARIABLE, folder_of
from calmotion.support.caching.caches import store_arrays, stored_arrays
from calmotion.support.caching.object_store import check_store
from calmotion.support.caching.signing import VARIABLE
from calmotion.workflow.batch.run import batch

fsspec = pytest.importorskip("fsspec")
ARRAYS = {"points": np.arange(6.0).reshape(2, 3)}


@pytest.fixture(params=["file", "memory"])
def worker(request, tmp_path, monkeypatch):
    """A function that makes this process another worker, with a cache of its own."""
    place = f"file://{tmp_path / 'store'}" if request.param == "file" else f"memory://{tmp_path.name}"
    monkeypatch.setenv(SHARED_VARIABLE, place)

    def become(name, key="one secret"):
        monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / name))
        monkeypatch.setenv(VARIABLE, key)
        object_store._tell.cache_clear()
        return fsspec.core.url_to_fs(place)

    return become


def test_what_one_worker_made_another_one_reads_and_keeps(worker):
    worker("a")
    assert stored_arrays(MESHES, "abc") is None
    store_arrays(MESHES, "abc", ARRAYS)
    store, root = worker("b")
    assert not (folder_of(MESHES) / "abc.npz").exists()
    np.testing.assert_array_equal(stored_arrays(MESHES, "abc")["points"], ARRAYS["points"])
    assert store.ls(f"{root}/{MESHES}", detail=False)[0].endswith("abc.npz")
    store.rm(root, recursive=True)
    assert stored_arrays(MESHES, "abc") is not None, "it is in the worker's own cache"


def test_kernels_are_never_there(worker):
    store, root = worker("a")
    store_arrays(KERNELS, "abc", ARRAYS)
    assert not store.exists(f"{root}/{KERNELS}")


def test_an_object_with_another_signature_is_not_used_and_stays(worker, caplog):
    worker("a", key="theirs")
    store_arrays(MESHES, "abc", ARRAYS)
    store, root = worker("b", key="ours")
    before = store.cat_file(f"{root}/{MESHES}/abc.npz")
    assert stored_arrays(MESHES, "abc") is None and "CALMOTION_CACHE_KEY" in caplog.text
    store_arrays(MESHES, "abc", {"points": np.zeros(3)})
    assert store.cat_file(f"{root}/{MESHES}/abc.npz") == before


def test_a_damaged_object_is_not_used_and_made_again(worker, caplog):
    worker("a")
    store_arrays(MESHES, "abc", ARRAYS)
    store, root = worker("b")
    content = bytearray(store.cat_file(f"{root}/{MESHES}/abc.npz"))
    content[100] ^= 1
    store.pipe_file(f"{root}/{MESHES}/abc.npz", bytes(content))
    assert stored_arrays(MESHES, "abc") is None and "not used" in caplog.text
    assert not (folder_of(MESHES) / "abc.npz").exists()
    store_arrays(MESHES, "abc", ARRAYS)
    worker("c")
    assert stored_arrays(MESHES, "abc") is not None


def test_a_store_that_fails_ends_no_run(tmp_path, monkeypatch, caplog):
    monkeypatch.setenv(SHARED_VARIABLE, "nowhere://bucket")
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    object_store._tell.cache_clear()
    store_arrays(MESHES, "abc", ARRAYS)
    assert stored_arrays(MESHES, "abc") is not None and "cannot be used" in caplog.text


def test_an_address_that_cannot_be_used_is_refused_before_any_work(tmp_path):
    check_store(f"file://{tmp_path}")
    with pytest.raises(ShotError, match="the shared cache cannot be used"):
        batch([tmp_path / "shot.usda"], tmp_path / "out", shared_cache="nowhere://bucket")
    assert not (tmp_path / "out").exists()


def test_a_missing_fsspec_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "fsspec", None)
    with pytest.raises(ShotError, match=r"pip install 'calmotion\[store\]'"):
        check_store("s3://bucket/folder")


def test_workers_with_one_process_number_write_apart_and_leave_nothing(worker, monkeypatch):
    """Containers number their processes alike: what one had half written was moved into place by the other."""
    store, root = worker("a")
    parts, kind = [], type(store)
    write = kind.pipe_file

    def writing(self, path, value, **more):
        parts.append(path)
        write(self, path, value, **more)
        if len(parts) == 3:
            raise OSError("the disk is full")

    monkeypatch.setattr(kind, "pipe_file", writing)
    for name in ("abc", "abd", "abe"):
        store_arrays(MESHES, name, ARRAYS)
    unique = {part.removesuffix(".part").rpartition(".")[2] for part in parts}
    assert len(unique) == 3, "the same process, and the same number in another container"
    assert sorted(path.rpartition("/")[2] for path in store.ls(f"{root}/{MESHES}", detail=False)) == [
        "abc.npz", "abd.npz"
    ]  # fmt: skip
