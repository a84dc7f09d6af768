"""Runs of the engine as the values that plugins write: motions by body, simulations with errors, what was left out."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from calmotion.arrays import Array
from calmotion.model import LimitUse, Motion, Simplification, Simulation
from calmotion.model.limits.bounds import Excess
from calmotion.multibody.analysis.joint_faults import dead_centres, unheld_joints
from calmotion.multibody.analysis.reactions import reactions
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import Model
from calmotion.simulation.forward import ForwardRun
from calmotion.simulation.inputs.curves import Curves, sample_tracks
from calmotion.simulation.inputs.time_grid import TimeGrid
from calmotion.simulation.intended_motion import rigid_motion, rigid_targets
from calmotion.simulation.preparation import Prepared
from calmotion.simulation.target_errors import IntendedMotion, rotation_errors
from calmotion.support.naming import distinct_names


def by_body(model: Model, values: Array) -> Array:
    """Reorder the second axis, of components, to the character's bodies."""
    order = np.empty(len(model.tree.body), int)
    order[list(model.tree.body)] = np.arange(len(order))
    return np.take(values, order, axis=1)


def elastic_by_body(model: Model, u: Array) -> tuple[Array, ...]:
    """Modes' coordinates of each body of the character, shape [T, r], from those of the components, [T, B, r]."""
    component = {body: k for k, body in enumerate(model.tree.body)}
    return tuple(u[:, component[b], : model.system.modes[component[b]]].copy() for b in range(len(component)))


def _simulated_motion(model: Model, grid: TimeGrid, run: ForwardRun, joints: int) -> Motion:
    states = run.trajectory.states
    shown = _shown(grid)
    elastic = elastic_by_body(model, states.u[shown])
    found = reactions(model.system, run.trajectory, run.joint_angles, run.joint_rates)
    efforts = model.motor_efforts(found.efforts)
    forces, moments = (_by_joint(model, joints, part[shown]) for part in (found.forces, found.moments))
    return Motion(
        grid.times[shown], by_body(model, states.c[shown]), by_body(model, states.q[shown]), elastic,
        run.commands[shown], efforts[shown], run.target_positions[shown], run.target_rotations[shown], forces, moments,
    )  # fmt: skip


def _by_joint(model: Model, joints: int, values: Array) -> Array:
    """From the system's joints and sides to the character's, shape [T, J, 3]; a joint that is left out carries none."""
    out = np.zeros((len(values), joints, 3))
    out[:, [*model.tree.joint, *model.tree.closing]] = model.sign[:, None] * values
    return out


def _shown(grid: TimeGrid) -> slice:
    """Instants that the user gets: all, but of a shot that loops not the one before it."""
    return slice(1 if grid.cyclic else 0, None)


def reference_motion(model: Model, grid: TimeGrid, rigid: IntendedMotion, angles: Array) -> Motion:
    """The intended motion; it has no efforts."""
    shown = _shown(grid)
    times, angles = grid.times[shown], angles[shown]
    return Motion(
        times, by_body(model, rigid.c[shown]), by_body(model, rigid.q[shown]),
        tuple(np.zeros((len(times), 0)) for _ in model.tree.body), angles, np.full_like(angles, np.nan),
        rigid.target_positions[shown], rigid.target_rotations[shown],
    )  # fmt: skip


def performed_motion(prepared: Prepared, curves: Curves) -> Motion | None:
    """A rigid robot performing curves; None where a linkage cannot follow them."""
    model, grid = prepared.model, prepared.grid
    try:
        rigid = rigid_motion(model, curves.angles, curves.rates, grid.h, prepared.world, grid.cyclic)
    except SimulationFailure:
        return None
    return reference_motion(model, grid, rigid, curves.angles)


def simulation_of(prepared: Prepared, run: ForwardRun, intended: IntendedMotion) -> Simulation:
    """A forward run as a value for the user, measured against the reference."""
    model, grid, character = prepared.model, prepared.grid, prepared.character
    turned, _ = rotation_errors(intended.target_rotations, run.target_rotations)
    off = run.target_positions - intended.target_positions
    errors, shown = np.linalg.norm(off, axis=2), _shown(grid)
    return Simulation(
        motion=_simulated_motion(model, grid, run, len(character.joints)),
        position_errors=errors[shown],
        rotation_errors=np.linalg.norm(turned, axis=2)[shown],
        newton_iterations=run.trajectory.newton_iterations,
        max_joint_gap=run.trajectory.max_joint_gap,
        wall_s=run.trajectory.wall_s,
        sag=np.zeros(0) if grid.cyclic else _sag(prepared, run, errors[0]),
        refined_steps=len(run.trajectory.refined),
        dead_centres=grid.times[dead_centres(run.trajectory.margins)],
        floquet_multiplier=run.floquet_multiplier,
        seam=np.linalg.norm(off[-1] - off[shown][0], axis=1) if grid.cyclic else np.zeros(0),
    )


def at_instants(simulation: Simulation, rows: slice) -> Simulation:
    """Some instants of a simulation; what it tells of all its steps remains."""
    motion = simulation.motion

    def cut(part: Array) -> Array:
        return part[rows].copy()

    def known(part: Array | None) -> Array | None:
        return None if part is None else cut(part)

    kept = Motion(
        cut(motion.times), cut(motion.positions), cut(motion.rotations), tuple(cut(part) for part in motion.elastic),
        cut(motion.motor_values), cut(motion.motor_efforts), cut(motion.target_positions), cut(motion.target_rotations),
        known(motion.joint_forces), known(motion.joint_moments),
    )  # fmt: skip
    return replace(
        simulation,
        motion=kept,
        position_errors=cut(simulation.position_errors),
        rotation_errors=cut(simulation.rotation_errors),
    )


def _sag(prepared: Prepared, run: ForwardRun, errors: Array) -> Array:
    """How far the targets of the robot at rest are from those of a rigid one on the same commands [m], shape [K].

    Args:
        errors: Distances to the reference, which are taken for it where joints move freely [m], shape [K].
    """
    rigid = rigid_targets(prepared.model, run.commands[:1], prepared.world[:1])
    return errors.copy() if rigid is None else np.linalg.norm(run.target_positions[0] - rigid[0], axis=1)


def left_out_rows(prepared: Prepared) -> list[Simplification]:
    """What a run of this shot leaves out."""
    character, grid = prepared.character, prepared.grid
    rigid = [body.path for body in character.bodies if body.flexible is None and not body.between]
    names = ", ".join(distinct_names(rigid).values())
    rows = [Simplification(f"{names}: rigid", "without CalmFlexibleBodyAPI")] if rigid else []
    rows += [row for body in prepared.bodies for row in body.left_out]
    if not grid.pre_roll:
        rows.append(Simplification("no pre-roll", "the shot is cyclic" if grid.cyclic else "the shot starts at rest"))
    rows += _unheld_rows(prepared)
    locked = [motor.path for motor in character.motors if not motor.optimize]
    rows += [Simplification(f"{path}: not optimised", "calm:motor:optimize is false") for path in locked]
    return rows


def _unheld_rows(prepared: Prepared) -> list[Simplification]:
    """The free joints that start where the shot has them, since nothing holds them there."""
    model, grid = prepared.model, prepared.grid
    angles, _ = sample_tracks(prepared.shot.animation.tracks, grid)
    joints = unheld_joints(model, model.joint_angles(angles[0]), prepared.world[0])
    why = "it is free there: neither gravity nor a spring moves it"
    return [
        Simplification(f"{prepared.character.joints[model.tree.joint[b]].path}: starts where the shot has it", why)
        for b in joints
    ]


def limit_uses(
    before: Sequence[Excess],
    after: Sequence[Excess],
    grid: TimeGrid,
    costs: Mapping[tuple[int, str], float] | None = None,
) -> tuple[LimitUse, ...]:
    """The limits of the motors as values for the user.

    Args:
        before, after: Of the input and of the result, in the same order.
        costs: Of limits that bind, by motor and quantity [m].
    """
    return tuple(
        LimitUse(
            item.motor, item.quantity, item.limit, first.value, item.value, float(grid.times[item.instant]),
            item.excess, (costs or {}).get((item.motor, item.quantity)),
        )
        for first, item in zip(before, after, strict=True)
    )  # fmt: skip
