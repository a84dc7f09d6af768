"""What MuJoCo's compiler makes of an MJCF robot, as JSON on stdout; run in the environment of the converters.

A converter writes what the file says. Masses that settings of the compiler change, springs given by their time constant
(`springdamper`), damping ratios of actuators and limits that are inherited are known after compilation alone.
"""

import json
import math
import sys
from typing import Any

import mujoco

_GAINS = {mujoco.mjtGain.mjGAIN_FIXED: "fixed", mujoco.mjtGain.mjGAIN_AFFINE: "affine"}
_BIASES = {mujoco.mjtBias.mjBIAS_NONE: "none", mujoco.mjtBias.mjBIAS_AFFINE: "affine"}
_DYNAMICS = {mujoco.mjtDyn.mjDYN_NONE: "none", mujoco.mjtDyn.mjDYN_INTEGRATOR: "integrator"}
_OTHER = "user"
_ELLIPSOID = int(mujoco.mjtGeom.mjGEOM_ELLIPSOID)
LEAST = 1e-12  # of masses and inertias of frames that move, which a flexible link or a fixed one may still have


def compiled(path: str) -> tuple[Any, Any, float]:
    """The model of a file, without pictures, its specification, and the mass that bodies without one get in it."""
    for least in (0.0, LEAST):
        spec = mujoco.MjSpec.from_file(path)
        for made in (*spec.geoms, *spec.sites, *spec.tendons):
            made.material = ""
        for unused in (*spec.materials, *spec.textures, *spec.skins, *spec.sensors, *spec.keys):
            spec.delete(unused)
        spec.compiler.fusestatic = False
        spec.compiler.alignfree = False  # bodies keep the frames that the file gives them
        for joint in spec.joints:
            joint.align = mujoco.mjtAlignFree.mjALIGNFREE_FALSE
        spec.compiler.boundmass = max(least, spec.compiler.boundmass)
        spec.compiler.boundinertia = max(least, spec.compiler.boundinertia)
        try:
            return spec.compile(), spec, least
        except ValueError as error:
            if least or "mass and inertia" not in str(error):
                raise
    raise AssertionError


def values(path: str) -> dict[str, Any]:
    """Bodies in the order of the file, each with its joints; actuators by name, and the names of those that are off;
    ellipsoids, which the converter leaves out."""
    model, spec, least = compiled(path)
    bodies = []
    for body in range(1, model.nbody):
        start = model.body_jntadr[body]
        joints = [_joint(model, start + k) for k in range(model.body_jntnum[body])]
        bodies.append(
            {
                "name": model.body(body).name,
                "mass": float(model.body_mass[body]),
                "center": model.body_ipos[body].tolist(),
                "axes": model.body_iquat[body].tolist(),
                "moments": model.body_inertia[body].tolist(),
                "joints": [joint for joint in joints if joint],
                "parent": int(model.body_parentid[body]) - 1,
                "position": model.body_pos[body].tolist(),
                "rotation": model.body_quat[body].tolist(),
            }
        )
    names = [actuator.name or f"Actuator_{actuator.id}" for actuator in spec.actuators]
    off = [
        name
        for index, name in enumerate(names)
        if 0 <= (group := model.actuator_group[index]) <= 30 and model.opt.disableactuator >> group & 1
    ]
    actuators = {name: _actuator(model, index) for index, name in enumerate(names)}
    totalled = spec.compiler.settotalmass > 0.0
    shapes = [_ellipsoid(model, geom) for geom in spec.geoms if model.geom_type[geom.id] == _ELLIPSOID]
    return {
        "bodies": bodies, "actuators": actuators, "off": off, "totalled": totalled, "ellipsoids": shapes, "least": least
    }  # fmt: skip


def _ellipsoid(model: Any, geom: Any) -> dict[str, Any]:
    """A geom of this shape, and what the file or a class states of its mass."""
    return {
        "body": int(model.geom_bodyid[geom.id]) - 1,
        "position": model.geom_pos[geom.id].tolist(),
        "rotation": model.geom_quat[geom.id].tolist(),
        "half_axes": model.geom_size[geom.id].tolist(),
        "mass": None if math.isnan(geom.mass) else float(geom.mass),
        "density": float(geom.density),
        "collides": bool(model.geom_contype[geom.id] or model.geom_conaffinity[geom.id]),
    }


def _joint(model: Any, joint: int) -> dict[str, Any]:
    kind = int(model.jnt_type[joint])
    if kind not in (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE)):
        return {}
    return {
        "angle": kind == int(mujoco.mjtJoint.mjJNT_HINGE),
        "axis": model.jnt_axis[joint].tolist(),
        "mjc:stiffness": float(model.jnt_stiffness[joint]),
        "newton:damping": float(model.dof_damping[model.jnt_dofadr[joint]]),
        "mjc:actuatorfrclimited": "true" if model.jnt_actfrclimited[joint] else "false",
    }


def _actuator(model: Any, index: int) -> dict[str, Any]:
    """The body whose joint an actuator acts on, and its attributes; only what is fixed and affine has gains."""
    kinds = mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT  # the same for hinges and slides
    on_joint = int(model.actuator_trntype[index]) in map(int, kinds)
    low, high = model.actuator_ctrlrange[index].tolist()
    least, most = model.actuator_forcerange[index].tolist()
    first, last = model.actuator_actrange[index].tolist()
    gain, bias = model.actuator_gainprm[index], model.actuator_biasprm[index]
    gain_type = _GAINS.get(mujoco.mjtGain(model.actuator_gaintype[index]), _OTHER)
    bias_type = _BIASES.get(mujoco.mjtBias(model.actuator_biastype[index]), _OTHER)
    attributes = {
        "mjc:gainType": gain_type,
        "mjc:gainPrm": (gain * (gain_type != _OTHER)).tolist(),
        "mjc:biasType": bias_type,
        "mjc:biasPrm": (bias * (bias_type == "affine")).tolist(),
        "mjc:dynType": _DYNAMICS.get(mujoco.mjtDyn(model.actuator_dyntype[index]), _OTHER),
        "mjc:gear": model.actuator_gear[index].tolist(),
        "mjc:forceLimited": "true" if model.actuator_forcelimited[index] else "false",
        "mjc:forceRange:min": least,
        "mjc:forceRange:max": most,
        "mjc:ctrlLimited": "true" if model.actuator_ctrllimited[index] else "false",
        "mjc:ctrlRange:min": low,
        "mjc:ctrlRange:max": high,
        "mjc:actLimited": "true" if model.actuator_actlimited[index] else "false",
        "mjc:actRange:min": first,
        "mjc:actRange:max": last,
    }
    return {
        "body": int(model.jnt_bodyid[model.actuator_trnid[index, 0]]) - 1 if on_joint else None,
        "attributes": attributes,
    }


if __name__ == "__main__":
    print(json.dumps(values(sys.argv[1])))
