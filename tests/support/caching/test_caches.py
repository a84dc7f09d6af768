"""Caches of the user: verified, limited, cleared."""

import os

import numpy as np
import pytest
from calmotion.support.caching import caches
from calmotion.support.caching.cache_folder import CACHES, FORMER, KERNELS, MESHES, REDUCTIONS, cache_folder
from calmotion.support.caching.caches import clear, entries, prune, store_arrays, stored_arrays
from calmotion.support.files import PREFIX, _machine


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    return tmp_path


def test_a_relative_cache_folder_of_the_system_does_not_count(monkeypatch, tmp_path):
    monkeypatch.delenv("CALMOTION_CACHE")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    assert cache_folder().is_absolute()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    assert cache_folder() == tmp_path / "caches" / "calmotion"


def aged(path, seconds):
    os.utime(path, (1e9 + seconds, 1e9 + seconds))


def test_what_is_stored_comes_back_and_damage_is_removed_with_a_notice(folder, caplog):
    assert stored_arrays(MESHES, "key") is None and not caplog.messages
    store_arrays(MESHES, "key", {"a": np.arange(3)})
    stored = stored_arrays(MESHES, "key")
    assert stored is not None and np.array_equal(stored["a"], np.arange(3))
    path = folder / MESHES / "key.npz"
    for damaged in (b"", path.read_bytes()[:-1], b"x" * 100):
        path.write_bytes(damaged)
        caplog.clear()
        assert stored_arrays(MESHES, "key") is None and not path.exists()
        assert len(caplog.messages) == 1 and str(path) in caplog.messages[0]


def test_what_was_stored_under_another_key_is_not_taken(folder):
    store_arrays(MESHES, "one", {"a": np.zeros(1)})
    store_arrays(MESHES, "other", {"a": np.ones(1)})
    (folder / MESHES / "one.npz").write_bytes((folder / MESHES / "other.npz").read_bytes())
    assert stored_arrays(MESHES, "one") is None and stored_arrays(MESHES, "other")["a"] == 1.0


def test_a_folder_in_place_of_a_file_is_replaced(folder, caplog):
    path = folder / MESHES / "key.npz"
    (path / "inside").mkdir(parents=True)
    assert stored_arrays(MESHES, "key") is None
    store_arrays(MESHES, "key", {"a": np.zeros(1)})
    assert stored_arrays(MESHES, "key") is not None and len(caplog.messages) == 1


def test_an_existing_entry_is_kept_when_wanted(folder):
    store_arrays(MESHES, "key", {"a": np.zeros(1)})
    store_arrays(MESHES, "key", {"a": np.ones(1)}, keep_existing=True)
    assert stored_arrays(MESHES, "key")["a"] == 0.0
    store_arrays(MESHES, "key", {"a": np.ones(1)})
    assert stored_arrays(MESHES, "key")["a"] == 1.0


def test_the_least_recently_used_go_first_and_folders_count_as_one(folder):
    for number in range(4):
        one = folder / KERNELS / f"version{number}"
        one.mkdir(parents=True)
        (one / "a").write_bytes(bytes(600))
        (one / "b").write_bytes(bytes(400))
        aged(one, number)
    aged(folder / KERNELS / "version0", 10)
    assert [(entry.path.name, entry.size) for entry in entries(KERNELS)] == [
        ("version0", 1000), ("version3", 1000), ("version2", 1000), ("version1", 1000),
    ]  # fmt: skip
    assert [entry.path.name for entry in prune(KERNELS, 2500)] == ["version2", "version1"]
    assert prune(KERNELS, 2500) == []
    assert len(prune(KERNELS, 0)) == 1 and [entry.path.name for entry in entries(KERNELS)] == ["version0"]
    assert len(clear(KERNELS)) == 1 and entries(KERNELS) == []


def test_a_cache_keeps_its_limit(folder, monkeypatch):
    monkeypatch.setitem(CACHES, REDUCTIONS, ("reduced bodies", 3000))
    for number in range(5):
        store_arrays(REDUCTIONS, str(number), {"a": np.zeros(100)})
        aged(folder / REDUCTIONS / f"{number}.npz", number)
    assert sum(entry.size for entry in entries(REDUCTIONS)) <= 3000
    assert stored_arrays(REDUCTIONS, "4") is not None and stored_arrays(REDUCTIONS, "0") is None


def test_a_symbolic_link_is_removed_and_what_it_names_is_not(folder, tmp_path_factory):
    precious = tmp_path_factory.mktemp("precious")
    (precious / "file").write_text("precious")
    (folder / MESHES).mkdir()
    (folder / MESHES / "link.npz").symlink_to(precious / "file")
    (folder / MESHES / "other").symlink_to(precious)
    assert len(clear(MESHES)) == 2
    assert (precious / "file").read_text() == "precious"


def test_a_cache_that_does_not_exist_is_empty():
    for cache in CACHES:
        assert entries(cache) == prune(cache) == clear(cache) == []


@pytest.mark.parametrize("remove", [prune, clear])
@pytest.mark.parametrize("cache", FORMER)
def test_folders_of_earlier_versions_go(folder, cache, remove):
    old = folder / FORMER[cache]
    (old / "deep").mkdir(parents=True)
    (old / "one.npz").write_bytes(b"12345")
    (old / "deep" / "two.npz").write_bytes(b"123")
    assert sorted(entry.size for entry in remove(cache)) == [3, 5]
    assert not old.exists() and remove(cache) == []


@pytest.mark.parametrize("cache", FORMER)
def test_storing_removes_the_folder_of_an_earlier_version(folder, cache):
    (folder / FORMER[cache]).mkdir()
    store_arrays(cache, "key", {"a": np.zeros(1)})
    assert sorted(path.name for path in folder.iterdir()) == [cache]


def test_a_link_in_place_of_a_former_folder_is_not_followed(folder, tmp_path_factory):
    other = tmp_path_factory.mktemp("other")
    (other / "mine.npz").write_bytes(b"1")
    (folder / FORMER[MESHES]).symlink_to(other, target_is_directory=True)
    prune(MESHES)
    assert (other / "mine.npz").exists()


def test_what_a_killed_process_left_is_removed_by_one_that_only_reads(folder):
    store_arrays(MESHES, "0" * 64, {"points": np.ones(3)})
    left = folder / MESHES / f"{PREFIX}{_machine()}-999999999-x.npz"
    left.write_bytes(b"half")
    caches._tidy.cache_clear()  # as in a new process
    assert stored_arrays(MESHES, "0" * 64) is not None and not left.exists()
