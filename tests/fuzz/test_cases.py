"""Damaged input ends in an error for users or is read: never in another exception, nor in numbers that are none.

Every target reads its seeds, damaged ones and what fuzzing has found; `make fuzz` goes on for ten minutes a target.
"""

import random
import sys
from pathlib import Path

import pytest
from calmotion.usd.validation import validate_shot

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

import targets  # noqa: E402

FOUND = sorted(path for path in (HERE / "cases").rglob("*") if path.is_file())


@pytest.mark.parametrize("path", FOUND, ids=lambda path: f"{path.parent.name}-{path.name}")
def test_a_found_case_is_read_or_refused(path):
    targets.TARGETS[path.parent.name](path.read_bytes())


@pytest.mark.parametrize("name", targets.TARGETS)
def test_seeds_and_damaged_seeds_are_read_or_refused(name):
    rng = random.Random(0)
    for seed in targets.SEEDS[name]:
        targets.TARGETS[name](seed)
        for _ in range({"shot": 6, "splines": 6, "manifests": 400, "settings": 300}.get(name, 30)):
            targets.TARGETS[name](targets.mutated(seed, rng))


@pytest.mark.parametrize("name", targets.SHOTS)
def test_a_damaged_shot_is_read_or_refused_and_its_check_lists_why(name):
    read = 0
    for seed in range(60):
        file = targets.edited_shot(name, random.Random(seed))
        read += targets.is_read(file)
        if seed < 6:
            assert all(finding.problem and finding.rule for finding in validate_shot(str(file)).items), seed
    assert read > 0, "some damage is harmless"


def test_a_shot_of_scrambled_text_is_read_or_refused(tmp_path):
    for seed in range(60):
        rng = random.Random(seed)
        path = tmp_path / f"{seed}.usda"
        path.write_bytes(targets.mutated(targets.shot_text(rng.choice(targets.SHOTS)).encode(), rng))
        targets.is_read(path)


def test_seeds_of_recordings_are_recordings(monkeypatch):
    """Random damage to what is refused anyway would find little."""
    pytest.importorskip("mcap_ros2")
    found = []
    for module, name in (("tables", "read_table"), ("bags", "read_bag")):
        module = targets._plugin("recording_readers", module)
        read = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given, read=read: found.append(read(*given)) or found[-1])
    for seed in targets.SEEDS["recordings"]:
        targets.recordings(seed)
    assert [len(recording.channels) for recording in found] == [2, 1, 2]


def test_bytes_drive_random_choices():
    rng = targets.Bytes(b"\x05\x00\xff\xff")
    assert rng.getrandbits(8) == 5 and rng.getrandbits(8) == 0 and rng.random() > 0.999 and rng.random() == 0.0
