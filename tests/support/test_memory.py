"""Memory that is left: the least of what machine, container and process allow."""

import math
import platform
import subprocess
import sys

import pytest
from calmotion.support import memory


@pytest.mark.posix
def test_memory_of_the_machine_is_read():
    assert 1e6 < memory.available_memory() < 1e15 or memory.available_memory() == math.inf
    assert memory.peak_memory() > 0.01


def test_a_container_limits_it(tmp_path, monkeypatch):
    (tmp_path / "max").write_text("3000000\n")
    (tmp_path / "current").write_text("1000000\n")
    monkeypatch.setattr(memory, "_GROUPS", ((str(tmp_path / "max"), str(tmp_path / "current")),))
    assert memory.available_memory() == 2e6
    (tmp_path / "max").write_text("max\n")
    assert memory.available_memory() > 2e6


@pytest.mark.posix
def test_a_limit_of_the_address_space_counts():
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30));"
        "from calmotion.support.memory import available_memory; print(available_memory())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert 0 < float(done.stdout) < 2**30


@pytest.mark.posix
def test_what_does_not_fit_into_the_limit_of_the_address_space_is_refused():
    code = """
import resource; resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))
from calmotion.errors import ShotError, failure_of_machine
from calmotion.support import memory
memory.require_address_space(1e8, "a stage")
assert not memory.was_short() and memory.address_limit() == 2**30
try:
    memory.require_address_space(2e9, "a stage")
except ShotError as error:
    print(error)
kept = bytearray(int(2**30 - memory._status("VmSize") - 5e7))
del kept
assert memory.was_short()
print(failure_of_machine(TypeError("'frame' object is not callable"), memory.was_short()).problem)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    refusal, failure = done.stdout.splitlines()
    assert "a stage takes 2.00 GB" in refusal and "limit of 1.07 GB" in refusal and "ulimit -v" in refusal
    assert failure == "there is not enough memory"


def test_without_a_limit_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "address_limit", lambda: math.inf)
    memory.require_address_space(1e18, "a stage")
    assert not memory.was_short()


FREED = """
import numpy as np
from calmotion.support.operating_system import return_freed_memory
np.ones(5_000_000), np.ones(3_000_000)
many = [np.ones(1_500_000) for _ in range(40)]
kept = many[::8]
del many
{called}
with open("/proc/self/statm") as file:
    print(4096 * int(file.read().split()[1]))
"""


@pytest.mark.posix
@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of the memory of glibc")
def test_freed_arrays_between_others_go_back_to_the_system():
    """Five arrays of 12 MB of forty are left, which lie between the others."""

    def resident(called):
        program = [sys.executable, "-c", FREED.format(called=called)]
        return int(subprocess.run(program, capture_output=True, text=True, check=True).stdout)

    assert resident("return_freed_memory()") < resident("") - 200e6
