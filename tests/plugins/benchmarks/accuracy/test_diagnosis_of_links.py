"""Links of an arm whose motors follow exactly, told by what other code's sensors see of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from calmotion.model import DRIVE, FEMesh, FEMeshes, FlexibleSettings, MeshQuality, RunSettings
from calmotion.multibody import Workspace, joint_values, span_tree
from calmotion.recordings import ACCELEROMETER, ANGLE, MARKER, Channel, SensorRecording
from calmotion.simulation import compile_shot, prepare, reduce_bodies, run_forward
from calmotion.testing import beam_mesh
from calmotion_plugins.benchmarks.scenes.faulty_arm import faulty_arm
from calmotion_plugins.diagnosis import diagnosis_of, situation_of
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

COUNT = 2.0 * np.pi / 4096


@cache
def arm(model):
    """Upper and fore link bend, each at some 9 Hz by itself, and together at 4 Hz."""
    drawn = next(own for own in (faulty_arm(seed, {"links": 1}) for seed in range(3, 99)) if not own.gives)
    shot = drawn.shot()
    character = shot.character
    settings = character.bodies[2].flexible
    assert isinstance(settings, FlexibleSettings)
    bodies = list(character.bodies)
    bodies[1] = replace(bodies[1], mass=None, flexible=settings)
    motors = character.motors
    if model == DRIVE:
        gain, damping = drawn.gains
        motors = tuple(
            replace(m, model=DRIVE, position_gain=float(k), velocity_gain=float(d))
            for m, k, d in zip(motors, 4.0 * gain, damping, strict=True)
        )
    character = replace(character, bodies=tuple(bodies), motors=motors)
    meshes = FEMeshes(
        tuple(
            FEMesh(body, *beam_mesh(length, drawn.thickness, 8, 2), MeshQuality(0.0, 0.0, 0.0))
            for body, length in ((1, drawn.upper), (2, drawn.fore))
        )
    )
    return compile_shot(character, shot.animation, reduce_bodies(character, span_tree(character), meshes))


@cache
def played(model):
    """Times [s], values of the motors, place of the load and what an accelerometer feels there."""
    shot = arm(model)
    settings = RunSettings(step=1e-3)
    prepared = prepare(shot, settings)
    times, model = prepared.grid.times, prepared.model
    command = np.stack([np.interp(times, track.times, track.values) for track in shot.animation.current], axis=1)
    command = make_interp_spline(times[::17], command[::17], k=5)
    run = run_forward(
        model, Workspace.for_system(model.system), command(times), command(times, 1), prepared.grid.h, prepared.world,
        integrator=settings.scheme,
    )  # fmt: skip
    values = joint_values(model.system, model.motor, shot.character.motors, run.trajectory.states.u, run.joint_angles)
    turned = Rotation.from_quat(run.target_rotations[:, 0][:, [1, 2, 3, 0]]).as_matrix()
    place = run.target_positions[:, 0]
    felt = make_interp_spline(times, place, k=5).derivative(2)(times) - shot.character.gravity
    return times, model.motor_values(values), place, np.einsum("tij,ti->tj", turned, felt)


def causes(model, sensors, rate, late=0.0):
    shot, (times, values, place, felt) = arm(model), played(model)
    rng, at = np.random.default_rng(4), np.arange(0.0, times[-1], 1.0 / rate)
    sampled = [np.stack([np.interp(at, times, column) for column in part.T], axis=1) for part in (values, place, felt)]
    channels = [
        Channel(ANGLE, motor.path, at + late, COUNT * np.round(sampled[0][:, [m]] / COUNT))
        for m, motor in enumerate(shot.character.motors)
        if "encoders" in sensors
    ]
    for kind, k, noise in ((MARKER, 1, 2e-4), (ACCELEROMETER, 2, 0.1)):
        if kind in sensors:
            channels.append(Channel(kind, "/Arm/Load", at + late, sampled[k] + rng.normal(0.0, noise, (len(at), 3))))
    return diagnosis_of(situation_of(shot, [SensorRecording("take.csv", "", tuple(channels))]))


@pytest.mark.parametrize(
    "model, sensors, rate",
    [
        ("prescribed", ("encoders", MARKER), 100.0),
        ("prescribed", ("encoders", ACCELEROMETER), 100.0),
        ("prescribed", (MARKER,), 100.0),
        (DRIVE, ("encoders", MARKER), 100.0),
    ],
)
def test_links_that_bend_together_are_the_cause(model, sensors, rate):
    first = causes(model, sensors, rate).causes[0]
    assert first.cause == "links" and first.share > 0.8 and first.confidence > 0.9
    assert {row["name"]: row["value"] for row in first.parameters}["factor"] == pytest.approx(1.0, abs=0.03)


def test_clocks_that_differ_are_a_delay_or_moved():
    first = causes("prescribed", ("encoders", MARKER), 100.0, late=0.03).causes[0]
    assert first.cause == "delay" and first.share > 0.8
    assert first.parameters[0]["value"] == pytest.approx(0.03, abs=2e-3)
    moved = causes("prescribed", ("encoders", MARKER), 100.0, late=1.0)
    assert moved.causes[0].cause == "links" and "1.00 s" in moved.situation.notes[-1]
