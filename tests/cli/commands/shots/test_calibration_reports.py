"""What `excite` and `refine` print: the answer first, and what to do next last."""

import io

from calmotion.cli.commands.shots import excite, refine

PARAMETER = {
    "name": "modulus /Arm/Link", "kind": "modulus", "path": "/Arm/Link", "unit": "Pa", "value": 2e9,
    "prior": {"value": 2e9, "standard_deviation": 4e8}, "standard_deviation": 1e7, "standard_deviation_chirp": 2e7,
    "identifiable": True, "of_robot": True,
}  # fmt: skip
MOTOR = {"path": "/Arm/Elbow"} | dict.fromkeys(("excursion", "velocity", "acceleration", "effort"), 1.0)
MOTOR |= dict.fromkeys(("range_share", "velocity_share", "acceleration_share", "effort_share"), 0.5)


def printed(module, report):
    stream = io.StringIO()
    module._print(report, stream)
    return stream.getvalue().splitlines()


def test_a_test_motion_says_what_its_recording_would_tell():
    unknown = PARAMETER | {"path": "/Arm/Hand", "identifiable": False}
    report = {"parameters": [PARAMETER, unknown], "motors": [MOTOR], "motions": 3, "wall_s": 1.0, "layer": "test.usda"}
    lines = printed(excite, report)
    assert lines[0] == "A recording of this motion would tell 1 of 2 parameters."
    assert lines[-1].startswith("next: play it") and "calmotion calibrate test.usda --recording FILE" in lines[-1]


def test_a_take_says_what_the_next_one_should_be_like():
    target = {
        "path": "/Arm/Hand", "max_error_played_m": 0.02, "max_error_m": 0.001, "expected_max_error_m": 0.002,
        "expected_p95_max_error_m": 0.003,
    }  # fmt: skip
    report = {"parameters": [PARAMETER], "targets": [target], "take": 1, "notes": [], "root": "two_root.usda"}
    lines = printed(refine, report)
    assert lines[0] == "The largest error of take 1 is 20 mm; 2 mm is to expect of the new curves."
    assert lines[-1] == "next: play two_root.usda in take 2, record it, and run calmotion refine again"
