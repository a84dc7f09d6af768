"""Full disks, folders that cannot be written or vanish, and caches and checkpoints that are damaged bit by bit."""

import os
import random
import resource
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import events
import runs
import verdicts
from kills import CACHED, writes_of
from workspace import CHECKPOINT, Workspace, empty

ROOM = 1_500_000  # an undisturbed run writes less [bytes] into each of its folders


@contextmanager
def small_disk(folder: Path, size: int) -> Iterator[None]:
    """Mount a file system of a size [bytes] over a folder, with the content of the folder."""
    content = folder.with_name(f"{folder.name}-content")
    shutil.copytree(folder, content)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)], check=True)
    try:
        shutil.copytree(content, folder, dirs_exist_ok=True)
        yield
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)
        shutil.rmtree(content)


def can_mount() -> bool:
    """Whether this process may mount file systems."""
    return os.name == "posix" and os.getuid() == 0 and shutil.which("mount") is not None


def full_disks(space: Workspace, rng: random.Random, count: int, tally: verdicts.Tally) -> None:
    """Disks that become full at a random byte of the outputs, the caches or the temporary files."""
    for number in range(count):
        space.reset(old_outputs=rng.random() < 0.3)
        figures, part = rng.random() < 0.2, space.cool(rng)
        about = f"full disk {number}"
        if can_mount() and rng.random() < 0.7:
            folder = rng.choice((space.out, space.cache, space.temporary))
            used = sum(path.stat().st_size + 4096 for path in folder.rglob("*"))
            with small_disk(folder, used + 8192 + int(ROOM * rng.random() ** 3)):
                ending = runs.run(space, figures)
                faults = _faults(space, ending, figures)
            about += f", {folder.name} without {part}"
        else:
            limit = int(600_000 * rng.random() ** 3)
            about += f", files of at most {limit} bytes, without {part}"

            def shorten(limit: int = limit) -> None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

            ending = runs.run(space, figures, shorten)
            faults = _faults(space, ending, figures)
        _judge(space, ending, figures, about, tally, faults)


def folders(space: Workspace, rng: random.Random, count: int, tally: verdicts.Tally) -> None:
    """Folders that cannot be written, are files, or vanish while the run writes."""
    writes = writes_of(space)
    for number in range(count):
        space.reset(old_outputs=rng.random() < 0.3)
        part = space.cool(rng)
        # rarely the whole cache: the kernels would compile for a minute
        parts = [space.out, space.temporary, *(space.cache / part for part in ("meshes", "reductions"))]
        folder = rng.choice(parts * 3 + [space.cache])
        kinds = ["vanishes", "is a file", "is missing"] + (["is read-only"] if can_mount() else [])
        kind = rng.choice(kinds)
        about = f"folder {number}: {folder.name} {kind}, without {part}"
        if kind == "vanishes":
            name, which = writes.draw(rng)
            about += f" at {name} {which}"
            ending = runs.run(space, fault=events.strike(space, name, which, lambda f=folder: _vanish(f)))
            faults = [] if folder == space.out and ending.status == 0 else _faults(space, ending, False)
        elif kind == "is read-only":
            with small_disk(folder, 50_000_000):
                subprocess.run(["mount", "-o", "remount,ro", str(folder)], check=True)
                ending = runs.run(space)
                faults = _faults(space, ending, False)
        else:
            shutil.rmtree(folder)
            if kind == "is a file":
                folder.write_text("not a folder")
            ending = runs.run(space)
            faults = _faults(space, ending, False)
        _judge(space, ending, False, about, tally, faults)


def _vanish(folder: Path) -> None:
    folder.rename(folder.with_name(f"{folder.name}-gone"))
    shutil.rmtree(folder.with_name(f"{folder.name}-gone"), ignore_errors=True)


def _flip(path: Path, rng: random.Random) -> None:
    data = bytearray(path.read_bytes())
    bit = rng.randrange(8 * len(data))
    data[bit // 8] ^= 1 << bit % 8
    path.write_bytes(data)


def _cut(path: Path, rng: random.Random) -> None:
    os.truncate(path, rng.randrange(path.stat().st_size))


def _zeros(path: Path, rng: random.Random) -> None:
    data = bytearray(path.read_bytes())
    begin = rng.randrange(len(data))
    data[begin : begin + 4096] = bytes(len(data[begin : begin + 4096]))
    path.write_bytes(data)


def _grow(path: Path, rng: random.Random) -> None:
    with path.open("ab") as file:
        file.write(rng.randbytes(rng.randint(1, 4096)))


def _noise(path: Path, rng: random.Random) -> None:
    path.write_bytes(rng.randbytes(rng.randint(0, 4096)))


def _folder(path: Path, rng: random.Random) -> None:
    path.unlink()
    path.mkdir()
    (path / "inside").write_text("x")


def _pipe(path: Path, rng: random.Random) -> None:
    path.unlink()
    os.mkfifo(path)


def _link(path: Path, rng: random.Random) -> None:
    path.unlink()
    path.symlink_to(rng.choice(("/dev/zero", "/dev/full", "nowhere", path.name, "..")))


def _other(path: Path, rng: random.Random) -> None:
    others = [other for other in path.parent.iterdir() if other.suffix == path.suffix and other.is_file()]
    path.write_bytes(rng.choice(others).read_bytes())


DAMAGES: tuple[Callable[[Path, random.Random], None], ...] = (
    _flip, _flip, _flip, _cut, _zeros, _grow, _noise, _folder, _pipe, _link, _other,
)  # fmt: skip


def damaged_files(space: Workspace, rng: random.Random, count: int, tally: verdicts.Tally) -> None:
    """Files of the caches, and a checkpoint, that are changed between two runs."""
    space.reset()
    stopped = runs.run(
        space, fault=events.strike(space, "checkpoint: rename", 2, lambda: os.kill(os.getpid(), signal.SIGKILL))
    )
    assert stopped.status == -signal.SIGKILL, stopped.err
    checkpoint = (space.out / CHECKPOINT).read_bytes()
    for number in range(count):
        space.reset()
        kind = rng.choice(("kernels", "meshes", "reductions", "checkpoint"))
        if kind == "checkpoint":
            (space.out / CHECKPOINT).write_bytes(checkpoint)
            path = space.out / CHECKPOINT
        else:
            path = rng.choice(sorted(path for path in (space.cache / kind).rglob("*") if path.is_file()))
        damage = rng.choice(DAMAGES)
        damage(path, rng)
        about = f"damage {number}: {damage.__name__[1:]} of {kind} {path.name}"
        ending = runs.run(space)
        faults = _faults(space, ending, False)
        faults += [] if ending.status == 0 else [f"exit status {ending.status} in place of the result"]
        _judge(space, ending, False, about, tally, faults, str(path.relative_to(space.root)))


def _faults(space: Workspace, ending: runs.Ending, figures: bool) -> list[str]:
    """What is wrong with the output of a run that a fault has disturbed."""
    if ending.status == 0:
        return verdicts.result_faults(space, figures)
    return verdicts.refusal_faults(ending) + (verdicts.unfinished_faults(space) if space.out.is_dir() else [])


def _judge(
    space: Workspace, ending: runs.Ending, figures: bool, about: str, tally: verdicts.Tally, faults: list[str],
    unused: str = "",
) -> None:  # fmt: skip
    """Count a run and the next one, which nothing disturbs and which must end with the result.

    Args:
        unused: A damaged file, which may stay where neither run uses it.
    """
    tally.add("same result" if ending.status == 0 else "refused", about, faults)
    for folder in (space.out, space.cache, *(space.cache / part for part in CACHED), space.temporary):
        if not folder.is_dir():
            empty(folder)
    if not any((space.cache / "kernels").rglob("*.nbi")):  # they would be compiled for minutes
        shutil.copytree(space.warm, space.cache, dirs_exist_ok=True)
    again = runs.run(space, figures)
    after = [f"the next run: exit status {again.status}", *verdicts.refusal_faults(again)]
    if again.status == 0:
        left = [text for text in verdicts.leftovers(space) if not unused or not text.startswith(unused)]
        after = [*verdicts.result_faults(space, figures), *left]
    tally.runs += 1
    tally.add("same result by the next run" if not after else "no result by the next run", about, after)
