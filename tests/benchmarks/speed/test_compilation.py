"""The time and the number of kernels that a first run compiles."""

import subprocess
import sys

import pytest
from calmotion.benchmarks.speed.compilation import main, measure

# Two small kernels compile within the noise of starting Python: a run that compiles them works for a second more.
MODULE = """
import time
from calmotion.support.compilation import kernel

@kernel
def doubled(x):
    return 2.0 * x

@kernel
def squared(x):
    return doubled(x) * x

assert squared(3.0) == 18.0
end = time.process_time() + 1.0
while squared.stats.cache_misses and time.process_time() < end:
    pass
"""


def test_compiled_functions_are_counted_and_their_time_is_that_of_the_run_without_them(tmp_path):
    (tmp_path / "module.py").write_text(MODULE)
    result = measure([sys.executable, str(tmp_path / "module.py")])
    assert result.kernels == 2
    assert result.compile_cpu_s > 0.0 and result.warm_s > 0.0 and result.first_s > 0.0


def test_a_command_that_fails_ends_the_measurement(capfd):
    with pytest.raises(subprocess.CalledProcessError):
        measure([sys.executable, "-c", "raise SystemExit(3)"])
    assert main(["no_such_shot.usda"]) == 1
    assert "no_such_shot.usda" in capfd.readouterr().err
