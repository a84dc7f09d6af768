"""A process in which the converters are loaded: each conversion is a fork of it, which spares their imports."""

import json
import os
import subprocess
from types import SimpleNamespace

import pytest

LOADED = """
import json, os, runpy, sys, traceback
import mujoco, mujoco_usd_converter, urdf_usd_converter
for line in sys.stdin:
    words, *files = json.loads(line)
    child = os.fork()
    if child == 0:
        for number, file in enumerate(files, start=1):
            os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT), number)
        module, status = words[0] == "-m", 1
        sys.argv = words[module:]
        try:
            (runpy.run_module if module else runpy.run_path)(sys.argv[0], run_name="__main__")
            status = 0
        except SystemExit as end:
            status = end.code or 0
            if isinstance(status, str):
                print(status, file=sys.stderr)
                status = 1
        except BaseException:
            traceback.print_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


@pytest.fixture(scope="session")
def loaded_converters():
    """Runs a command of the converters' Python in a fork; its status and what it printed."""
    from calmotion_plugins.robot_import.converters import converter_python

    command = [converter_python(None, print), "-I", "-c", LOADED]
    plain = {name: value for name, value in os.environ.items() if not name.startswith("PXR_")}
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=plain)

    def run(words, folder):
        files = [str(folder / name) for name in ("printed", "complained")]
        process.stdin.write(json.dumps([words, *files]) + "\n")
        process.stdin.flush()
        status = int(process.stdout.readline())
        texts = [open(file).read() for file in files]
        for file in files:
            os.remove(file)
        return status, *texts

    yield run
    process.stdin.close()
    process.wait(60.0)


@pytest.fixture
def warm_converters(request, monkeypatch, tmp_path_factory):
    """Conversions run in forks of one process; they are the same commands with the same messages."""
    from calmotion_plugins.robot_import import converters

    if not hasattr(os, "fork"):
        return
    loaded, folder = request.getfixturevalue("loaded_converters"), tmp_path_factory.mktemp("said")

    def run(command, **options):
        if command[1] != "-I" or command[2] == "-c":
            return subprocess.run(command, **options)
        return subprocess.CompletedProcess(command, *loaded(command[2:], folder))

    monkeypatch.setattr(converters, "subprocess", SimpleNamespace(run=run, TimeoutExpired=subprocess.TimeoutExpired))
