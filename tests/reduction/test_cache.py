"""Reduced bodies on disk."""

import os
import subprocess
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest
from calmotion.model import ElasticMaterial, FlexibleSettings, Simplification
from calmotion.reduction import cache as reduction_cache
from calmotion.reduction.cache import cache_key, cached_reduction, known_reduction, recomputed, store_reduction
from calmotion.reduction.reduced_body import Elasticity, Invariants, Marker, ReducedBody


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    return tmp_path / "reductions"


def a_body(seed=0, nonlinear=True):
    rng = np.random.default_rng(seed)
    invariants = Invariants(
        0.1 + rng.random(), *(rng.normal(size=s) for s in ((3,), (3, 3), (2, 2), (2, 3), (2, 3, 3), (2, 2, 3, 3)))
    )
    markers = tuple(
        Marker(rng.normal(size=3), rng.normal(size=4), rng.normal(size=(3, 2)), rng.normal(size=(3, 2)))
        for _ in range(2)
    )
    elasticity = Elasticity("neohookean", 1e-5, rng.normal(size=40), 3, (1e9, 1 / 3)) if nonlinear else None
    skin = (np.asfortranarray(rng.normal(size=(7, 3, 2))), np.zeros((0, 3, 2)))
    left_out = (Simplification("modes", "too fast", 1e-5),)
    return ReducedBody(invariants, rng.random(2), rng.random(2), markers, skin, 123, 45, elasticity, left_out)


def same(a, b):
    """Equal to the last bit, types included."""
    if isinstance(a, np.ndarray):
        return isinstance(b, np.ndarray) and a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and all(same(getattr(a, f), getattr(b, f)) for f in a.__dataclass_fields__)
    return type(a) is type(b) and a == b


def never():
    raise AssertionError("it was to come from the cache")


@pytest.mark.parametrize("nonlinear", [True, False])
def test_a_body_comes_back_to_the_last_bit(nonlinear):
    body = a_body(nonlinear=nonlinear)
    assert cached_reduction(("a", 1), lambda: body) is body
    again = cached_reduction(("a", 1), never)
    assert again is not body and same(body, again)
    assert again.skin[0].flags.f_contiguous and again.invariants.M.flags.writeable


def test_what_is_measured_is_computed_again():
    assert cached_reduction("key", lambda: 1.0) == 1.0
    with recomputed():
        assert cached_reduction("key", lambda: 2.0) == 2.0
    assert cached_reduction("key", never) == 2.0


def test_values_that_json_does_not_know_come_back():
    value = (np.inf, -np.inf, None, True, "αβ", (), np.float64(0.1), np.int32(7), 2**60)
    cached_reduction("values", lambda: value)
    assert cached_reduction("values", never) == (np.inf, -np.inf, None, True, "αβ", (), 0.1, 7, 2**60)


def test_any_part_of_a_key_changes_it(monkeypatch):
    material = ElasticMaterial("/M", 1e9, 0.3, 1000.0)
    settings = FlexibleSettings(material)
    points = np.arange(12.0).reshape(4, 3)
    variants = [
        (points, settings),
        (points.reshape(3, 4), settings),
        (points.astype(np.float32), settings),
        (points + 1e-15 * (points == 0), settings),
        (points, replace(settings, mode_count=3)),
        (points, replace(settings, material=replace(material, youngs_modulus=np.nextafter(1e9, 2e9)))),
        (points, replace(settings, material=replace(material, rayleigh=(1.0, 2.0)))),
        (points, settings, None),
        (points, settings, ()),
        (points, settings, ("a", "bc")),
        (points, settings, ("ab", "c")),
        (points, settings, 1),
        (points, settings, 1.0),
        (points, settings, True),
        (points, settings, "1"),
    ]
    keys = [cache_key(variant) for variant in variants]
    assert len(set(keys)) == len(keys)
    assert keys == [cache_key(variant) for variant in variants]
    monkeypatch.setattr(reduction_cache, "FORMAT", reduction_cache.FORMAT + 1)
    assert cache_key(variants[0]) not in keys
    monkeypatch.undo()
    monkeypatch.setattr(reduction_cache, "_sources", lambda: "other sources")
    assert cache_key(variants[0]) not in keys


def test_key_follows_the_memory_layout_of_nothing():
    points = np.arange(12.0).reshape(4, 3)
    assert cache_key(points) == cache_key(np.asfortranarray(points)) == cache_key(np.repeat(points, 2, axis=0)[::2])


def test_what_cannot_be_kept_is_named():
    @dataclass(frozen=True)
    class Stranger:
        x: float

    with pytest.raises(TypeError, match="Stranger"):
        cached_reduction("stranger", lambda: Stranger(1.0))
    with pytest.raises(TypeError, match="function"):
        cache_key((1, never))
    with pytest.raises(TypeError, match="objects"):
        cache_key(np.array([None]))


def test_a_file_with_a_changed_byte_is_computed_again_with_a_notice(folder, caplog):
    body = a_body()
    cached_reduction("flipped", lambda: body)
    (path,) = folder.glob("*.npz")
    whole = path.read_bytes()
    places = range(0, len(whole), 97)
    calls = []
    for at in places:
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 0x55]) + whole[at + 1 :])
        assert same(cached_reduction("flipped", lambda: calls.append(1) or body), body)
    assert len(calls) == len(places) == len(caplog.messages)
    assert str(path) in caplog.messages[0] and "made again" in caplog.messages[0]


def test_a_file_never_makes_objects_of_other_types(folder, monkeypatch):
    cached_reduction("typed", lambda: a_body())
    monkeypatch.setattr(reduction_cache, "TYPES", {})
    with pytest.raises(TypeError):  # neither read nor written
        cached_reduction("typed", a_body)


def test_a_folder_that_cannot_be_written_is_skipped(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("CALMOTION_CACHE", str(blocked))
    body = a_body()
    assert cached_reduction("x", lambda: body) is body


WORKER = """
import contextlib
import sys
import numpy as np
from calmotion.reduction.cache import cached_reduction
made = 0
for turn in range(40):
    key = turn % 4
    def compute():
        global made
        made += 1
        return tuple(np.full(20000, 10.0 * key + k) for k in range(3))
    value = cached_reduction(("shared", key), compute)
    assert all((value[k] == 10.0 * key + k).all() for k in range(3)), key
    if turn % 7 == int(sys.argv[1]):
        # somebody is stopped in the middle of a write, by a way that leaves half a file
        from calmotion.support.caching.cache_folder import REDUCTIONS, cache_folder
        from calmotion.reduction.cache import cache_key
        path = cache_folder() / REDUCTIONS / (cache_key(("shared", key)) + ".npz")
        with contextlib.suppress(FileNotFoundError):  # another process has removed half a file
            path.with_suffix(".half" + sys.argv[1]).write_bytes(path.read_bytes()[:1000])
            path.with_suffix(".half" + sys.argv[1]).replace(path)
print(made)
"""


def test_several_processes_at_once_never_see_half_a_file(folder, repository):
    environment = os.environ | {
        "PYTHONPATH": str(repository / "pipeline"), "CALMOTION_CACHE": str(folder.parent), "OPENBLAS_NUM_THREADS": "1",
    }  # fmt: skip
    running = [
        subprocess.Popen(
            [sys.executable, "-c", WORKER, str(k)],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for k in range(4)
    ]
    results = [(process.communicate(timeout=600), process.returncode) for process in running]
    for (out, err), code in results:
        assert code == 0, err
        assert int(out) < 40
    assert not list(folder.glob(".calmotion-*"))


def test_a_value_that_is_stored_takes_the_place_of_the_one_before():
    for value in (1.0, 2.0):
        store_reduction(("a body", 1), value)
        assert known_reduction(("a body", 1)) == value
