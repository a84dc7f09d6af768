"""Robust curves of shots with few or many robots, parameters, motors, targets and limits."""

import dataclasses

import numpy as np
import pytest
from calmotion.model.run import RunSettings
from calmotion.model.uncertainty import RobustSettings, Uncertainty
from calmotion.retargeting.optimize import optimize_shot
from calmotion.retargeting.robust.retarget import retarget_robustly
from calmotion.retargeting.to_tolerance import continued
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.tolerance.simulation import found_tracks
from calmotion.workflow.targets import robustness_report, robustness_row
from posed import ignore_progress

TOLERANCE = 6e-3
WORST = RobustSettings("worst", 3, 20)


def uncertain(modulus=0.1, damping=1.0, payload=0.1, gains=0.2):
    return lambda arm: dataclasses.replace(
        arm, retarget=dataclasses.replace(arm.retarget, uncertainty=Uncertainty(modulus, damping, payload, gains))
    )


def one_motor(arm):
    motors = tuple(dataclasses.replace(m, optimize=k == 0) for k, m in enumerate(arm.motors))
    return dataclasses.replace(arm, motors=motors)


def weighing(*weights):
    """Positions and rotations of the targets weigh so much; further targets are left out."""
    return lambda arm: dataclasses.replace(
        arm,
        targets=tuple(
            dataclasses.replace(target, position_weight=position, rotation_weight=rotation)
            for target, (position, rotation) in zip(arm.targets, weights, strict=False)
        ),
    )


def limited(arm):
    motors = tuple(dataclasses.replace(m, max_velocity=20.0, max_torque=1e3) for m in arm.motors)
    return dataclasses.replace(arm, motors=motors)


def same(arm):
    return arm


VARIATIONS = {
    "one robot": (same, dataclasses.replace(WORST, scenarios=1)),
    "two robots": (same, dataclasses.replace(WORST, scenarios=2)),
    "an even number of robots": (same, dataclasses.replace(WORST, scenarios=4)),
    "many robots": (same, dataclasses.replace(WORST, scenarios=15)),
    "one parameter": (uncertain(damping=0.0, payload=0.0, gains=0.0), WORST),
    "a parameter that moves nothing": (uncertain(modulus=0.0, damping=1e-9, payload=0.0, gains=0.0), WORST),
    "a spread of next to nothing": (uncertain(1e-6, 1e-6, 1e-6, 1e-6), WORST),
    "a motor alone": (one_motor, WORST),
    "a target alone": (weighing((1.0, 0.0)), WORST),
    "a target of which the turn alone weighs": (weighing((1.0, 0.0), (0.0, 0.1)), WORST),
    "a rotation that weighs beside the position": (
        weighing((1.0, 0.02)),
        dataclasses.replace(WORST, nominal_error=4.0),
    ),
    "targets of other weights": (weighing((0.1, 0.0), (1.0, 0.01)), WORST),
    "limits": (limited, WORST),
    "nothing allowed": (same, dataclasses.replace(WORST, nominal_error=0.0)),
    "very much allowed": (same, dataclasses.replace(WORST, nominal_error=100.0)),
    "a mean of one robot": (same, dataclasses.replace(WORST, kind="mean", scenarios=1)),
}


SLOW = (
    "two robots", "an even number of robots", "many robots", "a motor alone", "a target alone", "limits",
    "targets of other weights", "very much allowed",
)  # fmt: skip
NOMINAL = RunSettings(step=1 / 60, tolerance=TOLERANCE)


@pytest.fixture(scope="module")
def calmed(arm, animation, bodies):
    """A shot of the arm and its curves for one robot."""
    known = []

    def find(of):
        for kind, *found in known:
            if kind is of:
                return found
        shot = compile_shot(of(arm), animation, bodies)
        known.append((of, shot, optimize_shot(shot, NOMINAL, ignore_progress)))
        return known[-1][1:]

    return find


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.long) if name in SLOW else name for name in VARIATIONS]
)
def test_the_error_on_the_model_keeps_its_bound_and_that_on_others_does_not_grow(animation, calmed, name):
    of, robust = VARIATIONS[name]
    shot, nominal = calmed(of)
    options = dataclasses.replace(NOMINAL, robust=robust)
    result = retarget_robustly(shot, options, nominal, continued, ignore_progress)
    found = result.robustness
    rows = [robustness_row(result, k)["robustness"] for k in range(len(shot.character.targets))]
    assert robustness_report(result)["scenarios"] and all(np.isfinite(row["robust"]["p95_max_error_m"]) for row in rows)
    assert sum(scenario.weight for scenario in found.scenarios) == pytest.approx(1.0) and not found.scenarios[0].factors
    if robust.kind == "worst":
        weights = np.sqrt([(target.position_weight, target.rotation_weight) for target in shot.character.targets])
        scales = np.where(weights[:, :1] > 0.0, weights[:, :1], weights[:, 0].max())
        allowed = np.maximum(robust.nominal_error * TOLERANCE * scales, weights * found.nominal["nominal"])
        assert np.all(weights * found.nominal["robust"] <= allowed * (1.0 + 1e-6))
        worst = {name: (found.drawn[name] * weights).max() for name in ("nominal", "robust")}
        assert worst["robust"] <= 1.05 * worst["nominal"]
    kept = all(one.frame_values is other.frame_values for one, other in zip(result.curves, nominal.curves, strict=True))
    same_curves = all(
        np.allclose(one.values, other.values, atol=1e-12)
        for one, other in zip(*(found_tracks(r, animation) for r in (nominal, result)), strict=True)
    )
    assert kept == same_curves or robust.kind == "mean"
    if kept:
        assert all(row["nominal"] == row["robust"] for row in rows)  # which the report says
