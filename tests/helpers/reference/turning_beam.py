"""A straight beam on a driven hinge at the world, reduced: what several reference problems have in common."""

import numpy as np
from arms import Z_TO_Y, frame
from boxes import box_tets, fe_mesh
from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model import Body, Character, FlexibleSettings, Joint, MassProperties, Motor, Target
from calmotion.multibody.analysis.kinematics import rigid_state, target_frames
from calmotion.multibody.integrators.simulation import simulate
from calmotion.multibody.integrators.workspace import Workspace
from calmotion.multibody.model.model import body_anchors, compile_model, rigid_body
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.reduce import reduce_body


class TurningBeam:
    """A square beam along x whose hinge turns it about the world's y axis.

    Args:
        length, thickness: [m].
        material: Elastic material.
        cells: Bricks of six tetrahedra along the axes.
        law: `linear`, `stvk` or `neohookean`.
        modes: Linear modes; the nonlinear laws add modal derivatives.
        payload: Mass [kg] and inertia [kg m^2], [3, 3], of a rigid body welded to the tip about its middle, or None.
        gravity: [m/s^2].
    """

    def __init__(self, length, thickness, material, cells, law, modes, payload=None, gravity=(0.0, 0.0, 0.0)):
        settings = FlexibleSettings(material, mode_count=modes, elasticity=law)
        bodies = [Body("/C/L0", frame(), None, flexible=settings)]
        joints = [Joint("/C/J0", "revolute", -1, 0, frame(rotation=Z_TO_Y), frame(rotation=Z_TO_Y))]
        last = 0
        if payload is not None:
            bodies.append(Body("/C/Cube", frame(length), MassProperties(payload[0], np.zeros(3), payload[1])))
            joints.append(Joint("/C/Weld", "fixed", 0, 1, frame(length), frame()))
            last = 1
        target = Target("/C/tip", last, frame() if last else frame(length))
        motor = Motor(0, "/C/J0", "drive:angular:physics:targetPosition")
        self.character = Character(
            "/C", tuple(bodies), tuple(joints), (motor,), (target,), np.asarray(gravity, dtype=float)
        )
        tree = span_tree(self.character)
        anchors = body_anchors(self.character, tree)
        points, tets = box_tets(cells, (length, thickness, thickness), (0.0, -thickness / 2, -thickness / 2))
        own = anchors[0]
        kinds = ["interface"] * len(own.joints) + ["point"] * len(own.targets)
        named = [AttachmentFrame(f"/C/{k}", f, kind) for k, (f, kind) in enumerate(zip(own.frames, kinds, strict=True))]
        self.body = reduce_body(fe_mesh(points, tets), bodies[0], named, (), own.root)
        reduced = [self.body] + [rigid_body(body, a) for body, a in zip(bodies[1:], anchors[1:], strict=True)]
        self.model = compile_model(self.character, tree, reduced)
        self.length = length

    def swing(self, angle, rate, step, duration):
        """Times [s], tip position in the hinge's axes (along, across) [m], trajectory."""
        t = step * np.arange(round(duration / step) + 1)
        system = self.model.system
        angles, rates = np.zeros((len(t), len(system.parent))), np.zeros((len(t), len(system.parent)))
        angles[:, 0], rates[:, 0] = angle(t), rate(t)
        run = simulate(system, rigid_state(self.model, angles[0]), angles, rates, step, Workspace.for_system(system))
        states = run.states
        tip = target_frames(self.model, states.c, states.q, states.u)[0][:, 0]
        cosine, sine = np.cos(angles[:, 0]), np.sin(angles[:, 0])
        along = tip[:, 0] * cosine - tip[:, 2] * sine
        across = tip[:, 0] * sine + tip[:, 2] * cosine
        return t, np.stack([along, across], axis=1), run
