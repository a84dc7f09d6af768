"""Damaged files of compiled kernels are thrown away, and the kernels compiled again."""

import os
import pickle
import subprocess
import sys

import pytest
from calmotion.support.kernel_cache import KernelCacheFile

MODULE = """
import numpy as np
from calmotion.support.compilation import kernel

@kernel
def doubled(x):
    return 2.0 * x

print(doubled(np.float64(1.5)), sum(doubled.stats.cache_hits.values()))
"""


@pytest.fixture
def run(tmp_path, repository):
    (tmp_path / "module.py").write_text(MODULE)
    environment = os.environ | {"CALMOTION_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(repository / "pipeline")}
    environment.pop("NUMBA_CACHE_DIR", None)

    def run():
        command = [sys.executable, str(tmp_path / "module.py")]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr
        value, hits = done.stdout.split()
        assert float(value) == 3.0
        return int(hits), done.stderr

    return run


def test_a_damaged_cache_is_made_again_with_one_line_for_each_file(run, tmp_path):
    assert run() == (0, "") and run() == (1, "")
    files = sorted((tmp_path / "cache").rglob("*.nb?"))
    assert [path.suffix for path in files] == [".nbc", ".nbi"]
    for path in files:
        path.write_bytes(path.read_bytes()[:-1])
        hits, said = run()
        assert hits == 0 and str(path) in said and len(said.splitlines()) == 1
    files[0].unlink()
    assert run() == (0, "") and run() == (1, "")


def cache_file(folder, name, stamp=(1.0, 2)):
    return KernelCacheFile(folder, "module", name, stamp, pickle.dumps, bool)


@pytest.fixture
def make(tmp_path):
    return lambda stamp=(1.0, 2): cache_file(tmp_path, "name", stamp)


def test_data_come_back_for_their_key_and_their_source(make):
    make().save("key", {"code": b"machine code"})
    make().save("other", [1, 2])
    assert make().load("key") == {"code": b"machine code"} and make().load("other") == [1, 2]
    assert make().load("third") is None and make((1.0, 3)).load("key") is None
    make().flush()
    assert make().load("key") is None


@pytest.mark.parametrize("name", ["name.nbi", "name.1.nbc"])
def test_any_damage_to_any_file_is_seen(make, tmp_path, caplog, name):
    make().save("key", list(range(100)))
    whole = (tmp_path / name).read_bytes()
    damaged = [b"", whole[:10], whole + b"x", b"x" * len(whole)]
    damaged += [whole[:at] + bytes([whole[at] ^ 0xFF]) + whole[at + 1 :] for at in range(0, len(whole), 7)]
    for content in damaged:
        (tmp_path / name).write_bytes(content)
        caplog.clear()
        assert make().load("key") is None
        assert len(caplog.messages) == 1
        make().save("key", list(range(100)))
        assert make().load("key") == list(range(100))


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path):
    (tmp_path / "file").write_text("")
    cache = cache_file(tmp_path / "file" / "folder", "name")
    cache.flush()
    cache.save("key", 1)
    assert cache.load("key") is None


def test_a_kernel_in_the_place_of_another_one_is_compiled_again(tmp_path, run):
    source = MODULE.replace("\nprint", "\n@kernel\ndef tripled(x, y):\n    return 3.0 * x[0] + y[1]\n\nprint")
    source += "print(tripled(np.ones(1), np.ones(2)), file=sys.stderr)\n"
    (tmp_path / "module.py").write_text("import sys\n" + source)
    assert run() == (0, "4.0\n") and run() == (1, "4.0\n")
    doubled, tripled = sorted((tmp_path / "cache").rglob("*.nbc"))
    doubled.write_bytes(tripled.read_bytes())
    hits, said = run()
    assert hits == 0 and str(doubled) in said and said.endswith("4.0\n")
    assert run() == (1, "4.0\n")


def test_processes_that_save_at_once_lose_nothing(make, tmp_path):
    code = (
        "import sys\n"
        "import pathlib, pickle\n"
        "from calmotion.support.kernel_cache import KernelCacheFile\n"
        "for number in range(20):\n"
        f"    file = KernelCacheFile(pathlib.Path({str(tmp_path)!r}), 'module', 'name', (1.0, 2), pickle.dumps, bool)\n"
        "    file.save((sys.argv[1], number), [sys.argv[1], number])\n"
    )
    started = [subprocess.Popen([sys.executable, "-c", code, name]) for name in ("one", "two", "three")]
    assert [process.wait(600) for process in started] == [0, 0, 0]
    found = make()
    for name in ("one", "two", "three"):
        for number in range(20):
            assert found.load((name, number)) == [name, number]
