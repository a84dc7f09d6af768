"""The lamp's body: a base, a turning post, two printed links and a head with its bulb. Metres, x forward, z up.

At angle zero the arm points straight ahead; every body frame then has the axes of the world. Its servos are real ones
by name: the file has neither their gains nor their limits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from kit.author import Look, Plastic
from kit.parts import printed_link as link
from kit.robot import BodySpec, DriveSpec, JointSpec, Part, TargetSpec
from kit.shapes import Section, ball, cylinder, lathe, skin

POST, SHOULDER = (0.0, 0.0, 0.040), (0.0, 0.0, 0.062)
LOWER, UPPER, BULB = 0.24, 0.21, 0.085  # shoulder to elbow, elbow to head, head to bulb
SERVO = 0.030  # radius of the elbow's case; the lower link ends where it begins
MOTOR = "xm430-w350"

ABS = Plastic("ABS", youngs_modulus=2.1e9, poissons_ratio=0.37, density=1050.0, damping_ratio=0.02)

LOOKS = {
    "Blue": Look((0.02, 0.13, 0.36), 0.35),
    "White": Look((0.80, 0.79, 0.75), 0.4),
    "Charcoal": Look((0.05, 0.055, 0.065), 0.35),
    "Bulb": Look((0.95, 0.82, 0.45), 0.2),
    "Oak": Look((0.42, 0.26, 0.12), 0.55),
    "Paper": Look((0.85, 0.84, 0.80), 0.8),
}


def bodies() -> tuple[BodySpec, ...]:
    """Every body, parents before children."""
    base = lathe([(0.075, 0.0), (0.082, 0.006), (0.078, 0.016), (0.040, 0.026), (0.034, 0.038)], sides=40)
    neck = ((0.001, 0.026, 0.026), (0.006, 0.028, 0.028), (0.030, 0.022, 0.026), (0.040, 0.016, 0.020))
    post = skin([Section(*values) for values in neck], sides=24, squareness=3.0)
    # the wall outside, then inside: open towards the bulb's side
    outside = [(0.016, 0.012), (0.024, 0.016), (0.030, 0.045), (0.062, 0.115)]
    inside = [(0.0605, 0.1155), (0.028, 0.047), (0.012, 0.030)]
    shade = lathe(outside + inside, axis="x", sides=36)
    return (
        BodySpec("Base", (Part("Foot", base, "Blue"),), 1.6),
        BodySpec(
            "Post",
            (
                Part("Neck", post, "Blue"),
                Part("ShoulderServo", cylinder(0.024, 0.060, axis="y").moved(SHOULDER), "Charcoal"),
            ),
            0.24,
        ),
        BodySpec("LowerArm", (Part("Link", link(LOWER - SERVO, 0.0085), "White"),), None, interface_radius=0.028),
        BodySpec("ElbowServo", (Part("Case", cylinder(SERVO, 0.060, axis="y"), "Charcoal"),), 0.105),
        BodySpec("UpperArm", (Part("Link", link(UPPER + 0.018, 0.0085), "White"),), None, interface_radius=0.028),
        BodySpec(
            "Head",
            (
                Part("Case", cylinder(0.022, 0.052, axis="y"), "Charcoal"),
                Part("Shade", shade, "Blue"),
                Part("Bulb", ball(0.019, sides=20, levels=8).moved((BULB - 0.015, 0.0, 0.0)), "Bulb"),
            ),
            0.19,
            targets=(TargetSpec("BulbTarget", (BULB, 0.0, 0.0), 1.0, 0.02),),
        ),
    )


def joints(tracks: Mapping[str, Sequence[float]]) -> tuple[JointSpec, ...]:
    """Every joint, parents before children, with the servos and the given tracks [deg]."""

    def servo(name: str, axis: str, lower: float, upper: float) -> DriveSpec:
        return DriveSpec(axis, tuple(tracks[name]), lower, upper, max_acceleration=9000.0, motor=MOTOR)

    zero = (0.0, 0.0, 0.0)
    return (
        JointSpec("BaseMount", "", "Base", zero, zero),
        JointSpec("Turn", "Base", "Post", POST, zero, servo("Turn", "Z", -150.0, 150.0)),
        JointSpec("Shoulder", "Post", "LowerArm", SHOULDER, zero, servo("Shoulder", "Y", -150.0, 30.0)),
        JointSpec("ElbowMount", "LowerArm", "ElbowServo", (LOWER - SERVO, 0.0, 0.0), (-SERVO, 0.0, 0.0)),
        JointSpec("Elbow", "ElbowServo", "UpperArm", zero, zero, servo("Elbow", "Y", -20.0, 160.0)),
        JointSpec("HeadPitch", "UpperArm", "Head", (UPPER, 0.0, 0.0), zero, servo("HeadPitch", "Y", -110.0, 110.0)),
    )


def scenery() -> tuple[Part, ...]:
    """The desk and a sheet of paper on it. Not a body, no physics."""
    top = skin([Section(-0.03, 0.50, 0.60), Section(-0.0005, 0.50, 0.60)], sides=4, squareness=12.0).moved(
        (0.25, 0.0, 0.0)
    )
    sheet = skin([Section(0.0, 0.105, 0.148), Section(0.001, 0.105, 0.148)], sides=4, squareness=16.0)
    return (Part("Top", top, "Oak"), Part("Sheet", sheet.moved((0.36, -0.12, 0.0)), "Paper"))
