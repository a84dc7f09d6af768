"""What a shot needs of its bodies, closed chains and motors, from the poses of the rigid robot."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from calmotion.errors import ShotError
from calmotion.mesh.mass import joined_surfaces, mass_of_solid, mass_of_tets
from calmotion.model import Animation, Body, Character, MassProperties, ModelChoice
from calmotion.model.character import contact_joints
from calmotion.model.model_choice import AUTO, OFF, ON
from calmotion.model.run import RunSettings
from calmotion.multibody.analysis.kinematics import target_frames
from calmotion.multibody.model.model import body_anchors, rigid_body
from calmotion.multibody.model.topology import Tree, chain_members
from calmotion.simulation.inputs.curves import leaders
from calmotion.simulation.preparation import grid_of
from calmotion.simulation.rigid_run import RigidPoses, rigid_poses
from calmotion.tolerance.simplification.influence import NOTHING, influence
from calmotion.tolerance.simplification.redundant_constraints import closures_of

STEP = 1.0 / 100.0  # between the poses of the rigid robot [s]
_MOVES = 1e-6  # range of a joint that moves [rad or m]
_STILL = 1e-6  # range of a target that does not, of the largest of all that moves


def decide(
    character: Character, animation: Animation, options: RunSettings, tree: Tree, choice: Callable[[str], str],
    changes: bool,
) -> tuple[Character, list[ModelChoice], tuple[str, ...]]:  # fmt: skip
    """Decide which bodies are rigid, which joints of closed chains are needed and which motors move targets.

    Args:
        tree: Of the character.
        choice: From a kind of simplification to `auto`, `on` or `off`.
        changes: Whether motors' curves are to be changed.

    Returns:
        The character marked with the decisions, these, and notes for the user.

    Raises:
        SimulationFailure: The rigid robot cannot follow its tracks.
        ShotError: Motors contradict each other in a closed chain.
    """
    poses_matter = changes or bool(tree.closing)
    if not poses_matter and choice("bodies") == AUTO:
        return character, [], ()
    rough = with_rough_masses(character)
    character, rows = _bodies(character, choice("bodies"))
    if not poses_matter:
        return character, rows, ()
    rigid = [rigid_body(body, own) for body, own in zip(rough.bodies, body_anchors(rough, tree), strict=True)]
    grid = grid_of(character, animation, replace(options, step=STEP))
    poses = rigid_poses(character, animation, grid, tree, rigid, options.tolerance)
    if changes:
        character, more = _motors(character, poses, choice("motors"))
        rows += more
    character, more = _loops(character, tree, poses, choice("loops"))
    return character, rows + more, _still_targets(character, poses)


def _still_targets(character: Character, poses: RigidPoses) -> tuple[str, ...]:
    """Notes about targets whose position counts and does not change while motors move."""
    if not np.ptp(poses.joint_angles, axis=0).max(initial=0.0) > _MOVES:
        return ()
    places, _ = target_frames(poses.model, poses.c, poses.q, np.zeros(poses.c.shape[:2] + (0,)))
    spread = np.linalg.norm(np.ptp(places, axis=0), axis=1)
    largest = max(float(spread.max(initial=0.0)), float(np.linalg.norm(np.ptp(poses.c, axis=0), axis=1).max()))
    return tuple(
        f"target {target.path} does not move, so that it shows no shake: choose a point of a link that moves"
        for target, moved in zip(character.targets, spread, strict=True)
        if target.position_weight > 0.0 and moved <= _STILL * largest
    )


def with_rough_masses(character: Character) -> Character:
    """A character whose bodies can all be simulated as rigid: enough for motions that motors determine."""
    bodies = character.bodies
    return replace(
        character, bodies=tuple(body if body.mass else replace(body, mass=_rough_mass(body)) for body in bodies)
    )


def _rough_mass(body: Body) -> MassProperties | None:
    """Of a flexible body: that of its tetrahedra or of what its visible surfaces wind around, or of half the box around
    it where that is nothing; None of other bodies."""
    if body.flexible is None:
        return None
    density = body.flexible.material.density
    surfaces = [surface for surface in body.surfaces if surface.visible and len(surface.triangles)]
    joined = None if body.tets is not None or not surfaces else joined_surfaces(surfaces)
    found = None
    if body.tets is not None:
        found = mass_of_tets(body.tets.points, body.tets.tets, density)
    elif joined is not None:
        found = mass_of_solid(*joined, density)
    if found is not None and found.mass > 0.0 and np.linalg.eigvalsh(found.inertia)[0] > 0.0:
        return found
    corners = np.concatenate([np.zeros((1, 3))] if joined is None else [joined[0]])
    size = np.maximum(np.ptp(corners, axis=0), 1e-3)
    mass = 0.5 * density * float(np.prod(size))
    across = mass / 12.0 * (float(size @ size) - size**2)
    return MassProperties(mass, 0.5 * (corners.min(axis=0) + corners.max(axis=0)), np.diag(across))


def _bodies(character: Character, choice: str) -> tuple[Character, list[ModelChoice]]:
    """Flexible bodies that the user forces to be rigid or flexible; the others keep their finite elements."""
    if choice == AUTO:
        return character, []
    bodies, rows = list(character.bodies), []
    for k, body in enumerate(character.bodies):
        if body.flexible is None:
            continue
        why, mass = "forced by the user", None
        if choice == OFF:
            try:
                mass = _exact_mass(character, k)
            except ShotError as error:
                why = f"its mass is not known: {error.problem}"
        if mass is not None:
            bodies[k] = replace(body, stiff=True, mass=mass)
        model = "flexible" if mass is None else "rigid"
        rows.append(ModelChoice("bodies", f"{body.path}: {model}", mass is None, why, None, True))
    return replace(character, bodies=tuple(bodies)), rows


def _exact_mass(character: Character, index: int) -> MassProperties:
    """That of the solid of a flexible body.

    Raises:
        ShotError: It has none, or its density is not the same everywhere.
    """
    from calmotion.tolerance.meshes.accurate_mesh import frames_of
    from calmotion.tolerance.meshes.body_mesh import geometry_of
    from calmotion.tolerance.meshes.options import MeshOptions, Volume

    body = character.bodies[index]
    assert body.flexible is not None
    material, stated = body.flexible.material, None if body.mass is None else body.mass.mass
    if material.core is not None or material.parts:
        raise ShotError("only the mesh of a body of several materials has it", path=body.path)
    geometry = geometry_of(index, body, MeshOptions(), frames_of(character, index))
    if isinstance(geometry, Volume):
        return mass_of_solid(geometry.solid.points, geometry.solid.triangles, material.density, stated)
    return mass_of_tets(geometry.points, geometry.tets, material.density, stated)


def _motors(character: Character, rigid: RigidPoses, choice: str) -> tuple[Character, list[ModelChoice]]:
    """Motors that move no target."""
    if contact_joints(character):  # where a foot lands follows from all that was before
        return character, []
    own = leaders(character)
    reach = influence(character, rigid, own) if len(own) else np.zeros(0)
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


def _loops(character: Character, tree: Tree, rigid: RigidPoses, choice: str) -> tuple[Character, list[ModelChoice]]:
    """Closed loops, and joints that could be left out of them."""
    found = closures_of(rigid)
    if not found.joints:
        return character, []
    joints, rows = list(character.joints), []
    order = [*tree.joint, *tree.closing]
    for k in found.joints:
        item = joints[order[k]]
        members = chain_members(tree.parent, rigid.model.system.side[k])
        flexible = any(character.bodies[tree.body[b]].simulated_flexible for b in members)
        if k in found.redundant and choice != ON and (choice == OFF or not flexible):
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
