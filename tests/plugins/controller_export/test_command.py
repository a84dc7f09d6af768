"""What `calmotion export` prints: whether the loss is allowed, the file, what to do next, and then the numbers."""

import io
import json
import re

import pytest
from calmotion.cli import console_on
from calmotion_plugins.controller_export.command import _print
from one_hinge import ONE_HINGE

TARGET = {
    "path": "/Arm/Hand", "rate_loss_m": 2e-3, "rounding_loss_m": 0.0, "start_loss_m": 0.0, "loss_m": 2e-3,
    "delay_cost_m_per_s": 1.0,
}  # fmt: skip
REPORT = {
    "targets": [TARGET], "interpolation": "cubic", "commands": 11, "rate_hz": 10.0, "motors": ["/Arm/Elbow"],
    "simulations": 3, "step_s": 1e-3, "allowed_loss_m": 1e-3, "max_loss_m": 2e-3, "searched": True, "notes": ["a note"],
    "files": ["out.csv"],
}  # fmt: skip


@pytest.mark.parametrize(
    ("kept", "lowest", "then"),
    [
        (True, 8, "says how the file is played"),
        (False, 40, "--rate 40"),
        (False, None, "no rate is enough"),
    ],
)
def test_the_answer_is_first_and_the_next_step_before_the_numbers(kept, lowest, then):
    stream = io.StringIO()
    _print(REPORT | {"loss_kept": kept, "lowest_rate_hz": lowest}, console_on(stream))
    lines = stream.getvalue().splitlines()
    within = "within" if kept else "more than"
    assert lines[0] == f"Playing the commands costs up to 2 mm at the targets, {within} the allowed 1 mm."
    assert "wrote out.csv" in lines
    (following,) = [k for k, line in enumerate(lines) if line.startswith("next: ")]
    assert then in lines[following] and following < lines.index(
        "What playing the commands costs at the targets, at most"
    )
    assert lines[-1] == "note: a note"


def test_the_keys_of_an_export_are_those_of_the_page(repository, tmp_path, calmotion):
    (tmp_path / "shot.usda").write_text(ONE_HINGE)
    done = calmotion("export", tmp_path / "shot.usda", "--to", "csv", "--rate", "30", "--json", "--no-search",
                     "-o", tmp_path / "a.csv")  # fmt: skip
    report = json.loads(done.stdout)
    page = (repository / "docs" / "reference" / "outputs.md").read_text()
    section = page.split("`export` prints")[1].split("An error is one object")[0]
    named = set(re.findall(r"`([a-z_]+)`", section))
    assert set(report) - {"command", "version", "start_delay_s", "total_wall_s"} <= named
    assert set(report["targets"][0]) <= named


@pytest.mark.parametrize("file", ["shot.usda", "motion.csv", "below.usda"])
def test_what_is_read_is_never_written_over(tmp_path, calmotion, monkeypatch, file):
    monkeypatch.chdir(tmp_path)
    below = ONE_HINGE.replace("#usda 1.0", "").lstrip()
    assert below.startswith("(")
    (tmp_path / "shot.usda").write_text("#usda 1.0\n" + below.replace("(", "(\n subLayers = [@./below.usda@]\n", 1))
    (tmp_path / "below.usda").write_text("#usda 1.0\n")
    (tmp_path / "motion.csv").write_text("time_s,Hinge\n0,0\n1,0.5\n")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    done = calmotion("export", "shot.usda", "--motion", "motion.csv", "--to", "csv", "-o", file, "--json", "--quiet")
    error = json.loads(done.stdout)["error"]
    assert done.returncode in (1, 2) and error["remedy"] and file in error["found"], error
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
