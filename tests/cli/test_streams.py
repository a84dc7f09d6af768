"""Streams that are closed or full: no traceback."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from one_hinge import ONE_HINGE

LINE = (sys.executable, "-m", "calmotion")


def ran(line, folder, repository):
    environment = os.environ | {"PYTHONPATH": str(repository / "pipeline")}
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
