"""The swung arm with reduced flexible bodies of Exudyn and of Calmotion: run time against error.

0.6 m of plastic, 20 mm square, a rigid cube of 0.2 kg at its end; a quarter turn in half a second, and half a second
after it; no gravity, damping in proportion to stiffness. Six interface modes and eight more on both sides, the same
mesh, one thread. Each is measured against itself with a fine step, so that only the error in time counts.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from calmotion.arrays import Array
from calmotion.benchmarks.integrators.integrators import Scene
from calmotion.benchmarks.scenes.beam_arm import beam_arm, beam_mesh, quintic, shot_of
from calmotion.model import ElasticMaterial
from calmotion.reduction.elements.assembly import FEModel, assemble

LENGTH, THICKNESS, PAYLOAD, CELLS = 0.6, 0.02, 0.2, 12
RETARDATION = 2e-4  # damping over stiffness [s]
MATERIAL = ElasticMaterial("/Arm/Plastic", 1.8e9, 0.35, 1200.0, rayleigh=(0.0, RETARDATION))
FIXED_MODES, DURATION, SAMPLES = 8, 1.0, 24
STEPS, FINE = (240, 480, 960, 1920), 15360
LEVELS = (1e-4, 1e-5)  # errors of the tip [m] at which run times are compared


@dataclass(frozen=True)
class Run:
    """One simulation: steps, largest error of the tip at the samples [m], and run time [s]."""

    code: str
    steps: int
    error: float
    wall_s: float


@dataclass(frozen=True, eq=False)
class Performance:
    """What the load of the arm did.

    Attributes:
        times: [s], shape [s].
        positions: World [m], shape [s, 3].
        rotations: Rotation matrices, shape [s, 3, 3].
        wall_s: Run time [s].
    """

    times: Array
    positions: Array
    rotations: Array
    wall_s: float


def quarter_turn(t: float) -> float:
    """The motion of the comparison [rad]."""
    s = min(2.0 * t, 1.0)
    return 0.5 * np.pi * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


class Exudyn:
    """The arm in Exudyn, reduced once.

    Args:
        material: With damping in proportion to stiffness.
        payload: [kg].
        mesh: Elements along the arm and across it, and their grading, as of `beam_mesh`.
    """

    steps, fine = STEPS, FINE

    def __init__(
        self, material: ElasticMaterial = MATERIAL, payload: float = PAYLOAD,
        mesh: tuple[int, int, tuple[float, float]] = (CELLS, 2, (1.0, 1.0)),
    ) -> None:  # fmt: skip
        sys.exudynFast = True  # type: ignore[attr-defined]  # its build without range checks
        import exudyn
        from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface
        from scipy.sparse import csr_matrix, identity, kron

        model: FEModel = assemble(*beam_mesh(LENGTH, THICKNESS, *mesh), material)
        nodes = model.mesh.nodes
        self.ends = [np.flatnonzero(np.abs(nodes[:, 0] - x) < 1e-9) for x in (0.0, LENGTH)]
        fem = FEMinterface()
        fem.nodes = {"Position": nodes}
        fem.massMatrix = csr_matrix(kron(model.mass, identity(3)))
        fem.stiffnessMatrix = csr_matrix(model.stiffness)
        ends = [[int(node) for node in end] for end in self.ends]
        fem.ComputeHurtyCraigBamptonModes(ends, FIXED_MODES, True, HCBstaticModeSelection.RBE2)
        self.exu, self.body, self.payload = exudyn, ObjectFFRFreducedOrderInterface(fem), payload
        assert material.rayleigh is not None
        self.retardation = material.rayleigh[1]

    def run(self, steps: int) -> tuple[Array, float]:
        """Tip at the samples [m], shape [s, 3], and the run time [s]."""
        done = self.performed(steps, quarter_turn, DURATION, SAMPLES)
        return done.positions, done.wall_s

    # long: one model of another code, from top to bottom
    def performed(self, steps: int, motion: Callable[[float], float], seconds: float, samples: int) -> Performance:
        """The arm in a motion.

        Args:
            steps: Number of time steps.
            motion: Angle [rad] at a time [s].
            seconds: [s].
            samples: Number of samples, the last one at the end.
        """
        import exudyn.utilities as eu

        exu = self.exu
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        flexible = self.body.AddObjectFFRFreducedOrder(mbs, stiffnessProportionalDamping=self.retardation)
        root, tip = (
            mbs.AddMarker(
                eu.MarkerSuperElementRigid(
                    bodyNumber=flexible["oFFRFreducedOrder"], meshNodeNumbers=end,
                    weightingFactors=np.full(len(end), 1.0 / len(end)),
                )
            )
            for end in self.ends
        )  # fmt: skip
        # a hub that is turned about z, on which the arm is welded
        node = mbs.AddNode(eu.Rigid2D(referenceCoordinates=[0.0, 0.0, 0.0]))
        hub = mbs.AddObject(eu.ObjectRigidBody2D(mass=1.0, inertia=1e-2, nodeNumber=node))
        on_hub = mbs.AddMarker(eu.MarkerBodyRigid(bodyNumber=hub))
        ground = mbs.AddMarker(eu.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eu.NodePointGround()), coordinate=0))

        def turned(_: Any, t: float, __: int, ___: float) -> float:
            return motion(t)

        for k in range(3):
            markers = [ground, mbs.AddMarker(eu.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))]
            driven = {"offsetUserFunction": turned} if k == 2 else {}
            mbs.AddObject(eu.CoordinateConstraint(markerNumbers=markers, **driven))
        mbs.AddObject(eu.GenericJoint(markerNumbers=[on_hub, root], constrainedAxes=[1] * 6))
        edge = 2.0 * THICKNESS
        inertia = eu.RigidBodyInertia(
            mass=self.payload, com=[0.0] * 3, inertiaTensor=PAYLOAD * edge**2 / 6.0 * np.eye(3)
        )
        load = mbs.CreateRigidBody(inertia=inertia, referencePosition=[LENGTH, 0.0, 0.0], returnDict=True)
        on_load = mbs.AddMarker(eu.MarkerBodyRigid(bodyNumber=load["bodyNumber"]))
        mbs.AddObject(eu.GenericJoint(markerNumbers=[tip, on_load], constrainedAxes=[1] * 6))
        outputs = exu.OutputVariableType
        sensors = [
            mbs.AddSensor(
                eu.SensorBody(
                    bodyNumber=load["bodyNumber"], outputVariableType=output, storeInternal=True, writeToFile=False
                )
            )
            for output in (outputs.Position, outputs.RotationMatrix)
        ]  # fmt: skip
        mbs.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps, settings.timeIntegration.endTime = steps, seconds
        settings.timeIntegration.verboseMode = 0
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.linearSolver.solverType = exu.LinearSolverType.EigenDense
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = seconds / samples
        begin = time.perf_counter()
        mbs.SolveDynamic(settings)
        wall = time.perf_counter() - begin
        positions, rotations = (np.asarray(mbs.GetSensorStoredData(sensor))[-samples:] for sensor in sensors)
        return Performance(positions[:, 0], positions[:, 1:], rotations[:, 1:].reshape(-1, 3, 3), wall)


class Ours:
    """The arm here, by one integrator."""

    steps, fine = STEPS, FINE

    def __init__(self, integrator: str):
        character, meshes = beam_arm(
            length=LENGTH, thickness=THICKNESS, payload=PAYLOAD, modes=6 + FIXED_MODES, elasticity="linear",
            gravity=0.0, cells=CELLS,
        )  # fmt: skip
        settings = character.bodies[0].flexible
        assert settings is not None
        link = replace(character.bodies[0], flexible=replace(settings, material=MATERIAL))
        character = replace(character, bodies=(link, *character.bodies[1:]))
        # sampled so densely that the spline is the quintic
        self.scene = Scene((character, meshes), shot_of(quintic(0.5 * np.pi, 0.5), DURATION, rate=240.0))
        self.integrator = integrator
        self.scene.run(DURATION / 240, integrator, 0.1)  # compiles

    def run(self, steps: int) -> tuple[Array, float]:
        """Tip at the samples [m], shape [s, 3], and the run time [s]."""
        run = self.scene.run(DURATION / steps, self.integrator)
        return run.target_positions[:: steps // SAMPLES, 0][1:], run.trajectory.wall_s


def compare(peers: Mapping[str, Any], repeats: int = 3) -> list[Run]:
    """Work and precision of other codes, by name, and of ours; nothing without others."""
    results = []
    ours = {f"ours, {name}": Ours(name) for name in ("bdf2", "generalized-alpha")} if peers else {}
    for name, code in {**peers, **ours}.items():
        exact, _ = code.run(code.fine)
        for steps in code.steps:
            runs = [code.run(steps) for _ in range(repeats)]
            error = float(np.linalg.norm(runs[0][0] - exact, axis=1).max())
            results.append(Run(name, steps, error, float(np.median([wall for _, wall in runs]))))
    return results


def time_at(runs: list[Run], code: str, error: float) -> float:
    """Run time of a code at an error [s], by interpolation (or continuation) of logarithms."""
    selected = sorted((run for run in runs if run.code == code), key=lambda run: run.error)
    errors, walls = np.log([run.error for run in selected]), np.log([run.wall_s for run in selected])
    slope = np.polyfit(errors, walls, 1)
    return float(np.exp(np.polyval(slope, np.log(error))))
