import io

import pytest
from calmotion.cli.tables import console_on, length, name_paths, print_accuracy


def test_short_paths_stay_whole():
    assert name_paths(["/A/b", "/A/c"]) == {"/A/b": "/A/b", "/A/c": "/A/c"}


def test_long_paths_are_shortened_to_their_last_distinct_names():
    deep = "/Robot/" + "link/" * 20
    names = name_paths([deep + "left/hand", deep + "right/hand", deep + "head"])
    assert sorted(names.values()) == ["head", "left/hand", "right/hand"]


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


@pytest.mark.parametrize(
    "meters, text",
    [
        (0.0, "0 mm"), (1.392e-15, "< 0.0001 mm"), (9.9e-8, "< 0.0001 mm"), (1.2e-7, "0.00012 mm"),
        (0.0593, "59.3 mm"), (9.9994, "9999 mm"), (9.9999, "10 m"), (123.456, "123.5 m"), (None, "-"),
        (float("inf"), "-"),
    ],
)  # fmt: skip
def test_lengths_have_no_powers_of_ten(meters, text):
    assert length(meters) == text
