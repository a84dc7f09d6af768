"""Inputs that fuzzing has found, and the seeds, never raise again; every target reads its seeds and damaged ones."""

from __future__ import annotations

import json
import random
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import guided  # noqa: E402
import targets  # noqa: E402

FOUND = sorted(path for path in guided.CASES.rglob("*") if path.is_file())


@pytest.mark.parametrize("path", FOUND, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_a_found_case_is_read_or_refused(path):
    targets.TARGETS[path.parent.name](path.read_bytes())


@pytest.mark.parametrize("name", targets.TARGETS)
def test_seeds_and_damaged_seeds_are_read_or_refused(name):
    rng = random.Random(0)
    for seed in targets.SEEDS[name]:
        targets.TARGETS[name](seed)
        for _ in range(6 if name in ("shot", "splines") else 30):
            targets.TARGETS[name](guided.mutated(seed, rng))


def test_seeds_of_recordings_are_recordings(monkeypatch):
    """Random damage to what is refused anyway would find little."""
    pytest.importorskip("mcap_ros2")
    found = []
    for module, name in (("tables", "read_table"), ("printers", "read_log"), ("bags", "read_bag")):
        module = targets._plugin("recording_readers", module)
        read = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given, read=read: found.append(read(*given)) or found[-1])
    for seed in targets.SEEDS["recordings"]:
        targets.recordings(seed)
    assert [len(recording.channels) for recording in found] == [2, 1, 1, 2]


@pytest.mark.parametrize(
    ("does", "is_failure"),
    [
        ("while True: pass", True),
        ("import os; os.abort()", True),
        ("1 / 0", True),
        ("import time; time.sleep(1.5)", False),
    ],
)
def test_an_input_fails_by_itself_or_by_its_processor_time_and_not_by_waiting(does, is_failure):
    assert guided.fails([sys.executable, "-c", does], 1) == is_failure


def test_an_input_on_which_a_run_stopped_is_tried_again_before_it_is_a_finding(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(guided, "CASES", tmp_path / "cases")
    (tmp_path / f"{guided.FOUND}timeout-1").write_bytes(targets.SEEDS["settings"][0])
    assert guided.judged("settings", tmp_path) == (1, 0) and "no finding" in capsys.readouterr().out
    monkeypatch.setattr(guided, "fails", lambda command, seconds: True)
    assert guided.judged("settings", tmp_path) == (1, 1)
    (kept,) = (tmp_path / "cases" / "settings").iterdir()
    assert kept.read_bytes() == targets.SEEDS["settings"][0]


def test_a_failure_is_kept_and_raised(tmp_path, monkeypatch):
    monkeypatch.setattr(guided, "CASES", tmp_path)

    def broken(data):
        raise IndexError("x")

    with pytest.raises(IndexError):
        guided.kept("shot", broken)(b"input")
    (kept,) = tmp_path.rglob("*/*")
    assert kept.read_bytes() == b"input" and kept.parent.name == "shot"


def test_bytes_drive_random_choices():
    rng = targets.Bytes(b"\x05\x00\xff\xff")
    assert rng.getrandbits(8) == 5 and rng.getrandbits(8) == 0 and rng.random() > 0.999 and rng.random() == 0.0


def test_runs_add_up_and_make_the_table(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(f"before\n{guided.BEGIN}\nold\n{guided.END}\nafter\n")
    monkeypatch.setattr(guided, "COUNTS", tmp_path / "counts.json")
    monkeypatch.setattr(guided, "PAGE", page)
    guided.write("bvh", 90.0, 1000, 0, True)
    guided.write("bvh", 30.0, 500, 1, False)
    guided.write("shot", 6.0, 7, 0, True)
    text = page.read_text()
    assert text.startswith("before") and text.endswith("after\n") and "old" not in text
    assert "| bvh | 2.0 | 1.5 | 1,500 | 1 |" in text and "| shot | 0.1 | 0.1 | 7 | 0 |" in text


def test_runs_that_end_together_all_count(tmp_path, monkeypatch):
    page = tmp_path / "page.md"
    page.write_text(f"{guided.BEGIN}\n{guided.END}\n")
    monkeypatch.setattr(guided, "COUNTS", tmp_path / "counts.json")
    monkeypatch.setattr(guided, "PAGE", page)
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda _: guided.write("bvh", 1.0, 10, 0, True), range(40)))
    assert json.loads(guided.COUNTS.read_text())["bvh"]["inputs"] == 400
