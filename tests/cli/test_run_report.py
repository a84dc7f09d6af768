import io

from calmotion.cli.run_report import print_accuracy
from calmotion.cli.tables import console_on


def test_the_accuracy_is_reported_where_it_is_known():
    names = ("tolerance_m", "estimated_error_m", "estimated_step_error_m", "estimated_mesh_error_m", "verified_error_m")
    none = dict.fromkeys(names)
    told = none | {"estimated_error_m": 3e-4, "estimated_step_error_m": 1e-4, "verified_error_m": 2e-4}
    with_mesh = told | {"estimated_mesh_error_m": 5e-4, "verified_error_m": None}
    for report, expected in (
        (none, ""),
        (
            with_mesh,
            "estimated simulation error 0.3 mm (0.1 mm of it by the time step); mesh error 0.5 mm\n",
        ),
        (
            told | {"verified_step_s": 5e-4, "verified_modes": 44},
            "estimated simulation error 0.3 mm (0.1 mm of it by the time step)\n"
            "measured simulation error 0.2 mm, against a run with steps of 0.5 ms and 44 elastic coordinates\n",
        ),
    ):
        stream = io.StringIO()
        print_accuracy(console_on(stream), report)
        assert stream.getvalue() == expected


def test_a_tolerance_that_is_not_kept_is_reported():
    report = {"tolerance_m": 1e-4, "estimated_step_error_m": 1e-5, "estimated_mesh_error_m": None}
    report |= {"verified_step_s": 5e-4, "verified_modes": 44}
    for estimated, verified, told in (
        (1.5e-4, None, False),
        (3e-4, None, True),
        (3e-4, 9e-5, False),
        (5e-5, 2e-4, True),
    ):
        stream = io.StringIO()
        print_accuracy(console_on(stream), report | {"estimated_error_m": estimated, "verified_error_m": verified})
        assert ("the tolerance of 0.1 mm is not kept" in stream.getvalue()) == told
