"""Hostile physics: extreme moduli, masses, inertias, units, damping, motors, limits, closed chains and targets."""

from __future__ import annotations

import math

import numpy as np
from hostile import DONE, Case, Edit, arm, optimize, simulate
from motions import CODES, EITHER, SWING, track
from pxr import Gf, Sdf, Usd, UsdGeom, UsdPhysics
from shot_edits import applied, attribute, both, flexible, material, number, retarget, stage_metadata, target, vector
from small_shots import BASE, ELBOW, FORE, HAND, LENGTH, PLASTIC, SHOULDER, UPPER, make_target

SLOW = 120.0


def mass(path: str, value: float) -> Edit:
    """A mass, with the inertia of a box of 0.4 m."""
    turn = value * np.array([0.04**2 / 6, 0.4**2 / 12, 0.4**2 / 12])

    def edit(stage: Usd.Stage) -> None:
        own = UsdPhysics.MassAPI.Apply(stage.GetPrimAtPath(path))
        own.CreateMassAttr(value)
        own.CreateDiagonalInertiaAttr(Gf.Vec3f(*map(float, turn)))

    return edit


def motor(**values: float | str) -> Edit:
    """Values of the shoulder's motor; `model` is a token."""
    edits = [applied(SHOULDER, "CalmMotorAPI")]
    for name, value in values.items():
        kind = "Token" if isinstance(value, str) else "Float"
        edits.append(attribute(SHOULDER, f"calm:motor:{name}", kind, value))
    return both(*edits)


def drive(**values: float) -> Edit:
    return both(*(number(SHOULDER, f"drive:angular:physics:{name}", value) for name, value in values.items()))


def damping(**values: float) -> Edit:
    edits = [number(PLASTIC, f"calm:damping:{name}", value) for name, value in values.items()]
    return flexible(both(applied(PLASTIC, "CalmDampingAPI"), *edits))


def gravity(magnitude: float, *direction: float) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        scene = UsdPhysics.Scene.Define(stage, "/Arm/scene")
        scene.CreateGravityMagnitudeAttr(magnitude)
        if direction:
            scene.CreateGravityDirectionAttr(Gf.Vec3f(*direction))

    return edit


def chain(count: int, animated: bool = True) -> Edit:
    """More links of the forearm's kind, each on a hinge at the end of the one before."""

    def edit(stage: Usd.Stage) -> None:
        before, layer = FORE, stage.GetRootLayer()
        for k in range(count):
            link, joint = f"/Arm/link{k}", f"/Arm/joints/hinge{k}"
            Sdf.CopySpec(layer, FORE, layer, link)
            stage.RemovePrim(f"{link}/hand")
            UsdGeom.Xformable(stage.GetPrimAtPath(link)).GetOrderedXformOps()[0].Set(Gf.Vec3d(LENGTH * (k + 2), 0, 1))
            Sdf.CopySpec(layer, ELBOW, layer, joint)
            prim = UsdPhysics.RevoluteJoint(stage.GetPrimAtPath(joint))
            prim.GetBody0Rel().SetTargets([before])
            prim.GetBody1Rel().SetTargets([link])
            if not animated:
                prim.GetPrim().RemoveAppliedSchema("PhysicsDriveAPI:angular")
                prim.GetPrim().RemoveProperty("drive:angular:physics:targetPosition")
            before = link

    return edit


def closing_joint(body0: str, body1: str, at0: tuple[float, ...], at1: tuple[float, ...], kind: type) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        joint = kind.Define(stage, "/Arm/joints/closing")
        joint.CreateBody0Rel().SetTargets([body0] if body0 else [])
        joint.CreateBody1Rel().SetTargets([body1])
        joint.CreateLocalPos0Attr(Gf.Vec3f(*at0))
        joint.CreateLocalPos1Attr(Gf.Vec3f(*at1))

    return edit


def limp(path: str) -> Edit:
    """A joint without a motor."""

    def edit(stage: Usd.Stage) -> None:
        stage.GetPrimAtPath(path).RemoveAppliedSchema("PhysicsDriveAPI:angular")
        stage.GetPrimAtPath(path).RemoveProperty("drive:angular:physics:targetPosition")

    return edit


def modulus(value: float) -> Edit:
    return material(youngsModulus=value)


def far_target(distance: float) -> Edit:
    return lambda stage: (
        UsdGeom.Xformable(stage.GetPrimAtPath(HAND)).GetOrderedXformOps()[0].Set(Gf.Vec3d(distance, 0, 0))
    )


def many_targets(count: int) -> Edit:
    def edit(stage: Usd.Stage) -> None:
        for k in range(count):
            UsdGeom.Xform.Define(stage, f"{FORE}/t{k}").AddTranslateOp().Set(Gf.Vec3d(0.4 * k / count, 0, 0))
            make_target(stage, f"{FORE}/t{k}")

    return edit


FAST = track(CODES, 4.0 * SWING)
SOFT = "physics:youngsModulus|soft|modulus"

CASES: dict[str, Case] = {
    # stiffness
    "a modulus of 1e3": simulate(SOFT, make=arm(modulus(1e3))),
    "a modulus of 1e4": simulate(SOFT, make=arm(modulus(1e4))),
    "a modulus of 1e5": simulate(SOFT, make=arm(modulus(1e5))),
    "a modulus of 1e7": simulate(make=arm(modulus(1e7)), statuses=EITHER, seconds=SLOW),
    "a modulus of 1e8": simulate(make=arm(modulus(1e8)), statuses=DONE, seconds=SLOW),
    "a modulus of 1e10": simulate(make=arm(modulus(1e10)), statuses=DONE),
    "a modulus of 1e12": simulate(make=arm(modulus(1e12)), statuses=DONE),
    "a modulus of 1e20": simulate(make=arm(modulus(1e20)), statuses=EITHER),
    "a modulus of the largest float": simulate(make=arm(modulus(3.4e38)), statuses=EITHER),
    "a modulus in GPa by mistake": simulate(SOFT, make=arm(modulus(2.0))),
    "an infinite modulus": simulate(PLASTIC, "youngsModulus", make=arm(modulus(math.inf))),
    "a ratio of 0.4999": simulate(make=arm(material(poissonsRatio=0.4999)), statuses=EITHER),
    "a ratio of -0.99": simulate(make=arm(material(poissonsRatio=-0.99)), statuses=EITHER),
    "a ratio of -1": simulate(PLASTIC, "poissonsRatio", make=arm(material(poissonsRatio=-1.0))),
    "a density of 1e-6": simulate(make=arm(material(density=1e-6)), statuses=EITHER),
    "a density of 1e9": simulate("density is", make=arm(material(density=1e9)), statuses=DONE),
    "a density in g/cm3 by mistake": simulate(make=arm(material(density=1.1)), statuses=DONE),
    "an infinite density": simulate(PLASTIC, "density", make=arm(material(density=math.inf))),
    "no damping": simulate(make=arm(damping(ratio=0.0)), statuses=DONE),
    "damping of nearly 1": simulate(make=arm(damping(ratio=0.99)), statuses=DONE),
    "negative damping": simulate(PLASTIC, "calm:damping:ratio", make=arm(damping(ratio=-0.1))),
    "damping that is no number": simulate(PLASTIC, "calm:damping", make=arm(damping(rayleighMass=math.nan))),
    "damping of 1e9 by mass": simulate(make=arm(damping(rayleighMass=1e9)), statuses=EITHER),
    "damping of 1e9 by stiffness": simulate(make=arm(damping(rayleighStiffness=1e9)), statuses=EITHER),
    "no modes": simulate(make=arm(flexible(attribute(FORE, "calm:flexible:modeCount", "Int", 0))), statuses=EITHER),
    "a million modes": simulate(
        "modeCount",
        make=arm(flexible(attribute(FORE, "calm:flexible:modeCount", "Int", 10**6))),
        statuses=EITHER,
        seconds=SLOW,
    ),
    "modes up to 1e-3 Hz": simulate(
        make=arm(flexible(number(FORE, "calm:flexible:maxFrequency", 1e-3))), statuses=EITHER
    ),
    "everything is flexible": simulate(
        make=arm(flexible(both(applied(UPPER, "CalmFlexibleBodyAPI"), applied(BASE, "CalmFlexibleBodyAPI")))),
        statuses=EITHER,
    ),
    # masses
    "a mass of 1e-9": simulate(make=arm(mass(FORE, 1e-9)), statuses=EITHER),
    "a mass of 1e6 on one of 1": simulate(make=arm(mass(FORE, 1e6)), statuses=DONE),
    "a mass of 1e-6 between others": simulate(make=arm(mass(UPPER, 1e-6)), statuses=EITHER),
    "a mass of 1e30": simulate(make=arm(mass(FORE, 1e30)), statuses=EITHER),
    "a heavy tip on a soft link": simulate(
        make=arm(both(chain(1), modulus(2e9), mass("/Arm/link0", 1e4))), statuses=EITHER, seconds=SLOW
    ),
    "an inertia of zero": simulate(make=arm(vector(FORE, "physics:diagonalInertia", 0, 0, 0)), statuses=EITHER),
    "an inertia that breaks the triangle": simulate(
        "diagonalInertia|inertia", make=arm(vector(FORE, "physics:diagonalInertia", 1, 1, 100)), statuses=EITHER
    ),
    "an inertia of one axis": simulate(make=arm(vector(FORE, "physics:diagonalInertia", 0, 1e-3, 0)), statuses=EITHER),
    "an inertia of a planet": simulate(
        make=arm(vector(FORE, "physics:diagonalInertia", 1e20, 1e20, 1e20)), statuses=EITHER
    ),
    "a centre of mass far away": simulate(make=arm(vector(FORE, "physics:centerOfMass", 1e6, 0, 0)), statuses=EITHER),
    "a centre of mass that is no number": simulate(
        FORE, "centerOfMass", make=arm(vector(FORE, "physics:centerOfMass", math.nan, 0, 0))
    ),
    "axes of inertia of length zero": simulate(
        make=arm(lambda s: UsdPhysics.MassAPI(s.GetPrimAtPath(FORE)).CreatePrincipalAxesAttr(Gf.Quatf(0))),
        statuses=EITHER,
    ),
    # gravity and units
    "no gravity": simulate(make=arm(gravity(0.0)), statuses=DONE),
    "gravity of the sun": simulate(make=arm(gravity(274.0)), statuses=DONE),
    "gravity of a neutron star": simulate(make=arm(both(gravity(1e12), modulus(2e9))), statuses=EITHER),
    "gravity upwards": simulate(make=arm(gravity(9.81, 0, 0, 1)), statuses=DONE),
    "gravity in no direction": simulate(make=arm(gravity(9.81, 0, 0, 0)), statuses=EITHER),
    "gravity in a direction that is no number": simulate("/Arm/scene", make=arm(gravity(9.81, math.nan, 0, 0))),
    "negative gravity": simulate(make=arm(gravity(-9.81)), statuses=EITHER),
    "an arm of kilometres": simulate(make=arm(stage_metadata("metersPerUnit", 1000.0)), statuses=EITHER),
    "an arm of micrometres": simulate(make=arm(stage_metadata("metersPerUnit", 1e-6)), statuses=EITHER),
    "units of 1e-30 m": simulate("metersPerUnit", make=arm(stage_metadata("metersPerUnit", 1e-30)), statuses=EITHER),
    "an infinite unit of length": simulate("metersPerUnit", make=arm(stage_metadata("metersPerUnit", math.inf))),
    "kilograms of 1e20": simulate(make=arm(stage_metadata("kilogramsPerUnit", 1e20)), statuses=EITHER),
    "grams": simulate(make=arm(stage_metadata("kilogramsPerUnit", 1e-3)), statuses=DONE),
    # motors
    "a drive of no stiffness": simulate(
        make=arm(motor(model="drive"), drive(stiffness=0.0, damping=1.0)), statuses=EITHER
    ),
    "a drive of no stiffness and no damping": simulate(
        make=arm(motor(model="drive"), drive(stiffness=0.0, damping=0.0)), statuses=EITHER
    ),
    "a drive that is much too soft": simulate(
        make=arm(motor(model="drive"), drive(stiffness=1e-3, damping=1e-4)), statuses=EITHER
    ),
    "a drive that is much too stiff": simulate(
        make=arm(motor(model="drive"), drive(stiffness=1e12, damping=1e6)), statuses=EITHER
    ),
    "a drive with negative stiffness": simulate(
        SHOULDER, "stiffness", make=arm(motor(model="drive"), drive(stiffness=-5.0, damping=1.0))
    ),
    "a drive with negative damping": simulate(
        SHOULDER, "damping", make=arm(motor(model="drive"), drive(stiffness=500.0, damping=-1.0))
    ),
    "a drive of infinite stiffness": simulate(
        make=arm(motor(model="drive"), drive(stiffness=math.inf, damping=1.0)), statuses=EITHER
    ),
    "a drive without gains": simulate(SHOULDER, make=arm(motor(model="drive")), statuses=EITHER),
    "a motor of a model that is none": simulate(SHOULDER, "calm:motor:model", make=arm(motor(model="rocket"))),
    "a motor of a type that is none": simulate(SHOULDER, "calm:motor:type", make=arm(motor(type="XM9999"))),
    "a servo without anything": simulate(SHOULDER, make=arm(motor(model="servo")), statuses=EITHER),
    "a servo that is delayed by ten seconds": simulate(
        make=arm(motor(model="servo", positionGain=100.0, velocityGain=1.0, delay=10.0)), statuses=EITHER
    ),
    "a servo that is unstable": simulate(
        make=arm(motor(model="servo", positionGain=1e4, velocityGain=0.0, delay=0.05)), statuses=EITHER, seconds=SLOW
    ),
    "a servo with a torque of zero": simulate(
        SHOULDER, make=arm(motor(model="servo", positionGain=100.0, maxTorque=0.0))
    ),
    "backlash of a turn": simulate(make=arm(motor(backlash=360.0)), statuses=EITHER),
    "negative backlash": simulate(SHOULDER, "backlash", make=arm(motor(backlash=-1.0))),
    "negative friction": simulate(
        SHOULDER, "friction", make=arm(motor(model="servo", positionGain=100.0, velocityGain=1.0, friction=-1.0))
    ),
    "a friction that holds everything": simulate(
        make=arm(motor(model="drive", friction=1e6), drive(stiffness=100.0, damping=1.0)), statuses=EITHER, seconds=SLOW
    ),
    "a gear of no stiffness": simulate(make=arm(motor(gearStiffness=0.0)), statuses=EITHER),
    "an armature of 1e6": simulate(
        make=arm(motor(model="drive", armature=1e6), drive(stiffness=100.0, damping=1.0)), statuses=EITHER
    ),
    # limits
    "a limit of acceleration that nothing keeps": optimize(
        "exceed|limit|narrow|accel", make=arm(motor(maxAcceleration=1.0)), statuses=EITHER, seconds=SLOW
    ),
    "a limit of speed that nothing keeps": optimize(
        "exceed|limit", make=arm(motor(maxVelocity=0.5)), statuses=EITHER, seconds=SLOW
    ),
    "a limit of torque below the weight": optimize(
        "exceed|maxTorque|weight", make=arm(motor(maxTorque=0.1)), statuses=EITHER, seconds=SLOW
    ),
    "a limit of speed that is no number": optimize(SHOULDER, "maxVelocity", make=arm(motor(maxVelocity=math.nan))),
    "a negative limit of acceleration": optimize(SHOULDER, "maxAcceleration", make=arm(motor(maxAcceleration=-5.0))),
    "joint limits of no width": simulate(
        "limit",
        make=arm(both(number(SHOULDER, "physics:lowerLimit", 5.0), number(SHOULDER, "physics:upperLimit", 5.0))),
        statuses=EITHER,
    ),
    "joint limits of no width, optimised": optimize(
        make=arm(both(number(SHOULDER, "physics:lowerLimit", 5.0), number(SHOULDER, "physics:upperLimit", 5.0))),
        statuses=EITHER,
        seconds=SLOW,
    ),
    # structure
    "thirty links": simulate(make=arm(chain(28)), statuses=DONE, seconds=60),
    "a pendulum of five limp links": simulate(make=arm(chain(4, animated=False)), statuses=DONE, seconds=60),
    "a limp elbow": simulate(make=arm(limp(ELBOW)), statuses=DONE, seconds=60),
    "a loop that is closed twice": simulate(
        make=arm(closing_joint(FORE, UPPER, (0, 0, 0), (LENGTH, 0, 0), UsdPhysics.SphericalJoint)), statuses=EITHER
    ),
    "a linkage that does not close": simulate(
        "closing", make=arm(closing_joint("", FORE, (5, 5, 5), (0, 0, 0), UsdPhysics.SphericalJoint)), statuses=EITHER
    ),
    "a hand that is nailed to the world": simulate(
        "closing|elbow|shoulder", make=arm(closing_joint("", FORE, (0.8, 0, 1), (0.4, 0, 0), UsdPhysics.FixedJoint))
    ),
    "a joint that holds a body to the world twice": simulate(
        make=arm(closing_joint("", BASE, (0, 0, 1), (0, 0, 0), UsdPhysics.FixedJoint)), statuses=EITHER
    ),
    "a body on the joint of another robot": simulate(
        "elbow", make=arm(lambda s: UsdPhysics.Joint(s.GetPrimAtPath(ELBOW)).GetBody1Rel().SetTargets(["/Other/body"]))
    ),
    # targets and tolerances
    "no target": simulate(make=arm(target=False), statuses=EITHER),
    "no target, optimised": optimize("CalmTargetAPI|target", make=arm(target=False), statuses=EITHER),
    "a target that is a kilometre away": simulate(make=arm(far_target(1000.0)), statuses=DONE, seconds=60),
    "a target at 1e12": simulate(make=arm(far_target(1e12)), statuses=EITHER),
    "two hundred targets": simulate(make=arm(many_targets(200)), statuses=DONE),
    "a weight of 1e30": simulate(make=arm(target(positionWeight=1e30), target=False), statuses=EITHER),
    "an infinite weight": simulate(HAND, "positionWeight", make=arm(target(positionWeight=math.inf), target=False)),
    "a tolerance of 1e-12": simulate(
        "tolerance", make=arm(flexible(retarget("tolerance", "Float", 1e-12))), statuses=EITHER, seconds=SLOW
    ),
    "a tolerance of zero": simulate("/Arm", "calm:retarget:tolerance", make=arm(retarget("tolerance", "Float", 0.0))),
    "a tolerance of a kilometre": simulate("tolerance", make=arm(flexible(retarget("tolerance", "Float", 1000.0)))),
    "an infinite tolerance": simulate("/Arm", "tolerance", make=arm(retarget("tolerance", "Float", math.inf))),
    "a step of a nanosecond": simulate("timeStep", make=arm(retarget("timeStep", "Float", 1e-9))),
    "a step longer than the shot": simulate(make=arm(retarget("timeStep", "Float", 100.0)), statuses=EITHER),
    "knots a nanosecond apart": optimize(
        make=arm(flexible(retarget("knotSpacing", "Float", 1e-9))), statuses=EITHER, seconds=SLOW
    ),
    "a smoothness of 1e30": optimize(
        make=arm(flexible(retarget("smoothness", "Float", 1e30))), statuses=EITHER, seconds=SLOW
    ),
    "a smoothness that is no number": optimize(
        "/Arm", "smoothness", make=arm(retarget("smoothness", "Float", math.nan))
    ),
    "a soft arm that swings fast": simulate(make=arm(modulus(2e8), FAST), statuses=DONE, seconds=SLOW),
    "a modulus of 1e6": simulate(make=arm(modulus(1e6)), statuses=EITHER, seconds=2.0 * SLOW),
    "an uncertainty of 100": optimize(  # its softest robot, of a hundred-thousandth of the modulus, stands
        make=arm(flexible(retarget("uncertainty:modulus", "Float", 100.0))),
        args="--robust",
        statuses=EITHER,
        seconds=SLOW,
    ),
    "an uncertainty of 10000": optimize(
        "uncertainty",
        make=arm(flexible(retarget("uncertainty:modulus", "Float", 10000.0))),
        args="--robust",
        seconds=SLOW,
    ),
}
