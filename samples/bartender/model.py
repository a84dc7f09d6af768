"""The bartender's body: a turning chest, two slender plastic links, five servos and a cup. Metres, x forward, z up.

At angle zero the arm points straight ahead; every body frame then has the axes of the world.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from kit.author import Look, Plastic
from kit.parts import printed_link as link
from kit.robot import BodySpec, DriveSpec, JointSpec, Part, TargetSpec
from kit.shapes import Section, Shape, arc_slab, ball, cylinder, lathe, skin

SHOULDER = (0.0, -0.15, 0.10)
UPPER, FORE, GRIP = 0.32, 0.30, 0.078  # shoulder to elbow, elbow to wrist, palm to cup
SERVO = 0.036  # radius of the elbow's case; the upper arm ends where it begins

NYLON = Plastic("Nylon", youngs_modulus=1.9e9, poissons_ratio=0.38, density=1080.0, damping_ratio=0.015)

LOOKS = {
    "Ivory": Look((0.80, 0.76, 0.66), 0.45),
    "Charcoal": Look((0.05, 0.055, 0.065), 0.35),
    "Steel": Look((0.42, 0.44, 0.47), 0.3, 0.9),
    "Teal": Look((0.02, 0.33, 0.36), 0.4),
    "Red": Look((0.58, 0.03, 0.04), 0.45),
    "Amber": Look((0.90, 0.42, 0.05), 0.15),
    "Glass": Look((0.72, 0.83, 0.86), 0.1),
    "Walnut": Look((0.17, 0.075, 0.03), 0.5),
}


def cup() -> Shape:
    """A tumbler with a wall and a floor, its frame in the middle of its height."""
    outside = [(0.028, -0.048), (0.031, -0.046), (0.032, -0.042), (0.038, 0.046)]
    inside = [(0.0372, 0.048), (0.0358, 0.046), (0.0298, -0.038), (0.0285, -0.0405)]
    return lathe(outside + inside, sides=32)


# long: one table of the figure's measures, body after body
def bodies() -> tuple[BodySpec, ...]:
    """Every body, parents before children."""
    torso = skin(
        [
            Section(0.0, 0.155, 0.175),
            Section(0.02, 0.165, 0.185),
            Section(0.05, 0.155, 0.175),
            Section(0.07, 0.10, 0.115),
            Section(0.20, 0.085, 0.10),
            Section(0.40, 0.095, 0.115),
            Section(0.46, 0.09, 0.11),
            Section(0.475, 0.075, 0.09),
        ],
        sides=32,
        squareness=3.0,
    )
    chest = skin(
        [
            Section(0.004, 0.075, 0.09),
            Section(0.02, 0.09, 0.112),
            Section(0.08, 0.10, 0.122),
            Section(0.13, 0.098, 0.118),
            Section(0.165, 0.075, 0.09),
            Section(0.18, 0.04, 0.045),
            Section(0.205, 0.035, 0.035),
        ],
        sides=32,
        squareness=3.0,
    )
    bow = skin(
        [
            Section(y, half * 0.5, half)
            for y, half in (
                (-0.042, 0.018),
                (-0.038, 0.021),
                (-0.008, 0.008),
                (0.008, 0.008),
                (0.038, 0.021),
                (0.042, 0.018),
            )
        ],
        axis="y",
        sides=12,
        squareness=3.0,
    )
    palm = skin(
        [
            Section(-0.008, 0.017, 0.017),
            Section(-0.004, 0.02, 0.02),
            Section(0.03, 0.018, 0.018),
            Section(0.04, 0.012, 0.013),
        ],
        axis="x",
        sides=20,
        squareness=3.0,
    )
    hat = lathe(
        [(0.098, 0.0), (0.102, 0.004), (0.098, 0.010), (0.066, 0.014), (0.064, 0.055), (0.050, 0.078), (0.02, 0.088)]
    )
    return (
        BodySpec("Torso", (Part("Pedestal", torso, "Charcoal"),), 9.0),
        BodySpec(
            "Chest",
            (
                Part("Vest", chest, "Teal"),
                Part("BowTie", bow.moved((0.088, 0.0, 0.150)), "Red"),
                Part("Head", ball(0.072, stretch=1.15).moved((0.0, 0.0, 0.275)), "Ivory"),
                Part("LeftEye", ball(0.012, sides=16, levels=6).moved((0.066, 0.026, 0.285)), "Charcoal"),
                Part("RightEye", ball(0.012, sides=16, levels=6).moved((0.066, -0.026, 0.285)), "Charcoal"),
                Part("Hat", hat.moved((0.0, 0.0, 0.318)), "Charcoal"),
                Part("ShoulderServo", cylinder(0.042, 0.074, axis="y").moved(SHOULDER), "Steel"),
            ),
            3.2,
        ),
        BodySpec(
            "UpperArm",
            (Part("Link", link(UPPER - SERVO), "Ivory"),),
            None,
            interface_radius=0.028,
            targets=(TargetSpec("ElbowTarget", (UPPER - SERVO, 0.0, 0.0)),),
        ),
        BodySpec("ElbowServo", (Part("Case", cylinder(SERVO, 0.066, axis="y"), "Steel"),), 0.24),
        BodySpec("Forearm", (Part("Link", link(FORE + 0.018), "Ivory"),), None, interface_radius=0.028),
        BodySpec("WristServo", (Part("Case", cylinder(0.028, 0.056, axis="y"), "Steel"),), 0.12),
        BodySpec(
            "Hand",
            (
                Part("Palm", palm, "Charcoal"),
                Part(
                    "Clamp", arc_slab(0.0365, 0.045, -0.011, 0.011, (40.0, 320.0), 28).moved((GRIP, 0.0, 0.0)), "Steel"
                ),
            ),
            0.11,
        ),
        BodySpec(
            "Cup",
            (Part("Tumbler", cup(), "Glass"), Part("Drink", lathe([(0.028, -0.038), (0.0342, 0.028)]), "Amber")),
            0.24,
            targets=(TargetSpec("CupTarget", (0.0, 0.0, 0.0), 1.0, 0.05),),
        ),
    )


def joints(tracks: Mapping[str, Sequence[float]]) -> tuple[JointSpec, ...]:
    """Every joint, parents before children, with the servos and the given tracks [deg]."""

    def servo(name: str, axis: str, lower: float, upper: float, torque: float) -> DriveSpec:
        return DriveSpec(axis, tuple(tracks[name]), lower, upper, 420.0, 9000.0, torque)

    zero = (0.0, 0.0, 0.0)
    return (
        JointSpec("TorsoMount", "", "Torso", zero, zero),
        JointSpec("Waist", "Torso", "Chest", (0.0, 0.0, 0.475), zero, servo("Waist", "Z", -120.0, 120.0, 40.0)),
        JointSpec("Shoulder", "Chest", "UpperArm", SHOULDER, zero, servo("Shoulder", "Y", -80.0, 110.0, 40.0)),
        JointSpec("ElbowMount", "UpperArm", "ElbowServo", (UPPER - SERVO, 0.0, 0.0), (-SERVO, 0.0, 0.0)),
        JointSpec("Elbow", "ElbowServo", "Forearm", zero, zero, servo("Elbow", "Y", -140.0, 30.0, 20.0)),
        JointSpec(
            "WristPitch", "Forearm", "WristServo", (FORE, 0.0, 0.0), zero, servo("WristPitch", "Y", -100.0, 100.0, 8.0)
        ),
        JointSpec(
            "WristRoll", "WristServo", "Hand", (0.030, 0.0, 0.0), zero, servo("WristRoll", "X", -90.0, 90.0, 4.0)
        ),
        JointSpec("CupGrip", "Hand", "Cup", (GRIP, 0.0, 0.0), (0.0, 0.0, -0.006)),
    )


def scenery() -> tuple[Part, ...]:
    """The bar: a counter bent around the bartender and its front. Not a body, no physics."""
    counter = arc_slab(0.50, 0.86, 0.280, 0.308, (-80.0, 80.0), 40)
    front = arc_slab(0.78, 0.81, 0.0, 0.280, (-76.0, 76.0), 38)
    return (Part("Counter", counter, "Walnut"), Part("Front", front, "Charcoal"))
