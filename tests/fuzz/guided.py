"""Fuzzing guided by coverage: `python tests/fuzz/guided.py TARGET SECONDS`, one target in one process.

Atheris guides where it is installed (`pip install 'calmotion[fuzz]'`); elsewhere inputs are mutated at random. An input
that raises anything but an error for users is written to `tests/fuzz/cases/TARGET/`, which tests then run for ever.
"""

from __future__ import annotations

import hashlib
import random
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import targets

CASES = Path(__file__).resolve().parent / "cases"
_PACKAGES = ("calmotion", "fe_mesher", "bvh_reader")


def kept(name: str, function: Callable[[bytes], None]) -> Callable[[bytes], None]:
    """A target that keeps the inputs on which it fails."""

    def run(data: bytes) -> None:
        try:
            function(data)
        except Exception:
            path = CASES / name / hashlib.sha256(data).hexdigest()[:12]
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
            traceback.print_exc()
            print(f"kept {path}", flush=True)
            raise

    return run


def by_atheris(name: str, seconds: float) -> None:
    """Let Atheris guide; it ends the process."""
    import atheris

    with atheris.instrument_imports(include=list(_PACKAGES), enable_loader_override=False):
        run = kept(name, targets.TARGETS[name])
        for seed in targets.SEEDS[name]:  # imports what is instrumented
            run(seed)
    corpus = targets.FOLDER / "corpus"
    corpus.mkdir()
    for k, seed in enumerate(targets.SEEDS[name]):
        (corpus / str(k)).write_bytes(seed)
    options = [f"-max_total_time={int(seconds)}", "-timeout=60", "-rss_limit_mb=4000", "-max_len=4096"]
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={targets.FOLDER}/", str(corpus)], run)
    atheris.Fuzz()


def by_chance(name: str, seconds: float) -> int:
    """Mutate the seeds at random; the number of inputs."""
    run, rng, end, count = kept(name, targets.TARGETS[name]), random.Random(0), time.monotonic() + seconds, 0
    while time.monotonic() < end:
        run(mutated(rng.choice(targets.SEEDS[name]), rng))
        count += 1
    return count


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Bytes with some changed, lost, doubled or new."""
    values = bytearray(data)
    for _ in range(rng.choice((1, 2, 5, 20))):
        at, size = rng.randrange(len(values) + 1), rng.choice((1, 1, 4, 16))
        what = rng.randrange(4)
        if what == 0:
            del values[at : at + size]
        elif what == 1:
            values[at:at] = values[at : at + size]
        elif what == 2:
            values[at : at + size] = rng.randbytes(size)
        else:
            values[at:at] = rng.choice((b"\0", b"-1", b"nan", b"1e999", b"9" * 20, b"\xff", b"\n"))
    return bytes(values)


def main() -> int:
    """The command."""
    name, seconds = sys.argv[1], float(sys.argv[2])
    try:
        import atheris  # noqa: F401
    except ImportError:
        print(f"{name}: {by_chance(name, seconds)} inputs at random; Atheris is not installed")
        return 0
    by_atheris(name, seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
