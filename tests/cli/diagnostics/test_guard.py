"""Under a limit of the address space, native code that dies or hangs is told as an error."""

import json
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="address spaces are limited on Linux")

START = """
import os, resource, signal, sys, time
from calmotion.cli.diagnostics import guard
resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))
guard._HANG = 0.3
ended = guard.guarded({arguments})
if ended is not None:
    sys.exit(ended)
"""
HANG = """
import ctypes
room = {limit} - int(open("/proc/self/statm").read().split()[0]) * 4096
library = ctypes.CDLL(None)
library.malloc.restype, library.malloc.argtypes = ctypes.c_void_p, [ctypes.c_size_t]
kept = library.malloc(room - 20_000_000)
ask = library.read
nowhere = os.open("/dev/zero", os.O_RDONLY)
piece = ctypes.create_string_buffer(4_000_000)
while True:  # in the system most of the time, as a library that asks for memory
    ask(nowhere, piece, 4_000_000)
"""


def start(code, limit=2_000_000_000, arguments=("optimize", "--json")):
    text = START.format(limit=limit, arguments=list(arguments)) + code.replace("{limit}", str(limit))
    return subprocess.Popen([sys.executable, "-c", text], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ended(code, **options):
    process = start(code, **options)
    out, err = process.communicate(timeout=600)
    return process.returncode, out, err


@pytest.mark.parametrize("number", ["SIGSEGV", "SIGABRT"])
def test_a_crash_in_native_code_is_an_error_with_a_remedy(number):
    status, out, err = ended(f"os.kill(os.getpid(), signal.{number})")
    error = json.loads(out)["error"]
    assert status == 1 and not err
    assert "not enough memory" in error["problem"] and number in error["found"] and "2.00 GB" in error["found"]
    assert "ulimit -v" in error["remedy"]


def test_a_library_that_asks_for_memory_for_ever_is_ended():
    status, out, _ = ended(HANG)
    assert status == 1 and "for ever" in json.loads(out)["error"]["found"]


@pytest.mark.parametrize("code", ["sys.exit(0)", "sys.exit(3)"])
def test_another_end_is_that_of_the_program(code):
    assert ended(code) == (int(code[-2]), "", "")


def test_a_signal_that_ends_the_program_ends_the_guard():
    assert ended("os.kill(os.getpid(), signal.SIGKILL)")[0] == -signal.SIGKILL


def test_signals_reach_the_program_once():
    code = """
got = []
signal.signal(signal.SIGTERM, lambda number, frame: got.append(number))
print("ready", flush=True)
while not got:
    time.sleep(0.01)
time.sleep(0.2)
sys.exit(10 + len(got))
"""
    process = start(code)
    assert process.stdout.readline() == "ready\n"
    process.terminate()
    process.communicate(timeout=600)
    assert process.returncode == 11


def test_the_program_ends_with_its_guard():
    process = start("print(os.getpid(), flush=True)\ntime.sleep(600)")
    child = int(process.stdout.readline())
    process.kill()
    process.communicate(timeout=600)
    for _ in range(10_000):
        try:
            state = open(f"/proc/{child}/stat").read().rpartition(")")[2].split()[0]
        except FileNotFoundError:
            return
        if state == "Z":  # nobody awaits it here
            return
        time.sleep(0.05)
    raise AssertionError(f"the program outlives its guard: {state}")


def test_libraries_that_do_not_fit_are_refused_before_they_are_loaded():
    status, out, _ = ended("print('went on')", limit=500_000_000)
    assert status == 1 and "libraries" in json.loads(out)["error"]["problem"]
    for light in (("motors",), ("optimize", "--help")):
        assert ended("print('went on')", limit=500_000_000, arguments=light)[:2] == (0, "went on\n")


def test_without_a_limit_nothing_is_forked():
    code = "from calmotion.cli.diagnostics.guard import guarded; print(guarded(['optimize']))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "None\n"
