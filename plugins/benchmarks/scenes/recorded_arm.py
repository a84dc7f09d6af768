"""Random arms whose parameters are not those of their model, and what sensors record of them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import DRIVE, Body, Character, FEMeshes, RunSettings
from calmotion.multibody import SimulationFailure, span_tree
from calmotion.recordings import ACCELEROMETER, ANGLE, MARKER, Channel, SensorRecording
from calmotion.reduction import assemble, frequency_errors
from calmotion.simulation import CompiledShot, compile_shot, reduce_bodies
from calmotion.testing import beam_arm, quintic, shot_of
from calmotion_plugins.calibration import HIGHER_MODES, Robot, Signals, robot_parameters, robot_with, signals_of

REFERENCE = RunSettings(step=1.0 / 3840.0, integrator="newmark")  # of the real robot, and half of it
RATES = {MARKER: 120.0, ACCELEROMETER: 800.0, ANGLE: 200.0}  # of the sensors [Hz]
NOISE = {MARKER: 3e-4, ACCELEROMETER: 0.1, ANGLE: 3e-4}  # [m], [m/s^2], [rad]
BIAS, PLACE, DRIFT = 0.2, 1e-3, 3e-5  # standard deviations of what sensors have of their own
MISSING, OUTLIERS = 0.01, 0.003  # shares of the samples
AFTER = 0.6  # what is recorded after the end of the shot [s]
# Elements along a link and across it, and how they are graded towards the clamps, of the model and of a finer mesh: the
# frequencies of the first bending modes are 0.03 to 0.1% above those of a finer mesh. Elements of equal size are 0.3%
# off where they are clamped, and so would be a mesh that nothing refines there.
MESH, FINER = (24, 4, (2.0, 1.5)), (32, 6, (2.5, 2.0))
UP_TO = 4000.0  # modes of the finer mesh [Hz]: twice as many as the model has


@dataclass(frozen=True, eq=False)
class RecordedArm:
    """An arm, its recordings, and the truth.

    Attributes:
        shot: The model.
        recordings: Of the real arm.
        truth: Values of its parameters, by name.
    """

    shot: CompiledShot
    recordings: tuple[SensorRecording, ...]
    truth: Mapping[str, float]


def recorded_arm(number: int, finer: bool = False) -> RecordedArm:
    """The arm of a number: the same on every machine.

    Args:
        number: Seed of everything that is random.
        finer: Whether the real arm has a finer mesh and more modes than the model.
    """
    rng = np.random.default_rng(number)
    links, length, slenderness = int(rng.integers(1, 3)), rng.uniform(0.25, 0.4), rng.uniform(16.0, 24.0)
    size = {
        "links": links, "length": length, "thickness": length / slenderness, "payload": rng.uniform(0.1, 0.3),
        "youngs_modulus": 10.0 ** rng.uniform(9.2, 9.7), "damping": rng.uniform(0.01, 0.03), "elasticity": "linear",
    }  # fmt: skip
    turn, seconds = rng.uniform(0.4, 0.9), rng.uniform(0.2, 0.35)
    away, back = quintic(turn, seconds, 0.1), quintic(-turn, rng.uniform(0.2, 0.35), 0.4 + seconds)
    animation = shot_of(lambda t: away(t) + back(t), 1.5, motors=links)
    gives = rng.uniform() < 0.5
    model, real = (_arm(size, animation, gives, fine) for fine in (False, finer))
    # a nuisance of the model is not of the robot
    parameters = tuple(p for p in robot_parameters(model) if p.kind != HIGHER_MODES)
    x = np.clip(rng.standard_normal(len(parameters)), -2.0, 2.0)
    values = {p.name: p.value(max(float(v), p.least)) for p, v in zip(parameters, x, strict=True)}
    truth = {(p.kind, p.path, p.axis): values[p.name] for p in parameters}
    signals = _reference(robot_with(real, truth))
    recordings = _recorded(model.character, signals, rng)
    return RecordedArm(model, recordings, values)


def _arm(size: Mapping[str, object], animation: object, gives: bool, fine: bool) -> CompiledShot:
    cells, across, grading = FINER if fine else MESH
    character, meshes = beam_arm(**size, cells=cells, across=across, grading=grading)  # type: ignore[arg-type]
    if fine:  # the lowest modes alone would lack static responses, and be 1 to 2% too stiff
        character = replace(character, bodies=tuple(_with_more_modes(body) for body in character.bodies))
    else:
        meshes = _with_error(character, meshes)
    if gives:
        last = replace(character.motors[-1], model=DRIVE, position_gain=150.0, velocity_gain=1.5)
        character = replace(character, motors=(*character.motors[:-1], last))
    bodies = reduce_bodies(character, span_tree(character), meshes)
    return compile_shot(character, animation, bodies)  # type: ignore[arg-type]


def _with_error(character: Character, meshes: FEMeshes) -> FEMeshes:
    """The meshes with the estimated error of their first frequency, as that of a shot has it."""
    settings, mesh = character.bodies[0].flexible, meshes.meshes[0]  # all links are alike
    assert settings is not None
    model = assemble(mesh.points, mesh.tets, settings.material)
    clamped = np.flatnonzero(model.mesh.nodes[:, 0] < 1e-9)
    error = float(frequency_errors(model, settings.material, 1, clamped)[1][0])
    own = (replace(m, quality=replace(m.quality, frequency_error=error)) for m in meshes.meshes)
    return replace(meshes, meshes=tuple(own))


def _with_more_modes(body: Body) -> Body:
    return replace(body, flexible=replace(body.flexible, max_frequency=UP_TO)) if body.flexible is not None else body


def _reference(robot: Robot) -> Signals:
    """Signals of the real arm, extrapolated to steps of zero: the error is of fourth order.

    Newmark's method does not damp the fast modes of a compliant motor, and can diverge: then the scheme is the
    generalized-alpha method.
    """
    try:
        coarse, fine = _halved(robot, REFERENCE)
    except SimulationFailure:
        coarse, fine = _halved(robot, replace(REFERENCE, integrator="generalized-alpha"))

    def limit(one: Array, other: Array) -> Array:
        return np.asarray(other[::2] + (other[::2] - one) / 3.0)

    names = ("positions", "rotations", "angles", "efforts")
    limits = {name: limit(getattr(coarse, name), getattr(fine, name)) for name in names}
    return replace(coarse, **limits, _splines={})


def _halved(robot: Robot, options: RunSettings) -> tuple[Signals, Signals]:
    """With the step of the options, and with half of it."""
    assert options.step is not None
    coarse = signals_of(robot, options, AFTER)
    return coarse, signals_of(robot, replace(options, step=0.5 * options.step), AFTER)


def _recorded(character: Character, signals: Signals, rng: np.random.Generator) -> tuple[SensorRecording, ...]:
    """A marker and an accelerometer at the first target, and the encoders, each on its own clock.

    Args:
        character: With targets and motors.
        signals: What they do.
        rng: Of noise, clocks, biases and places.
    """
    loads, end = [character.targets[0].path], float(signals.times[-1])
    motors = [motor.path for motor in character.motors]
    found = []
    for kind, paths in ((MARKER, loads), (ACCELEROMETER, loads), (ANGLE, motors)):
        start, drift = rng.uniform(-3.0, 3.0), DRIFT * rng.standard_normal()
        own = np.arange(-0.3, end - 0.05, 1.0 / RATES[kind])  # of the robot's clock
        channels = []
        for index, path in enumerate(paths):
            values = signals.at(kind, index, own)
            if kind == MARKER:
                values = values + signals.axes_at(index, own) @ (PLACE * rng.standard_normal(3))
            if kind == ACCELEROMETER:
                values = values + BIAS * rng.standard_normal(3)
            values = _disturbed(values, NOISE[kind], rng)
            channels.append(Channel(kind, path, start + own / (1.0 + drift), values))
        found.append(SensorRecording(f"{kind}.csv", f"{kind}", tuple(channels)))
    return tuple(found)


def _disturbed(values: Array, noise: float, rng: np.random.Generator) -> Array:
    """With noise, gaps and outliers."""
    values = values + noise * rng.standard_normal(values.shape)
    lost, wrong = rng.uniform(size=len(values)) < MISSING, rng.uniform(size=len(values)) < OUTLIERS
    values[wrong] += 30.0 * noise * rng.standard_normal((int(wrong.sum()), values.shape[1]))
    values[lost] = np.nan
    return np.asarray(values)
