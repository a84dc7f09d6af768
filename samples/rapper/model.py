"""The rapper: a figure with a microphone whose right arm is a four-bar linkage. Metres, x forward, z up.

Two servos share the axis of the shoulder. One swings the upper arm; the other turns a crank whose rods, one on either
side of the upper arm, turn a lever behind the elbow, and with it the forearm. Crank and lever are equally long, so the
forearm keeps the crank's direction however the upper arm swings. Three hinges of the linkage are passive.

At angle zero the arm is stretched straight ahead; every body frame then has the axes of the world.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from kit.author import Look, Plastic
from kit.parts import printed_link
from kit.robot import BodySpec, DriveSpec, JointSpec, Part, TargetSpec, Vector
from kit.shapes import Section, Shape, ball, cylinder, lathe, skin

SHOULDER = (0.0, -0.235, 1.26)
UPPER, FORE = 0.36, 0.33  # shoulder to elbow, elbow to wrist
HUB = 0.036  # radius of the cases at shoulder and elbow; the links end where they begin
CRANK = 0.095  # from the shoulder to the rods' hinge, and from the elbow to theirs
SLIM = 0.0105  # half the thickness of the links
LEAN = 155.0  # from the forearm to the lever, about y [deg]
ROD_AT = 0.05  # of either rod beside the middle of the arm

NYLON = Plastic("Nylon", youngs_modulus=1.6e9, poissons_ratio=0.39, density=1010.0, damping_ratio=0.02)

LOOKS = {
    "Skin": Look((0.42, 0.24, 0.15), 0.5),
    "Hoodie": Look((0.93, 0.60, 0.05), 0.7),
    "Denim": Look((0.05, 0.09, 0.20), 0.8),
    "White": Look((0.82, 0.82, 0.80), 0.5),
    "Ivory": Look((0.80, 0.76, 0.66), 0.45),
    "Steel": Look((0.42, 0.44, 0.47), 0.3, 0.9),
    "Black": Look((0.03, 0.03, 0.035), 0.35),
    "Gold": Look((0.83, 0.58, 0.16), 0.25, 0.9),
    "Stage": Look((0.20, 0.19, 0.21), 0.7),
}

LEVER: Vector = (
    round(CRANK * math.cos(math.radians(LEAN)), 6),
    0.0,
    round(-CRANK * math.sin(math.radians(LEAN)), 6),
)


def bar(start: Vector, end: Vector, half: float, side: float = 0.0) -> Shape:
    """A flat bar in a plane of constant y between two points, rounded at both."""
    dx, dz = end[0] - start[0], end[2] - start[2]
    length = math.hypot(dx, dz)
    stations = [(-0.8 * half, 0.6), (-0.3 * half, 0.95), (0.0, 1.0), (length, 1.0), (length + 0.3 * half, 0.95)]
    stations += [(length + 0.8 * half, 0.6)]
    shape = skin([Section(x, 0.006, half * share) for x, share in stations], axis="x", sides=16, squareness=4.0)
    return shape.turned((dx / length, dz / length)).moved((start[0], start[1] + side, start[2]))


def _pair(name: str, start: Vector, end: Vector, half: float, look: str) -> tuple[Part, Part]:
    """The same bar on both sides of the arm, so that it bends without twisting."""
    return (
        Part(f"{name}Left", bar(start, end, half, ROD_AT), look),
        Part(f"{name}Right", bar(start, end, half, -ROD_AT), look),
    )


def _lever(name: str, mass: float) -> BodySpec:
    """The crank at the shoulder, or the lever at the elbow."""
    return BodySpec(
        name,
        (
            *_pair("Arm", (0.0, 0.0, 0.0), LEVER, 0.017, "Steel"),
            Part("Pin", cylinder(0.007, 2.0 * ROD_AT + 0.03, axis="y").moved(LEVER), "Gold"),
        ),
        mass,
    )


def _figure() -> BodySpec:
    hoodie = skin(
        [Section(0.80, 0.10, 0.155), Section(0.82, 0.125, 0.18), Section(0.90, 0.125, 0.18), Section(1.10, 0.12, 0.18),
         Section(1.24, 0.115, 0.185), Section(1.31, 0.09, 0.15), Section(1.345, 0.07, 0.085),
         Section(1.37, 0.075, 0.08), Section(1.385, 0.06, 0.065)],
        sides=32, squareness=2.8,
    )  # fmt: skip
    trousers = [
        Part(f"{name}Leg", skin(
            [Section(0.05, 0.07, 0.06), Section(0.06, 0.085, 0.075), Section(0.30, 0.08, 0.07, 0.0, 0.01 * -side),
             Section(0.60, 0.085, 0.08, 0.0, -0.02 * side), Section(0.84, 0.10, 0.085, 0.0, -0.03 * side)],
            sides=24, squareness=2.6,
        ).moved((0.0, 0.115 * side, 0.0)), "Denim")
        for name, side in (("Left", 1.0), ("Right", -1.0))
    ]  # fmt: skip
    shoes = [
        Part(f"{name}Shoe", skin(
            [Section(-0.09, 0.03, 0.02, 0.0, 0.03), Section(-0.07, 0.052, 0.034, 0.0, 0.036),
             Section(0.06, 0.056, 0.036, 0.0, 0.037), Section(0.14, 0.05, 0.026, 0.0, 0.028),
             Section(0.18, 0.02, 0.012, 0.0, 0.016)],
            axis="x", sides=24, squareness=3.0,
        ).moved((0.0, 0.115 * side, 0.0)), "White")
        for name, side in (("Left", 1.0), ("Right", -1.0))
    ]  # fmt: skip
    cap = lathe([(0.094, 1.50), (0.098, 1.505), (0.097, 1.53), (0.085, 1.57), (0.055, 1.598), (0.02, 1.608)])
    brim = skin(
        [Section(0.0, 0.085, 0.005), Section(0.07, 0.085, 0.005), Section(0.13, 0.07, 0.005),
         Section(0.155, 0.04, 0.004)],
        axis="x", sides=24, squareness=4.0,
    ).moved((0.06, 0.0, 1.508))  # fmt: skip
    shades = skin(
        [Section(0.0, 0.062, 0.016), Section(0.012, 0.064, 0.018), Section(0.018, 0.058, 0.014)],
        axis="x", sides=24, squareness=5.0,
    ).moved((0.074, 0.0, 1.478))  # fmt: skip
    left_arm = skin(
        [Section(0.80, 0.035, 0.035, 0.11, 0.0), Section(0.82, 0.05, 0.045, 0.10, 0.0),
         Section(1.00, 0.055, 0.05, 0.0, 0.04), Section(1.16, 0.06, 0.055, -0.01, 0.02),
         Section(1.28, 0.06, 0.055, 0.0, -0.01), Section(1.31, 0.035, 0.035, 0.0, -0.02)],
        sides=24,
    ).moved((0.0, 0.215, 0.0))  # fmt: skip
    pendant = cylinder(0.035, 0.012, axis="x").moved((0.134, 0.0, 1.13))
    return BodySpec(
        "Figure",
        (
            Part("Hoodie", hoodie, "Hoodie"),
            *trousers,
            *shoes,
            Part("Neck", cylinder(0.05, 0.10).moved((0.0, 0.0, 1.39)), "Skin"),
            Part("Head", ball(0.092, stretch=1.2).moved((0.0, 0.0, 1.485)), "Skin"),
            Part("Cap", cap, "Black"),
            Part("Brim", brim, "Black"),
            Part("Shades", shades, "Black"),
            Part("LeftArm", left_arm, "Hoodie"),
            Part("Pendant", pendant, "Gold"),
            Part("Shoulder", cylinder(0.045, 0.06, axis="y").moved((0.0, -0.165, SHOULDER[2])), "Steel"),
        ),
        45.0,
    )


def bodies() -> tuple[BodySpec, ...]:
    """Every body, parents before children."""
    microphone = lathe(
        [(0.014, -0.075), (0.016, -0.07), (0.02, 0.025), (0.027, 0.035), (0.031, 0.055), (0.027, 0.075),
         (0.015, 0.087)],
        sides=24,
    ).moved((0.075, 0.0, 0.01))  # fmt: skip
    return (
        _figure(),
        BodySpec(
            "UpperArm",
            (Part("Link", printed_link(UPPER - HUB, SLIM), "Ivory"),),
            None,
            interface_radius=0.028,
            targets=(TargetSpec("ElbowTarget", (UPPER - HUB, 0.0, 0.0), position_weight=0.2),),
        ),
        BodySpec("ElbowCase", (Part("Case", cylinder(HUB, 0.062, axis="y"), "Steel"),), 0.12),
        _lever("Crank", 0.25),
        BodySpec(
            "Rods",
            _pair("Rod", (0.0, 0.0, 0.0), (UPPER, 0.0, 0.0), 0.008, "Black"),
            0.10,
        ),
        _lever("Lever", 0.12),
        BodySpec("Forearm", (Part("Link", printed_link(FORE, SLIM), "Ivory"),), None, interface_radius=0.028),
        BodySpec(
            "Hand",
            (
                Part("Fist", ball(0.045, stretch=0.95).moved((0.055, 0.0, 0.0)), "Skin"),
                Part("Cuff", cylinder(0.027, 0.03, axis="x").moved((0.012, 0.0, 0.0)), "Hoodie"),
                Part("Microphone", microphone, "Black"),
            ),
            0.42,
            targets=(TargetSpec("HandTarget", (0.065, 0.0, 0.0)),),
        ),
    )


def joints(tracks: Mapping[str, Sequence[float]]) -> tuple[JointSpec, ...]:
    """Every joint, parents before children, with the servos and the given tracks [deg]."""
    zero = (0.0, 0.0, 0.0)
    arm, crank = tracks["UpperArm"], tracks["Elbow"]
    bent = tuple(c - a for a, c in zip(arm, crank, strict=True))
    straight = tuple(-angle for angle in bent)
    return (
        JointSpec("Stand", "", "Figure", zero, zero),
        JointSpec("UpperArm", "Figure", "UpperArm", SHOULDER, zero,
                  DriveSpec("Y", tuple(arm), -60.0, 110.0, 700.0, 14000.0, 80.0)),
        JointSpec("ElbowMount", "UpperArm", "ElbowCase", (UPPER - HUB, 0.0, 0.0), (-HUB, 0.0, 0.0)),
        JointSpec("Elbow", "Figure", "Crank", SHOULDER, zero,
                  DriveSpec("Y", tuple(crank), -150.0, 100.0, 700.0, 14000.0, 60.0)),
        JointSpec("CrankHinge", "Crank", "Rods", LEVER, zero, passive="Y", angles=straight),
        JointSpec("ElbowHinge", "ElbowCase", "Lever", zero, zero, passive="Y", angles=bent),
        JointSpec("LeverHinge", "Rods", "Lever", (UPPER, 0.0, 0.0), LEVER, passive="Y"),
        JointSpec("ForearmMount", "Lever", "Forearm", zero, zero),
        JointSpec("Wrist", "Forearm", "Hand", (FORE, 0.0, 0.0), zero),
    )  # fmt: skip


def scenery() -> tuple[Part, ...]:
    """The stage. Not a body, no physics."""
    return (Part("Floor", lathe([(0.58, -0.05), (0.60, -0.045), (0.60, -0.005), (0.59, 0.0)], sides=64), "Stage"),)
