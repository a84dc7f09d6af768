"""Errors for users: where they are, and what the machine lacks, which is no fault of the program."""

import errno
import pickle

import pytest
from calmotion.errors import ShotError, ShotErrors, each, failure_of_machine
from calmotion.host import SettingError
from calmotion.workflow.problems import Problem, RunError


@pytest.mark.parametrize(
    ("error", "problem"),
    [
        (MemoryError(), "not enough memory"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "not enough memory"),
        (RuntimeError("can't start new thread"), "not enough memory"),
        (ImportError("x.so: failed to map segment from shared object"), "not enough memory"),
        (RuntimeError("Failed to write: No space left on device (os error 28)"), "a file cannot be"),
        (OSError(errno.ENOSPC, "No space left on device", "calm.usda"), "a file cannot be"),
        (PermissionError(errno.EACCES, "Permission denied", "calm.usda"), "a file cannot be"),
    ],
)
def test_a_failure_of_the_machine_has_a_problem_and_a_remedy(error, problem):
    found = failure_of_machine(error)
    assert problem in found.problem and found.remedy
    if isinstance(error, OSError) and error.filename:
        assert found.path == "calm.usda" and found.found == error.strerror


@pytest.mark.parametrize("error", [ValueError("x"), OSError("without a number"), ShotError("a shot"), ImportError("x")])
def test_other_exceptions_are_none(error):
    assert failure_of_machine(error) is None


@pytest.mark.parametrize(
    "error",
    [
        ShotError("bad", path="/Arm", attribute="a", found=ValueError("x"), remedy="Correct it"),
        SettingError("bad", path="--step", found=1.0, remedy="Write another"),
        ShotErrors([ShotError("one", path="/a"), ShotError("two", path="/b")]),
        RunError([Problem(ShotError("one", path="/a"), "usd.read", "usd_reader"), Problem(ShotError("two"))]),
    ],
)
def test_errors_travel_between_processes(error):
    back = pickle.loads(pickle.dumps(error))
    assert type(back) is type(error) and str(back) == str(error) and back.as_dict() == error.as_dict()
    assert [str(one) for one in each(back)] == [str(one) for one in each(error)]
    assert [row.as_dict() for row in getattr(back, "problems", ())] == [
        row.as_dict() for row in getattr(error, "problems", ())
    ]


@pytest.mark.parametrize(
    ("path", "attribute", "place"),
    [
        ("/Arm", "physics:mass", "/Arm.physics:mass"), ("/Arm", "", "/Arm"), ("", "--rate", "--rate"),
        ("/Arm", "--pre-roll", "--pre-roll, for /Arm"),
    ],
)  # fmt: skip
def test_the_place_of_an_option_is_no_attribute_of_a_prim(path, attribute, place):
    assert ShotError("a problem", path=path, attribute=attribute).place == place
