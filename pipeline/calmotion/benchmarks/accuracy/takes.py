"""What takes bring on a robot that is not the model: recorded, refined, performed again.

`calmotion bench takes SHOT [--modulus F] [--damping F] [--payload F] [--takes N] [--draws N] [--folder DIR]` optimises
a shot and lets another robot perform the curves: with F times the modulus, damping and payload, and a quarter of the
time step. Markers, accelerometers and encoders record it, with noise, bias, gaps, outliers and clocks of their own;
`calmotion refine` improves model and curves, which the robot performs next. The table has, for each take, the largest
error on its model and on the robot, and the largest on robots that are drawn from the error of its calibration. All are
those of the target that the first curves bring closest to its intended motion: what others keep is not the model's.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from calmotion.accuracy.reduced_bodies import compiled_in
from calmotion.accuracy.simulate_to_tolerance import found_tracks
from calmotion.benchmarks.common.parsers import bench_parser, output_options
from calmotion.benchmarks.common.tables import markdown
from calmotion.benchmarks.scenes.recorded_arm import AFTER, recorded, written
from calmotion.identification.calibrate import simulable
from calmotion.identification.robots import Robot
from calmotion.identification.signals import ends_at_rest, signals_of
from calmotion.retargeting.robust.measure import errors_on
from calmotion.retargeting.robust.scenarios import PAYLOAD, payload_bodies, shot_of
from calmotion.shot import Character
from calmotion.shot.robust.robots import Scenario
from calmotion.shot.run import OutputPaths, RunSettings
from calmotion.simulation.compiled_shot import CompiledShot
from calmotion.workflow.calibration.refine import expected_errors, refine
from calmotion.workflow.commands import optimize
from calmotion.workflow.results import OptimizationResult

FINER = 4  # steps of the real robot in one of the model
FALLS = 5.0  # factor by which the error should fall
HEADS = ("take", "on its model", "on the robot", "median of draws", "largest of draws", "modulus, damping, payload off")


@dataclass(frozen=True)
class Take:
    """A take.

    Attributes:
        take: Its number.
        on_model: Largest error of the target on the model of which the curves are [m].
        on_robot: On the robot [m].
        median, largest: Over robots drawn from the error of the calibration [m]; NaN of the first take.
        off: Estimate over truth minus one, by the name of the parameter.
    """

    take: int
    on_model: float
    on_robot: float
    median: float
    largest: float
    off: dict[str, float]


def real_robot(shot: CompiledShot, modulus: float, damping: float, payload: float) -> Scenario:
    """The robot with such factors of all moduli, dampings and loads."""
    character, factors = shot.character, dict[str, float]()
    for body in character.bodies:
        if body.flexible is not None and body.simulated_flexible:
            path = body.flexible.material.path
            factors |= {f"modulus {path}": modulus, f"damping {path}": damping}
    return Scenario(factors | ({PAYLOAD: payload} if payload_bodies(shot) else {}))


def performed(
    path: str, factors: tuple[float, float, float], takes: int, draws: int, folder: Path, seed: int = 0
) -> list[Take]:  # fmt: skip
    """The takes of a shot.

    Args:
        path: Of the shot.
        factors: Of modulus, damping and payload.
        takes: Number of takes.
        draws: Number of robots that are drawn from each calibration.
        folder: For layers and recordings.
        seed: Of the noise.

    Raises:
        ShotError: The shot cannot be processed.
    """
    rng = np.random.default_rng(seed)
    optimized = optimize(path, outputs=OutputPaths(layer=str(folder / "take1.usda")))
    model = compiled_in(optimized.outcome.run.get)
    scenario = real_robot(model, *factors)
    truth, target = _truth(model, scenario), int(np.argmin(_errors(optimized)))
    on_robot = _on_robot(model, scenario, optimized)[target]
    found = [Take(1, _errors(optimized)[target], on_robot, np.nan, np.nan, {})]
    _tell(found[-1])
    for number in range(1, takes):
        files = _recorded(model, scenario, optimized, rng, folder, number)
        refined = refine(folder / f"take{number}_root.usda", files, layer=folder / f"take{number + 1}.usda")
        optimized = refined.optimized
        drawn = expected_errors(optimized, draws)[:, target]
        estimates = {item.name: item.value for item in refined.calibrated.calibration.estimates}
        found.append(
            Take(
                number + 1, _errors(optimized)[target], _on_robot(model, scenario, optimized)[target],
                float(np.median(drawn)), float(drawn.max()),
                {n: estimates[n] / value - 1.0 for n, value in truth.items() if n in estimates},
            )
        )  # fmt: skip
        _tell(found[-1])
    return found


def _truth(shot: CompiledShot, scenario: Scenario) -> dict[str, float]:
    """The values of the robot, by the names of estimates."""
    character: Character = shot.character
    found = {}
    for body in character.bodies:
        if body.flexible is not None and body.simulated_flexible:
            material = body.flexible.material
            ratio = material.damping_ratio if material.rayleigh is None else 1.0
            for kind, value in (("modulus", material.youngs_modulus), ("damping", ratio)):
                found[f"{kind} {material.path}"] = value * scenario.factors[f"{kind} {material.path}"]
    for index in payload_bodies(shot):
        own = character.bodies[index]
        if own.mass is not None:
            found[f"mass {own.path}"] = own.mass.mass * scenario.factors[PAYLOAD]
    return found


def _errors(optimized: OptimizationResult) -> list[float]:
    """Largest error of each target on the model [m]."""
    return [target.max_error for target in optimized.targets.values()]


def _on_robot(model: CompiledShot, scenario: Scenario, optimized: OptimizationResult) -> list[float]:
    """Largest error of each target with the curves on the robot [m]."""
    result, animation = optimized.result, model.animation
    options = RunSettings(step=result.step_s / FINER, pre_roll=result.pre_roll_s)
    shot = model.with_tracks(animation.tracks)
    return [float(e) for e in errors_on(shot, options, {"": found_tracks(result, animation)}, [scenario])[""][0]]


def _recorded(
    model: CompiledShot, scenario: Scenario, optimized: OptimizationResult, rng: np.random.Generator, folder: Path,
    number: int,
) -> list[str]:  # fmt: skip
    """Files of the recordings of a take."""
    result = optimized.result
    shot = model.with_tracks(found_tracks(result, model.animation))
    after = AFTER if ends_at_rest(shot.animation) else 0.0
    options, _ = simulable(shot, RunSettings(step=result.step_s / FINER), after)
    robot = Robot(shot_of(shot, scenario), np.zeros(len(shot.character.motors)))
    recordings = recorded(shot.character, signals_of(robot, replace(options), after), rng)
    return [written(recording, folder / f"take{number}_{recording.file}") for recording in recordings]


def _row(take: Take) -> list[str]:
    drawn = ("", "") if np.isnan(take.largest) else (f"{1e3 * take.median:.2f} mm", f"{1e3 * take.largest:.2f} mm")
    off = ", ".join(f"{100.0 * value:+.2g}%" for value in take.off.values())
    return [str(take.take), f"{1e3 * take.on_model:.2f} mm", f"{1e3 * take.on_robot:.2f} mm", *drawn, off]


def _tell(take: Take) -> None:
    print(", ".join(f"{head} {text}" for head, text in zip(HEADS, _row(take), strict=True) if text), file=sys.stderr)
    sys.stderr.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """The command: exit status 1 where the error on the robot does not fall fivefold."""
    parser = bench_parser("takes", __doc__)
    parser.add_argument("shot", metavar="SHOT", help="USD file of the shot")
    for name, value in (("modulus", 1.2), ("damping", 0.7), ("payload", 1.1)):
        parser.add_argument(
            f"--{name}", type=float, default=value, metavar="F", help=f"{name} of the robot over the shot's ({value})"
        )
    parser.add_argument("--takes", type=int, default=3, metavar="N", help="number of takes (default: 3)")
    parser.add_argument("--draws", type=int, default=200, metavar="N", help="robots drawn from a calibration (200)")
    parser.add_argument("--folder", metavar="DIR", help="keep layers and recordings in this folder")
    output_options(parser, markdown=True)
    options = parser.parse_args(arguments)
    with TemporaryDirectory() as temporary:
        folder = Path(options.folder or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        factors = (options.modulus, options.damping, options.payload)
        takes = performed(options.shot, factors, options.takes, options.draws, folder)
    rows = [_row(take) for take in takes]
    if options.markdown:
        Path(options.markdown).write_text(markdown(HEADS, rows), encoding="utf-8")
    if options.json:
        print(json.dumps([asdict(take) for take in takes]))
    else:
        from calmotion.cli.tables import console_on, print_table

        print_table(console_on(sys.stdout), "Takes of a robot that is not the model", HEADS, rows)
    return int(min(take.on_robot for take in takes) > takes[0].on_robot / FALLS)


if __name__ == "__main__":
    sys.exit(main())
