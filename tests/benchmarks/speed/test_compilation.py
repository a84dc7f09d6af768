"""The time and the number of kernels that a first run compiles."""

import subprocess
import sys

import pytest
from calmotion.benchmarks.speed import compilation
from calmotion.benchmarks.speed.compilation import Compilation, main, measure

MODULE = """
from calmotion.support.compilation import kernel

@kernel
def doubled(x):
    return 2.0 * x

@kernel
def squared(x):
    return doubled(x) * x

assert squared(3.0) == 18.0
"""


def test_compiled_functions_are_counted(tmp_path):
    (tmp_path / "module.py").write_text(MODULE)
    assert measure([sys.executable, str(tmp_path / "module.py")]).kernels == 2


def test_the_time_of_compiling_is_that_of_a_run_with_it_less_that_of_a_run_without(monkeypatch):
    seconds = [(9.0, 8.0), (6.0, 5.5), (2.0, 1.0)]
    monkeypatch.setattr(compilation, "_run", lambda command: seconds.pop(0))
    assert measure(["command"]) == Compilation(0, first_s=9.0, compile_s=4.0, compile_cpu_s=4.5, warm_s=2.0)


def test_a_command_that_fails_ends_the_measurement(capfd):
    with pytest.raises(subprocess.CalledProcessError):
        measure([sys.executable, "-c", "raise SystemExit(3)"])
    assert main(["no_such_shot.usda"]) == 1
    assert "no_such_shot.usda" in capfd.readouterr().err
