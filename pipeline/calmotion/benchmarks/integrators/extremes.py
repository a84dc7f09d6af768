"""Physics at the edge: verdicts of hard scenes, growth of the cost, and audits of energy and momentum in long runs.

`calmotion bench extremes [--json] [--only TEXT] [--quick]` goes beyond `calmotion bench stability`, which has moduli,
mass ratios, steps, spins and loads. Columns buckle, linkages pass dead centres, and closed chains are nearly redundant:
each must run, or be refused with its reason, as physics says. Chains grow to 200 links and motors and shots to 600 s:
the cost must grow no faster than the problem, and long runs must keep energy and momentum. It ends with exit status 1
when a verdict is wrong, an exponent exceeds 1.15 or an audit fails.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.integrators.audits import Audit, audit
from calmotion.benchmarks.integrators.outcomes import FAILED, REFUSED, RUNS, Case, Outcome, Scene, run_case
from calmotion.benchmarks.scenes.beam_arm import beam_arm, quintic, shot_of
from calmotion.benchmarks.scenes.four_bar import four_bar
from calmotion.benchmarks.speed.growth import Growth, growths, links, prepared
from calmotion.shot import Frame
from calmotion.shot.character import Array

EXPONENT = 1.15  # largest growth that counts as linear: times of a busy machine scatter
LOST, GAINED, MOMENTUM = 2e-2, 2e-3, 2e-3  # largest errors of an audit, see `audits.Audit`
LENGTH, THICKNESS, MODULUS, GRAVITY = 0.6, 0.02, 1.8e9, 9.81  # of the arm that `beam_arm` makes


@dataclass(frozen=True)
class Verdict:
    """A scene, and the outcome that physics asks for.

    Attributes:
        case: The scene.
        right: Outcomes that are right.
        says: A word of the reason, where it is refused.
        errors: Least and largest error of the target where it runs [m].
    """

    case: Case
    right: tuple[str, ...]
    says: str = ""
    errors: tuple[float, float] = (0.0, np.inf)

    def fault(self, outcome: Outcome) -> str:
        """What is wrong with an outcome; empty where nothing is."""
        if outcome.outcome not in self.right:
            return f"{outcome.outcome}, not {' or '.join(self.right)}: {outcome.why}"
        if outcome.outcome == REFUSED and self.says not in outcome.why:
            return f"the reason does not say {self.says!r}: {outcome.why}"
        if outcome.outcome == RUNS and not self.errors[0] <= outcome.error_m <= self.errors[1]:
            return f"an error of {outcome.error_m:.2g} m, not of {self.errors[0]:g} to {self.errors[1]:g} m"
        return ""


@dataclass(frozen=True)
class LongRun:
    """A run whose balances are audited.

    Attributes:
        name: What it is.
        bodies, steps, seconds: Its size, and the time that it simulates [s].
        wall_s: The simulation alone.
        audit: Its balances; None where it failed.
        fault: What is wrong, or empty.
    """

    name: str
    bodies: int
    steps: int
    seconds: float
    wall_s: float
    audit: Audit | None
    fault: str


def euler_load() -> float:
    """Load at the free end under which the clamped arm buckles [kg]: pi^2 E I / (4 L^2 g)."""
    return float(np.pi**2 * MODULUS * THICKNESS**4 / 12.0 / (4.0 * LENGTH**2) / GRAVITY)


def _column(share: float) -> Scene:
    """The arm as a column under a share of its Euler load, disturbed by its motor."""

    def scene() -> object:
        character, meshes = beam_arm(payload=share * euler_load())
        return (replace(character, gravity=np.array([-GRAVITY, 0.0, 0.0])), meshes), shot_of(quintic(0.01, 0.5), 3.0)

    return scene  # type: ignore[return-value]


def _linkage(tilt: float = 0.0, driven: int = 0, turn: float = 2.0 * np.pi, seconds: float = 2.0) -> Scene:
    """The four-bar with a hinge whose axis is tilted out of the plane [rad], driven at the crank or the rocker."""

    def scene() -> object:
        character, meshes = four_bar()
        joints = list(character.joints)
        frame = joints[3].frame0
        turned = Rotation.from_quat(np.roll(frame.rotation, -1)) * Rotation.from_rotvec([tilt, 0.0, 0.0])
        joints[3] = replace(joints[3], frame0=Frame(frame.position, np.roll(turned.as_quat(), 1)))
        motor = replace(character.motors[0], joint=driven, path=joints[driven].path)
        made = replace(character, joints=tuple(joints), motors=(motor,))
        return (made, meshes), shot_of(quintic(turn, 0.9 * seconds), seconds)

    return scene  # type: ignore[return-value]


def verdicts() -> tuple[Verdict, ...]:
    """The scenes."""
    found = [
        # a column beyond its load falls: it is refused, or its error says so
        Verdict(Case("column", f"{share:g} of the Euler load", _column(share)), right, "/Arm/Link0", errors)
        for share, right, errors in (
            (0.3, (RUNS,), (0.0, 0.05)), (0.8, (RUNS,), (0.0, 0.12)), (1.3, (RUNS, REFUSED), (0.2, np.inf)),
            (4.0, (RUNS, REFUSED), (0.2, np.inf)),
        )
    ]  # fmt: skip
    found += [
        Verdict(Case("dead centre", "crank drives, a whole turn", _linkage()), (RUNS,)),
        Verdict(Case("dead centre", "rocker drives within its range", _linkage(driven=3, turn=0.2)), (RUNS,)),
        Verdict(Case("dead centre", "rocker drives past its range", _linkage(driven=3, turn=3.0)), (REFUSED,), "/Bars"),
    ]
    found += [
        Verdict(Case("nearly redundant", f"axis tilted by {tilt:g} rad", _linkage(tilt, turn=1.0)), right, says)
        for tilt, right, says in (
            (0.0, (RUNS,), ""), (1e-12, (RUNS,), ""), (1e-9, (RUNS,), ""), (1e-6, (RUNS,), ""),
            (1e-3, (RUNS, REFUSED), "/Bars"), (0.1, (RUNS, REFUSED), "/Bars"),
        )
    ]  # fmt: skip
    return tuple(found)


def _wave(t: Array) -> tuple[Array, Array]:
    return 2e-3 * (1.0 - np.cos(6.0 * t)), 12e-3 * np.sin(6.0 * t)


def _spin(t: Array) -> tuple[Array, Array]:
    """100 rad/s after two seconds of smooth acceleration."""
    s = np.clip(t / 2.0, 0.0, 1.0)
    rate = 100.0 * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    angle = 200.0 * (2.5 * s**4 - 3.0 * s**5 + s**6) + 100.0 * np.maximum(t - 2.0, 0.0)
    return angle, rate


def long_runs(quick: bool = False) -> list[LongRun]:
    """The audited runs; smaller ones where they are to be quick."""
    share = 0.02 if quick else 1.0
    return [
        _audited("200 links and motors", 12 if quick else 200, 1.0 / 480.0, 300, _wave),
        _audited("100,000 steps", 1, 1e-4, int(share * 100_000), _wave),
        _audited("600 s", 1, 1.0 / 240.0, int(share * 144_000), _wave),
        _audited("100 rad/s", 1, 1.0 / 9600.0, 28_800, _spin),
    ]


def _audited(name: str, count: int, h: float, steps: int, curve: Callable[[Array], tuple[Array, Array]]) -> LongRun:
    from calmotion.errors import ShotError
    from calmotion.multibody.failure import SimulationFailure
    from calmotion.multibody.integrators.workspace import Workspace
    from calmotion.simulation.forward import run_forward

    model = prepared(*links(count, 4))
    driven = np.ones(len(model.system.rows[model.motor >= 0]))
    angles, rates = (np.outer(values, driven) for values in curve(h * np.arange(steps + 1, dtype=float)))
    begin = time.perf_counter()
    size = (len(model.system.parent), steps, h * steps)
    try:
        run = run_forward(model, Workspace.for_system(model.system), angles, rates, h)
    except (ShotError, SimulationFailure) as error:
        return LongRun(name, *size, time.perf_counter() - begin, None, str(error))
    wall = time.perf_counter() - begin
    found = audit(model.system, run)
    faults = [
        f"{text} {value:.1e}"
        for text, value, limit in (
            ("energy differs by", found.energy, LOST), ("energy appears:", found.gained, GAINED),
            ("momentum differs by", found.momentum, MOMENTUM),
        )
        if not value <= limit
    ]  # fmt: skip
    return LongRun(name, *size, wall, found, ", ".join(faults))


def print_all(outcomes: Sequence[tuple[Outcome, str]], grown: Sequence[Growth], runs: Sequence[LongRun]) -> None:
    """The tables for a person."""
    from calmotion.cli.tables import console_on, print_table, say

    console = console_on(sys.stdout)
    rows = [
        [o.group, o.name, o.outcome, "WRONG" if fault else "right", f"{o.error_m:.2g}", f"{o.gap_m:.0e}"]
        for o, fault in outcomes
    ]
    print_table(console, "Verdicts", ["extreme", "case", "outcome", "verdict", "error [m]", "gap [m]"], rows, texts=4)
    rows = [[g.name, f"{g.values[0]} to {g.values[-1]}", f"{g.exponent:.2f}"] for g in grown]
    print_table(console, "Growth of the cost", ["quantity", "values", "exponent"], rows, texts=2)
    rows = [
        [r.name, str(r.bodies), str(r.steps), f"{r.seconds:g}", f"{r.wall_s:.1f}",
         *((f"{v:.0e}" for v in asdict(r.audit).values()) if r.audit else ("-",) * 3)]
        for r in runs
    ]  # fmt: skip
    heads = ["run", "bodies", "steps", "time [s]", "took [s]", "energy", "gained", "momentum"]
    print_table(console, "Balances of long runs, relative", heads, rows)
    for outcome, fault in outcomes:
        if fault or outcome.why:
            say(console, f"{outcome.group}, {outcome.name}: {fault or outcome.why}")
    for run in runs:
        if run.fault:
            say(console, f"{run.name}: {run.fault}")


def main(arguments: list[str] | None = None) -> int:
    """The command: exit status 1 when a verdict is wrong, the cost grows too fast or an audit fails."""
    parser = bench_parser("extremes", __doc__)
    output_options(parser)
    parser.add_argument(
        "--only", metavar="TEXT", default="", help="scenes whose name contains a text, and nothing else"
    )
    parser.add_argument("--quick", action="store_true", help="smaller chains and shorter runs")
    options = parser.parse_args(arguments)
    only = options.only.lower()
    chosen = [one for one in verdicts() if only in f"{one.case.group} {one.case.name}".lower()]
    outcomes = [(outcome, one.fault(outcome)) for one in chosen for outcome in [run_case(one.case)]]
    grown: list[Growth] = []
    runs: list[LongRun] = []
    if not only:
        grown = growths((4, 8, 16), (500, 2_000), (4, 8)) if options.quick else growths((8, 16, 32, 64, 128, 200))
        runs = long_runs(options.quick)
    if options.json:
        print(json.dumps({
            "verdicts": [asdict(outcome) | {"fault": fault} for outcome, fault in outcomes],
            "growth": [asdict(one) | {"exponent": one.exponent} for one in grown],
            "runs": [asdict(run) for run in runs],
        }))  # fmt: skip
    else:
        print_all(outcomes, grown, runs)
    # more modes cost more than in proportion: their inertia is a matrix
    fast = [one for one in grown if one.name != "modes in a body" and one.exponent > EXPONENT]
    wrong = any(fault for _, fault in outcomes) or any(outcome.outcome == FAILED for outcome, _ in outcomes)
    return int(wrong or bool(fast and not options.quick) or any(run.fault for run in runs))


if __name__ == "__main__":
    sys.exit(main())
