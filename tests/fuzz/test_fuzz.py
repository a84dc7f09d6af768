"""Random damage ends in a ShotError or is read: never in another exception, nor in numbers that are none.

A few hundred seeds run with the other tests; `make fuzz` runs for ten minutes (CALMOTION_FUZZ, in seconds).
"""

from __future__ import annotations

import itertools
import os
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from calmotion import ShotError
from calmotion.host import PluginError, SettingError
from calmotion.host.manifest import check_requirements, read_manifest
from calmotion.host.settings import read_assignment, read_settings_file
from calmotion.usd.reading import read_shot
from calmotion.usd.validation import validate_shot

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "helpers" / "usd"))

import mutations  # noqa: E402
import posed_shots  # noqa: E402
import small_shots  # noqa: E402

SECONDS = float(os.environ.get("CALMOTION_FUZZ", "0"))
FIRST = int(os.environ.get("CALMOTION_FUZZ_SEED", "0"))


def flexible(stage) -> None:
    small_shots.make_flexible(stage)
    small_shots.make_target(stage)


SHOTS: dict[str, Callable | None] = {
    "drives": None, "flexible": flexible, "posed": posed_shots.posed, "skeletal": posed_shots.skeletal,
}  # fmt: skip


def seeds(count: int, share: float) -> Iterator[int]:
    """Seeds for the default run, or for a share of the time that is given."""
    if not SECONDS:
        yield from range(FIRST, FIRST + count)
        return
    end = time.monotonic() + share * SECONDS
    yield from itertools.takewhile(lambda _: time.monotonic() < end, itertools.count(FIRST))


@pytest.fixture(scope="module")
def texts(tmp_path_factory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("shots")
    return {name: small_shots.write_arm(folder / f"{name}.usda", edit).read_text() for name, edit in SHOTS.items()}


def check_reading(path: Path, about: str) -> bool:
    """Whether a shot is read; anything but a ShotError fails the test."""
    try:
        character, animation, _ = read_shot(str(path))
    except ShotError as error:
        assert error.problem, about
        return False
    except Exception as error:
        raise AssertionError(f"{about}: {type(error).__name__}: {error}\n{path.read_text()[:2000]}") from error
    numbers = [animation.frame_times, character.gravity, *(t.values for t in (*animation.tracks, *animation.current))]
    numbers += [t.times for t in animation.tracks] + [j.frame0.position for j in character.joints]
    numbers += [b.mass.inertia for b in character.bodies if b.mass] + [b.rest.position for b in character.bodies]
    assert all(np.all(np.isfinite(values)) for values in numbers), about
    assert all(body.mass is None or body.mass.mass > 0.0 for body in character.bodies), about
    assert len(character.motors) == len(animation.tracks) and len(animation.frame_times) >= 1, about
    assert all(np.all(np.diff(track.times) > 0.0) for track in animation.tracks), about
    return True


@pytest.mark.parametrize("name", SHOTS)
def test_a_damaged_shot_is_read_or_refused(texts, tmp_path, name):
    read = 0
    for seed in seeds(120, 0.2):
        text, edits = mutations.damaged(texts[name], seed)
        path = tmp_path / f"{seed}.usda"
        path.write_text(text)
        read += check_reading(path, f"seed {seed} of {name}: {edits}")
        path.unlink()
    assert read > 0, "some damage is harmless"


def test_a_scrambled_file_is_read_or_refused(texts, tmp_path):
    names = list(texts)
    for seed in seeds(120, 0.1):
        path = tmp_path / f"{seed}.usda"
        path.write_text(mutations.scrambled(texts[names[seed % len(names)]], seed))
        check_reading(path, f"seed {seed}, scrambled")
        path.unlink()


def test_the_check_of_a_damaged_shot_lists_and_never_raises(texts, tmp_path):
    for seed in seeds(25, 0.05):
        path = tmp_path / f"{seed}.usda"
        path.write_text(mutations.damaged(texts["flexible"], seed)[0])
        assert all(finding.problem and finding.rule for finding in validate_shot(str(path)).items), seed
        path.unlink()


MANIFEST = """\
id = "anvil"
version = "0.1.0"
name = "Anvil"
tagline = "Hits"
maintainer = "Smith"
license = "MIT"
tags = ["iron", "heat"]
calmotion = ">=0.1"
requires = ["numpy>=2", "scipy ; python_version < '3'"]
"""


def test_a_damaged_manifest_is_read_or_refused(tmp_path):
    folder = tmp_path / "anvil"
    folder.mkdir()
    for seed in seeds(400, 0.03):
        text = mutations.scrambled(MANIFEST, seed)
        (folder / "plugin.toml").write_bytes(text.encode("utf-8" if seed % 3 else "utf-16"))
        try:
            check_requirements(read_manifest(folder), "0.1.0")
        except PluginError as error:
            assert error.problem, seed


def test_a_damaged_setting_is_read_or_refused(tmp_path):
    file = tmp_path / "settings.toml"
    for seed in seeds(300, 0.02):
        file.write_text(mutations.scrambled('[fe.mesh]\nelement_size = "5mm"\n[usd.write]\nbake = "motors"\n', seed))
        for read, given in ((read_settings_file, file), (read_assignment, mutations.scrambled("a.b=5mm", seed))):
            try:
                read(given)
            except SettingError as error:
                assert error.problem, seed


def test_the_same_seed_does_the_same_damage(texts):
    assert mutations.damaged(texts["drives"], 7) == mutations.damaged(texts["drives"], 7)
