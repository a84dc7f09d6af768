"""How a stream is played, and what that leaves out for a robot."""

from dataclasses import dataclass

import numpy as np
from calmotion.errors import ShotError
from calmotion.host import SettingError
from calmotion.model import PRESCRIBED, contact_joints, switched_motors
from calmotion.multibody import VelocityForces
from calmotion.simulation import CompiledShot

LONGEST = 5.0  # look-ahead that is accepted [s]


@dataclass(frozen=True)
class LiveSettings:
    """How a stream is played.

    Attributes:
        rate: Commands a second [Hz].
        lookahead: How late the robot may answer [s].
        sender_rate: Samples a second of the sender [Hz]; None: one for each command.
        uncertainty: Share by which the frequencies of the robot are not known; None: `UNCERTAINTY`, as far as the robot
            of the model hardly loses by it, see `affordable_others`.
        tolerance: Error at the targets that is worth an effort [m]; None: the shot's.
        background: Whether a thread renews the gains; else `step` does, at fixed ticks: slower, but repeatable.
    """

    ACCELERATION = 100.0  # of a motor without a limit, which is worth the tolerance [rad/s^2 or m/s^2]
    PENALTY = 0.5  # of a deviating acceleration at its limit, in tolerances
    FINEST = 2e-4  # tolerance over the longest lever of a motor, below which errors of a linear model are followed
    CLOSE = 0.01  # error over that lever for which motors may deviate by a radian, where no target moves
    HIGHEST = 1 / 3  # frequency of a mode that commands can act on, of the rate
    RENEWAL_S = 0.02  # between two renewals without a thread
    POSES = 5  # of the shot, in which the robot of the model may not lose
    UNCERTAINTY = 0.1  # of frequencies, which is spared where the robot of the model would shake
    SLOW_GAINS_S = 0.1  # processor time of a renewal that is told; poses turn by a tenth of a radian meanwhile

    rate: float = 250.0
    lookahead: float = 0.12
    sender_rate: float | None = None
    uncertainty: float | None = None
    tolerance: float | None = None
    background: bool = True

    def closeness(self, lever: float, tolerance: float, spread: float) -> float:
        """Error that a deviation of a command is worth [m/rad].

        Robots whose frequencies differ by a share leave errors of that share in common, which must not pay for motors
        that leave the linear model: without this, a G1 of 14 motors deviates by 1.7 rad, and errs more than uncalmed.

        Args:
            lever: The longest of the motors [m].
            tolerance: [m].
            spread: Of the frequencies, see `Weighting`.
        """
        return max(max(self.CLOSE, spread) * lever, tolerance)


def refuse_unfit(shot: CompiledShot, settings: LiveSettings) -> None:
    """Refuse what cannot be streamed to.

    Raises:
        ShotError, SettingError: As of `Live`.
    """
    character, contacts = shot.character, contact_joints(shot.character)
    if contacts:
        raise ShotError(
            "a robot whose feet come and go cannot be calmed live: where they stand later is not known",
            path=character.joints[contacts[0]].path,
            remedy="Fix the feet to the ground, or use calmotion optimize on the whole motion.",
        )
    coupled = [motor.path for motor in character.motors if motor.turns_with is not None]
    if coupled:
        raise ShotError(
            "the live model has no motor that two joints turn",
            path=coupled[0],
            attribute="calm:motor:coupledTo",
            remedy="Remove it if its effect is small, or use calmotion optimize on the whole motion.",
        )
    if not 10.0 <= settings.rate <= 2000.0:
        raise SettingError(
            "the rate is no rate of commands",
            path="--rate",
            found=f"{settings.rate:g} Hz",
            remedy="Use 10 to 2000 Hz; most controllers take 50 to 500.",
        )
    if not 0.0 <= settings.lookahead <= LONGEST:
        raise SettingError(
            f"the look-ahead is not within 0 and {LONGEST:g} s",
            path="--lookahead",
            found=f"{settings.lookahead:g} s",
            remedy="Use a third of the longest period of the robot, such as 120ms; see calmotion inspect --modes.",
        )


def notes_of(shot: CompiledShot, forces: VelocityForces) -> tuple[str, ...]:
    """What is left out for a robot."""
    found = []
    if shot.animation.moving:
        found.append("the moving root stays where it is in the first frame")
    if not forces.known:
        found.append("centrifugal forces are left out: joints move freely or close chains")
        if any(np.isfinite(motor.max_torque) for motor in shot.character.motors):
            found.append("efforts are not known either, so that nothing tells where a motor has too little")
    free = [motor.path.rpartition("/")[2] for motor in shot.character.motors if not np.isfinite(motor.max_velocity)]
    if free:
        names = ", ".join(free) if len(free) < len(shot.character.motors) or len(free) < 4 else "all of them"
        found.append(f"a jump is played within a tick by motors without a limit of speed: {names}")
    switched = [shot.character.motors[k].path.rpartition("/")[2] for k in switched_motors(shot.character)]
    if switched:
        found.append(f"motors that the shot switches off (calm:motor:powered) stay on: {', '.join(switched)}")
    delays = {motor.delay for motor in shot.character.motors if motor.model != PRESCRIBED}
    if len(delays) > 1:
        found.append("motors with different delays are taken as if all had the longest")
    return tuple(found)
