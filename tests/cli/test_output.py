"""What reaches a terminal: sentences of Calmotion, in characters that it has."""

import io
import logging
import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from calmotion.cli.output import own_messages
from calmotion.cli.signals import prepare_streams
from calmotion.cli.tables import console_on, print_table
from one_hinge import ONE_HINGE


@pytest.fixture
def no_filters():
    """Warnings as Python has them without options."""
    with warnings.catch_warnings():
        warnings.resetwarnings()
        yield


def test_warnings_of_libraries_are_not_printed(capsys, no_filters):
    with own_messages():
        warnings.warn("invalid value in divide", RuntimeWarning, stacklevel=1)
        logging.getLogger("matplotlib").warning("building the font cache")
    printed = capsys.readouterr()
    assert (printed.out, printed.err) == ("", "")


def test_warnings_of_calmotion_are_sentences(capsys):
    with own_messages():
        logging.getLogger("calmotion").warning("The checkpoint %s is damaged; the search begins anew.", "x")
    assert capsys.readouterr().err == "warning: The checkpoint x is damaged; the search begins anew.\n"
    assert not logging.getLogger("calmotion").handlers


def test_warnings_are_errors_where_the_user_says_so(no_filters):
    warnings.simplefilter("error")
    with own_messages(), pytest.raises(RuntimeWarning):
        warnings.warn("invalid value in divide", RuntimeWarning, stacklevel=1)


def test_a_stream_of_ascii_replaces_what_it_does_not_have(monkeypatch):
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr(sys, "stdout", stream)
    prepare_streams()
    print_table(console_on(sys.stdout), "9.81 m/s²", ["motor", "at"], [["/Robot/机", "90°"]])
    stream.flush()
    text = stream.buffer.getvalue().decode()
    assert "9.81 m/s?" in text and "/Robot/?" in text and "90?" in text


LINE = (sys.executable, "-m", "calmotion")


def ran(line, folder, repository):
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
    environment.pop("PYTHONUNBUFFERED", None)  # what is left for the end of the process counts as well
    return subprocess.run(["sh", "-c", line], cwd=folder, capture_output=True, text=True, timeout=600, env=environment)


@pytest.mark.posix
@pytest.mark.parametrize(
    ("line", "status"),
    [
        ("{} motors --json >&-", 0), ("{} motors 2>&-", 0), ("{} motors <&- >&- 2>&-", 0), ("{} motors nope 2>&-", 1),
        ("{} motors --json > /dev/full", 1), ("{} motors > /dev/full", 1), ("{} motors --json | head -c 5", 0),
    ],
)  # fmt: skip
def test_streams_that_take_nothing_end_in_no_traceback(tmp_path, repository, line, status):
    if "/dev/full" in line and not Path("/dev/full").exists():
        pytest.skip("needs /dev/full")
    done = ran(line.format(" ".join(LINE)), tmp_path, repository)
    assert "Traceback" not in done.stderr and done.returncode == status, done.stderr
    if "/dev/full" in line:
        assert "No space left" in done.stderr


@pytest.mark.posix
def test_a_layer_does_not_get_the_number_of_a_closed_stream(tmp_path, repository):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    line = f"{' '.join(LINE)} simulate shot.usda -o out.usda --step 10ms --tolerance 1mm --json >&- 2>&-"
    assert ran(line, tmp_path, repository).returncode == 0
    assert (tmp_path / "out.usda").read_text().startswith("#usda 1.0")
