"""What shakes: known faults of random arms, found from noisy recordings.

`calmotion bench diagnose [--count N] [--first SEED] [--csv FILE]` draws arms with one or two faults at three
strengths, or none. MuJoCo, where it is installed, and our own simulator with another mesh, step and integrator record
each by turns: encoders of 12 bits and an accelerometer at the hand. The table counts which cause `diagnose` names first
for each fault. Seeds below 100000 were used while the explanations were written; the table begins above.
"""

import time
from collections import Counter
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from calmotion.recordings import SensorRecording
from calmotion_plugins.diagnosis import diagnosis_of, situation_of

from ..common.reporting import bench_parser, finish, numbered, numbered_options
from ..scenes.faulty_arm import FAULTS, FaultyArm, faulty_arm
from ..scenes.faulty_mujoco import recorded_in_mujoco
from ..scenes.faulty_own import POSSIBLE, recorded_by_us

FIRST, RECORDINGS = 100000, 120
STRENGTHS = ("weak", "medium", "strong")
SURE = 0.8  # confidence from which on an answer counts as given with confidence
NONE, UNKNOWN, TWO = "none", "unknown", "two of them"
NAMED = (*FAULTS, NONE, UNKNOWN)
HEALTHY, DOUBLE = 0.1, 0.25  # shares of arms without a fault, and with two


@dataclass(frozen=True)
class Answer:
    """One diagnosis.

    Attributes:
        seed: Of the arm.
        simulator: What recorded it.
        faults: Its faults, separated by +.
        strength: Of both.
        first, second: Causes that are named first and second.
        confidence: Of the first.
        right: Whether the first is a fault of the arm.
        processor_s: Time of the diagnosis [s].
    """

    seed: int
    simulator: str
    faults: str
    strength: str
    first: str
    second: str
    confidence: float
    right: bool
    processor_s: float


def drawn(seed: int) -> tuple[FaultyArm, str, int]:
    """The arm of a seed, the simulator that records it, and the strength of its faults."""
    rng = np.random.default_rng([seed, 76])
    mujoco = find_spec("mujoco") is not None and seed % 2 == 0
    kinds = FAULTS if mujoco else POSSIBLE
    strength, kind = int(rng.integers(0, 3)), rng.uniform()
    count = 0 if kind < HEALTHY else 2 if kind > 1.0 - DOUBLE else 1
    names = [str(name) for name in rng.choice(kinds, count, replace=False)]
    return faulty_arm(seed, dict.fromkeys(names, strength)), "MuJoCo" if mujoco else "own", strength


def recorded(arm: FaultyArm, simulator: str) -> SensorRecording:
    """What the sensors of an arm say."""
    return recorded_in_mujoco(arm) if simulator == "MuJoCo" else recorded_by_us(arm)


def answered(seed: int) -> Answer:
    """The diagnosis of the arm of a seed."""
    arm, simulator, strength = drawn(seed)
    recording = recorded(arm, simulator)
    shot = arm.shot()
    begin = time.process_time()
    causes = diagnosis_of(situation_of(shot, [recording])).causes
    spent = time.process_time() - begin
    names, faults = [cause.cause for cause in causes], tuple(arm.faults) or (NONE,)
    return Answer(
        seed=seed,
        simulator=simulator,
        faults="+".join(faults),
        strength=STRENGTHS[strength] if arm.faults else "-",
        first=names[0],
        second=names[1] if len(names) > 1 else "",
        confidence=causes[0].confidence,
        right=names[0] in faults,
        processor_s=spent,
    )


def confusion(answers: list[Answer]) -> list[list[str]]:
    """Rows of the confusion matrix: for each fault of medium and strong size, recordings, right ones, and how often
    each cause is named first."""
    rows = []
    for fault in (*FAULTS, TWO, NONE):
        own = [a for a in answers if fault == (TWO if "+" in a.faults else a.faults) and a.strength != STRENGTHS[0]]
        counts = Counter(a.first for a in own)
        named = [str(counts[name] or "") for name in NAMED]
        rows.append([fault, str(len(own)), str(sum(a.right for a in own)), *named])
    return rows


def summary(answers: list[Answer]) -> list[str]:
    """How often the first cause is right, and wrong with confidence."""
    lines = []
    for name, own in (
        ("medium and strong", [a for a in answers if a.strength in STRENGTHS[1:]]),
        ("weak", [a for a in answers if a.strength == STRENGTHS[0]]),
        ("all", answers),
    ):
        if own:
            right = np.mean([a.right for a in own])
            wrong = np.mean([not a.right and a.first not in (NONE, UNKNOWN) and a.confidence >= SURE for a in own])
            missed = np.mean([not a.right and a.first == NONE for a in own])
            lines.append(
                f"{name}: {len(own)} recordings, right first {right:.0%}, another cause with confidence {wrong:.1%}, "
                f"error within the noise {missed:.0%}"
            )
    spent = [a.processor_s for a in answers]
    lines.append(f"processor time of a diagnosis: median {np.median(spent):.1f} s, largest {np.max(spent):.1f} s")
    return lines


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("diagnose", __doc__)
    numbered_options(parser, RECORDINGS, FIRST)
    options = parser.parse_args(arguments)
    answers = numbered(options, Answer, "seed", lambda seed: [answered(seed)])
    told = summary(answers)
    table = ("fault", "recordings", "right", *NAMED), confusion(answers)
    finish(options, "Named first", answers, table, told, summary=told)
    return 0
