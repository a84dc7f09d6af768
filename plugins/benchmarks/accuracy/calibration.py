"""How honest calibrations are: random arms with known parameters, recorded with noise and calibrated.

`calmotion bench calibration [--count N] [--first K] [--finer-mesh] [--csv FILE [--resume]]` draws arms of one or two
flexible links with a load, half of them with a compliant motor. The parameters of the real arm differ from the model
by a standard deviation of their priors. It is simulated by another integrator (Newmark's method, steps of 1/7680 s,
extrapolated; the generalized-alpha method where that diverges) and, with `--finer-mesh`, with another mesh and twice
the modes. A marker, an accelerometer and the encoders record it, each with its own clock, noise, bias, gaps and
outliers. The table has, for each kind of parameter, how often the 95% interval covers the truth, the median and the
largest error, the median standard deviation, and in how many trials it was identifiable, and how often it was
recovered to `GOALS` where its 95% interval is that narrow. Trial number K is the same on every machine. `--resume`
goes on with the trials that the CSV file does not have: 100 trials may take several days. The command fails where
fewer than 85% of the intervals cover the truth.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from calmotion.model import RunSettings
from calmotion_plugins.calibration import HIGHER_MODES, CalibrationSettings, calibrate_shot

from ..common.reporting import bench_parser, finish, numbered, numbered_options
from ..scenes.recorded_arm import recorded_arm

WITHIN = 1.96  # standard deviations of a 95% interval
GRADED = 5e-4  # prior of `higher_modes`: what the mesh of `recorded_arm` has of it, 2e-4 to 6e-4 over 5 bending modes
GOALS = {"modulus": 0.01, "damping": 0.1}  # relative errors of what is recovered well; 5% of others, 1 ms of delays
OTHERS, DELAYS = 0.05, 1e-3
HEADS = "parameter, number, in the 95% interval, median error, largest, median standard deviation".split(", ")
HEADS += ["identifiable", "recovered to, where told"]


@dataclass(frozen=True)
class Recovered:
    """A parameter of one trial; errors and deviations relative to the truth, those of a delay in seconds.

    Attributes:
        trial: Its number.
        kind: Of the parameter.
        error: Estimate minus truth.
        deviation: Standard deviation of the estimate.
        pull: Error over deviation; of logarithms where the parameter is logarithmic.
        identifiable: Whether it was called identifiable.
        converged: Whether the search converged.
        simulations: Of the trial.
        wall_s: Time of the trial [s].
    """

    trial: int
    kind: str
    error: float
    deviation: float
    pull: float
    identifiable: bool
    converged: bool
    simulations: int
    wall_s: float


def tried(number: int, finer: bool = False) -> list[Recovered]:
    """One trial.

    Raises:
        ShotError: The arm cannot be simulated.
    """
    arm = recorded_arm(number, finer)
    found = calibrate_shot(
        arm.shot, arm.recordings, CalibrationSettings(priors={HIGHER_MODES: GRADED}), RunSettings(step=1.0 / 480.0)
    )
    rows = []
    for item in found.estimates:
        if item.name not in arm.truth:
            continue
        truth = arm.truth[item.name]
        if item.logarithmic:
            pull = np.log(item.value / truth) / (item.standard_deviation / item.value)
            error, deviation = item.value / truth - 1.0, item.standard_deviation / item.value
        else:
            error, deviation = item.value - truth, item.standard_deviation
            pull = error / deviation
        known = item.identifiable, found.converged, found.simulations, found.wall_s
        rows.append(Recovered(number, item.kind, float(error), float(deviation), float(pull), *known))
    return rows


def table_of(rows: Sequence[Recovered]) -> list[list[str]]:
    """Rows of the table."""
    out = []
    for kind in dict.fromkeys(row.kind for row in rows):
        own = [row for row in rows if row.kind == kind]
        inside = sum(abs(row.pull) <= WITHIN for row in own)
        errors = np.abs([row.error for row in own])
        told = [row for row in own if row.identifiable and WITHIN * row.deviation <= goal_of(kind)]
        out.append(
            [
                kind,
                str(len(own)),
                f"{100.0 * inside / len(own):.0f}%",
                _shown(kind, float(np.median(errors))),
                _shown(kind, float(errors.max())),
                _shown(kind, float(np.median([row.deviation for row in own]))),
                str(sum(row.identifiable for row in own)),
                f"{_shown(kind, goal_of(kind))}: {sum(abs(row.error) <= goal_of(kind) for row in told)} of {len(told)}",
            ]
        )
    return out


def goal_of(kind: str) -> float:
    """Error up to which a parameter of a kind counts as recovered: relative, of a delay in seconds."""
    return DELAYS if kind == "delay" else GOALS.get(kind, OTHERS)


def _shown(kind: str, value: float) -> str:
    return f"{1e3 * value:.2g} ms" if kind == "delay" else f"{100.0 * value:.2g}%"


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 where fewer than 85% of the intervals cover the truth."""
    parser = bench_parser("calibration", __doc__)
    parser.add_argument("--finer-mesh", action="store_true", help="the real arm has a finer mesh and more modes")
    numbered_options(parser, 20)
    options = parser.parse_args(arguments)
    rows = numbered(options, Recovered, "trial", lambda k: tried(k, options.finer_mesh))
    finish(options, "Parameters of random arms, recovered from recordings", rows, (HEADS, table_of(rows)))
    return int(not rows or np.mean([abs(row.pull) <= WITHIN for row in rows]) < 0.85)
