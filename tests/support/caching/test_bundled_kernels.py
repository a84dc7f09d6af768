"""Kernels of a platform wheel are taken where the processor has what they were compiled for, if they are whole."""

import pickle

import numba
import pytest
from calmotion.support.caching.bundled_kernels import BundledKernels, export, name_of, runs_on
from calmotion.support.caching.verified_files import read_verified, sealed
from calmotion.support.kernel_cache import _FOR_KERNELS, KernelCacheFile

TRIPLE = "x86_64-unknown-linux-gnu"
BASELINE = (TRIPLE, "x86-64-v3", "+avx2,+fma")
NEWER, OLDER = (TRIPLE, "znver5", "+avx2,+avx512f,+fma,-sha"), (TRIPLE, "penryn", "+sse4.1,-avx2,-fma")


@pytest.mark.parametrize(
    ("built_for", "processor", "expected"),
    [
        (BASELINE, BASELINE, True), (BASELINE, NEWER, True), (BASELINE, OLDER, False), (NEWER, BASELINE, False),
        (BASELINE, ("aarch64-apple-darwin", "m1", "+avx2,+fma"), False), ((TRIPLE, "znver5", ""), NEWER, False),
    ],
)  # fmt: skip
def test_code_runs_where_all_its_features_are(built_for, processor, expected):
    assert runs_on(built_for, processor) is expected


@pytest.fixture
def bundle(tmp_path):
    """A function in two forms, with and without an entrance for Python, as a wheel has them."""
    key, hashes = ("float64",), ("a", "b")
    index = {(key, BASELINE, hashes): "name.1.nbc", (((key, BASELINE, hashes)), _FOR_KERNELS): "name.2.nbc"}
    contents = {"name.nbi": (numba.__version__, "stamp", index), "name.1.nbc": "with", "name.2.nbc": "without"}
    for name, content in contents.items():
        (tmp_path / name).write_bytes(sealed(pickle.dumps(content), name_of(tmp_path / name)))
    return BundledKernels(tmp_path, "name"), lambda processor: (key, processor, hashes)


def test_a_function_is_found_for_its_types_its_source_and_a_processor_with_the_features(bundle):
    kernels, key_on = bundle
    assert kernels.load(key_on(NEWER)) == "with" and kernels.load(key_on(NEWER), _FOR_KERNELS) == "without"
    assert kernels.load(key_on(OLDER)) is None
    assert (
        kernels.load((("int64",), NEWER, ("a", "b"))) is None
        and kernels.load((("float64",), NEWER, ("a", "c"))) is None
    )


def test_damage_and_other_versions_of_numba_are_no_error(bundle, tmp_path, monkeypatch):
    kernels, key_on = bundle
    (tmp_path / "name.1.nbc").write_bytes(b"damaged")
    assert kernels.load(key_on(NEWER)) is None and (tmp_path / "name.1.nbc").exists()
    monkeypatch.setattr(numba, "__version__", "0.0.0")
    assert BundledKernels(tmp_path, "name").load(key_on(NEWER), _FOR_KERNELS) is None
    assert BundledKernels(tmp_path / "nowhere", "name").load(key_on(NEWER)) is None


def test_the_cache_of_the_user_comes_first(bundle, tmp_path):
    _, key_on = bundle
    kernels = tmp_path / "bundled" / "key" / "calmotion.room"
    kernels.mkdir(parents=True)
    for path in tmp_path.glob("name.*"):
        place = kernels / path.name
        place.write_bytes(sealed(read_verified(path, name_of(path)), name_of(place)))
    called_by_kernel: list[bool] = []
    place, module = tmp_path / "key" / "numba's name", "calmotion.room.module"
    cache = KernelCacheFile(
        place, module, "name", "stamp", pickle.dumps, lambda: bool(called_by_kernel), tmp_path / "bundled"
    )
    assert cache.load(key_on(NEWER)) == "with" and cache.load(key_on(OLDER)) is None
    called_by_kernel.append(True)
    assert cache.load(key_on(NEWER)) == "with", "what has an entrance does as well"
    (kernels / "name.1.nbc").unlink()
    assert cache.load(key_on(NEWER)) == "without"
    called_by_kernel.clear()
    cache.save(key_on(NEWER), "own")
    assert cache.load(key_on(NEWER)) == "own" and (tmp_path / "key" / "calmotion.room" / "name.nbi").exists()


def test_exported_kernels_do_not_depend_on_the_user(tmp_path):
    for package in ("calmotion.room", "others"):
        path = tmp_path / "key" / package / "name.1.nbc"
        path.parent.mkdir(parents=True)
        path.write_bytes(sealed(b"code", name_of(path)))
    assert export(tmp_path / "key", tmp_path / "kernels") == 1
    exported = tmp_path / "kernels" / "key" / "calmotion.room" / "name.1.nbc"
    assert read_verified(exported, "key/calmotion.room/name.1.nbc") == b"code"
