"""The input of a search, simulated anew: a search needs a rough model of the shake only, its report more."""

from dataclasses import replace

from calmotion.errors import ShotError
from calmotion.model import Result
from calmotion.model.run import RunSettings
from calmotion.model.tolerance import tolerance_of
from calmotion.retargeting.found_curves import best_so_far
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.simulation.report import at_instants
from calmotion.simulation.simulate import simulate_shot
from calmotion.tolerance.integrator_choice import FAST, SAFE
from calmotion.tolerance.step_error import CLOSED_GAP, distance, order_of

OF_SHAKE = 0.01  # of the largest error of the input: how well it is told where the tolerance is less
FINEST = 4  # most steps in one of the search
_ROUNDED = 1e-9  # relative, for a step that is a whole part of another


def with_input_resolved(result: Result, shot: CompiledShot, options: RunSettings) -> Result:
    """The result of a search with the input as steps show it whose error is within the tolerance, or a hundredth of the
    input's own error; its instants are those of the search. As the search had it where finer steps fail.

    Args:
        shot: With the tracks of the input.
        options: Of a run whose step is chosen.
    """
    before = result.before
    enough = max(
        tolerance_of(shot.character, options.tolerance), OF_SHAKE * float(before.position_errors.max(initial=0.0))
    )
    scheme, parts = FAST, 1  # a quarter of the search's error by the same steps, as by half of them otherwise
    while parts <= FINEST:
        step = result.step_s / parts * (1.0 + _ROUNDED)
        finer = replace(options, integrator=scheme, step=step, pre_roll=result.pre_roll_s)
        try:
            found = simulate_shot(shot, finer, lambda fraction, message: None).before
        except ShotError:
            if scheme == SAFE:
                break
            scheme, parts = SAFE, 2 * parts
            continue
        except KeyboardInterrupt:
            return best_so_far(result)
        found = at_instants(found, slice(None, None, parts))
        changed = distance(found.motion.target_positions, before.motion.target_positions)
        before, parts = found, 2 * parts
        # Richardson's extrapolation
        if changed <= (2.0 ** order_of(shot.character) - 1.0) * enough and found.max_joint_gap <= CLOSED_GAP:
            break
    return replace(result, before=before)
