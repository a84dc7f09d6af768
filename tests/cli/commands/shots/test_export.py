"""What `calmotion export` prints: whether the tolerance is kept, the file, what to do next, and then the numbers."""

import io

import pytest
from calmotion.cli import console_on
from calmotion.cli.commands.shots.export import _print

TARGET = {
    "path": "/Arm/Hand", "rate_loss_m": 2e-3, "rounding_loss_m": 0.0, "start_loss_m": 0.0, "loss_m": 2e-3,
    "delay_cost_m_per_s": 1.0,
}  # fmt: skip
REPORT = {
    "targets": [TARGET], "interpolation": "cubic", "commands": 11, "rate_hz": 10.0, "motors": ["/Arm/Elbow"],
    "simulations": 3, "step_s": 1e-3, "tolerance_m": 1e-3, "max_loss_m": 2e-3, "searched": True, "notes": ["a note"],
    "files": ["out.csv"],
}  # fmt: skip


@pytest.mark.parametrize(
    ("kept", "lowest", "then"),
    [
        (True, 8, "tells how the file is played"),
        (False, 40, "--rate 40"),
        (False, None, "no rate keeps it"),
    ],
)  # fmt: skip
def test_the_answer_is_first_and_the_next_step_before_the_numbers(kept, lowest, then):
    stream = io.StringIO()
    _print(REPORT | {"tolerance_kept": kept, "lowest_rate_hz": lowest}, console_on(stream))
    lines = stream.getvalue().splitlines()
    keep = "keep" if kept else "do not keep"
    assert lines[0] == f"The commands {keep} the tolerance of 1 mm: playing them costs up to 2 mm."
    assert "wrote out.csv" in lines
    (following,) = [k for k, line in enumerate(lines) if line.startswith("next: ")]
    assert then in lines[following] and following < lines.index(
        "What playing the commands costs at the targets, at most"
    )
    assert lines[-1] == "note: a note"
