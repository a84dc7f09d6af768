"""The columns of a result's table: targets, motors and joints at each time step, named as the USD contract does."""

import numpy as np

from calmotion.arrays import Array
from calmotion.model.character import Character
from calmotion.model.result import Result, Simulation


def columns(character: Character, result: Result) -> dict[str, Array]:
    """Name to values, all of the same length; the pre-roll is not part of the shot and left out.

    The motion is the optimised one where there is one, else the simulated one. A motor's input is the
    animator's curve, its output the curve that was simulated. The motion as animated follows in columns `..._before`
    where there is an optimised one.

    Reactions are what each joint does to its body1, world axes, see `calmotion.model.Motion`.

    Returns:
        `time_s` [s], and at another tempo `animation_s`, the time of the animation; positions and errors of targets
        [m], rotation errors [rad]; motor angles [rad] or lengths [m],
        efforts [N m] or [N]; `<joint path>.force.x` and so on [N], `<joint path>.moment.x` and so on [N m].
    """
    simulation = result.after or result.before
    motion = simulation.motion
    rows = motion.judged
    table = {"time_s": motion.times[rows]}
    if result.retimed is not None and (tempo := result.retimed.animation.tempo) is not None:
        table["animation_s"] = tempo.animated(table["time_s"])
    table |= target_columns(character, simulation)
    for m, motor in enumerate(character.motors):
        table[f"{motor.path}.input"] = result.reference.motor_values[rows, m]
        table[f"{motor.path}.output"] = motion.motor_values[rows, m]
        table[f"{motor.path}.effort"] = motion.motor_efforts[rows, m]
    for name, values in (("force", motion.joint_forces), ("moment", motion.joint_moments)):
        if values is None:
            continue
        for j, joint in enumerate(character.joints):
            for axis, letter in enumerate("xyz"):
                table[f"{joint.path}.{name}.{letter}"] = values[rows, j, axis]
    if result.after is not None:
        before = target_columns(character, result.before)
        times = result.before.motion.times[result.before.motion.judged]
        if not np.array_equal(times, table["time_s"]):
            before = {name: np.interp(table["time_s"], times, values) for name, values in before.items()}
        table |= {f"{name}_before": values for name, values in before.items()}
    return table


def target_columns(character: Character, simulation: Simulation) -> dict[str, Array]:
    """Positions and errors of the targets [m], and rotation errors [rad], at each step of a simulation."""
    rows, table = simulation.motion.judged, {}
    for k, target in enumerate(character.targets):
        for axis, name in enumerate("xyz"):
            table[f"{target.path}.{name}"] = simulation.motion.target_positions[rows, k, axis]
        table[f"{target.path}.error"] = simulation.position_errors[rows, k]
        table[f"{target.path}.rotation_error"] = simulation.rotation_errors[rows, k]
    return table


def read_only(values: Array) -> Array:
    """A view that cannot be written to: what is written of a result later must not differ from its report."""
    view = values.view()
    view.flags.writeable = False
    return view
