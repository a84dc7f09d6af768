"""What motors that give cost: time of a step with drives and with servos over that with ideal motors.

`calmotion bench motor-cost [SHOT ...]` simulates each shot with all its motors ideal, as drives, and as servos whose
gears give, with the same step and the same curves; and linearises each simulation as the optimiser does (factors,
one tangent, one adjoint). Runs of the three take turns, so that a busy machine slows all alike; times are the median.
The default shots are an arm of two plastic links, one with a closed chain, and an arm of seven rigid links.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.shots import MADE, load
from calmotion.multibody.analysis.kinematics import rigid_state
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import Model, rigid_model, start_angles, with_drives
from calmotion.multibody.sensitivity.adjoint import adjoint
from calmotion.multibody.sensitivity.linearization import linearize
from calmotion.multibody.sensitivity.tangent import tangent
from calmotion.shot.character import Array, Character
from calmotion.shot.motor import DRIVE, PRESCRIBED, SERVO, Motor, Rotor
from calmotion.shot.run import RunSettings
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot
from calmotion.simulation.inputs.curves import sample_tracks
from calmotion.simulation.prepare import prepare

MODELS = (PRESCRIBED, DRIVE, SERVO)
ALLOWED = {PRESCRIBED: 1.0, DRIVE: 1.3, SERVO: 1.5}
RIGID = "seven-links"
_STIFFNESS, _DAMPING = 2e3, 4e1  # of the motors that give [N m/rad], [N m s/rad]
_ROTOR = Rotor(0.05, 2e4, 2e1, 0.5, 0.3)


@dataclass(frozen=True)
class Row:
    """One model of the motors on one shot.

    Attributes:
        shot, model: Names.
        coordinates: Of all bodies.
        step_us, newton: Time of a step [us], and Newton iterations of it.
        over_ideal: That time over the time with ideal motors.
        sweeps_us, sweeps_over_ideal: The same for factors, tangent and adjoint together.
    """

    shot: str
    model: str
    coordinates: int
    step_us: float
    newton: float
    over_ideal: float
    sweeps_us: float
    sweeps_over_ideal: float


def with_model(character: Character, model: str) -> Character:
    """The character with all its motors of one model, stiff and well damped."""

    def changed(motor: Motor) -> Motor:
        rotor = _ROTOR if model == SERVO else Rotor()
        return replace(motor, model=model, position_gain=_STIFFNESS, velocity_gain=_DAMPING, rotor=rotor)

    return replace(character, motors=tuple(map(changed, character.motors)))


def compare(name: str, shot: CompiledShot, rigid: bool, repeats: int) -> list[Row]:
    """The three models on one shot.

    Args:
        rigid: Whether its bodies are taken as rigid ones.
        repeats: Runs of each model, of which the median counts.
    """
    prepared = prepare(shot, RunSettings())
    angles, rates = sample_tracks(shot.animation.tracks, prepared.grid)
    forward: dict[str, Callable[[], int]] = {}
    sweeps: dict[str, Callable[[], None]] = {}
    models: dict[str, Model] = {}
    for kind in MODELS:
        character = with_model(shot.character, kind)
        model = compile_shot(character, shot.animation, shot.bodies).model
        models[kind] = with_drives(rigid_model(model), character.motors) if rigid else model
        forward[kind], sweeps[kind] = _actions(models[kind], angles, rates, prepared.grid.h)
    newton = {kind: action() for kind, action in forward.items()}  # loads or compiles the kernels
    for action in sweeps.values():
        action()
    steps = len(angles) - 1
    taken = _in_turns(forward, repeats)
    swept = _in_turns(sweeps, repeats)
    return [
        Row(
            name, kind, models[kind].dof, 1e6 * taken[kind] / steps, newton[kind] / steps,
            taken[kind] / taken[PRESCRIBED], 1e6 * swept[kind] / steps, swept[kind] / swept[PRESCRIBED],
        )
        for kind in MODELS
    ]  # fmt: skip


def _actions(model: Model, angles: Array, rates: Array, h: float) -> tuple[Callable[[], int], Callable[[], None]]:
    """A simulation, which returns its Newton iterations, and the sweeps of its linearisation."""
    joint_angles, joint_rates = model.joint_angles(angles), model.joint_angles(rates)
    workspace, system = Workspace.for_system(model.system), model.system
    start = rigid_state(model, start_angles(model, joint_angles[0]))

    def run() -> int:
        found = simulate(system, start, joint_angles, joint_rates, h, workspace)
        return int(found.newton_iterations)

    trajectory = simulate(system, start, joint_angles, joint_rates, h, workspace)
    weights = np.ones((len(angles), len(system.parent), system.size))

    def sweep() -> None:
        lin = linearize(system, trajectory, joint_angles, joint_rates, workspace)
        tangent(lin, joint_rates, joint_rates)
        adjoint(lin, weights)

    return run, sweep


def _in_turns(actions: Mapping[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Median processor time of each action [s]; they take turns."""
    times: dict[str, list[float]] = {name: [] for name in actions}
    for _ in range(repeats):
        for name, action in actions.items():
            begin = time.process_time()
            action()
            times[name].append(time.process_time() - begin)
    return {name: float(np.median(values)) for name, values in times.items()}


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("motor-cost", __doc__)
    known = "; ".join(f"{name}: {text}" for name, text in MADE.items())
    default = ["arm", "linkage", RIGID]
    parser.add_argument(
        "shots", metavar="SHOT", nargs="*", default=default,
        help=f"USD file, or a synthetic shot ({known}; {RIGID}: rigid); default: {' '.join(default)}",
    )  # fmt: skip
    parser.add_argument("--repeats", metavar="N", type=int, default=9, help="runs of each model (default 9)")
    output_options(parser)
    options = parser.parse_args(arguments)
    rows: list[Row] = []
    for name in options.shots:
        shot = _seven_links() if name == RIGID else load(name).compiled
        rows += compare(name, shot, name == RIGID, options.repeats)
    if options.json:
        print(json.dumps([asdict(row) for row in rows]))
    else:
        _print(rows)
    return int(any(row.over_ideal > ALLOWED[row.model] for row in rows))


def _seven_links() -> CompiledShot:
    from calmotion.benchmarks.scenes.rigid_arm import rigid_arm

    return compile_shot(*rigid_arm(7))


def _print(rows: Sequence[Row]) -> None:
    from calmotion.cli.tables import console_on, print_table

    heads = [
        "shot",
        "motors",
        "coordinates",
        "a step",
        "over ideal",
        "allowed",
        "Newton",
        "sweeps of a step",
        "over ideal",
    ]
    shown = [
        [
            row.shot, row.model, str(row.coordinates), f"{row.step_us:.1f} us", f"{row.over_ideal:.2f}",
            f"{ALLOWED[row.model]:.1f}", f"{row.newton:.2f}", f"{row.sweeps_us:.1f} us", f"{row.sweeps_over_ideal:.2f}",
        ]
        for row in rows
    ]  # fmt: skip
    print_table(console_on(sys.stdout), "Cost of motors that give", heads, shown, texts=2)


if __name__ == "__main__":
    sys.exit(main())
