"""A flexible arm with a load in Exudyn, another program with reduced flexible bodies (the optional extra `bench`)."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array
from calmotion.model import ElasticMaterial
from calmotion.reduction import FEModel, assemble
from calmotion.testing import beam_mesh


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


class ExudynArm:
    """The arm in Exudyn, reduced once.

    It turns about z, without gravity; a rigid cube is welded to its end.

    Args:
        material: With damping in proportion to stiffness.
        payload: [kg].
        mesh: Elements along the arm and across it, and their grading, as of `beam_mesh`.

    Attributes:
        LENGTH, THICKNESS: Of the arm, which is square [m].
        PAYLOAD: At its end [kg], where no other is given.
        CELLS: Elements along it, where no other mesh is given.
        FIXED_MODES: Modes of the reduction with both ends held, beside the six of each interface that moves.
        RETARDATION: Damping over stiffness [s].
        MATERIAL: A plastic, where no other is given.
    """

    LENGTH, THICKNESS, PAYLOAD, CELLS, FIXED_MODES = 0.6, 0.02, 0.2, 12, 8
    RETARDATION = 2e-4
    MATERIAL = ElasticMaterial("/Arm/Plastic", 1.8e9, 0.35, 1200.0, rayleigh=(0.0, RETARDATION))

    def __init__(
        self,
        material: ElasticMaterial = MATERIAL,
        payload: float = PAYLOAD,
        mesh: tuple[int, int, tuple[float, float]] = (CELLS, 2, (1.0, 1.0)),
    ) -> None:
        sys.exudynFast = True  # type: ignore[attr-defined]  # its build without range checks
        import exudyn
        from exudyn.FEM import FEMinterface, HCBstaticModeSelection, ObjectFFRFreducedOrderInterface
        from scipy.sparse import csr_matrix, identity, kron

        model: FEModel = assemble(*beam_mesh(self.LENGTH, self.THICKNESS, *mesh), material)
        nodes = model.mesh.nodes
        self.ends = [np.flatnonzero(np.abs(nodes[:, 0] - x) < 1e-9) for x in (0.0, self.LENGTH)]
        fem = FEMinterface()
        fem.nodes = {"Position": nodes}
        fem.massMatrix = csr_matrix(kron(model.mass, identity(3)))
        fem.stiffnessMatrix = csr_matrix(model.stiffness)
        ends = [[int(node) for node in end] for end in self.ends]
        fem.ComputeHurtyCraigBamptonModes(ends, self.FIXED_MODES, True, HCBstaticModeSelection.RBE2)
        self.exu, self.body, self.payload = exudyn, ObjectFFRFreducedOrderInterface(fem), payload
        assert material.rayleigh is not None
        self.retardation = material.rayleigh[1]

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
                    bodyNumber=flexible["oFFRFreducedOrder"],
                    meshNodeNumbers=end,
                    weightingFactors=np.full(len(end), 1.0 / len(end)),
                )
            )
            for end in self.ends
        )
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
        edge = 2.0 * self.THICKNESS
        inertia = eu.RigidBodyInertia(
            mass=self.payload, com=[0.0] * 3, inertiaTensor=self.PAYLOAD * edge**2 / 6.0 * np.eye(3)
        )
        load = mbs.CreateRigidBody(inertia=inertia, referencePosition=[self.LENGTH, 0.0, 0.0], returnDict=True)
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
        ]
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
