"""Limits of the motors that an animation exceeds, before anything is meshed: what `inspect` tells."""

from __future__ import annotations

from calmotion.model import Animation, Character
from calmotion.model.character import with_ideal_motors
from calmotion.model.limits.base import CurveLimit
from calmotion.model.limits.kinds import kinds_of_limits
from calmotion.model.limits.use import LimitUse, is_exceeded
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import body_anchors, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.simulation.compiled_shot import compile_shot
from calmotion.simulation.cyclic import SteadyState
from calmotion.simulation.forward import limited_values, run_forward
from calmotion.simulation.inputs.curves import sample_curves
from calmotion.simulation.motor_limits import excesses, motor_bounds
from calmotion.simulation.preparation import prepare
from calmotion.simulation.report import limit_uses
from calmotion.tolerance.simplification.by_rigid_poses import with_rough_masses


def exceeded_limits(character: Character, animation: Animation, options: RunSettings) -> tuple[LimitUse, ...]:
    """The limits that an animation exceeds on a rigid robot with ideal motors, each where it does most.

    Efforts are those of rigid links: flexible ones swing about them. Links without a stated mass have that of their
    closed surface, or of half of the box around it. Where the robot cannot follow the animation, efforts are unknown.

    Args:
        character, animation: The shot.
        options: Of the run.
    """
    bounds = motor_bounds(character)
    if not bounds:
        return ()
    tree, rough = span_tree(character), with_rough_masses(with_ideal_motors(character))
    rigid = [rigid_body(body, own) for body, own in zip(rough.bodies, body_anchors(rough, tree), strict=True)]
    prepared = prepare(compile_shot(rough, animation, rigid), options)
    model, grid, world = prepared.model, prepared.grid, prepared.world
    curves, workspace = sample_curves(animation.tracks, grid), Workspace.for_system(model.system)
    steady = SteadyState(model, world, grid.h, workspace) if grid.cyclic else None
    try:
        run = run_forward(model, workspace, curves.angles, curves.rates, grid.h, world, steady=steady)
        values = limited_values(model, bounds, curves, run)
    except SimulationFailure:
        kinds = {name: kind for name, kind in kinds_of_limits().items() if isinstance(kind, CurveLimit)}
        values = {name: curves.derivatives[kinds[name].order] for name in bounds if name in kinds}
        bounds = {name: bounds[name] for name in values}
    found = excesses(bounds, values, grid.judged)
    return tuple(use for use in limit_uses(found, found, grid) if is_exceeded(use))
