"""Robots that differ from the model: their parameters, sets of them, and their compiled shots.

A factor of a modulus, a damping or a payload scales the matrices of a reduced body exactly, so that no mesh and no
reduction is made anew (docs/formulation.md, "Robust retargeting").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from calmotion.reduction.reduced_body import Invariants, ReducedBody
from calmotion.reduction.scaled_stiffness import with_scaled_stiffness
from calmotion.shot import Character
from calmotion.shot.character import Array, ElasticMaterial
from calmotion.shot.robust.robots import Scenario
from calmotion.simulation.compiled_shot import CompiledShot

MODULUS, DAMPING, PAYLOAD = "modulus", "damping", "payload"
_SEED = 20190704  # of the draws, which are the same in every run


@dataclass(frozen=True)
class Parameter:
    """A parameter that is not known exactly.

    Attributes:
        name: `modulus PATH` and `damping PATH` of a material, or `payload`.
        spread: Standard deviation of the logarithm of its factor.
    """

    name: str
    spread: float


def uncertain_parameters(shot: CompiledShot) -> tuple[Parameter, ...]:
    """The parameters of a shot that are not known exactly; empty where all its uncertainties are zero."""
    character, found = shot.character, dict[str, float]()
    given = character.retarget.uncertainty
    for body in character.bodies:
        if body.flexible is not None and body.simulated_flexible:
            path = body.flexible.material.path
            found[f"{MODULUS} {path}"] = float(np.log1p(given.modulus))
            found[f"{DAMPING} {path}"] = float(np.log1p(given.damping))
    if payload_bodies(shot):
        found[PAYLOAD] = float(np.log1p(given.payload))
    return tuple(Parameter(name, spread) for name, spread in found.items() if spread > 0.0)


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
    return Scenario({p.name: float(np.exp(p.spread * v)) for p, v in zip(parameters, x, strict=True)}, weight)


def shot_of(shot: CompiledShot, scenario: Scenario) -> CompiledShot:
    """The shot on the robot of a scenario; the shot itself where that is the nominal one."""
    if not scenario.factors:
        return shot
    ends = set(payload_bodies(shot))
    return shot.with_bodies(
        [_scaled(body, shot.character, k, k in ends, scenario.factors) for k, body in enumerate(shot.bodies)]
    )


def _scaled(
    body: ReducedBody, character: Character, index: int, end: bool, factors: Mapping[str, float]
) -> ReducedBody:
    """A reduced body with other parameters."""
    own = character.bodies[index]
    if own.flexible is not None and own.simulated_flexible:
        material = own.flexible.material
        modulus, damping = (factors.get(f"{kind} {material.path}", 1.0) for kind in (MODULUS, DAMPING))
        return scaled_body(body, material, modulus, damping)
    return replace(body, invariants=_heavier(body.invariants, factors.get(PAYLOAD, 1.0))) if end else body


def scaled_body(body: ReducedBody, material: ElasticMaterial, modulus: float, damping: float) -> ReducedBody:
    """A flexible body of another modulus and damping.

    Args:
        body: The body.
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
