"""Inverse dynamics and forward kinematics of a robot's original file by MuJoCo; a program of its own.

    python mujoco_inverse.py ROBOT MOTION.npz RESULT.npz

It runs in an environment that has MuJoCo, such as that of the converters. The motion has `names` of joints, and `q`,
`v` and `a`, shape [T, J]; other joints rest at 0. The result has `torques`, shape [T, J], of an ideal robot: without
armature, damping, friction, contacts and closed chains; and by name of each body `position/NAME`, shape [T, 3].
"""

import sys
import xml.etree.ElementTree as xml

import mujoco
import numpy as np


def model_of(path):
    root = xml.parse(path).getroot()
    if root.tag != "robot":
        return mujoco.MjModel.from_xml_path(path)
    for link in root.findall("link"):
        # geometry plays no part where each link has its inertia
        for kind in ("visual", "collision"):
            for node in link.findall(kind):
                link.remove(node)
    option = xml.SubElement(root, "mujoco")
    limits = {"boundmass": "1e-6", "boundinertia": "1e-10"}
    xml.SubElement(option, "compiler", fusestatic="false", discardvisual="false", inertiafromgeom="false", **limits)
    return mujoco.MjModel.from_xml_string(xml.tostring(root, encoding="unicode"))


def main(robot, motion, result):
    given = np.load(motion)
    model = model_of(robot)
    for part in (
        model.dof_armature,
        model.dof_damping,
        model.dof_frictionloss,
        model.jnt_stiffness,
        model.body_gravcomp,
    ):
        part[:] = 0.0
    flags = mujoco.mjtDisableBit
    model.opt.disableflags |= flags.mjDSBL_CONTACT | flags.mjDSBL_LIMIT | flags.mjDSBL_EQUALITY
    model.opt.gravity[:] = (0.0, 0.0, -9.81)
    data = mujoco.MjData(model)
    joints = [model.joint(str(name)) for name in given["names"]]
    place, dof = (np.array([getattr(joint, key)[0] for joint in joints]) for key in ("qposadr", "dofadr"))
    names = [model.body(k).name for k in range(1, model.nbody)]
    steps = len(given["q"])
    torques, positions = np.zeros((steps, len(joints))), np.zeros((steps, len(names), 3))
    for n in range(steps):
        data.qpos[:], data.qvel[:], data.qacc[:] = 0.0, 0.0, 0.0
        data.qpos[place], data.qvel[dof], data.qacc[dof] = given["q"][n], given["v"][n], given["a"][n]
        mujoco.mj_inverse(model, data)
        torques[n] = data.qfrc_inverse[dof]
        positions[n] = data.xpos[1:]
    np.savez(result, torques=torques, **{f"position/{name}": positions[:, k] for k, name in enumerate(names)})


if __name__ == "__main__":
    main(*sys.argv[1:])
