"""Files that are written whole or not at all."""

import os
import stat

import pytest
from calmotion.support.files import write_whole


def test_a_file_is_replaced_as_a_whole_and_is_as_public_as_others(tmp_path):
    file = tmp_path / "deep" / "table.csv"
    write_whole(file, "old")
    write_whole(file, "new é\n")
    assert file.read_text(encoding="utf-8") == "new é\n" and [p.name for p in file.parent.iterdir()] == ["table.csv"]
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(file.stat().st_mode) == 0o666 & ~mask


def test_what_cannot_be_written_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    file = tmp_path / "table.csv"
    write_whole(file, "old")
    monkeypatch.setattr(os, "fsync", lambda descriptor: (_ for _ in ()).throw(OSError("the disk is full")))
    with pytest.raises(OSError, match="full"):
        write_whole(file, "new")
    assert file.read_text() == "old" and [path.name for path in tmp_path.iterdir()] == ["table.csv"]


def test_a_file_where_a_folder_should_be_is_an_error(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OSError):
        write_whole(tmp_path / "taken" / "table.csv", "new")
