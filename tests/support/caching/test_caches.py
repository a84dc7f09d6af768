"""Caches of the user: verified, limited, cleared."""

import os
import pickle

import numpy as np
import pytest
from calmotion.support.caching import caches
from calmotion.support.caching.bundled_kernels import name_of
from calmotion.support.caching.cache_folder import CACHES, KERNELS, MESHES, REDUCTIONS, cache_folder
from calmotion.support.caching.caches import clear, entries, prune, store_arrays, stored_arrays
from calmotion.support.caching.verified_files import sealed
from calmotion.support.files import PREFIX, _machine
from calmotion.support.kernel_cache import KernelCacheFile


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


@pytest.mark.posix
def test_a_symbolic_link_is_removed_and_what_it_names_is_not(folder, tmp_path_factory):
    precious = tmp_path_factory.mktemp("precious")
    (precious / "file").write_text("precious")
    (folder / MESHES).mkdir()
    (folder / MESHES / "link.npz").symlink_to(precious / "file")
    (folder / MESHES / "other").symlink_to(precious)
    assert len(clear(MESHES)) == 2
    assert (precious / "file").read_text() == "precious"


@pytest.mark.posix
@pytest.mark.parametrize("foreign", ["writable by a group", "writable by all", "of another user"])
def test_what_another_user_can_write_is_not_read_and_made_again_without_a_word(folder, caplog, monkeypatch, foreign):
    store_arrays(MESHES, "key", {"a": np.zeros(1)})
    path = folder / MESHES / "key.npz"
    with monkeypatch.context() as patch:
        if foreign == "of another user":
            status = os.stat_result([*path.stat()[:4], os.geteuid() + 1, *path.stat()[5:]])
            patch.setattr(os, "fstat", lambda descriptor: status)
        else:
            path.chmod(0o664 if foreign == "writable by a group" else 0o646)
        assert stored_arrays(MESHES, "key") is None and path.exists() and not caplog.messages
    store_arrays(MESHES, "key", {"a": np.ones(1)})
    assert stored_arrays(MESHES, "key")["a"] == 1.0


@pytest.mark.posix
def test_files_are_read_whatever_the_umask_is(folder):
    for mask in (0o002, 0o000, 0o077):
        former = os.umask(mask)
        try:
            store_arrays(MESHES, f"{mask}", {"a": np.zeros(1)})
        finally:
            os.umask(former)
        assert stored_arrays(MESHES, f"{mask}") is not None


@pytest.mark.posix
@pytest.mark.posix
def test_a_kernel_that_another_user_can_write_is_never_unpickled(tmp_path):
    path = tmp_path / "kernel.nbi"
    path.write_bytes(sealed(pickle.dumps("of an attacker"), name_of(path)))
    cache = KernelCacheFile(tmp_path, "module", "kernel", "stamp", pickle.dumps, bool)
    path.chmod(0o666)
    assert cache._read(path.name) is None and path.exists(), "it is replaced when the kernel is compiled"
    path.chmod(0o644)
    assert cache._read(path.name) is not None


def test_what_a_killed_process_left_is_removed_by_one_that_only_reads(folder):
    store_arrays(MESHES, "0" * 64, {"points": np.ones(3)})
    left = folder / MESHES / f"{PREFIX}{_machine()}-999999999-x.npz"
    left.write_bytes(b"half")
    caches._tidy.cache_clear()  # as in a new process
    assert stored_arrays(MESHES, "0" * 64) is not None and not left.exists()
