"""From rerun's threads into a file, by way of a pipe.

rerun writes in a thread, which ends when a write fails, as on a full disk. A later call that flushes may then wait for
that thread for ever. A write into a pipe whose content is taken does not fail.
"""

import os
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
from calmotion.support import PIPES

_PIECE = 2**20  # read at once [bytes]


@contextmanager
def saved(recording: rr.RecordingStream, file: Path) -> Iterator[None]:
    """Save what is logged in the block; the recording is disconnected and its file complete when the block ends.

    Raises:
        OSError, RuntimeError: It cannot be written.
    """
    if not os.path.isdir(PIPES):  # pipes have no names here
        recording.save(str(file))
        yield
        recording.flush()
        recording.disconnect()
        return
    taken, given = os.pipe()
    with ThreadPoolExecutor(1) as threads:
        copied = threads.submit(_copy, taken, file)
        try:
            recording.save(f"{PIPES}/{given}")
            yield
            recording.flush()
        finally:
            os.close(given)
            recording.disconnect()
        copied.result()


def _copy(pipe: int, file: Path) -> None:
    """Write all that comes through a pipe into a file, and take it also when that fails.

    Raises:
        OSError: The file cannot be written.
    """
    with open(pipe, "rb", buffering=0) as source:
        try:
            with file.open("wb") as target:
                shutil.copyfileobj(source, target, _PIECE)
        except OSError:
            while source.read(_PIECE):
                pass
            raise
