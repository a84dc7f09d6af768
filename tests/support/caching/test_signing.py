"""The key of the caches: the user's alone, made once, shared where the user says so."""

import os
import pickle
import subprocess
import sys
import time

import numpy as np
import pytest
from calmotion.support.caching import signing
from calmotion.support.caching.caches import entries, store_arrays, stored_arrays
from calmotion.support.caching.signing import FILE_NAME, VARIABLE, signing_key
from calmotion.support.caching.verified_files import ForeignFileError, sealed, unsealed


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path / "config"))
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv(VARIABLE, raising=False)
    signing._kept.cache_clear()
    yield tmp_path / "config"
    signing._kept.cache_clear()


def test_the_key_is_made_once_and_is_the_users_alone(folder):
    key = signing_key()
    assert len(key) == 32 and (folder / FILE_NAME).read_bytes() == key
    assert (folder / FILE_NAME).stat().st_mode & 0o077 == 0
    signing._kept.cache_clear()
    assert signing_key() == key and [path.name for path in folder.iterdir()] == [FILE_NAME]


def test_processes_that_start_at_once_have_one_key(folder):
    code = "from calmotion.support.caching.signing import signing_key; print(signing_key().hex())"
    started = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) for _ in range(4)]
    keys = {process.communicate()[0] for process in started}
    assert keys == {signing_key().hex().encode() + b"\n"}


def test_the_key_of_a_faster_process_is_kept(folder):
    folder.mkdir()
    key = b"k" * 32
    (folder / FILE_NAME).write_bytes(key)
    (folder / FILE_NAME).chmod(0o600)
    assert signing._made(folder / FILE_NAME) == key, "it was made after this process found none"


def test_processes_that_find_a_damaged_key_replace_it_by_one(folder, monkeypatch):
    """Each replaced it, and kept signing with a key that another one had replaced."""
    from concurrent.futures import ThreadPoolExecutor

    waits, replace = [0.1, 0.2, 0.3], os.replace

    def slow(source, target):
        time.sleep(waits.pop(0))
        replace(source, target)

    folder.mkdir()
    (folder / FILE_NAME).write_bytes(b"short")
    monkeypatch.setattr(os, "replace", slow)
    with ThreadPoolExecutor(3) as pool:
        keys = set(pool.map(lambda _: signing._made(folder / FILE_NAME), range(3)))
    assert keys == {(folder / FILE_NAME).read_bytes()} and len(waits) == 2


def test_a_file_system_without_hard_links_keeps_a_key(folder, monkeypatch):
    def none(*arguments):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", none)
    key = signing_key()
    assert len(key) == 32 and signing._made(folder / FILE_NAME) == key


@pytest.mark.parametrize("damage", ["readable", "short", "link", "folder"])
def test_a_key_that_others_can_read_or_that_is_damaged_is_replaced(folder, damage):
    first, path = signing_key(), folder / FILE_NAME
    if damage == "readable":
        path.chmod(0o644)
    elif damage == "short":
        path.write_bytes(b"x")
    elif damage == "link":
        path.rename(folder / "key")
        path.symlink_to(folder / "key")
    else:
        path.unlink()
        path.mkdir()
    signing._kept.cache_clear()
    found = signing_key()
    if damage == "folder":
        assert found == b"", "caches are then verified without a key"
    elif damage == "link":
        assert found in (b"", first) or len(found) == 32
    else:
        assert len(found) == 32 and found != first and path.stat().st_mode & 0o077 == 0


def test_machines_can_share_a_key(folder, monkeypatch):
    monkeypatch.setenv(VARIABLE, "of our farm")
    key = signing_key()
    assert len(key) == 32 and not folder.exists()
    monkeypatch.setenv(VARIABLE, "of another farm")
    assert signing_key() != key


def test_what_one_machine_stores_in_a_shared_folder_another_one_reads(folder, monkeypatch, tmp_path):
    store_arrays("meshes", "0" * 64, {"points": np.ones(3)})
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path / "of another machine"))
    signing._kept.cache_clear()
    assert stored_arrays("meshes", "0" * 64) is None, "it has another key"
    monkeypatch.setenv(VARIABLE, "of our farm")
    store_arrays("meshes", "0" * 64, {"points": np.arange(3.0)})
    monkeypatch.setenv("CALMOTION_CONFIG", str(folder))
    found = stored_arrays("meshes", "0" * 64)
    assert found is not None and found["points"].tolist() == [0.0, 1.0, 2.0] and len(entries("meshes")) == 1


def test_without_a_folder_for_the_key_caches_work(folder, monkeypatch, tmp_path):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("CALMOTION_CONFIG", str(tmp_path / "file"))
    assert signing_key() == b""


def test_files_of_others_are_neither_used_nor_called_damaged(folder, caplog, tmp_path):
    store_arrays("meshes", "0" * 64, {"points": np.ones(3)})
    assert stored_arrays("meshes", "0" * 64) is not None
    (entry,) = entries("meshes")
    content = unsealed(entry.path.read_bytes(), signing_key(), entry.path.name)
    entry.path.write_bytes(sealed(content, b"of an attacker", entry.path.name))
    assert stored_arrays("meshes", "0" * 64) is None and entries("meshes") == [] and not caplog.records


def test_a_forged_kernel_is_never_unpickled(folder, tmp_path):
    from calmotion.support.kernel_cache import _content

    path = tmp_path / "kernel.nbi"
    path.write_bytes(sealed(pickle.dumps("of an attacker")))  # whole, but without the key
    assert _content(path) is None
    with pytest.raises(ForeignFileError):
        unsealed(path.read_bytes(), signing_key())
    assert os.path.exists(path), "it is replaced when the kernel is compiled"
