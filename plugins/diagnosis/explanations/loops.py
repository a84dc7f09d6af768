"""Gains, friction and delay: what changes how a joint follows its command."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..signals import HEALTHY, Drive
from ..situation import Situation
from .base import LoopExplanation, Parameter, Values

TURN = 2.0 * np.pi


def _frequency(situation: Situation, motor: int) -> Parameter:
    """The frequency of a loop [Hz]: known but for a factor where its gain is known."""
    joint = situation.joints[motor]
    own = float(np.sqrt(joint.gain / joint.middle)) / TURN if joint.gain else 0.0
    if own and not joint.guessed:
        return Parameter("frequency", "Hz", (own,), 0.3 * own, 3.0 * own, 0.25, True)
    return Parameter("frequency", "Hz", (8.0, 3.0, 20.0), 1.0, 45.0, np.inf, True)


def _with_frequency(situation: Situation, drive: Drive, motor: int, frequency: float, damping: float) -> Drive:
    gain = (TURN * frequency) ** 2 * situation.joints[motor].middle
    return drive.with_joint(motor, {"gain": gain, "damping": damping * situation.joints[motor].critical(gain)})


def _guessed_anew(situation: Situation, drive: Drive, motor: int, values: Values) -> Drive:
    """A healthy loop of another frequency, where the gain is a guess."""
    if "frequency" not in values:
        return drive
    gain, before = (TURN * values["frequency"]) ** 2 * situation.joints[motor].middle, drive.gain[motor]
    ratio = drive.damping[motor] / situation.joints[motor].critical(before) if np.isfinite(before) else HEALTHY
    return drive.with_joint(motor, {"gain": gain, "damping": ratio * situation.joints[motor].critical(gain)})


class ServoGains(LoopExplanation):
    """A loop that rings, or is softer than the shot says."""

    cause = "servo_gains"
    label = "the servo loop"
    tells = (
        "a small step of one joint with half of its position gain, which slows the ringing of a loop down by 30%, "
        "but not that of a link"
    )
    RINGS = 0.5  # ratio of critical below which a loop's ringing is seen

    def parameters(self, situation: Situation, motor: int) -> tuple[Parameter, ...]:
        """Frequency and damping ratio."""
        found = (_frequency(situation, motor), Parameter("damping", "of critical", (0.15, 0.5), 0.01, 1.5))
        joint = situation.joints[motor]
        return found if joint.gain else (*found, Parameter("share", "", (0.0, 1.0), 0.0, 1.0))

    def changed(self, situation: Situation, drive: Drive, motor: int, values: Values) -> Drive:
        """A loop of this frequency and damping."""
        drive = _with_frequency(situation, drive, motor, values["frequency"], values["damping"])
        return drive.with_joint(motor, {"share": values.get("share", situation.joints[motor].share)})

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Raise the damping, or the gain."""
        rows: dict[str, dict[str, float]] = {}
        for row in parameters:
            rows.setdefault(row["path"], {})[row["name"]] = row["value"]
        path, own = min(rows.items(), key=lambda item: item[1]["damping"])
        if own["damping"] < self.RINGS:
            return (
                f"{path} rings at {own['frequency']:.2g} Hz with {own['damping']:.2g} of critical damping: raise its "
                f"velocity gain {HEALTHY / own['damping']:.2g} times, or lower its position gain"
            )
        return (
            f"{path} is a softer or stiffer loop than the shot says ({own['frequency']:.2g} Hz): estimate its gains "
            "with calmotion calibrate, and optimise with them"
        )


class Friction(LoopExplanation):
    """Dry friction: a joint stands still, and then jumps."""

    cause = "friction"
    label = "friction and stiction"
    tells = "the same motion at a quarter of its speed: what friction does stays as large, and jumps become clearer"

    def parameters(self, situation: Situation, motor: int) -> tuple[Parameter, ...]:
        """Lost motion (friction over gain), excess at rest, and where the gain is not known the frequency."""
        joint = situation.joints[motor]
        lost = Parameter("lost_motion", "rad", (0.01, 0.03), 1e-5, 0.5, np.inf, True)
        excess = Parameter("excess_at_rest", "", (0.3,), 0.0, 2.0, 0.5)
        return (lost, excess) if joint.gain and not joint.guessed else (lost, excess, _frequency(situation, motor))

    def changed(self, situation: Situation, drive: Drive, motor: int, values: Values) -> Drive:
        """With friction."""
        drive = _guessed_anew(situation, drive, motor, values)
        return drive.with_joint(
            motor, {"friction": values["lost_motion"] * drive.gain[motor], "excess": values["excess_at_rest"]}
        )

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Raise the gain, or compensate."""
        worst = max((row for row in parameters if row["name"] == "lost_motion"), key=lambda row: row["value"])
        return (
            f"{worst['path']} sticks within {worst['value']:.2g} rad of its command: lubricate or loosen it, raise its "
            "position gain or compensate friction; calmotion calibrate --parameters friction adds it to the model"
        )


class Delay(LoopExplanation):
    """The motion comes later than its command, and is the same otherwise."""

    cause = "delay"
    label = "a delay between command and motion"
    tells = "command and motion logged by one device on one clock: an offset of clocks looks like a delay"
    EARLIEST = -0.005  # no joint moves before its command, but samples have times that are a little off [s]

    def parameters(self, situation: Situation, motor: int) -> tuple[Parameter, ...]:
        """The delay."""
        joint = situation.joints[motor]
        late = Parameter("delay", "s", (max(joint.delay, 0.03), 0.03, 0.08), self.EARLIEST, 0.5)
        return (late, _frequency(situation, motor)) if joint.guessed and joint.gain else (late,)

    def changed(self, situation: Situation, drive: Drive, motor: int, values: Values) -> Drive:
        """With a delay."""
        return _guessed_anew(situation, drive, motor, values).with_joint(motor, {"delay": values["delay"]})

    def remedy(self, situation: Situation, parameters: Sequence[Mapping[str, Any]]) -> str:
        """Send commands earlier."""
        late = float(np.median([row["value"] for row in parameters if row["name"] == "delay"]))
        return (
            f"the robot moves {1e3 * late:.0f} ms after its command: send commands that much earlier (set "
            "calm:motor:delay, so that calmotion optimize does it), or shorten buffers of the bus and the driver"
        )
