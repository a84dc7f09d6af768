"""An optimisation that the user stops, or that is killed, through the command line."""

import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest
from small_shots import FORE, make_flexible, make_target, write_arm

fcntl, termios = pytest.importorskip("fcntl"), pytest.importorskip("termios")

OPTIONS = ("--step", "4ms")
# The search waits after its first checkpoint: on a busy machine it would end before the signal.
WAITING = """
import sys, time
from calmotion.__main__ import main
from calmotion.retargeting.checkpoint import Checkpoint

def save_and_wait(*arguments):
    save(*arguments)
    time.sleep(600.0)

save, Checkpoint.save = Checkpoint.save, save_and_wait
sys.exit(main())
"""


@pytest.fixture
def shot(tmp_path_factory):
    """An arm so soft that its search has work left after its first checkpoint."""

    def soften(stage):
        make_flexible(stage, FORE, youngsModulus=3e7)
        make_target(stage)

    return write_arm(tmp_path_factory.mktemp("shot") / "arm.usda", soften)


def command(shot, layer, waits):
    program = ["-c", WAITING] if waits else ["-m", "calmotion"]
    return [sys.executable, *program, "optimize", str(shot), "-o", str(layer), "--json", *OPTIONS]


def started(repository, shot, layer, waits=False):
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    # a shell that runs the tests in the background ignores interrupts, and so would its children
    return subprocess.Popen(
        command(shot, layer, waits),
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )


def kept(layer):
    return layer.with_name(f".{layer.name}.checkpoint.npz")


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.long)])
def test_a_signal_writes_the_best_so_far_and_the_same_command_resumes(
    calmotion, repository, shot, tmp_path_factory, tmp_path, number
):
    layer = tmp_path / "calm.usda"
    process = started(repository, shot, layer, waits=True)
    while not kept(layer).exists() and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(number)
    out, _ = process.communicate(timeout=600)
    early = json.loads(out)
    assert process.returncode == 130 and early["interrupted"] and early["stopped"] == "interrupted"
    assert layer.exists() and kept(layer).exists()
    assert early["objective_after"] < early["objective_before"]
    if number != signal.SIGINT:
        return
    done = calmotion("optimize", shot, "-o", layer, "--json", *OPTIONS)
    late = json.loads(done.stdout)
    assert done.returncode == 0 and not late["interrupted"] and late["stopped"] == "converged"
    assert late["resumed_iterations"] == early["iterations"] and late["objective_after"] < early["objective_after"]
    whole = tmp_path_factory.mktemp("whole") / "calm.usda"
    expected = json.loads(calmotion("optimize", shot, "-o", whole, "--json", *OPTIONS).stdout)
    assert late["objective_after"] == pytest.approx(expected["objective_after"], rel=1e-9)
    assert not kept(layer).exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["calm.usda", "calm_root.usda"]


INTERRUPT = "import os, signal; os.kill(os.getpid(), signal.SIGINT)"
REGISTER = "def register(host): pass\ndef unregister(host): pass\n"
PLUGINS = {
    "as it imports": f"{INTERRUPT}\n{REGISTER}",
    "as it imports, in code that is executed": f"exec({INTERRUPT!r})\n{REGISTER}",
    "as it imports, which makes another error of it": (
        f"try:\n    {INTERRUPT}\nexcept BaseException:\n    raise ImportError('lost') from None\n{REGISTER}"
    ),
    "as it registers": f"def register(host):\n    {INTERRUPT}\ndef unregister(host): pass\n",
    "as it registers, which swallows it": (
        f"def register(host):\n    try:\n        {INTERRUPT}\n    except BaseException:\n        pass\n"
        "def unregister(host): pass\n"
    ),
}


@pytest.mark.parametrize("when", PLUGINS)
def test_an_interrupt_while_a_plugin_loads_ends_the_program_in_one_line(
    calmotion_process, make_plugin, repository, tmp_path, when
):
    shot, layer = repository / "samples" / "bartender" / "bartender.usda", tmp_path / "calm.usda"
    folder = make_plugin("slow", PLUGINS[when])
    done = calmotion_process(
        "optimize", shot, "-o", layer, "--plugins", folder,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "error: interrupted\n")
    assert [path.name for path in tmp_path.iterdir()] == ["plugins"]


OPERATOR = """
    from calmotion.host import Operator
    from calmotion.model import Character, Animation, Provenance
    from calmotion.model.run import Source

    class Read(Operator):
        idname, label, requires, provides = "slow.read", "Read slowly", (Source,), (int,)
        def execute(self, context):
            try:
                {interrupt}
            except BaseException:
                {then}
            return (1,)

    def register(host): host.register_operator(Read)
    def unregister(host): host.unregister_operator(Read)
"""


@pytest.mark.parametrize("then", ["raise ValueError('lost') from None", "pass"])
def test_an_interrupt_that_an_operator_swallows_ends_the_run(calmotion_process, make_plugin, repository, then):
    folder = make_plugin("slow", OPERATOR.format(interrupt=INTERRUPT, then=then))
    shot = repository / "samples" / "bartender" / "bartender.usda"
    done = calmotion_process(
        "inspect", shot, "--plugins", folder, "--run", "slow.read", "--json",
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert done.returncode == 130 and "Traceback" not in done.stderr
    assert json.loads(done.stdout)["error"]["problem"] == "interrupted"


def take_terminal():
    """Makes the terminal that of the new session; `nohup` would leave its signal ignored."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="this system has no pseudo terminals")
def test_a_closed_terminal_writes_the_best_so_far(repository, shot, tmp_path):
    layer = tmp_path / "calm.usda"
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    ours, theirs = os.openpty()
    line = [arg for arg in command(shot, layer, waits=True) if arg != "--json"]
    process = subprocess.Popen(
        line,
        env=environment,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        start_new_session=True,
        preexec_fn=take_terminal,
    )
    os.close(theirs)
    reader = threading.Thread(target=drain, args=(ours,), daemon=True)
    reader.start()
    while not kept(layer).exists() and process.poll() is None:
        time.sleep(0.01)
    os.close(ours)
    assert process.wait(timeout=600) == 130
    assert layer.exists() and kept(layer).exists()
    assert not list(tmp_path.glob(".calmotion-*"))


def drain(descriptor):
    """Read what a terminal shows until it is closed."""
    with contextlib.suppress(OSError):
        while os.read(descriptor, 4096):
            pass


@pytest.mark.long
def test_killed_at_any_moment_the_same_command_ends_as_well(repository, tmp_path):
    shot = repository / "samples" / "bartender" / "bartender.usda"
    whole = started(repository, shot, tmp_path / "whole.usda")
    begin = time.monotonic()
    expected = json.loads(whole.communicate(timeout=600)[0])
    seconds = time.monotonic() - begin
    rng = random.Random(0)
    layer = tmp_path / "calm.usda"
    for _ in range(20):
        process = started(repository, shot, layer)
        time.sleep(rng.uniform(0.0, seconds))
        process.kill()
        process.communicate()
        process = started(repository, shot, layer)
        found = json.loads(process.communicate(timeout=600)[0])
        assert process.returncode == 0
        # a search that goes on from a point ends where less than a share of the tolerance is to be gained
        assert found["stopped"] == "converged" and found["tolerance_kept"] == expected["tolerance_kept"]
        for one, other in zip(found["targets"], expected["targets"], strict=True):
            off = abs(one["max_error_after_m"] - other["max_error_after_m"])
            assert off < 0.1 * expected["tolerance_m"]
        assert not list(tmp_path.glob(".*"))
