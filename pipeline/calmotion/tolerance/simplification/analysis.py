"""What a shot needs, from its geometry and one simulation of the rigid robot: before meshes and finite elements."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from calmotion.model import Animation, Character, FlexibleSettings, ModelChoice, ModelChoices
from calmotion.model.character import with_settings
from calmotion.model.model_choice import AUTO, OFF, ON
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.topology import span_tree
from calmotion.support.naming import distinct_names
from calmotion.tolerance.simplification.rotating_bodies import Turning, turning_of

FINE, NONE = 1e-3, np.inf  # shares of the tolerance for modes that are left out, where modes are forced on and off


def analyse(
    character: Character, animation: Animation, options: RunSettings, forced: Mapping[str, str], changes: bool
) -> ModelChoices:
    """Decide what a shot needs.

    Args:
        options: With the tolerance.
        forced: Kinds of `shot.model_choice.KINDS` that are forced `on` or `off`.
        changes: Whether motors' curves are to be changed.

    Returns:
        The decisions, and the character marked with them. A shot whose rigid robot cannot follow its tracks keeps
        everything: the flexible one will say why.

    Raises:
        ShotError: Motors contradict each other in a closed chain.
    """
    forced = {kind: choice for kind, choice in forced.items() if choice != AUTO}
    choice = partial(_choice, forced)
    if len(animation.frame_times) < 2:
        return ModelChoices(_with_forced(character, forced), (), forced)
    tree = span_tree(character)
    rows: list[ModelChoice] = []
    notes: tuple[str, ...] = ()
    if tree.closing or any(body.flexible for body in character.bodies):
        # what simulates the rigid robot takes a while to load, and a rigid shot without loops does not need it
        from calmotion.tolerance.simplification.by_rigid_poses import decide

        try:
            character, rows, notes = decide(character, animation, options, tree, choice, changes)
        except SimulationFailure:
            return ModelChoices(_with_forced(character, forced), (), forced)
    found = _turning(turning_of(character, animation, tree, changes), choice("turning"))
    character, more = _straight(character, found, "turning" in forced)
    return ModelChoices(_with_forced(character, forced), (*rows, *more), forced, notes)


def _choice(forced: Mapping[str, str], kind: str) -> str:
    return forced.get(kind, AUTO)


def _with_forced(character: Character, forced: Mapping[str, str]) -> Character:
    """The character with modes, their pairs and elastic laws as they are forced."""

    def settings(own: FlexibleSettings) -> FlexibleSettings:
        if "modes" in forced:
            own = replace(own, modes_share=FINE if forced["modes"] == ON else NONE)
        if forced.get("directions") == ON:
            own = replace(own, pairs_share=0.0)
        if "elasticity" in forced:
            own = replace(own, elasticity="stvk" if forced["elasticity"] == ON else "linear")
        return own

    return with_settings(character, settings)


def _turning(found: list[Turning], choice: str) -> list[Turning]:
    """What is decided of what was found."""
    if choice == ON:
        return [replace(item, turns=True, why="forced by the user") for item in found]
    if choice == OFF:
        return [replace(item, turns=False, why="forced by the user") for item in found]
    return found


def _straight(character: Character, found: list[Turning], forced: bool) -> tuple[Character, list[ModelChoice]]:
    """The character with its bodies marked, and a row for each reason."""
    bodies = tuple(replace(b, non_rotating=not t.turns) for b, t in zip(character.bodies, found, strict=True))
    names = distinct_names([body.path for body in bodies])
    groups: dict[tuple[bool, str], list[int]] = {}
    for k, item in enumerate(found):
        groups.setdefault((item.turns, item.why), []).append(k)
    rows = []
    for (turns, why), members in groups.items():
        terms = "gyroscopic terms" if turns else "no gyroscopic terms"
        what = ", ".join(names[bodies[k].path] for k in members) + f": {terms}"
        rows.append(ModelChoice("turning", what, turns, why, None, forced))
    return replace(character, bodies=bodies), rows
