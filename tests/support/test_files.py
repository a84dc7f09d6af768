"""Files are replaced atomically."""

import os
import stat
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from calmotion.support.files import (
    PREFIX,
    _machine,
    is_own,
    remove_abandoned,
    replaced,
    system_temporary,
    temporary_folder,
    try_writing,
    write_text,
)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_replaced_as_a_whole_and_is_as_public_as_others(tmp_path):
    file = tmp_path / "deep" / "table.csv"
    write_text(file, "old")
    write_text(file, "new é\r\n\n")
    assert file.read_bytes() == "new é\r\n\n".encode() and names(file.parent) == ["table.csv"]
    mask = os.umask(0)
    os.umask(mask)
    assert stat.S_IMODE(file.stat().st_mode) == 0o666 & ~mask
    file.chmod(0o660)  # as a studio sets it for a group
    write_text(file, "newer")
    assert stat.S_IMODE(file.stat().st_mode) == 0o660


@pytest.mark.posix
@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="needs Linux")
def test_files_of_the_system_are_never_replaced_also_where_they_lead_to_a_file(tmp_path):
    """`/dev/stdout` leads to a file where the output is redirected; as root it would be replaced for all programs."""
    with (tmp_path / "redirected").open("w") as file:
        for own in (f"/proc/self/fd/{file.fileno()}", f"/dev/fd/{file.fileno()}", "/dev/calmotion.csv"):
            for write in (try_writing, lambda path: write_text(path, "table")):
                with pytest.raises(OSError, match="never replaced"):
                    write(own)
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(OSError, match="."):
        (tmp_path / "loop").stat()
    try_writing(tmp_path / "loop")  # a link to itself is replaced as any other
    assert names(tmp_path) == ["loop", "redirected"]


def test_a_dash_is_no_name_of_an_output(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match="standard output"):
        try_writing("-")
    assert names(tmp_path) == []


def test_what_ends_in_a_slash_is_no_file(tmp_path):
    with pytest.raises(IsADirectoryError):
        try_writing(f"{tmp_path}/out/")
    assert names(tmp_path) == []


def test_a_home_folder_that_no_shell_has_replaced_is_no_place_of_an_output(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(OSError, match="home folder"):
        try_writing("~/out.csv")
    assert names(tmp_path) == []
    try_writing("~out.csv")
    (tmp_path / "~").mkdir()
    try_writing("~/out.csv")


def test_temporary_files_have_random_names_and_are_private(tmp_path):
    seen = []
    for _ in range(3):
        with replaced(tmp_path / "layer.usda") as temporary:
            seen.append(temporary)
            assert temporary.name.startswith(PREFIX) and temporary.suffix == ".usda" and temporary.parent == tmp_path
            assert stat.S_IMODE(temporary.stat().st_mode) == 0o600 and temporary.stat().st_size == 0
    assert len(set(seen)) == 3 and names(tmp_path) == ["layer.usda"]


@pytest.mark.posix
def test_a_symbolic_link_is_replaced_and_what_it_names_is_not_touched(tmp_path, monkeypatch):
    precious = tmp_path / "precious"
    precious.write_text("precious")
    (tmp_path / "table.csv").symlink_to(precious)
    write_text(tmp_path / "table.csv", "new")
    assert not (tmp_path / "table.csv").is_symlink() and (tmp_path / "table.csv").read_text() == "new"
    assert precious.read_text() == "precious"
    # a link that waits under the name of the temporary file is passed over
    candidates = iter(["guessed", "another"])
    monkeypatch.setattr("tempfile._get_candidate_names", lambda: candidates)
    (tmp_path / f"{PREFIX}{_machine()}-{os.getpid()}-guessed.csv").symlink_to(precious)
    with replaced(tmp_path / "other.csv") as temporary:
        assert temporary.name.endswith("-another.csv")
        temporary.write_text("new")
    assert precious.read_text() == "precious" and (tmp_path / "other.csv").read_text() == "new"


@pytest.mark.posix
def test_a_link_that_takes_the_place_of_the_temporary_file_is_not_followed(tmp_path):
    precious = tmp_path / "precious"
    precious.write_text("precious")
    mode = precious.stat().st_mode
    with pytest.raises(OSError), replaced(tmp_path / "table.csv") as temporary:
        temporary.unlink()
        temporary.symlink_to(precious)
    assert names(tmp_path) == ["precious"]
    assert precious.read_text() == "precious" and precious.stat().st_mode == mode


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch):
    file = tmp_path / "table.csv"
    write_text(file, "old")
    with pytest.raises(KeyboardInterrupt), replaced(file) as temporary:
        temporary.write_text("half")
        raise KeyboardInterrupt
    assert file.read_text() == "old" and names(tmp_path) == ["table.csv"]
    monkeypatch.setattr(os, "fsync", lambda descriptor: (_ for _ in ()).throw(OSError("the disk is full")))
    with pytest.raises(OSError, match="full"):
        write_text(file, "new")
    assert file.read_text() == "old" and names(tmp_path) == ["table.csv"]


def test_a_file_where_a_folder_should_be_is_an_error(tmp_path):
    (tmp_path / "taken").write_text("")
    with pytest.raises(OSError):
        write_text(tmp_path / "taken" / "table.csv", "new")


def test_files_of_killed_processes_are_removed_by_the_next_that_writes_there(tmp_path):
    code = f"""
import os, sys
from calmotion.support.files import replaced
with replaced({str(tmp_path / "layer.usda")!r}):
    os._exit(9)
"""
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 9
    assert len(names(tmp_path)) == 1 and names(tmp_path)[0].startswith(PREFIX)
    with replaced(tmp_path / "layer.usda") as running:
        with replaced(tmp_path / "table.csv"):
            assert running.exists(), "this process runs"
            assert len(names(tmp_path)) == 2, "that one does not"
    assert names(tmp_path) == ["layer.usda", "table.csv"]


def test_folders_of_killed_processes_are_removed_by_the_next_that_makes_one(tmp_path, monkeypatch):
    code = """
import os
from calmotion.support.files import temporary_folder
with temporary_folder() as folder:
    (folder / "surface.npz").write_text("much")
    os._exit(9)
"""
    environment = os.environ | {"TMPDIR": str(tmp_path)}
    assert subprocess.run([sys.executable, "-c", code], check=False, env=environment).returncode == 9
    assert len(names(tmp_path)) == 1
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with temporary_folder() as folder:
        assert names(tmp_path) == [folder.name] and folder.name.startswith(PREFIX)
        if os.name == "posix":
            assert folder.stat().st_mode & 0o077 == 0
    assert names(tmp_path) == []


def test_the_folder_for_temporary_files_is_one_that_takes_files_and_keeps_none(tmp_path, monkeypatch):
    chosen = tmp_path / "chosen"
    chosen.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", None)
    monkeypatch.setenv("TMPDIR", str(tmp_path / "missing"))
    monkeypatch.setenv("TEMP", str(chosen))
    assert system_temporary() == Path(tempfile.gettempdir()) == chosen and names(tmp_path) == ["chosen"]
    assert names(chosen) == []


def test_temporary_files_of_other_users_are_left_alone(tmp_path, monkeypatch):
    (tmp_path / f"{PREFIX}{_machine()}-999999999-x").mkdir()
    user = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    remove_abandoned(tmp_path)
    assert len(names(tmp_path)) == 1


def test_old_temporary_files_are_removed_and_new_ones_are_not(tmp_path):
    for name, age in ((f"{PREFIX}old.npz", 7200.0), (f"{PREFIX}new.npz", 60.0), ("old.npz", 7200.0)):
        (tmp_path / name).write_text("")
        then = (tmp_path / name).stat().st_mtime - age
        os.utime(tmp_path / name, (then, then))
    remove_abandoned(tmp_path)
    assert names(tmp_path) == [f"{PREFIX}new.npz", "old.npz"]


def kept_of(path):
    """Kind, number, size and date of change; the date of reading changes when somebody asks where a link leads."""
    state = os.lstat(path)
    return state.st_mode, state.st_ino, state.st_size, state.st_mtime_ns


@pytest.mark.posix
@pytest.mark.parametrize("make", [lambda path: os.mkfifo(path), lambda path: path.symlink_to("/dev/null")])
def test_what_is_no_file_is_not_replaced(tmp_path, make):
    path = tmp_path / "table.csv"
    make(path)
    before = kept_of(path)
    for write in (try_writing, lambda path: write_text(path, "new")):
        with pytest.raises(OSError, match="Not a file"):
            write(path)
    assert kept_of(path) == before and names(tmp_path) == ["table.csv"]


def test_a_folder_is_locked_for_one_process_at_a_time(tmp_path):
    code = (
        "import pathlib, sys, time\nfrom calmotion.support import locked\nfolder = pathlib.Path(sys.argv[1])\n"
        "with locked(folder):\n    count = len(list(folder.glob('[0-9]*')))\n    time.sleep(0.05)\n"
        "    (folder / str(count)).write_text('')\n"
    )
    started = [subprocess.Popen([sys.executable, "-c", code, str(tmp_path)]) for _ in range(4)]
    assert [process.wait() for process in started] == [0] * 4 and names(tmp_path) == [".lock", "0", "1", "2", "3"]


@pytest.mark.posix
@pytest.mark.parametrize("kind", ["file", "folder"])
def test_what_another_user_owns_or_can_write_is_not_ones_own(tmp_path, monkeypatch, kind):
    path = tmp_path / kind
    path.mkdir() if kind == "folder" else path.touch()
    for mode, own in ((0o755, True), (0o600, True), (0o775, False), (0o757, False)):
        path.chmod(mode)
        assert is_own(path.stat()) is own
    path.chmod(0o700)
    user = path.stat().st_uid
    monkeypatch.setattr(os, "geteuid", lambda: user + 1)
    assert is_own(path.stat()) is (user == 0), "what the system owns is trusted"
