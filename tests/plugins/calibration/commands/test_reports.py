"""What `calibrate`, `excite` and `refine` print: the answer and what to do next, then all that is less."""

import io

from calmotion.cli import console_on
from calmotion_plugins.calibration.commands import calibrate, excite, refine

PARAMETER = {
    "name": "modulus /Arm/Link", "kind": "modulus", "path": "/Arm/Link", "unit": "Pa", "value": 2e9,
    "prior": {"value": 2e9, "standard_deviation": 4e8}, "standard_deviation": 1e7, "standard_deviation_chirp": 2e7,
    "identifiable": True, "of_robot": True,
}  # fmt: skip
MOTOR = {"path": "/Arm/Elbow"} | dict.fromkeys(("excursion", "velocity", "acceleration", "effort"), 1.0)
MOTOR |= dict.fromkeys(("range_share", "velocity_share", "acceleration_share", "effort_share"), 0.5)


def printed(module, report):
    stream = io.StringIO()
    module._print(report, console_on(stream))
    return stream.getvalue().splitlines()


def test_a_test_motion_says_what_its_recording_would_tell():
    unknown = PARAMETER | {"path": "/Arm/Hand", "identifiable": False}
    report = {"parameters": [PARAMETER, unknown], "motors": [MOTOR], "motions": 3, "wall_s": 1.0, "layer": "test.usda"}
    near = {"bodies": ["/Arm/Base", "/Arm/Hand"], "first_pose_m": 0.05, "least_m": 0.021}
    report |= {"clearances": [near | {"least_m": 0.03}, near], "unchecked_pairs": 4 * [["/Arm/A", "/Arm/B"]]}
    lines = printed(excite, report)
    assert lines[0] == "A recording of this motion identifies 1 of 2 parameters."
    (next_,) = [line for line in lines if line.startswith("next: ")]
    assert next_.startswith("next: play it") and "calmotion calibrate test.usda --recording FILE" in next_
    assert lines.index(next_) < lines.index("What the motors do (rad or m, s, N m or N)")
    text = " ".join(" ".join(lines).split())
    assert "stay 21 mm apart or more (/Arm/Base and /Arm/Hand)" in text and "/Arm/A and /Arm/B and 1 more pairs" in text
    assert "collisions with what is not a body of the robot are not checked" in text
    alone = " ".join(printed(excite, report | {"clearances": [], "unchecked_pairs": []}))
    assert "apart or more" not in alone and "look at the motion first" in alone


def test_a_calibration_says_what_the_recordings_tell_before_what_they_cost():
    offset = PARAMETER | {"kind": "clock_offset", "name": "clock_offset take.csv", "unit": "s", "of_robot": False}
    rows = [row | {"advice": ""} for row in (PARAMETER, PARAMETER | {"identifiable": False}, offset)]
    channel = {"name": "marker /Arm/Hand", "unit": "m", "rms_before": 8e-4, "rms": 2e-4, "noise": 2e-4}
    report = {
        "parameters": rows, "channels": [channel | {"validation_rms": None}], "notes": ["a note"], "figures": [],
        "html": None, "layer": "mine.usda", "root": "mine_root.usda", "simulations": 3, "wall_s": 1.0, "step_s": 1e-3,
        "step_shift": 0.1,
    }  # fmt: skip
    lines = printed(calibrate, report)
    assert lines[0] == "The recordings identify 1 of 2 parameters of the robot."
    assert lines[1].startswith(
        "marker /Arm/Hand: the difference between recording and simulation falls from 0.8 mm to 0.2 mm"
    )
    order = ["Parameters of the robot", "wrote mine.usda", "wrote mine_root.usda"]
    order += ["next: calmotion optimize mine_root.usda -o LAYER makes curves for this robot", "note: a note"]
    order += ["Parameters of the model and the measurement"]
    assert [line for line in lines if line in order] == order


def test_a_take_says_what_the_next_one_should_be_like():
    target = {
        "path": "/Arm/Hand", "max_error_played_m": 0.02, "max_error_m": 0.001, "expected_max_error_m": 0.002,
        "expected_p95_max_error_m": 0.003,
    }  # fmt: skip
    files = {"layer": "two.usda", "root": "two_root.usda", "model": "two_model.usda", "model_root": None}
    report = {"parameters": [PARAMETER], "targets": [target], "take": 1, "notes": ["a note"]} | files
    lines = printed(refine, report)
    assert lines[0] == "The largest error of take 1 is 20 mm; the new curves should leave 2 mm."
    assert lines[-5:] == [
        "wrote two.usda", "wrote two_root.usda", "wrote two_model.usda",
        "next: play two_root.usda in take 2, record it, and run calmotion refine again", "note: a note",
    ]  # fmt: skip
