"""Fuzzing guided by coverage: `python tests/fuzz/guided.py TARGET SECONDS`, one target in one process.

Atheris guides where it is installed (`pip install 'calmotion[fuzz]'`); elsewhere inputs are mutated at random. An input
that raises anything but an error for users, or ends the process, or takes a minute of processor time, is written to
`tests/fuzz/cases/TARGET/`, which tests then run for ever.

Hours add up over runs: inputs that reach new code stay in `build/fuzz/TARGET`, and with --write the processor time and
the inputs of a run are added to `tests/fuzz/counts.json`, from which the table in docs/reliability.md is made.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import re
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path

import targets
from calmotion.support.files import locked

HERE = Path(__file__).resolve().parent
CASES, COUNTS, CORPUS = HERE / "cases", HERE / "counts.json", HERE.parents[1] / "build" / "fuzz"
PAGE = HERE.parents[1] / "docs" / "reliability.md"
BEGIN, END = "<!-- counts of make fuzz -->", "<!-- end of the counts of make fuzz -->"
MEMORY = "/dev/shm"  # files that are kept in memory, on Linux
FOUND = "found-"  # what files begin with that have an input on which Atheris stopped
LONGEST = 60  # processor time of one input [s]
_PACKAGES = ("calmotion", "bvh_reader", "recording_readers", "motion_table")
_DONE, _PULSE = re.compile(r"Done (\d+) runs"), re.compile(r"^#(\d+)", re.MULTILINE)


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
    corpus = CORPUS / name
    corpus.mkdir(parents=True, exist_ok=True)
    for k, seed in enumerate(targets.SEEDS[name]):
        (corpus / f"seed{k}").write_bytes(seed)
    options = [f"-max_total_time={int(seconds)}", f"-timeout={LONGEST}", "-rss_limit_mb=4000", "-max_len=4096"]
    found = Path(tempfile.gettempdir()) / FOUND  # not among the files of the target, which are removed
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={found}", str(corpus)], run)
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


def added(counts: dict[str, dict], name: str, seconds: float, inputs: int, found: int, guided: bool) -> dict[str, dict]:
    """Counts of all runs, with those of one more."""
    before = counts.get(name, {"processor_s": 0.0, "guided_s": 0.0, "inputs": 0, "findings": 0})
    now = {
        "processor_s": round(before["processor_s"] + seconds, 1),
        "guided_s": round(before["guided_s"] + guided * seconds, 1),
        "inputs": before["inputs"] + inputs, "findings": before["findings"] + found,
    }  # fmt: skip
    return dict(sorted((counts | {name: now}).items()))


def table(counts: dict[str, dict]) -> str:
    """The counts as Markdown."""
    rows = [["target", "processor time [min]", "of it guided by coverage", "inputs", "findings"], ["---"] * 5]
    for name in targets.TARGETS:
        if name in counts:
            row = counts[name]
            minutes = [f"{row[key] / 60.0:.1f}" for key in ("processor_s", "guided_s")]
            rows.append([name, *minutes, f"{row['inputs']:,}", str(row["findings"])])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def write(name: str, seconds: float, inputs: int, found: int, guided: bool) -> None:
    """Add a run to the counts, and make the table of the page anew; several targets may end at the same time."""
    with locked(COUNTS.parent):
        counts = added(json.loads(COUNTS.read_text()) if COUNTS.is_file() else {}, name, seconds, inputs, found, guided)
        temporary = COUNTS.with_suffix(".part")
        temporary.write_text(json.dumps(counts, indent=1) + "\n")
        os.replace(temporary, COUNTS)
        before, _, rest = PAGE.read_text().partition(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n\n{table(counts)}\n\n{END}{rest.partition(END)[2]}")


def fails(command: Sequence[str], seconds: int) -> bool:
    """Whether a process fails by itself, or takes more processor time than that.

    An input is also stopped where other programs leave it no processor, or where the machine sleeps.
    """

    def limited() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))

    return subprocess.run(command, preexec_fn=limited, capture_output=True, timeout=60 * seconds).returncode != 0


def judged(name: str, files: Path) -> tuple[int, int]:
    """Try the inputs on which a run stopped once more, and keep those that fail; how many were tried, and failed."""
    inputs = sorted(files.glob(f"{FOUND}*"))
    failed = 0
    for path in inputs:
        if fails([sys.executable, str(HERE / "guided.py"), name, "0", "--replay", str(path)], LONGEST):
            data, failed = path.read_bytes(), failed + 1
            (CASES / name).mkdir(parents=True, exist_ok=True)
            (CASES / name / hashlib.sha256(data).hexdigest()[:12]).write_bytes(data)
        else:
            print(f"{path.name}: no finding, it ends as it should in a process of its own", flush=True)
    return len(inputs), failed


def supervised(name: str, seconds: float) -> tuple[bool, float, int, int, bool]:
    """Fuzz in a process of its own: whether it failed, processor time [s], inputs, findings, whether it was guided."""
    folder = CASES / name
    before = len(list(folder.glob("*")))
    command = [sys.executable, str(HERE / "guided.py"), name, str(seconds), "--here"]
    lines, guided = [], False
    # inputs are files, which take most of the time where they are written to a disk
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=MEMORY if os.access(MEMORY, os.W_OK) else None) as files:
        process = subprocess.Popen(
            command, stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True, errors="replace",
            env=os.environ | {"TMPDIR": files},
        )  # fmt: skip
        assert process.stdout is not None
        for line in process.stdout:
            lines.append(line)
            guided = guided or line.startswith("INFO:")
            print(line, end="", flush=True)
        status = process.wait()
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        tried, failed = judged(name, Path(files))
    text = "".join(lines[-2000:])
    done = _DONE.search(text)
    inputs = int(done[1]) if done else max(map(int, _PULSE.findall(text)), default=0)
    found = len(list(folder.glob("*"))) - before
    return failed > 0 or bool(status and not tried), used.ru_utime + used.ru_stime, inputs, found, guided


def main() -> int:
    """The command: exit status 1 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", choices=tuple(targets.TARGETS))
    parser.add_argument("seconds", type=float)
    parser.add_argument("--write", action="store_true", help="add the run to the counts and to docs/reliability.md")
    parser.add_argument("--here", action="store_true", help="in this process, which Atheris ends")
    parser.add_argument("--replay", type=Path, metavar="FILE", help="read this input only")
    options = parser.parse_args()
    name, seconds = options.target, options.seconds
    if options.replay:
        kept(name, targets.TARGETS[name])(options.replay.read_bytes())
        return 0
    if not options.here:
        failed, *counts = supervised(name, seconds)
        if options.write:
            write(name, *counts)
        return int(failed)
    try:
        import atheris  # noqa: F401
    except ImportError:
        print(f"Done {by_chance(name, seconds)} runs at random of {name}; Atheris is not installed")
        return 0
    by_atheris(name, seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
