"""Settings and motions that no simulation of a shot supports; they follow from its input alone."""

import numpy as np

from calmotion.arrays import Array
from calmotion.errors import IntegrationError, ShotError
from calmotion.model import Animation, Character
from calmotion.model.run import INTEGRATORS, RunSettings
from calmotion.model.tolerance import reach
from calmotion.multibody.integrators.integrate import follows_roots
from calmotion.simulation.cyclic import refuse_open_loops
from calmotion.simulation.inputs.contacts import refuse_unsupported_contacts
from calmotion.simulation.inputs.time_grid import TimeGrid

ROUNDING = 1e-9  # of the reach: no simulation has smaller errors
FINEST = 1e-9  # shortest step [s]
LONGEST_PRE_ROLL = 60.0  # [s], unless the shot is longer
_IN_PRE_ROLL = ", in the pre-roll, which eases the robot from rest into the motion of the first frame"
_EASE = "Let the motion begin at rest or more slowly, use a shorter --pre-roll,"


def refuse_unsupported(character: Character, animation: Animation, options: RunSettings) -> None:
    """Refuse settings that no simulation of a shot supports.

    Raises:
        ShotError: The tolerance, step, integrator or pre-roll, a cyclic shot that does not close, or one of one frame.
    """
    _refuse_tolerance(character, options)
    own = "calm:retarget:timeStep" if options.step is None else "--step"
    step = character.retarget.time_step if options.step is None else options.step
    for name, value, least in ((own, step, FINEST), ("--pre-roll", options.pre_roll, 0.0)):
        if value is not None and not least <= value < np.inf:
            raise ShotError(
                "this time is out of range",
                path=character.path,
                attribute=name,
                found=f"{value:g} s",
                remedy=f"Use {least:g} s or more, or leave it out.",
            )
    longest = max(LONGEST_PRE_ROLL, float(animation.frame_times[-1]))
    if options.pre_roll is not None and options.pre_roll > longest:
        raise ShotError(
            "the pre-roll is too long",
            path=character.path,
            attribute="--pre-roll",
            found=f"{options.pre_roll:g} s",
            remedy=f"Use {longest:g} s or less, or leave it out.",
        )
    if character.retarget.cyclic:
        refuse_open_loops(character, animation)
        if options.pre_roll:
            raise ShotError(
                "a cyclic shot has no pre-roll",
                path=character.path,
                attribute="--pre-roll",
                found=f"{options.pre_roll:g} s",
                remedy="Leave it out, or set calm:retarget:cyclic to false.",
            )
        if options.scheme != "bdf2":
            raise IntegrationError(
                "only bdf2 simulates cyclic shots",
                path=character.path,
                attribute="--integrator",
                found=options.scheme,
                remedy="Leave it out, or set calm:retarget:cyclic to false.",
            )
    refuse_unsupported_contacts(character, options)
    if options.scheme not in INTEGRATORS:
        raise ShotError(
            "there is no such integrator",
            attribute="--integrator",
            found=options.scheme,
            remedy=f"Use one of {', '.join(INTEGRATORS)}.",
        )
    if animation.moving and not follows_roots(options.scheme):
        raise IntegrationError(
            "this integrator does not support roots that move",
            path=character.joints[animation.moving[0].joint].path,
            attribute="--integrator",
            found=options.scheme,
            remedy=f"Use one of {', '.join(filter(follows_roots, INTEGRATORS))}.",
        )
    if len(animation.frame_times) < 2:
        raise ShotError(
            "a shot of one frame has no motion",
            path=character.path,
            attribute="endTimeCode",
            found="one frame: startTimeCode and endTimeCode are less than a frame apart",
            remedy="Author startTimeCode and endTimeCode further apart in the root layer, or correct "
            "timeCodesPerSecond and framesPerSecond.",
        )


def _refuse_tolerance(character: Character, options: RunSettings) -> None:
    """A tolerance must be above the rounding of positions, and within the character."""
    tolerance = options.tolerance if options.tolerance is not None else character.retarget.tolerance
    if tolerance is None:
        return
    far = reach(character) or np.inf
    least = ROUNDING * far if np.isfinite(far) else 0.0
    if least <= tolerance <= far and tolerance > 0.0:
        return
    fine = not tolerance > least
    raise ShotError(
        "the tolerance is finer than a simulation can be" if fine else "the tolerance is larger than the character",
        path=character.path,
        attribute="calm:retarget:tolerance" if options.tolerance is None else "--tolerance",
        found=f"{tolerance:.4g} m, where the character reaches {far:.4g} m",
        remedy=f"Use {least:.1g} m or more." if fine else "Use a length that matters in the picture, such as 1mm.",
    )


def refuse_half_turns(character: Character, grid: TimeGrid, angles: Array) -> None:
    """Motors must not turn by half a turn within a step: nothing could tell which way they went.

    Args:
        character: With the motors.
        angles: Of the motors, shape [T, M].
    """
    if len(angles) > 1:
        _refuse_turns(character, np.abs(np.diff(angles, axis=0)), grid.times, grid.h)


def refuse_fast_motors(character: Character, grid: TimeGrid, rates: Array, h: float) -> None:
    """As `refuse_half_turns`, for a step that is much shorter than those of the grid.

    Args:
        character: With the motors.
        grid: Instants of the rates.
        rates: Of the motors, shape [T, M] [rad/s].
        h: Step [s].

    Raises:
        ShotError: A motor turns by half a turn or more within the step.
    """
    _refuse_turns(character, h * np.abs(rates), grid.times, h)


def _refuse_turns(character: Character, turns: Array, times: Array, h: float) -> None:
    for k, motor in enumerate(character.motors):
        if character.joints[motor.joint].kind != "revolute":
            continue
        n = int(np.argmax(turns[:, k]))
        if not turns[n, k] < np.pi:
            raise IntegrationError(
                f"this motor turns by {np.degrees(turns[n, k]):.0f} degrees within one step of {1e3 * h:.3g} ms",
                path=motor.path,
                attribute=motor.attribute,
                found=f"at {times[n]:.3f} s{_IN_PRE_ROLL if times[n] < 0.0 else ''}",
                remedy=f"{_EASE if times[n] < 0.0 else 'Use a smaller --step, slow it down there,'} or check "
                "timeCodesPerSecond and the unit of its samples: degrees in a shot, rad in a table of --motion.",
            )
