"""Scenes that are hard to simulate, and the outcome of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from calmotion.benchmarks.scenes.beam_arm import IDENTITY, beam_arm, quintic, shot_of
from calmotion.errors import ShotError
from calmotion.shot import Animation, Body, Character, FEMeshes, Frame, Joint, MassProperties
from calmotion.shot.character import Array

if TYPE_CHECKING:
    from calmotion.shot.run import RunSettings
    from calmotion.simulation.compiled_shot import CompiledShot


Scene = Callable[[], tuple[tuple[Character, FEMeshes], Animation]]
RUNS, REFUSED, FAILED = "runs", "refused", "failed"
NORM = 1e-9  # how far a quaternion's norm may be from 1
REACH = 1.5  # times the arm's length: a target beyond it has flown away


@dataclass(frozen=True)
class Case:
    """A scene and how it is run.

    Attributes:
        group, name: What is extreme about it.
        scene: Makes the character, its meshes and its animation.
        step: [s], None for the automatic one.
        integrator: One of `multibody.integrators`.
    """

    group: str
    name: str
    scene: Scene
    step: float | None = None
    integrator: str = "bdf2"


@dataclass(frozen=True)
class Outcome:
    """The outcome of a case.

    Attributes:
        group, name: Of the case.
        outcome: RUNS, REFUSED or FAILED.
        why: The reason of a refusal or failure, else empty.
        steps, newton: Steps, and linear systems solved in a step.
        error_m: Largest error of the target against the rigid motion [m].
        gap_m: Largest gap of a joint [m].
        wall_s: The simulation alone.
    """

    group: str
    name: str
    outcome: str
    why: str = ""
    steps: int = 0
    newton: float = 0.0
    error_m: float = float("nan")
    gap_m: float = float("nan")
    wall_s: float = float("nan")


SWING = partial(quintic, np.pi / 2)


def _arm(angle: Callable[[Array], Array] | None = None, seconds: float = 1.0, rate: float = 24.0, **arm: Any) -> Scene:
    return lambda: (beam_arm(**arm), shot_of(angle or SWING(0.5), seconds, arm.get("links", 1), rate))


def _spin(t: Array) -> Array:
    """100 rad/s after a second of constant acceleration."""
    return 100.0 * np.where(t < 1.0, 0.5 * t**2, t - 0.5)


def _jumps(t: Array) -> Array:
    """Half a turn from one frame to the next."""
    return np.where(t > 0.5 - 1e-9, np.pi, 0.0)


def _wave(t: Array) -> Array:
    return 0.005 * (1.0 - np.cos(2.0 * np.pi * t))


def _nearly_massless() -> tuple[tuple[Character, FEMeshes], Animation]:
    """A wrist of a billionth of a kilogram between the arm and its load, on a motor of its own."""
    character, meshes = beam_arm()
    link, load = character.bodies
    wrist = Body("/Arm/Wrist", load.rest, MassProperties(1e-9, np.zeros(3), 1e-15 * np.eye(3)))
    hinge = replace(character.joints[1], path="/Arm/Turn", kind="revolute", body0=0, body1=1)
    at = Frame(np.array([0.02, 0.0, 0.0]), IDENTITY)
    weld = Joint("/Arm/Weld", "fixed", 1, 2, at, Frame(np.zeros(3), IDENTITY))
    motors = (character.motors[0], replace(character.motors[0], joint=1, path="/Arm/Turn"))
    target = replace(character.targets[0], body=2)
    joints = (character.joints[0], hinge, weld)
    made = replace(character, bodies=(link, wrist, load), joints=joints, motors=motors, targets=(target,))
    return (made, meshes), shot_of(SWING(0.5), 1.0, 2)


def _cases() -> tuple[Case, ...]:
    found = [
        Case("Young's modulus", f"1e{power} Pa", _arm(youngs_modulus=10.0**power))
        for power in (4, 5, 6, 7, 8, 9, 10, 11, 12)
    ]
    found += [
        Case("Young's modulus", f"1e{power} Pa, still", _arm(quintic(0.1, 0.9), youngs_modulus=10.0**power))
        for power in (7, 8)
    ]
    found += [
        Case(
            "Young's modulus", f"1e{power} Pa, 12 modes",
            _arm(youngs_modulus=10.0**power, modes=12, elasticity="linear"),
        )
        for power in (10, 12)
    ]  # fmt: skip
    found += [
        Case("mass ratio", "load a millionth of the arm", _arm(payload=0.288e-6)),
        Case("mass ratio", "arm a millionth of the load", _arm(density=1200.0 * 0.2e-6 / 0.288)),
        Case("mass ratio", "load a million arms", _arm(payload=0.288e6)),
        Case("nearly massless link", "wrist of 1e-9 kg", _nearly_massless),
    ]
    found += [
        Case("step", f"{step:.3g} s", _arm(seconds=0.75), step)
        for step in (1e-5, 1e-4, 1e-3, 1 / 240, 1 / 120, 1 / 48, 1 / 24)
    ]
    found += [
        Case("damping", "none", _arm(damping=0.0, seconds=4.0)),
        Case("damping", "none, stiff", _arm(damping=0.0, youngs_modulus=1e12, seconds=4.0)),
        Case("jump", "half a turn in a frame, plastic", _arm(_jumps)),
        Case("jump", "half a turn in a frame, steel", _arm(_jumps, youngs_modulus=2.1e11, density=7800.0)),
        Case("spin", "100 rad/s", _arm(_spin, 2.0, 480.0)),
        Case("spin", "100 rad/s, steps of 1/24 s", _arm(_spin, 2.0), 1 / 24),
        Case("slender", "1:500, plastic", _arm(thickness=0.6 / 500, cells=60)),
        Case("slender", "1:500, steel, light load", _arm(
            thickness=0.6 / 500, cells=60, payload=1e-5, youngs_modulus=2.1e11, density=7800.0
        )),
        Case("gravity", "times 100", _arm(gravity=981.0)),
        Case("gravity", "times 100, aluminium", _arm(gravity=981.0, youngs_modulus=7e10, density=2700.0)),
        Case("gravity", "none", _arm(gravity=0.0)),
        Case("long", "100,000 steps", _arm(_wave, 10.0), 1e-4),
        Case("chain", "64 flexible links", _arm(
            _wave, links=64, length=0.05, thickness=0.02, youngs_modulus=2.1e11, density=7800.0, cells=3
        )),
    ]  # fmt: skip
    return tuple(found)


CASES = _cases()


def run_case(case: Case) -> Outcome:
    """Run one case as `calmotion simulate` would."""
    from calmotion.shot.run import RunSettings
    from calmotion.simulation.body_reduction import reduced_shot

    (character, meshes), animation = case.scene()
    options = RunSettings(step=case.step, integrator=case.integrator)
    try:
        shot = reduced_shot(character, animation, meshes, options)
    except ShotError as error:
        return Outcome(case.group, case.name, REFUSED, str(error))
    return judged(case.group, case.name, shot, options)


def judged(group: str, name: str, shot: CompiledShot, options: RunSettings, gap: float | None = None) -> Outcome:
    """Simulate a shot and return the outcome.

    Args:
        group, name: Of the outcome.
        gap: Largest position gap of a joint that counts as none [m]; None: `step_error.CLOSED_GAP`.
    """
    from calmotion.accuracy.step_error import CLOSED_GAP
    from calmotion.simulation.simulate import simulate_shot

    allowed = CLOSED_GAP if gap is None else gap
    try:
        result = simulate_shot(shot, options, lambda fraction, message: None)
    except ShotError as error:
        return Outcome(group, name, REFUSED, str(error))
    except Exception as error:  # whatever it is, it is what this looks for
        return Outcome(group, name, FAILED, f"{type(error).__name__}: {error}")
    motion, simulation = result.before.motion, result.before
    parts = (motion.positions, motion.rotations, motion.target_positions, motion.motor_efforts, *motion.elastic)
    reach = sum(float(np.linalg.norm(joint.frame0.position)) for joint in shot.character.joints if joint.body0 >= 0)
    wrong = ""
    if not all(np.all(np.isfinite(part)) for part in parts):
        wrong = "not a number"
    elif np.linalg.norm(motion.target_positions, axis=2).max() > REACH * reach:
        wrong = "the target flew away"
    elif simulation.max_joint_gap > allowed:
        wrong = f"a joint came apart by {simulation.max_joint_gap:.1e} m"
    elif np.abs(np.linalg.norm(motion.rotations, axis=2) - 1.0).max() > NORM:
        wrong = "a quaternion lost its length"
    steps = len(motion.times)
    return Outcome(
        group, name, FAILED if wrong else RUNS, wrong, steps, simulation.newton_iterations / steps,
        float(simulation.position_errors.max()), simulation.max_joint_gap, simulation.wall_s,
    )  # fmt: skip
