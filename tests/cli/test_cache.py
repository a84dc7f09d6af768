"""`calmotion cache`."""

import argparse
import json
import re

import numpy as np
import pytest
from calmotion.cli.commands.cache import size
from calmotion.cli.main import main
from calmotion.support.caching.caches import store_arrays


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("CALMOTION_CACHE", str(tmp_path))
    for key in "ab":
        store_arrays("meshes", key, {"a": np.zeros(1000)})
    return tmp_path


def test_info_lists_each_cache(folder, capsys):
    assert main(["cache", "info", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["folder"] == str(folder)
    caches = {cache["name"]: cache for cache in told["caches"]}
    assert set(caches) == {"kernels", "meshes", "reductions"}
    assert caches["meshes"]["entries"] == 2 and 16000 < caches["meshes"]["size_bytes"] < 18000
    assert main(["cache", "info"]) == 0
    text = capsys.readouterr().out
    assert re.search(r"tetrahedral meshes +meshes +2 +16\.\d kB +1\.0 GB", text) and str(folder) in text


def test_prune_and_clear_remove_what_they_say(folder, capsys):
    assert main(["cache", "prune", "reductions", "--size", "0B"]) == 0
    assert re.search(r"reductions +0 +0 bytes", capsys.readouterr().out)
    assert main(["cache", "prune", "--size", "10kB"]) == 0
    assert re.search(r"meshes +1 +8\.\d kB", capsys.readouterr().out)
    assert main(["cache", "clear", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [row["removed"] for row in told["caches"]] == [0, 1, 0]
    assert list((folder / "meshes").iterdir()) == []


@pytest.mark.parametrize("wrong", ["5", "MB", "-1MB", "nanMB", "1e99GB", "5 miles"])
def test_a_size_needs_a_unit(wrong):
    with pytest.raises(argparse.ArgumentTypeError, match="such as 500MB"):
        size(wrong)


def test_sizes_are_read():
    assert [size(text) for text in ("0B", "5kB", "1.5 MB", "2gb")] == [0, 5000, 1500000, 2 * 10**9]
