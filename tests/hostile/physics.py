"""Hostile physics: extreme moduli, masses, inertias, units, damping, motors, limits, closed chains and targets."""

import math

import numpy as np
from hostile import DONE, EITHER, REFUSED, Case, Edit, optimize, simulate
from motions import CODES, SWING, track
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
    "a modulus of 1e3": simulate(REFUSED, modulus(1e3), SOFT),
    "a modulus of 1e4": simulate(REFUSED, modulus(1e4), SOFT),
    "a modulus of 1e5": simulate(REFUSED, modulus(1e5), SOFT),
    "a modulus of 1e7": simulate(EITHER, modulus(1e7), seconds=SLOW),
    "a modulus of 1e8": simulate(DONE, modulus(1e8), seconds=SLOW),
    "a modulus of 1e10": simulate(DONE, modulus(1e10)),
    "a modulus of 1e12": simulate(DONE, modulus(1e12)),
    "a modulus of 1e20": simulate(EITHER, modulus(1e20)),
    "a modulus of the largest float": simulate(EITHER, modulus(3.4e38)),
    "a ratio of 0.4999": simulate(EITHER, material(poissonsRatio=0.4999)),
    "a ratio of -0.99": simulate(EITHER, material(poissonsRatio=-0.99)),
    "a density of 1e-6": simulate(EITHER, material(density=1e-6)),
    "a density of 1e9": simulate(DONE, material(density=1e9), "density is"),
    "a density in g/cm3 by mistake": simulate(DONE, material(density=1.1)),
    "no damping": simulate(DONE, damping(ratio=0.0)),
    "damping of nearly 1": simulate(DONE, damping(ratio=0.99)),
    "damping that is no number": simulate(REFUSED, damping(rayleighMass=math.nan), PLASTIC, "calm:damping"),
    "damping of 1e9 by mass": simulate(EITHER, damping(rayleighMass=1e9)),
    "damping of 1e9 by stiffness": simulate(EITHER, damping(rayleighStiffness=1e9)),
    "no modes": simulate(EITHER, flexible(attribute(FORE, "calm:flexible:modeCount", "Int", 0))),
    "a million modes": simulate(
        EITHER, flexible(attribute(FORE, "calm:flexible:modeCount", "Int", 10**6)), "modeCount", seconds=SLOW
    ),
    "modes up to 1e-3 Hz": simulate(EITHER, flexible(number(FORE, "calm:flexible:maxFrequency", 1e-3))),
    "everything is flexible": simulate(
        EITHER, flexible(both(applied(UPPER, "CalmFlexibleBodyAPI"), applied(BASE, "CalmFlexibleBodyAPI")))
    ),
    # masses
    "a mass of 1e-9": simulate(EITHER, mass(FORE, 1e-9)),
    "a mass of 1e6 on one of 1": simulate(DONE, mass(FORE, 1e6)),
    "a mass of 1e-6 between others": simulate(EITHER, mass(UPPER, 1e-6)),
    "a mass of 1e30": simulate(EITHER, mass(FORE, 1e30)),
    "a heavy tip on a soft link": simulate(EITHER, both(chain(1), modulus(2e9), mass("/Arm/link0", 1e4)), seconds=SLOW),
    "an inertia of zero": simulate(EITHER, vector(FORE, "physics:diagonalInertia", 0, 0, 0)),
    "an inertia that breaks the triangle": simulate(
        EITHER, vector(FORE, "physics:diagonalInertia", 1, 1, 100), "diagonalInertia|inertia"
    ),
    "an inertia of one axis": simulate(EITHER, vector(FORE, "physics:diagonalInertia", 0, 1e-3, 0)),
    "an inertia of a planet": simulate(EITHER, vector(FORE, "physics:diagonalInertia", 1e20, 1e20, 1e20)),
    "a centre of mass far away": simulate(EITHER, vector(FORE, "physics:centerOfMass", 1e6, 0, 0)),
    "a centre of mass that is no number": simulate(
        REFUSED, vector(FORE, "physics:centerOfMass", math.nan, 0, 0), FORE, "centerOfMass"
    ),
    "axes of inertia of length zero": simulate(
        EITHER, lambda s: UsdPhysics.MassAPI(s.GetPrimAtPath(FORE)).CreatePrincipalAxesAttr(Gf.Quatf(0))
    ),
    # gravity and units
    "no gravity": simulate(DONE, gravity(0.0)),
    "gravity of the sun": simulate(DONE, gravity(274.0)),
    "gravity of a neutron star": simulate(EITHER, both(gravity(1e12), modulus(2e9))),
    "gravity upwards": simulate(DONE, gravity(9.81, 0, 0, 1)),
    "gravity in no direction": simulate(EITHER, gravity(9.81, 0, 0, 0)),
    "gravity in a direction that is no number": simulate(REFUSED, gravity(9.81, math.nan, 0, 0), "/Arm/scene"),
    "negative gravity": simulate(EITHER, gravity(-9.81)),
    "an arm of kilometres": simulate(EITHER, stage_metadata("metersPerUnit", 1000.0)),
    "an arm of micrometres": simulate(EITHER, stage_metadata("metersPerUnit", 1e-6)),
    "units of 1e-30 m": simulate(EITHER, stage_metadata("metersPerUnit", 1e-30), "metersPerUnit"),
    "kilograms of 1e20": simulate(EITHER, stage_metadata("kilogramsPerUnit", 1e20)),
    "grams": simulate(DONE, stage_metadata("kilogramsPerUnit", 1e-3)),
    # motors
    "a drive of no stiffness": simulate(EITHER, motor(model="drive"), drive(stiffness=0.0, damping=1.0)),
    "a drive of no stiffness and no damping": simulate(EITHER, motor(model="drive"), drive(stiffness=0.0, damping=0.0)),
    "a drive that is much too soft": simulate(EITHER, motor(model="drive"), drive(stiffness=1e-3, damping=1e-4)),
    "a drive that is much too stiff": simulate(EITHER, motor(model="drive"), drive(stiffness=1e12, damping=1e6)),
    "a drive of infinite stiffness": simulate(EITHER, motor(model="drive"), drive(stiffness=math.inf, damping=1.0)),
    "a drive without gains": simulate(EITHER, motor(model="drive"), SHOULDER),
    "a servo without anything": simulate(EITHER, motor(model="servo"), SHOULDER),
    "a servo that is delayed by ten seconds": simulate(
        EITHER, motor(model="servo", positionGain=100.0, velocityGain=1.0, delay=10.0)
    ),
    "a servo that is unstable": simulate(
        EITHER, motor(model="servo", positionGain=1e4, velocityGain=0.0, delay=0.05), seconds=SLOW
    ),
    "backlash of a turn": simulate(EITHER, motor(backlash=360.0)),
    "negative backlash": simulate(REFUSED, motor(backlash=-1.0), SHOULDER, "backlash"),
    "negative friction": simulate(
        REFUSED, motor(model="servo", positionGain=100.0, velocityGain=1.0, friction=-1.0), SHOULDER, "friction"
    ),
    "a friction that holds everything": simulate(
        EITHER, motor(model="drive", friction=1e6), drive(stiffness=100.0, damping=1.0), seconds=SLOW
    ),
    "a gear of no stiffness": simulate(EITHER, motor(gearStiffness=0.0)),
    "an armature of 1e6": simulate(EITHER, motor(model="drive", armature=1e6), drive(stiffness=100.0, damping=1.0)),
    # limits
    "a limit of acceleration that nothing keeps": optimize(
        EITHER, motor(maxAcceleration=1.0), "exceed|limit|narrow|accel", seconds=SLOW
    ),
    "a limit of speed that nothing keeps": optimize(EITHER, motor(maxVelocity=0.5), "exceed|limit", seconds=SLOW),
    "a limit of torque below the weight": optimize(
        EITHER, motor(maxTorque=0.1), "exceed|maxTorque|weight", seconds=SLOW
    ),
    "joint limits of no width": simulate(
        EITHER, both(number(SHOULDER, "physics:lowerLimit", 5.0), number(SHOULDER, "physics:upperLimit", 5.0)), "limit"
    ),
    "joint limits of no width, optimised": optimize(
        EITHER,
        both(number(SHOULDER, "physics:lowerLimit", 5.0), number(SHOULDER, "physics:upperLimit", 5.0)),
        seconds=SLOW,
    ),
    # structure
    "thirty links": simulate(DONE, chain(28), seconds=60),
    "a pendulum of five limp links": simulate(DONE, chain(4, animated=False), seconds=60),
    "a limp elbow": simulate(DONE, limp(ELBOW), seconds=60),
    "a loop that is closed twice": simulate(
        EITHER, closing_joint(FORE, UPPER, (0, 0, 0), (LENGTH, 0, 0), UsdPhysics.SphericalJoint)
    ),
    "a linkage that does not close": simulate(
        EITHER, closing_joint("", FORE, (5, 5, 5), (0, 0, 0), UsdPhysics.SphericalJoint), "closing"
    ),
    "a hand that is nailed to the world": simulate(
        REFUSED, closing_joint("", FORE, (0.8, 0, 1), (0.4, 0, 0), UsdPhysics.FixedJoint), "closing|elbow|shoulder"
    ),
    "a joint that holds a body to the world twice": simulate(
        EITHER, closing_joint("", BASE, (0, 0, 1), (0, 0, 0), UsdPhysics.FixedJoint)
    ),
    # targets and tolerances
    "no target": simulate(EITHER, target=False),
    "no target, optimised": optimize(EITHER, "CalmTargetAPI|target", target=False),
    "a target that is a kilometre away": simulate(DONE, far_target(1000.0), seconds=60),
    "a target at 1e12": simulate(EITHER, far_target(1e12)),
    "two hundred targets": simulate(DONE, many_targets(200)),
    "a weight of 1e30": simulate(EITHER, target(positionWeight=1e30), target=False),
    "a tolerance of 1e-12": simulate(
        EITHER, flexible(retarget("tolerance", "Float", 1e-12)), "tolerance", seconds=SLOW
    ),
    "a tolerance of a kilometre": simulate(REFUSED, flexible(retarget("tolerance", "Float", 1000.0)), "tolerance"),
    "a step of a nanosecond": simulate(REFUSED, retarget("timeStep", "Float", 1e-9), "timeStep"),
    "a step longer than the shot": simulate(EITHER, retarget("timeStep", "Float", 100.0)),
    "knots a nanosecond apart": optimize(EITHER, flexible(retarget("knotSpacing", "Float", 1e-9)), seconds=SLOW),
    "a smoothness of 1e30": optimize(EITHER, flexible(retarget("smoothness", "Float", 1e30)), seconds=SLOW),
    "a soft arm that swings fast": simulate(DONE, modulus(2e8), FAST, seconds=SLOW),
    "a modulus of 1e6": simulate(EITHER, modulus(1e6), seconds=2.0 * SLOW),
    "an uncertainty of 100": optimize(
        EITHER, flexible(retarget("uncertainty:modulus", "Float", 100.0)), args="--robust", seconds=SLOW
    ),
    "an uncertainty of 10000": optimize(
        REFUSED,
        flexible(retarget("uncertainty:modulus", "Float", 10000.0)),
        "uncertainty",
        args="--robust",
        seconds=SLOW,
    ),
}
