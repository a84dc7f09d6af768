"""Damaged files of compiled kernels are thrown away, and the kernels compiled again."""

import os
import subprocess
import sys

import pytest

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
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        value, hits = done.stdout.split()
        assert float(value) == 3.0
        return int(hits), done.stderr

    return run


def test_damaged_files_are_made_again_with_one_line_each(run, tmp_path):
    assert run() == (0, "") and run() == (1, "")
    files = sorted((tmp_path / "cache").rglob("*.nb?"))
    assert [path.suffix for path in files] == [".nbc", ".nbi"]
    for path in files:
        whole = path.read_bytes()
        for damaged in (b"", whole[: len(whole) // 2], whole[:40] + bytes([whole[40] ^ 0xFF]) + whole[41:]):
            path.write_bytes(damaged)
            hits, said = run()
            assert hits == 0 and str(path) in said and len(said.splitlines()) == 1
            assert run() == (1, "")


def test_a_missing_data_file_is_made_again(run, tmp_path):
    run()
    next((tmp_path / "cache").rglob("*.nbc")).unlink()
    assert run() == (0, "") and run() == (1, "")
