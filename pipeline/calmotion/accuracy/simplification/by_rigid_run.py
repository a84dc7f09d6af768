"""What a shot needs of its bodies, loops and motors, from their geometry and one simulation of the rigid robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from calmotion.accuracy.deflection_bound.bound import Stiffness, static_reach
from calmotion.accuracy.simplification.influence import NOTHING, influence
from calmotion.accuracy.simplification.redundant_constraints import closures_of
from calmotion.geometry.solid import solid_of
from calmotion.multibody.model.joint_arrays import BodyAnchors
from calmotion.multibody.model.model import Model, body_anchors, rigid_body
from calmotion.multibody.model.topology import Tree, chain_members
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.shot import Animation, Body, Character, MassProperties, ModelChoice
from calmotion.shot.model_choice import AUTO, OFF, ON
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.gearing import leaders
from calmotion.simulation.prepare import grid_of
from calmotion.simulation.rigid_run import excitation_of, rigid_run
from calmotion.simulation.settings import Options

STEP = 1.0 / 100.0  # of the rigid robot's simulation [s]: loads are those of the animation, and safe bounds follow


def decide(
    character: Character, animation: Animation, options: Options, tree: Tree, choice: Callable[[str], str],
    allowed: float, changes: bool,
) -> tuple[Character, list[ModelChoice], dict[int, Stiffness]]:  # fmt: skip
    """Decide which bodies bend, which loops are needed and which motors move targets.

    Args:
        tree: Of the character.
        choice: From a kind of need to `auto`, `on` or `off`.
        allowed: What bodies taken as rigid may cost together at the targets [m].
        changes: Whether motors' curves are to be changed.

    Returns:
        The character marked with the decisions, these, and how far flexible bodies bend, where that can be told.

    Raises:
        SimulationFailure: The rigid robot cannot follow its tracks.
    """
    solids = {k: solid_of(body) for k, body in enumerate(character.bodies) if body.flexible is not None}
    known = {k: None if solid is None else solid.mass for k, solid in solids.items()}
    rough = replace(character, bodies=tuple(_with_mass(k, body, known) for k, body in enumerate(character.bodies)))
    anchors = body_anchors(rough, tree)
    rigid = [rigid_body(body, own) for body, own in zip(rough.bodies, anchors, strict=True)]
    grid = grid_of(character, animation, replace(options, step=STEP))
    model, run = rigid_run(character, animation, grid, tree, rigid)
    character, rows = _motors(character, model, run, choice("motors")) if changes else (character, [])
    # loads of one body depend on the masses of all
    trusted = all(mass is not None for mass in known.values())
    stiffness = _stiffness(rough, anchors, excitation_of(character, model, run, grid.h)) if trusted else {}
    masses = {k: mass for k, mass in known.items() if mass is not None}
    character, more = _bodies(character, stiffness, masses, allowed, choice("bodies"))
    rows += more
    character, more = _loops(character, tree, model, run, choice("loops"))
    return character, rows + more, stiffness


def _with_mass(index: int, body: Body, known: Mapping[int, MassProperties | None]) -> Body:
    """A body that can be simulated as rigid."""
    if index not in known:
        return body
    return replace(body, mass=known[index] or _guessed_mass(body))


def _guessed_mass(body: Body) -> MassProperties:
    """That of the box around a body, half full: enough for motions that motors determine."""
    assert body.flexible is not None
    points = [surface.points for surface in body.surfaces] or [np.zeros((1, 3))]
    corners = np.concatenate(points)
    size = np.maximum(np.ptp(corners, axis=0), 1e-3)
    mass = 0.5 * body.flexible.material.density * float(np.prod(size))
    across = mass / 12.0 * (float(size @ size) - size**2)
    return MassProperties(mass, 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.diag(across))


def _stiffness(
    character: Character, anchors: list[BodyAnchors], loads: tuple[LoadEnvelope, ...]
) -> dict[int, Stiffness]:
    """How far flexible bodies bend, where that can be told."""
    found = {
        k: static_reach(body, own, load)
        for k, (body, own, load) in enumerate(zip(character.bodies, anchors, loads, strict=True))
        if body.flexible is not None
    }
    return {k: stiffness for k, stiffness in found.items() if stiffness is not None}


def _bodies(
    character: Character, stiffness: Mapping[int, Stiffness], masses: Mapping[int, MassProperties], allowed: float,
    choice: str,
) -> tuple[Character, list[ModelChoice]]:  # fmt: skip
    """Flexible bodies that are simulated as rigid."""
    bodies, rows, spent = list(character.bodies), [], 0.0
    flexible = [k for k, body in enumerate(bodies) if body.flexible is not None]
    # those that bend least first, as long as all together stay within what is allowed
    for k in sorted(flexible, key=lambda k: stiffness[k].displacement_m if k in stiffness else np.inf):
        body, own, settings = bodies[k], stiffness.get(k), bodies[k].flexible
        assert settings is not None
        error = None if own is None else own.displacement_m
        deflects = "" if error is None else f"its deflection is at most {1e3 * error:.2g} mm"
        if choice != AUTO:
            stiff, why, is_forced = choice == OFF, "forced by the user", True
        elif settings.mode_count >= 0 or settings.elasticity != "auto":
            stiff, why, is_forced = False, "its attributes fix the model", True
        else:
            stiff, is_forced = error is not None and spent + error <= allowed, False
            why = deflects or "only finite elements can estimate its deflection"
        if stiff and k not in masses:
            stiff, why = False, "only the mesh gives its mass"
        if stiff:
            bodies[k] = replace(body, stiff=True, mass=masses[k])
            spent += error or 0.0
        model = "rigid" if stiff else "flexible"
        rows.append(ModelChoice("bodies", f"{body.path}: {model}", not stiff, why, error, is_forced))
    return replace(character, bodies=tuple(bodies)), rows


def _motors(character: Character, model: Model, run: ForwardRun, choice: str) -> tuple[Character, list[ModelChoice]]:
    """Motors that move no target."""
    own = leaders(character)
    reach = influence(character, model, run, own) if len(own) else np.zeros(0)
    if choice == ON or not np.any(reach > NOTHING):
        return character, []
    motors, rows = list(character.motors), []
    for k, far in zip(own, reach, strict=True):
        if far <= NOTHING:
            motors[k] = replace(motors[k], idle=True)
            rows.append(
                ModelChoice(
                    "motors", f"{motors[k].path}: not optimised", False, "it moves no target", None, choice == OFF
                )
            )
    return replace(character, motors=tuple(motors)), rows


def _loops(
    character: Character, tree: Tree, model: Model, run: ForwardRun, choice: str
) -> tuple[Character, list[ModelChoice]]:
    """Closed loops, and joints that could be left out of them."""
    found = closures_of(model, run)
    if not found.joints:
        return character, []
    joints, rows = list(character.joints), []
    order = [*tree.joint, *tree.closing]
    for k in found.joints:
        item = joints[order[k]]
        members = chain_members(tree.parent, model.system.side[k])
        bends = any(character.bodies[tree.body[b]].bends for b in members)
        if k in found.redundant and choice != ON and (choice == OFF or not bends):
            joints[order[k]] = replace(item, redundant=True)
            why = "other joints transmit its forces, and its own are shown as zero"
            rows.append(ModelChoice("loops", f"{item.path}: joint omitted", False, why, None, choice == OFF))
        else:
            rows.append(
                ModelChoice("loops", f"{item.path}: joint kept", True, "it closes a chain", None, choice != AUTO)
            )
    left = [k for k in found.joints if not joints[order[k]].redundant]
    if found.redundant_rows and left:
        why = f"{found.redundant_rows} constraint rows follow from others; the forces of least norm are used"
        rows.append(ModelChoice("loops", "redundant constraints", True, why))
    return replace(character, joints=tuple(joints)), rows
