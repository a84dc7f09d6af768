"""The recording itself. With `bodies.py` and `layout.py`, all that talks to rerun, which changes every minor version.

Only rerun's viewer binds sockets or reports on its use. It is never started here: a recording is a file.
"""

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import rerun as rr
from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Animation, Character, Motion, Result, Simulation, SystemModes, measure_of
from calmotion.support import distinct_names, replaced
from calmotion.views import error_spectrum, highest_frequency, pace_of, sample_motion

from .bodies import log_bodies, log_ghost, log_scenery
from .colors import Style
from .deviation import largest_deviation
from .layout import ALONE, INPUT, OPTIMIZED, REFERENCE, STYLES, TIME, make_blueprint, motor_plots
from .stream import saved
from .summary import describe
from .trails import log_trails

_END, _FOOTER = b"RRF2FOOT", 32  # mark at the end of a whole recording, and where it is looked for [bytes]
ITERATION = "iteration"
Progress = Callable[[float, str], None]


def write_recording(
    path: str,
    character: Character,
    animation: Animation,
    result: Result,
    *,
    samples_per_plot: int = 2000,
    progress: Progress = lambda fraction, message: None,
    system: SystemModes | None = None,
) -> None:
    """Write a .rrd file atomically.

    In 3D the motion is sampled at the shot's frames; curves keep the simulation's steps, thinned to
    `samples_per_plot`. What lies before the first frame (the pre-roll) is not recorded.

    Args:
        path: The file.
        character: The character.
        animation: For the times of its frames.
        result: Of `simulate` (then nothing is logged as optimised) or of `optimize`.
        samples_per_plot: Largest number of samples of a curve.
        progress: Called with a fraction in 0..1 and a message.
        system: Natural modes of the whole character.

    Raises:
        ShotError: When the file cannot be written.
    """
    target = Path(path)
    # The viewer keeps one layout, with its camera, for all recordings of an application: each shot is one.
    recording = rr.RecordingStream(f"calmotion {target.stem}", recording_id=f"{target.stem}{character.path}")
    motions = {INPUT: result.before.motion, REFERENCE: result.reference}
    if result.after is not None:
        motions[OPTIMIZED] = result.after.motion
    at_frames = {root: sample_motion(motion, animation.frame_times) for root, motion in motions.items()}
    scale = largest_deviation(character, result, at_frames[INPUT], at_frames[REFERENCE])
    try:
        with replaced(target) as temporary:
            with saved(recording, temporary):
                # active: also where the viewer remembers the layout of an earlier recording of this shot
                blueprint = make_blueprint(character, animation, result, scale)
                recording.send_blueprint(blueprint, make_active=True, make_default=True)
                summary = rr.TextDocument(describe(character, result, system), media_type="text/markdown")
                recording.log("summary", summary, static=True)
                log_all(recording, character, at_frames, result, scale, samples_per_plot, progress)
            _refuse_cut(temporary)
    except (OSError, RuntimeError) as error:  # the second one is that of rerun's threads
        raise ShotError(
            "the recording cannot be written",
            path=path,
            found=str(error) or None,
            remedy="Check the free space of the disk, or choose another --rrd.",
        ) from error


def _refuse_cut(file: Path) -> None:
    """Refuse a recording without its end, of which rerun only prints a message.

    Raises:
        OSError: It has none.
    """
    with file.open("rb") as opened:
        opened.seek(-min(_FOOTER, file.stat().st_size), os.SEEK_END)
        if _END not in opened.read():
            raise OSError("its end could not be written")


def log_all(
    recording: rr.RecordingStream,
    character: Character,
    at_frames: dict[str, Motion],
    result: Result,
    scale: float,
    samples_per_plot: int,
    progress: Progress,
) -> None:
    """Everything, in the order of the entity tree."""
    for count, (root, motion) in enumerate(at_frames.items()):
        progress(count / (len(at_frames) + 1), f"{root} in 3D")
        if root != REFERENCE:
            log_bodies(recording, root, character, result, at_frames, scale)
            log_ghost(recording, root, character, result, at_frames, scale)
            log_trails(recording, root, character, whole_motion(result, root), result.reference, motion.times, scale)
    log_scenery(recording, character)
    progress(len(at_frames) / (len(at_frames) + 1), "curves")
    for root, simulation in simulations_of(result).items():
        style = STYLES[root] if result.after is not None else replace(STYLES[root], label=ALONE)
        for log in (log_errors, log_motors, log_reactions):
            log(recording, character, root, simulation, samples_per_plot, style)
    log_spectra(recording, character, result)
    log_tempo(recording, character, result)
    if result.after is not None:
        log_changes(recording, character, result, samples_per_plot)
    log_progress(recording, result)


def simulations_of(result: Result) -> dict[str, Simulation]:
    """The simulations by their roots."""
    return {INPUT: result.before} | ({OPTIMIZED: result.after} if result.after is not None else {})


def whole_motion(result: Result, root: str) -> Motion:
    """The motion of all time steps under one root."""
    if root == REFERENCE:
        return result.reference
    run = result.before if root == INPUT else result.after
    assert run is not None
    return run.motion


def thinned(simulation: Simulation, samples: int) -> slice:
    """Rows of a simulation to plot: the judged ones, every n-th."""
    rows = simulation.motion.judged
    count = len(simulation.motion.times) - rows.start
    return slice(rows.start, None, max(1, int(np.ceil(count / samples))))


def log_curve(
    recording: rr.RecordingStream, entity: str, times: Array, values: Array, color: tuple[int, int, int], name: str
) -> None:
    """One curve over the time of the shot."""
    recording.log(entity, rr.SeriesLines(colors=[color], names=[name], widths=[1.8]), static=True)
    recording.send_columns(entity, [rr.TimeColumn(TIME, duration=times)], rr.Scalars.columns(scalars=values))


def log_errors(
    recording: rr.RecordingStream, character: Character, root: str, simulation: Simulation, samples: int, style: Style
) -> None:
    """Position errors [mm] of all targets, rotation errors [deg] of those whose rotation counts."""
    rows = thinned(simulation, samples)
    times = simulation.motion.times[rows]
    names = distinct_names([target.path for target in character.targets])
    for k, target in enumerate(character.targets):
        name = f"{names[target.path]} {style.label}"
        color = style.shade(k, len(character.targets))
        errors = 1e3 * simulation.position_errors[rows, k]
        log_curve(recording, f"errors/position_mm/{root}{target.path}", times, errors, color, f"{name} [mm]")
        if target.rotation_weight > 0.0:
            turns = np.degrees(simulation.rotation_errors[rows, k])
            log_curve(recording, f"errors/rotation_deg/{root}{target.path}", times, turns, color, f"{name} [deg]")


def log_spectra(recording: rr.RecordingStream, character: Character, result: Result) -> None:
    """Amplitude of each target's error [mm] by frequency [Hz], as far as something happens in the input."""
    simulations = simulations_of(result)
    for k, target in enumerate(character.targets):
        spectra = {root: error_spectrum(run.motion, result.reference, k) for root, run in simulations.items()}
        end = highest_frequency(*spectra[INPUT])
        for root, (frequencies, amplitudes) in spectra.items():
            shown = slice(1, int(np.searchsorted(frequencies, end, side="right")))
            if shown.stop <= 1:
                continue
            bars = rr.BarChart(
                1e3 * amplitudes[shown],
                abscissa=frequencies[shown],
                widths=np.full(shown.stop - 1, frequencies[1], dtype=np.float32),
                color=STYLES[root].shade(k, len(character.targets)),
            )
            recording.log(f"spectra/{root}{target.path}", bars, static=True)


def log_motors(
    recording: rr.RecordingStream, character: Character, root: str, simulation: Simulation, samples: int, style: Style
) -> None:
    """Angle [deg] and torque [N m], or length [mm] and force [N], of each motor."""
    rows = thinned(simulation, samples)
    motion = simulation.motion
    for m, motor in enumerate(character.motors):
        measure = measure_of(motor)
        for (name, unit), values in zip(
            motor_plots(motor), (measure.factor * motion.motor_values, motion.motor_efforts), strict=True
        ):
            label = f"{style.label} [{unit}]"
            log_curve(
                recording, f"motors{motor.path}/{name}/{root}", motion.times[rows], values[rows, m], style.color, label
            )


def log_reactions(
    recording: rr.RecordingStream, character: Character, root: str, simulation: Simulation, samples: int, style: Style
) -> None:
    """Size of the force [N] and the moment [N m] that each joint transmits."""
    rows, motion = thinned(simulation, samples), simulation.motion
    names = distinct_names([joint.path for joint in character.joints])
    for kind, values in (("force_N", motion.joint_forces), ("moment_Nm", motion.joint_moments)):
        if values is None:
            continue
        for j, joint in enumerate(character.joints):
            size = np.linalg.norm(values[rows, j], axis=1)
            color, name = style.shade(j, len(character.joints)), f"{names[joint.path]} {style.label}"
            log_curve(recording, f"reactions/{kind}{joint.path}/{root}", motion.times[rows], size, color, name)


def log_changes(recording: rr.RecordingStream, character: Character, result: Result, samples: int) -> None:
    """What the optimiser added to each motor's angle [deg] or length [mm]."""
    assert result.after is not None
    rows = thinned(result.after, samples)
    after = result.after.motion
    before = sample_motion(result.before.motion, after.times[rows])
    names = distinct_names([motor.path for motor in character.motors])
    for m, motor in enumerate(character.motors):
        measure = measure_of(motor)
        change = measure.factor * (after.motor_values[rows, m] - before.motor_values[:, m])
        color = STYLES[OPTIMIZED].shade(m, len(character.motors), spread=0.85)  # no two runs to tell apart
        name = f"{names[motor.path]} [{measure.unit}]"
        log_curve(recording, f"changes_{measure.unit}{motor.path}", after.times[rows], change, color, name)


def log_tempo(recording: rr.RecordingStream, character: Character, result: Result) -> None:
    """Tempo of the performance [% of the animation's], and what makes each part slower, where it begins."""
    pace = pace_of(character, result)
    if pace is None:
        return
    log_curve(recording, "tempo/percent", pace.times, pace.percent, STYLES[OPTIMIZED].color, "tempo [%]")
    texts = [f"to {part.end:.2f} s {part.factor:.2f} times as long: {', '.join(part.because)}" for part in pace.parts]
    if texts:
        starts = [rr.TimeColumn(TIME, duration=[part.start for part in pace.parts])]
        recording.send_columns("tempo_reasons", starts, rr.TextLog.columns(text=texts))


def log_progress(recording: rr.RecordingStream, result: Result) -> None:
    """Objective and gradient of each iteration, as powers of ten since a plot has no logarithmic axis."""
    if not result.search.steps:
        return
    iterations = [rr.TimeColumn(ITERATION, sequence=range(len(result.search.steps)))]
    series = {
        "log10_objective": [step.objective for step in result.search.steps],
        "log10_gradient_norm": [step.gradient_norm for step in result.search.steps],
    }
    for (name, values), color in zip(series.items(), ((0, 114, 178), (150, 150, 150)), strict=True):
        powers = np.log10(np.maximum(np.abs(np.array(values, dtype=float)), 1e-300))
        recording.log(f"optimizer/{name}", rr.SeriesLines(colors=[color], names=[name.replace("_", " ")]), static=True)
        recording.send_columns(f"optimizer/{name}", iterations, rr.Scalars.columns(scalars=powers))
