"""The command `bench`: each benchmark takes its own arguments, and has help that fits a terminal."""

import sys

import pytest
from calmotion_plugins.benchmarks.command import BENCHMARKS


def test_benchmarks_take_their_own_arguments(calmotion_process):
    done = calmotion_process("bench", "stability", "--only", "no map")
    assert done.returncode == 0 and "0 cells run" in done.stdout, done.stderr


def test_a_benchmark_that_is_none_is_refused(calmotion):
    done = calmotion("bench", "nothing")
    assert done.returncode == 2 and "nothing" in done.stderr


def test_the_help_names_all_in_lines_of_eighty_columns(calmotion, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    done = calmotion("bench", "--help")
    assert done.returncode == 0 and max(map(len, done.stdout.splitlines())) <= 80
    assert all(f"\n  {name} " in done.stdout for name in BENCHMARKS)


@pytest.mark.parametrize("name", BENCHMARKS)
def test_the_help_of_each_fits_a_terminal_of_eighty_columns(name, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    with pytest.raises(SystemExit):
        pytest.importorskip(f"calmotion_plugins.benchmarks.{BENCHMARKS[name]}").main(["--help"])
    printed = capsys.readouterr().out
    assert f"calmotion bench {name}" in printed and max(map(len, printed.splitlines())) <= 80


def test_a_benchmark_of_a_plugin_that_is_deleted_tells_that_it_needs_it(calmotion, monkeypatch):
    monkeypatch.setitem(sys.modules, "calmotion_plugins.calibration", None)
    for name in ("accuracy.calibration", "scenes.recorded_arm"):
        monkeypatch.delitem(sys.modules, f"calmotion_plugins.benchmarks.{name}", raising=False)
    done = calmotion("bench", "calibration")
    assert done.returncode == 2 and "the benchmark calibration needs the plugin calibration" in done.stderr
