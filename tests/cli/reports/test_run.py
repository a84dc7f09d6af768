import io

import pytest
from calmotion.cli.reports.run import (
    REMEDIES,
    print_budget,
    print_efforts,
    print_errors,
    print_files,
    print_joint_gap,
    print_robustness,
    print_verdict,
)
from calmotion.cli.tables import console_on


def report(**values):
    """The entries of a report about its accuracy."""
    budget = [{"source": "mesh", "allowed_m": 4e-4, "estimated_m": None}]
    budget = [{"source": "time step", "allowed_m": 5e-4, "estimated_m": 3e-4}, *budget]
    known = {"error_budget": budget, "tolerance_m": 1e-3, "tolerance_kept": True, "tolerance_missed_by": None}
    known |= {"shot": "shot.usda", "limits": [], "objective_before": 2.0, "improved": True, "interrupted": False}
    return known | {"simulation_error_m": 3e-4, "verified_error_m": None, "targets": []} | values


def printed(values):
    stream = io.StringIO()
    print_verdict(console_on(stream), values)
    print_budget(console_on(stream), values)
    return stream.getvalue()


def test_the_error_budget_is_a_table_and_the_verdict_a_sentence():
    text = printed(report())
    assert "time step   0.5 mm     0.3 mm" in text and "mesh        0.4 mm    unknown" in text
    assert "The simulation keeps the tolerance of 1 mm: these numbers are accurate to 0.3 mm." in " ".join(text.split())
    verified = {"verified_step_s": 5e-4, "verified_modes": 44, "verified_mesh_error_m": 5e-5, "verified_parts": 1}
    measured = printed(report(verified_error_m=2e-4, **verified))
    said = "measured simulation error 0.2 mm, against a run with steps of 0.5 ms and 44 elastic coordinates"
    assert f"{said}, whose meshes may be off by 0.05 mm" in " ".join(measured.split())


@pytest.mark.parametrize(
    ("delay", "said"),
    [(0.031, "It delays the motion by 0.031 s; without this delay the largest error is 4 mm."), (0.0, "")],
)
def test_the_delay_of_a_shaper_is_told_with_the_error_without_it(delay, said):
    worst = {"path": "/Arm/Hand", "max_error_m": 6e-3}
    values = {"shaper": "zvd", "shaper_delay_s": delay, "delayed_max_error_m": 4e-3, "targets": [worst]}
    text = " ".join(printed(report(**values)).split())
    assert "With the shaper zvd, the largest error is 6 mm (at /Arm/Hand)." in text
    assert said in text and ("delays" in text) == bool(said)


@pytest.mark.parametrize("source", REMEDIES)
def test_a_tolerance_that_is_not_kept_is_reported_with_what_would_help(source):
    text = printed(report(tolerance_kept=False, tolerance_missed_by=source, simulation_error_m=2e-3))
    said = f"does not keep the tolerance of 1 mm: error 2 mm, mostly of the {source}. {REMEDIES[source]}"
    assert said in " ".join(text.split())


def test_without_an_estimate_nothing_is_claimed():
    text = printed(report(error_budget=[], tolerance_kept=False, simulation_error_m=None))
    assert text.split() == "The error of the simulation was not estimated; the tolerance is 1 mm.".split()


@pytest.mark.parametrize(("gap", "told"), [(0.0, ""), (9e-7, ""), (7.1e-5, "joints come apart by up to 0.071 mm")])
def test_joints_that_come_apart_are_reported(gap, told):
    stream = io.StringIO()
    print_joint_gap(console_on(stream), gap)
    assert stream.getvalue().startswith(told) and bool(stream.getvalue()) == bool(told)


@pytest.mark.parametrize("verbose", [False, True])
def test_rotations_without_weight_are_printed_only_on_request(verbose):
    errors = {f"{kind}_{name}": 0.1 for kind in ("max", "rms") for name in ("error_m", "rotation_error_rad")}
    targets = [{"path": "/Cup", "rotation_weight": 0.05} | errors, {"path": "/Elbow", "rotation_weight": 0.0} | errors]
    stream = io.StringIO()
    print_errors(console_on(stream), report(targets=targets), verbose)
    position, rotation = stream.getvalue().split("Rotation error of the targets")
    assert "/Elbow" in position and "/Cup" in rotation and ("/Elbow" in rotation) == verbose


def test_figures_of_a_folder_are_named_on_one_line():
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv"))
    print_files(console_on(stream), report(**files, figures=["out/errors.png", "out/motors.png"], can_shake=True))
    assert "wrote errors.png, motors.png in out" in stream.getvalue()


@pytest.mark.parametrize(
    ("error", "turn", "weight", "shakes"),
    [(2e-3, 0.0, 0.0, True), (5e-4, 0.1, 0.0, False), (5e-4, 0.1, 0.01, True), (5e-4, 5e-3, 0.01, False)],
)
def test_a_shot_that_keeps_within_the_tolerance_is_not_said_to_shake(error, turn, weight, shakes):
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv"))
    target = {"path": "/Cup", "max_error_m": error, "max_rotation_error_rad": turn, "rotation_weight": weight}
    print_files(console_on(stream), report(**files, figures=[], targets=[target], can_shake=True))
    assert ("next: calmotion optimize shot.usda -o LAYER removes the shake" in stream.getvalue()) == shakes
    assert ("off by more than the tolerance" in stream.getvalue()) != shakes


@pytest.mark.parametrize("optimised", [False, True])
def test_of_a_rigid_robot_with_ideal_motors_is_told_that_nothing_shakes(optimised):
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv"))
    suffix = "_before" if optimised else ""
    target = {"path": "/Cup", f"max_error{suffix}_m": 1e-9, f"max_rotation_error{suffix}_rad": 0.0}
    values = report(**files, figures=[], targets=[target | {"rotation_weight": 1.0}], can_shake=False)
    print_files(console_on(stream), values | ({"objective_after": 0.0} if optimised else {}))
    assert "nothing shakes" in stream.getvalue() and "CalmFlexibleBodyAPI" in stream.getvalue()
    assert "calmotion optimize" not in stream.getvalue()


def test_the_answer_comes_first():
    targets = [
        {"path": "/Cup", "max_error_before_m": 0.06, "max_error_after_m": 1e-3},
        {"path": "/Elbow", "max_error_before_m": 0.01, "max_error_after_m": 5e-3},
    ]
    text = printed(report(targets=targets, objective_after=1.0))
    assert text.startswith("The largest error falls from 60 mm to 5 mm (at /Elbow).")
    assert "the errors after are accurate to 0.3 mm" in text, "those before may be off by a twentieth of the shake"
    targets[0]["max_error_after_m"] = 0.07
    assert "rises from 60 mm to 70 mm" in printed(report(targets=targets, objective_after=1.0))
    alone = printed(report(targets=[{"path": "/Cup", "max_error_m": 0.06}]))
    assert alone.startswith("As animated, the largest error is 60 mm (at /Cup).")


def test_curves_on_random_robots_are_a_table():
    errors = {"nominal_max_error_m": 1e-3, "median_max_error_m": 2e-3, "p95_max_error_m": 4e-3}
    rows = {name: errors | {"worst_max_error_m": worst} for name, worst in (("before", None), ("nominal", 9e-3))}
    target = {"path": "/Arm/Tip", "robustness": rows | {"robust": errors | {"worst_max_error_m": 5e-3}}}
    stream = io.StringIO()
    names = ("nominal_max_error_m", "p95_max_error_m", "worst_max_error_m")
    between = {"nominal_allowed_m": 2e-3, **{name: [v] for name, v in zip(names, (2e-3, 6e-3, 7e-3), strict=True)}}
    report = {"scenarios": [], "draws": 200, "targets": [target], "tradeoff": [between]}
    print_robustness(console_on(stream), report)
    text = stream.getvalue()
    assert "Largest error on 200 random robots" in text and "failed" in text
    assert [line.split()[-2:] for line in text.splitlines()[-3:]] == [["9", "mm"], ["5", "mm"], ["7", "mm"]]
    assert "model within 2 mm" in text and "no robust curves" not in text
    stream = io.StringIO()
    kept = target | {"robustness": rows | {"robust": rows["nominal"]}}
    print_robustness(console_on(stream), report | {"targets": [kept]})
    assert "no robust curves were found: the layer has the curves optimised for the model" in " ".join(
        stream.getvalue().split()
    )
    stream = io.StringIO()
    print_robustness(console_on(stream), {"targets": []})
    assert stream.getvalue() == ""


def test_a_motor_that_hardly_works_does_not_decide_how_well_efforts_are_known():
    def row(path, largest, error):
        return {"path": path, "largest": largest, "estimated_error": error, "unit": "N m"}

    rows = [row("/Shoulder", 20.0, 0.2), row("/WristRoll", 0.004, 0.002)]
    stream = io.StringIO()
    print_efforts(console_on(stream), rows)
    assert stream.getvalue() == ""
    stream = io.StringIO()
    print_efforts(console_on(stream), [*rows, row("/Elbow", 5.0, 1.0)])
    assert "/Elbow by 1 N m of at most 5 N m" in " ".join(stream.getvalue().split())
