"""Fuzzing guided by coverage: `python tests/fuzz/guided.py TARGET SECONDS`, one target in one process.

Atheris guides (`pip install atheris`). An input that raises anything but an error for users, or ends the process, or
takes a minute of processor time, is written to `tests/fuzz/cases/TARGET/`, which tests then run for ever; an input that
was only slow because other programs left it no processor is to be removed there. Inputs that reach new code stay in
`build/fuzz/TARGET`.
"""

import argparse
import sys
from pathlib import Path

import targets

HERE = Path(__file__).resolve().parent
CASES, CORPUS = HERE / "cases", HERE.parents[1] / "build" / "fuzz"
LONGEST = 60  # time of one input [s]
_PACKAGES = ("calmotion", "bvh_reader", "recording_readers", "motion_table")


def fuzz(name: str, seconds: float) -> None:
    """Let Atheris guide, which keeps its findings by itself and ends the process."""
    import atheris

    target = targets.TARGETS[name]

    with atheris.instrument_imports(include=list(_PACKAGES), enable_loader_override=False):
        for seed in targets.SEEDS[name]:  # imports what is instrumented
            target(seed)
    corpus = CORPUS / name
    for folder in (corpus, CASES / name):
        folder.mkdir(parents=True, exist_ok=True)
    for k, seed in enumerate(targets.SEEDS[name]):
        (corpus / f"seed{k}").write_bytes(seed)
    options = [f"-max_total_time={int(seconds)}", f"-timeout={LONGEST}", "-rss_limit_mb=4000", "-max_len=4096"]
    atheris.Setup([sys.argv[0], *options, f"-artifact_prefix={CASES / name}/", str(corpus)], target)
    atheris.Fuzz()


def main() -> None:
    """The command: another exit status than 0 after a finding."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("target", choices=tuple(targets.TARGETS))
    parser.add_argument("seconds", type=float)
    options = parser.parse_args()
    fuzz(options.target, options.seconds)


if __name__ == "__main__":
    main()
