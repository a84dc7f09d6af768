"""Files that are verified when they are read."""

import os
import subprocess
import sys

import numpy as np
import pytest
from calmotion.support.caching.verified_files import (
    DamagedFileError,
    ForeignFileError,
    read_arrays,
    read_verified,
    sealed,
    unsealed,
    write_arrays,
)


def test_content_comes_back_and_any_change_is_seen():
    data = sealed(b"content")
    assert unsealed(data) == b"content" and unsealed(sealed(b"")) == b""
    for at in range(len(data)):
        with pytest.raises(DamagedFileError):
            unsealed(data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :])
        with pytest.raises(DamagedFileError):
            unsealed(data[:at])
    for other in (b"", data + b"x", data + data, bytes(len(data))):
        with pytest.raises(DamagedFileError):
            unsealed(other)


def test_arrays_come_back_bit_for_bit(tmp_path):
    arrays = {"a": np.asfortranarray(np.random.default_rng(0).normal(size=(3, 4))), "b": np.arange(3, dtype=np.int32)}
    write_arrays(tmp_path / "x.npz", arrays)
    again = read_arrays(tmp_path / "x.npz")
    assert set(again) == {"a", "b"}
    for name, array in arrays.items():
        assert again[name].dtype == array.dtype and again[name].tobytes("A") == array.tobytes("A")


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x05\x06" + bytes(18)])
def test_whole_files_without_arrays_are_refused(tmp_path, content):
    path = tmp_path / "x.npz"
    path.write_bytes(sealed(content))
    assert read_verified(path) == content
    if content.startswith(b"PK"):
        assert read_arrays(path) == {}
    else:
        with pytest.raises(DamagedFileError):
            read_arrays(path)


def test_pickled_objects_are_not_loaded(tmp_path):
    np.savez(tmp_path / "objects.npz", a=np.array([{}], object))
    (tmp_path / "x.npz").write_bytes(sealed((tmp_path / "objects.npz").read_bytes()))
    with pytest.raises(DamagedFileError):
        read_arrays(tmp_path / "x.npz")


@pytest.mark.parametrize("bomb", ["compressed", "shape"])
def test_arrays_that_are_larger_than_their_file_are_refused(tmp_path, bomb):
    if bomb == "compressed":
        np.savez_compressed(tmp_path / "bomb.npz", a=np.zeros(10**6))
        content = (tmp_path / "bomb.npz").read_bytes()
    else:
        np.savez(tmp_path / "bomb.npz", a=np.zeros(1000))
        content = (tmp_path / "bomb.npz").read_bytes().replace(b"(1000,), }     ", b"(10000000000,)}")
    (tmp_path / "x.npz").write_bytes(sealed(content))
    with pytest.raises(DamagedFileError):
        read_arrays(tmp_path / "x.npz")


def test_another_name_is_damage_and_another_version_is_none():
    named = sealed(b"content", "name")
    assert unsealed(named, "name") == b"content"
    for name in ("", "other"):
        with pytest.raises(DamagedFileError):
            unsealed(named, name)
    for former in (b"calmotion-1\n", b"calmotion-2\n"):
        with pytest.raises(ForeignFileError):
            unsealed(b"content" + bytes(72) + former)


@pytest.mark.posix
def test_a_named_pipe_stops_nobody(tmp_path):
    os.mkfifo(tmp_path / "x.npz")
    code = "import sys; from calmotion.support.caching.verified_files import read_verified; read_verified(sys.argv[1])"
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "x.npz"], capture_output=True, text=True, timeout=600)
    assert "DamagedFileError" in done.stderr


def test_a_folder_and_a_missing_file(tmp_path):
    with pytest.raises((DamagedFileError, PermissionError)):  # the latter on Windows
        read_verified(tmp_path)
    with pytest.raises(FileNotFoundError):
        read_verified(tmp_path / "missing")


def test_a_file_that_would_fill_the_memory_is_not_read(tmp_path):
    with open(tmp_path / "x.npz", "wb") as file:
        file.truncate(2**40)  # a hole, which takes no room on the disk
    with pytest.raises(DamagedFileError, match="larger"):
        read_verified(tmp_path / "x.npz")


def test_an_encrypted_archive_is_refused(tmp_path):
    write_arrays(tmp_path / "x.npz", {"a": np.zeros(3)})
    content = bytearray(unsealed((tmp_path / "x.npz").read_bytes()))
    for head, flags in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        content[content.index(head) + flags] |= 1
    (tmp_path / "x.npz").write_bytes(sealed(bytes(content)))
    with pytest.raises(DamagedFileError):
        read_arrays(tmp_path / "x.npz")
