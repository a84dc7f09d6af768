"""Robots that differ from the model: their parameters, sets of them, and their compiled shots.

A factor of a modulus, a damping or a payload scales the matrices of a reduced body exactly, so that no mesh and no
reduction is made anew (docs/formulation.md, "Robust retargeting").
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.model import Character
from calmotion.model.character import ElasticMaterial
from calmotion.model.motor import PRESCRIBED, Motor
from calmotion.model.uncertainty import Scenario
from calmotion.reduction.reduced_body import Invariants, ReducedBody
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot

MODULUS, DAMPING, MASS, PAYLOAD = "modulus", "damping", "mass", "payload"
GAINS = ("position_gain", "velocity_gain")
OF_MOTOR, OF_ROTOR = (*GAINS, "delay", "max_torque"), (
    "gear_stiffness", "armature", "friction", "viscous_friction",
)  # fmt: skip
LOAD_FRICTION = "load_friction"  # the share of the load in the friction of a rotor
_SEED = 20190704  # of the draws, which are the same in every run


@dataclass(frozen=True)
class Parameter:
    """A parameter that is not known exactly.

    Attributes:
        name: `modulus PATH` or `damping PATH` of a material, `mass PATH` of a body, `payload`, or a value of a motor,
            such as `position_gain PATH`.
        spread: Standard deviation of the logarithm of its factor, by what this parameter alone tells.
        others: Logarithms of the factors of other parameters that go with one such deviation.
    """

    name: str
    spread: float
    others: tuple[tuple[str, float], ...] = ()


def uncertain_parameters(shot: CompiledShot) -> tuple[Parameter, ...]:
    """The parameters of a shot that are not known exactly; empty where all its uncertainties are zero."""
    character, found = shot.character, dict[str, float]()
    given = character.retarget.uncertainty
    for body in character.bodies:
        if body.flexible is not None and body.simulated_flexible:
            path = body.flexible.material.path
            found[f"{MODULUS} {path}"] = float(np.log1p(given.modulus))
            found[f"{DAMPING} {path}"] = float(np.log1p(given.damping))
    known = _calibrated(shot)
    names = {p.name for p in known}
    if any(f"{MASS} {character.bodies[k].path}" not in names for k in payload_bodies(shot)):
        found[PAYLOAD] = float(np.log1p(given.payload))
    free = (Parameter(name, spread) for name, spread in found.items() if spread > 0.0 and name not in names)
    return (*free, *_gains(character, names), *known)


def _gains(character: Character, known: Collection[str]) -> Iterator[Parameter]:
    """The gains of each compliant motor, which have a common factor, but for those that a calibration tells."""
    spread = float(np.log1p(character.retarget.uncertainty.gains))
    for motor in character.motors:
        if spread > 0.0 and motor.model != PRESCRIBED and motor.follows is None:
            own = [f"{gain} {motor.path}" for gain in GAINS if 0.0 < getattr(motor, gain) < np.inf]
            own = [name for name in own if name not in known]
            if own:
                yield Parameter(own[0], spread, tuple((name, spread) for name in own[1:]))


def _calibrated(shot: CompiledShot) -> tuple[Parameter, ...]:
    """Independent parameters whose factors together have the covariance that a calibration tells."""
    character = shot.character
    given = character.retarget.uncertainty.calibrated
    flexible = [b for b in character.bodies if b.flexible is not None and b.simulated_flexible]
    paths = {
        **dict.fromkeys((MODULUS, DAMPING), [b.flexible.material.path for b in flexible if b.flexible]),
        MASS: [b.path for b in character.bodies if not (b.simulated_flexible or b.between)],
        **dict.fromkeys(
            (*OF_MOTOR, *OF_ROTOR, LOAD_FRICTION), [m.path for m in character.motors if m.model != PRESCRIBED]
        ),
    }
    own = [k for k, name in enumerate(given.names) if name.partition(" ")[2] in paths.get(name.partition(" ")[0], ())]
    if not own:
        return ()
    root = np.linalg.cholesky(np.array(given.covariance)[np.ix_(own, own)])
    names = [given.names[k] for k in own]
    return tuple(
        Parameter(name, float(root[i, i]), tuple((names[j], float(root[j, i])) for j in range(i + 1, len(own))))
        for i, name in enumerate(names)
    )


def payload_bodies(shot: CompiledShot) -> tuple[int, ...]:
    """The rigid bodies at the ends of the chains, by their index; of a robot of one body none."""
    tree, bodies = shot.tree, shot.character.bodies
    carriers = {int(parent) for parent in tree.parent}
    ends = (k for k, parent in enumerate(tree.parent) if parent >= 0 and k not in carriers)
    return tuple(tree.body[k] for k in ends if not bodies[tree.body[k]].simulated_flexible)


def random_scenarios(parameters: Sequence[Parameter], count: int) -> tuple[Scenario, ...]:
    """Random robots of equal weights."""
    points = np.random.default_rng(_SEED).standard_normal((count, len(parameters)))
    return tuple(scenario_at(parameters, x, 1.0 / count) for x in points)


def scenario_at(parameters: Sequence[Parameter], x: Array, weight: float = 1.0) -> Scenario:
    """The robot whose parameters are x standard deviations off; the nominal one at zero."""
    if not np.any(x):
        return Scenario({}, weight)
    logs: dict[str, float] = {}
    for p, v in zip(parameters, x, strict=True):
        for name, spread in ((p.name, p.spread), *p.others):
            logs[name] = logs.get(name, 0.0) + spread * float(v)
    return Scenario({name: float(np.exp(log)) for name, log in logs.items()}, weight)


def shot_of(shot: CompiledShot, scenario: Scenario) -> CompiledShot:
    """The shot on the robot of a scenario; the shot itself where that is the nominal one."""
    if not scenario.factors:
        return shot
    ends, character = set(payload_bodies(shot)), shot.character
    bodies = [_scaled(body, character, k, k in ends, scenario.factors) for k, body in enumerate(shot.bodies)]
    motors = tuple(_other_motor(motor, scenario.factors) for motor in character.motors)
    if motors == character.motors:
        return shot.with_bodies(bodies)
    return compile_shot(replace(character, motors=motors), shot.animation, bodies)


def _other_motor(motor: Motor, factors: Mapping[str, float]) -> Motor:
    """A motor with other gains, rotor or delay; itself where nothing is other."""
    own = {
        name: factors[f"{name} {motor.path}"]
        for name in (*OF_MOTOR, *OF_ROTOR, LOAD_FRICTION)
        if f"{name} {motor.path}" in factors
    }
    if not own:
        return motor
    # before the gain, which may change the largest torque, is another
    of_motor = {name: own[name] * getattr(motor, name) for name in OF_MOTOR[1:] if name in own}
    if GAINS[0] in own:
        motor = motor.with_gain(own[GAINS[0]] * motor.position_gain)
    rotor: dict[str, Any] = {name: own[name] * getattr(motor.rotor, name) for name in OF_ROTOR if name in own}
    if LOAD_FRICTION in own:
        rotor["law"] = motor.rotor.law.with_share(own[LOAD_FRICTION] * motor.rotor.law.share)
    return replace(motor, rotor=replace(motor.rotor, **rotor), **of_motor)


def _scaled(
    body: ReducedBody, character: Character, index: int, end: bool, factors: Mapping[str, float]
) -> ReducedBody:
    """A reduced body with other parameters."""
    own = character.bodies[index]
    if own.flexible is not None and own.simulated_flexible:
        material = own.flexible.material
        modulus, damping = (factors.get(f"{kind} {material.path}", 1.0) for kind in (MODULUS, DAMPING))
        return scaled_body(body, material, modulus, damping)
    factor = factors.get(f"{MASS} {own.path}", factors.get(PAYLOAD, 1.0) if end else 1.0)
    return body if factor == 1.0 else replace(body, invariants=_heavier(body.invariants, factor))


def scaled_body(body: ReducedBody, material: ElasticMaterial, modulus: float, damping: float) -> ReducedBody:
    """A flexible body of another modulus and damping.

    Args:
        material: Its material: a damping ratio keeps its value when the modulus changes, Rayleigh coefficients keep
            theirs.
        modulus: Factor of Young's modulus.
        damping: Factor of the damping ratio, or of both Rayleigh coefficients.
    """
    softer, law = with_scaled_stiffness(body, modulus), body.elasticity
    if material.rayleigh is None:
        by_mass, by_stiffness = np.sqrt(modulus) * body.damping, damping / np.sqrt(modulus)
    else:
        # the part proportional to the stiffness, which a nonlinear body has in its elastic law
        grown = np.zeros_like(body.stiffness) if law is not None else (modulus - 1.0) * body.stiffness
        by_mass, by_stiffness = body.damping + np.diag(material.rayleigh[1] * grown), damping
    elasticity = softer.elasticity
    if elasticity is not None:
        elasticity = replace(elasticity, retardation=by_stiffness * elasticity.retardation)
    return replace(softer, damping=damping * by_mass, elasticity=elasticity)


def _heavier(given: Invariants, factor: float) -> Invariants:
    """The integrals of a rigid body of another density."""
    return replace(given, mass=factor * given.mass, s=factor * given.s, Z=factor * given.Z)
