import io

import pytest
from calmotion.cli.reports.run import (
    print_budget,
    print_efforts,
    print_errors,
    print_files,
    print_joint_gap,
    print_robustness,
)
from calmotion.cli.reports.verdict import REMEDIES, print_remaining, print_verdict
from calmotion.cli.tables import console_on


def report(**values):
    """The entries of a report about its accuracy."""
    budget = [{"source": "mesh", "allowed_m": 4e-4, "estimated_m": None}]
    budget = [{"source": "time step", "allowed_m": 5e-4, "estimated_m": 3e-4}, *budget]
    known = {"error_budget": budget, "tolerance_m": 1e-3, "tolerance_kept": True, "tolerance_missed_by": None}
    known |= {"motors": [{"path": "/Cup/Turn", "changed": True}], "terms": []}
    known |= {"shot": "shot.usda", "limits": [], "interrupted": False, "improved": True, "step_s": 2e-3, "goal_m": None}
    return (
        known
        | {"simulation_error_m": 3e-4, "verified_error_m": None, "targets": [], "can_shake": True, "main_target": None}
        | values
    )


def printed(values):
    stream = io.StringIO()
    print_verdict(console_on(stream), values)
    print_budget(console_on(stream), values)
    return stream.getvalue()


def test_the_error_budget_is_a_table_and_the_verdict_a_sentence():
    text = printed(report())
    assert "time step   0.5 mm     0.3 mm" in text and "mesh        0.4 mm    unknown" in text
    assert "The simulation keeps the tolerance of 1 mm: these errors are accurate to 0.3 mm." in " ".join(text.split())
    verified = {"verified_step_s": 5e-4, "verified_modes": 44, "verified_mesh_error_m": 5e-5}
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


@pytest.mark.parametrize(
    ("after", "stopped", "said"),
    [
        (1e-3, "goal reached", "The goal is reached: the largest error is at most 2 mm."),
        (5e-3, "converged", "The goal of 2 mm is out of reach with these motors, limits and weights: 5 mm at /Cup."),
        (5e-3, "iteration limit", "The goal of 2 mm is not reached: 5 mm at /Cup."),
        (2.1e-3, "converged", "is too coarse to decide about the goal: use --tolerance 0.2mm."),
    ],
)
def test_a_goal_is_reached_or_the_targets_that_miss_it_are_named(after, stopped, said):
    target = {"path": "/Cup", "max_error_before_m": 9e-3, "max_error_after_m": after, "goal_kept": after <= 2e-3}
    near = {"path": "/Elbow", "max_error_before_m": 9e-3, "max_error_after_m": 1e-3, "goal_kept": True}
    kept, targets = after <= 2e-3, [target, near]
    values = report(goal_m=2e-3, goal_kept=kept, stopped=stopped, objective_after=0.0, targets=targets)
    values["main_target"] = "/Cup"
    text = " ".join(printed(values).split())
    assert said in text and ("too coarse" in text) == (after == 2.1e-3)


@pytest.mark.parametrize("source", REMEDIES)
def test_a_tolerance_that_is_not_kept_is_reported_with_what_would_help(source):
    text = printed(report(tolerance_kept=False, tolerance_missed_by=source, simulation_error_m=2e-3))
    said = f"does not keep the tolerance of 1 mm: its own error is about 2 mm, mostly from the {source}. "
    said += REMEDIES[source].format(step="2 ms")
    assert said in " ".join(text.split())


def test_without_an_estimate_nothing_is_claimed():
    text = printed(report(error_budget=[], tolerance_kept=False, simulation_error_m=None))
    assert text.split() == "The accuracy of the simulation was not estimated (tolerance 1 mm).".split()


@pytest.mark.parametrize(("gap", "told"), [(0.0, ""), (9e-7, ""), (7.1e-5, "joints come apart by up to 0.071 mm")])
def test_joints_that_come_apart_are_reported(gap, told):
    stream = io.StringIO()
    print_joint_gap(console_on(stream), gap)
    assert stream.getvalue().startswith(told) and bool(stream.getvalue()) == bool(told)


@pytest.mark.parametrize("verbose", [False, True])
def test_rotations_without_weight_are_printed_only_on_request(verbose):
    errors = {f"{kind}_{name}": 0.1 for kind in ("max", "rms") for name in ("error_m", "rotation_error_rad")}
    targets = [{"path": path, "rotation_weight": weight} | errors for path, weight in (("/Cup", 0.05), ("/Elbow", 0.0))]
    stream = io.StringIO()
    print_errors(console_on(stream), report(targets=targets), verbose)
    position, rotation = stream.getvalue().split("Rotation error of the targets")
    assert "/Elbow" in position and "/Cup" in rotation and ("/Elbow" in rotation) == verbose


def test_figures_of_a_folder_are_named_on_one_line():
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv", "html"))
    print_files(console_on(stream), report(**files, figures=["out/errors.png", "out/motors.png"], can_shake=True))
    assert "wrote errors.png, motors.png in out" in stream.getvalue()


@pytest.mark.parametrize(
    ("error", "turn", "weight", "shakes"),
    [(2e-3, 0.0, 0.0, True), (5e-4, 0.1, 0.0, False), (5e-4, 0.1, 0.01, True), (5e-4, 5e-3, 0.01, False)],
)
def test_a_shot_that_keeps_within_the_tolerance_is_not_said_to_shake(error, turn, weight, shakes):
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv", "html"))
    target = {"path": "/Cup", "max_error_m": error, "max_rotation_error_rad": turn, "rotation_weight": weight}
    print_files(console_on(stream), report(**files, figures=[], targets=[target], can_shake=True))
    assert ("next: calmotion optimize shot.usda -o LAYER removes the shake" in stream.getvalue()) == shakes
    assert ("below the accuracy of the simulation" in stream.getvalue()) != shakes


@pytest.mark.parametrize("optimised", [False, True])
def test_of_a_rigid_robot_with_ideal_motors_is_told_that_nothing_shakes(optimised):
    stream = io.StringIO()
    files = dict.fromkeys(("layer", "root_layer", "rrd", "video", "csv", "html"))
    suffix = "_before" if optimised else ""
    target = {"path": "/Cup", f"max_error{suffix}_m": 1e-9, f"max_rotation_error{suffix}_rad": 0.0}
    target |= {"rotation_weight": 1.0}
    values = report(**files, figures=[], targets=[target], can_shake=False)
    values |= {"objective_after": 0.0} if optimised else {}
    print_verdict(console_on(stream), values)
    print_files(console_on(stream), values)
    assert stream.getvalue().startswith("Nothing shakes") and "CalmFlexibleBodyAPI" in stream.getvalue()
    assert "calmotion optimize" not in stream.getvalue() and "/Cup" not in stream.getvalue()


def two_targets(cup_after=1e-3, main="/Cup"):
    errors = {"/Elbow": (0.01, 5e-3), "/Cup": (0.06, cup_after)}
    rows = [
        {"path": path, "max_error_before_m": before, "max_error_after_m": after}
        for path, (before, after) in errors.items()
    ]
    return report(targets=rows, objective_after=1.0, main_target=main)


def test_each_target_has_its_own_error_before_and_after_and_the_main_one_is_first():
    text = printed(two_targets())
    assert text.splitlines()[:2] == [
        "The largest error falls from 60 mm to 1 mm (at /Cup).",
        "At /Elbow, it falls from 10 mm to 5 mm.",
    ]
    assert "errors after the optimisation are accurate to 0.3 mm" in text, "those before may be off by more"
    assert "to 5 mm (at /Elbow)" in printed(two_targets(main="/Elbow")).splitlines()[0]
    worse = printed(two_targets(0.07) | {"improved": False}).splitlines()
    assert worse[:2] == [
        "The new curves are worse than the animation.",
        "The largest error rises from 60 mm to 70 mm (at /Cup).",
    ]
    still = printed(two_targets(0.07) | {"motors": [{"path": "/Turn", "changed": False}]}).splitlines()
    assert still[0].startswith("No curve was changed") and still[1].endswith("stays at 60 mm (at /Cup).")
    alone = printed(report(targets=[{"path": "/Cup", "max_error_m": 0.06}]))
    assert alone.startswith("As animated, the largest error is 60 mm (at /Cup).")


def test_the_largest_error_that_remains_is_named_where_no_sentence_has_it():
    rows = [{"path": f"/T{k}", "max_error_before_m": 0.06 - 0.01 * k, "max_error_after_m": 1e-3 * k} for k in range(5)]
    told = report(targets=rows, objective_after=1.0, main_target="/T0")
    assert "The table has 2 more targets, with up to 4 mm (at /T4)." in printed(told).splitlines()
    rows[1]["max_error_after_m"] = 5e-3
    assert "The table has 2 more targets." in printed(told).splitlines()


def test_how_far_motors_move_and_why_errors_remain_are_told():
    cause = {"motors": 5, "directions": 9}
    remaining = [cause | {"path": "/Cup", "max_error_m": 1.4e-3, "causes": ["motors"]}]
    remaining += [cause | {"path": "/Elbow", "max_error_m": 5.5e-3, "causes": ["motors"]}]
    remaining += [cause | {"path": "/Nose", "max_error_m": 2e-3, "causes": ["limits", "sag"]}]
    one = {"motors": 1, "directions": 3}
    remaining += [one | {"path": "/Tip", "max_error_m": 1e-3, "causes": ["sag", "motors"]}]
    motors = [{"path": f"/J{k}", "changed": k < 8, "max_offset_rad": 0.01 * k} for k in range(9)]
    stream = io.StringIO()
    print_remaining(console_on(stream), two_targets() | {"motors": motors, "remaining_errors": remaining})
    lines = stream.getvalue().splitlines()
    assert lines[0].startswith("Largest changes of motor angles: J7 4.01°, J6") and "2 more by less" in lines[0]
    assert lines[1].startswith(
        "Why 5.5 mm at /Elbow, 1.4 mm at /Cup remain: 5 motors cannot follow the targets in all 9 "
    )
    assert lines[2].startswith(
        "Why 2 mm at /Nose remain: motors are at their limits (see the table of limits); gravity"
    )
    assert lines[3].endswith("even at rest; 1 motor cannot follow the target in all 3 directions.")


def test_curves_on_random_robots_are_a_table():
    errors = {"nominal_max_error_m": 1e-3, "median_max_error_m": 2e-3, "p95_max_error_m": 4e-3}
    rows = {name: errors | {"worst_max_error_m": worst} for name, worst in (("before", None), ("nominal", 9e-3))}
    target = {
        "path": "/Arm/Tip",
        "rotation_weight": 0.0,
        "robustness": rows | {"robust": errors | {"worst_max_error_m": 5e-3}},
    }
    stream = io.StringIO()
    report = {"scenarios": [], "draws": 200, "targets": [target], "main_target": "/Arm/Tip"}
    print_robustness(console_on(stream), report)
    text = stream.getvalue()
    assert "Largest error on 200 random robots" in text and "failed" in text
    assert [line.split()[-2:] for line in text.splitlines()[-2:]] == [["9", "mm"], ["5", "mm"]]
    assert "No robust curves" not in text
    better = rows | {"robust": errors | {"p95_max_error_m": 3e-3, "worst_max_error_m": 5e-3}}
    print_robustness(console_on(stream), report | {"targets": [target | {"robustness": better}]})
    assert "On 95% of the robots around the model, the error at /Arm/Tip is at most 3 mm." in stream.getvalue()
    turned = {
        name: row | {key.replace("error_m", "rotation_error_rad"): 0.1 for key in row} for name, row in better.items()
    }
    print_robustness(
        console_on(stream), report | {"targets": [target | {"rotation_weight": 0.1, "robustness": turned}]}
    )
    assert stream.getvalue().splitlines()[-1].split()[-1] == "5.73°"
    stream = io.StringIO()
    kept = target | {"robustness": rows | {"robust": rows["nominal"]}}
    print_robustness(console_on(stream), report | {"targets": [kept]})
    assert "No robust curves were found that keep the allowed error on the model." in " ".join(
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
    print_efforts(console_on(stream), rows, 5e-3)
    assert stream.getvalue() == ""
    stream = io.StringIO()
    print_efforts(console_on(stream), [*rows, row("/Elbow", 5.0, 1.0)], 5e-3)
    text = " ".join(stream.getvalue().split())
    assert "that of /Elbow, at most 5 N m, may be off by 1 N m" in text and "use a --step shorter than 5 ms" in text
