"""What a shot needs, from its geometry and one simulation of the rigid robot: before meshes and finite elements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from ..dynamics.failure import SimulationFailure
from ..dynamics.joint_arrays import BodyAnchors
from ..dynamics.model import Model, body_anchors, rigid_body
from ..dynamics.topology import Tree, loop_members, span_tree
from ..fem.excitation_data import Excitation
from ..naming import distinct_names
from ..retarget.coupling import leaders
from ..retarget.excitation import excitation_of, rigid_run
from ..retarget.forward import ForwardRun
from ..retarget.prepare import Options, grid_of
from ..shot import Animation, Body, Character, FlexibleSettings, MassProperties, Need, Needs
from ..shot.needs import AUTO, OFF, ON
from .bending import Stiffness, static_reach
from .closures import closures_of
from .influence import NOTHING, influence
from .solid import solid_of
from .turning import Turning, turning_of

SHARE = 0.2  # of the tolerance, that bodies taken as rigid may take together, and those taken as not turning
FINE, NONE = 1e-3, np.inf  # shares of the tolerance for modes that are left out, where modes are forced on and off


def analyse(
    character: Character, animation: Animation, options: Options, forced: Mapping[str, str], changes: bool
) -> Needs:
    """Decide what a shot needs.

    Args:
        options: With the tolerance.
        forced: Kinds of `shot.needs.KINDS` that are forced `on` or `off`.
        changes: Whether motors' curves are to be changed.

    Returns:
        The decisions, and the character marked with them. A shot whose rigid robot cannot follow its tracks keeps
        everything: the flexible one will say why.
    """
    forced = {kind: choice for kind, choice in forced.items() if choice != AUTO}
    choice = partial(_choice, forced)
    character = _asked(character, forced)
    tree = span_tree(character)
    solids = {k: solid_of(body) for k, body in enumerate(character.bodies) if body.flexible is not None}
    known = {k: None if solid is None else solid.mass for k, solid in solids.items()}
    rough = replace(character, bodies=tuple(_with_mass(k, body, known) for k, body in enumerate(character.bodies)))
    anchors = body_anchors(rough, tree)
    rigid = [rigid_body(body, own) for body, own in zip(rough.bodies, anchors, strict=True)]
    if len(animation.frame_times) < 2:
        return Needs(character, (), forced)
    try:
        grid = grid_of(character, animation, options)
        model, run = rigid_run(character, animation, grid, tree, rigid)
        loads = excitation_of(character, model, run, grid.h)
        character, rows = _motors(character, model, run, choice("motors")) if changes else (character, [])
        allowed = SHARE * character.retarget.allowed(options.tolerance)
        trusted = all(mass is not None for mass in known.values())
        stiffness = _stiffness(rough, anchors, loads) if trusted else {}
        masses = {k: mass for k, mass in known.items() if mass is not None}
        character, more = _bodies(character, stiffness, masses, allowed, choice("bodies"))
        rows += more
        character, more = _loops(character, tree, model, run, choice("loops"))
        rows += more
        bodies = _turning(turning_of(character, animation, tree, stiffness, changes), choice("turning"), allowed)
        character, more = _straight(character, bodies)
        rows += more
    except SimulationFailure:
        return Needs(character, (), forced)
    return Needs(character, tuple(rows), forced)


def _choice(forced: Mapping[str, str], kind: str) -> str:
    return forced.get(kind, AUTO)


def _asked(character: Character, forced: Mapping[str, str]) -> Character:
    """The character with modes and elastic laws as they are forced."""

    def settings(own: FlexibleSettings) -> FlexibleSettings:
        if "modes" in forced:
            own = replace(own, modes_share=FINE if forced["modes"] == ON else NONE)
        if "elasticity" in forced:
            own = replace(own, elasticity="stvk" if forced["elasticity"] == ON else "linear")
        return own

    bodies = tuple(
        body if body.flexible is None else replace(body, flexible=settings(body.flexible)) for body in character.bodies
    )
    return replace(character, bodies=bodies)


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


def _stiffness(character: Character, anchors: list[BodyAnchors], loads: tuple[Excitation, ...]) -> dict[int, Stiffness]:
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
) -> tuple[Character, list[Need]]:  # fmt: skip
    """Flexible bodies that are simulated as rigid."""
    bodies, rows, spent = list(character.bodies), [], 0.0
    flexible = [k for k, body in enumerate(bodies) if body.flexible is not None]
    # those that bend least first, as long as all together stay within what is allowed
    for k in sorted(flexible, key=lambda k: stiffness[k].displacement_m if k in stiffness else np.inf):
        body, own, settings = bodies[k], stiffness.get(k), bodies[k].flexible
        assert settings is not None
        error = None if own is None else own.displacement_m
        bends = "" if error is None else f"it bends by at most {1e3 * error:.2g} mm"
        if choice != AUTO:
            stiff, why, is_forced = choice == OFF, f"forced {choice}", True
        elif settings.mode_count >= 0 or settings.elasticity != "auto":
            stiff, why, is_forced = False, "the shot says how it is to be simulated", True
        else:
            stiff, is_forced = error is not None and spent + error <= allowed, False
            why = bends or "only finite elements tell how far it bends"
        if stiff and k not in masses:
            stiff, why = False, "its mass is only known from its mesh"
        if stiff:
            bodies[k] = replace(body, stiff=True, mass=masses[k])
            spent += error or 0.0
        rows.append(Need("bodies", f"finite elements of {body.path}", not stiff, why, error, is_forced))
    return replace(character, bodies=tuple(bodies)), rows


def _motors(character: Character, model: Model, run: ForwardRun, choice: str) -> tuple[Character, list[Need]]:
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
                Need("motors", f"optimisation of {motors[k].path}", False, "it moves no target", None, choice == OFF)
            )
    return replace(character, motors=tuple(motors)), rows


def _loops(
    character: Character, tree: Tree, model: Model, run: ForwardRun, choice: str
) -> tuple[Character, list[Need]]:
    """Closed loops, and joints that could be left out of them."""
    found = closures_of(model, run)
    if not found.joints:
        return character, [Need("loops", "closed loops", False, "no joint closes one")]
    joints, rows = list(character.joints), []
    order = [*tree.joint, *tree.loops]
    for k in found.joints:
        item = joints[order[k]]
        members = loop_members(tree.parent, model.system.side[k])
        bends = any(character.bodies[tree.body[b]].bends for b in members)
        if k in found.redundant and choice != ON and (choice == OFF or not bends):
            joints[order[k]] = replace(item, redundant=True)
            why = "other joints hold all that it holds; its force is shown as zero"
            rows.append(Need("loops", f"the joint {item.path}", False, why, None, choice == OFF))
        else:
            rows.append(Need("loops", f"the joint {item.path}", True, "it closes a loop", None, choice != AUTO))
    left = [k for k in found.joints if not joints[order[k]].redundant]
    if found.redundant_rows and left:
        why = f"{found.redundant_rows} rows of all joints follow from others, and are met by forces of least norm"
        rows.append(Need("loops", "redundant constraints", True, why))
    return replace(character, joints=tuple(joints)), rows


def _turning(found: list[Turning], choice: str, allowed: float) -> list[Turning]:
    """What is decided of what was found."""
    if choice == ON:
        return [replace(item, turns=True, why="forced on") for item in found]
    if choice == OFF:
        return [replace(item, turns=False, why="forced off") for item in found]
    return [
        replace(item, turns=True, why="what carries it bends too far")
        if (item.error_m or 0.0) > allowed / len(found)
        else item
        for item in found
    ]


def _straight(character: Character, found: list[Turning]) -> tuple[Character, list[Need]]:
    """The character with its bodies marked, and a row for each reason."""
    bodies = tuple(replace(b, straight=not t.turns) for b, t in zip(character.bodies, found, strict=True))
    names = distinct_names([body.path for body in bodies])
    groups: dict[tuple[bool, str], list[int]] = {}
    for k, item in enumerate(found):
        groups.setdefault((item.turns, item.why), []).append(k)
    rows = []
    for (turns, why), members in groups.items():
        errors = [error for k in members if (error := found[k].error_m) is not None]
        what = "turning of " + ", ".join(names[bodies[k].path] for k in members)
        rows.append(Need("turning", what, turns, why, sum(errors) if errors else None, why.startswith("forced")))
    return replace(character, bodies=bodies), rows
