"""The dancer: a skirted figure that stands still and waves two slender arms. Metres, y up, facing z.

At angle zero the arms are stretched out to both sides, the left one along x; every body frame then has the axes of the
world.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from kit.author import Look, Plastic
from kit.parts import printed_link
from kit.robot import BodySpec, DriveSpec, JointSpec, Part, TargetSpec
from kit.shapes import Section, ball, cylinder, lathe, skin

SHOULDER = (0.135, 0.93, 0.0)
UPPER, FORE = 0.30, 0.27  # shoulder to elbow, elbow to wrist
SERVO = 0.036  # radius of the elbow's case; the upper arm ends where it begins
POM = 0.052

NYLON = Plastic("Nylon", youngs_modulus=1.7e9, poissons_ratio=0.39, density=1010.0, damping_ratio=0.02)

LOOKS = {
    "Porcelain": Look((0.83, 0.79, 0.74), 0.35),
    "Plum": Look((0.24, 0.05, 0.20), 0.5),
    "Rose": Look((0.72, 0.20, 0.28), 0.5),
    "Steel": Look((0.42, 0.44, 0.47), 0.3, 0.9),
    "Ink": Look((0.05, 0.05, 0.065), 0.35),
    "Gold": Look((0.83, 0.58, 0.16), 0.3, 0.7),
    "Stage": Look((0.20, 0.19, 0.21), 0.7),
}
SIDES = {"Left": 1.0, "Right": -1.0}


def _sided(part: Part, side: float) -> Part:
    """A part of the left arm, or its mirror image."""
    return part if side > 0.0 else Part(part.name, part.shape.mirrored(), part.look)


def _arm(name: str, side: float) -> tuple[BodySpec, ...]:
    def out(x: float) -> tuple[float, float, float]:
        return (side * x, 0.0, 0.0)

    return (
        BodySpec(
            f"{name}UpperArm",
            (_sided(Part("Link", printed_link(UPPER - SERVO), "Porcelain"), side),),
            None,
            interface_radius=0.028,
        ),
        BodySpec(f"{name}ElbowServo", (Part("Case", cylinder(SERVO, 0.062, axis="z"), "Steel"),), 0.19),
        BodySpec(
            f"{name}Forearm",
            (_sided(Part("Link", printed_link(FORE), "Porcelain"), side),),
            None,
            interface_radius=0.028,
        ),
        BodySpec(
            f"{name}Hand",
            (
                Part("Pom", ball(POM).moved(out(POM + 0.018)), "Rose"),
                _sided(Part("Cuff", lathe([(0.02, -0.004), (0.023, 0.0), (0.023, 0.02), (0.02, 0.024)], axis="x"),
                            "Gold"), side),
            ),
            0.15,
            targets=(TargetSpec(f"{name}HandTarget", out(POM + 0.018)),),
        ),
    )  # fmt: skip


def bodies() -> tuple[BodySpec, ...]:
    """Every body, parents before children."""
    skirt = lathe(
        [(0.20, 0.0), (0.235, 0.012), (0.24, 0.03), (0.20, 0.10), (0.145, 0.28), (0.105, 0.46), (0.085, 0.58),
         (0.076, 0.64), (0.066, 0.66)],
        axis="y", sides=40,
    )  # fmt: skip
    bodice = skin(
        [Section(0.645, 0.062, 0.072), Section(0.70, 0.075, 0.092), Section(0.80, 0.088, 0.118),
         Section(0.90, 0.084, 0.122), Section(0.955, 0.066, 0.10), Section(0.985, 0.034, 0.042),
         Section(1.02, 0.029, 0.029)],
        axis="y", sides=32, squareness=2.6,
    )  # fmt: skip
    chignon = ball(0.038).moved((0.0, 1.165, -0.062))
    eyes = [
        Part(f"{name}Eye", ball(0.011, sides=16, levels=6).moved((side * 0.026, 1.122, 0.061)), "Ink")
        for name, side in SIDES.items()
    ]
    shoulders = [
        Part(f"{name}Shoulder", cylinder(0.038, 0.068, axis="z").moved((side * SHOULDER[0], *SHOULDER[1:])), "Steel")
        for name, side in SIDES.items()
    ]
    figure = BodySpec(
        "Figure",
        (
            Part("Skirt", skirt, "Plum"),
            Part("Bodice", bodice, "Rose"),
            Part("Head", ball(0.069).moved((0.0, 1.105, 0.0)), "Porcelain"),
            Part("Chignon", chignon, "Ink"),
            *eyes,
            *shoulders,
        ),
        11.0,
    )
    return (figure, *(body for name, side in SIDES.items() for body in _arm(name, side)))


def joints(tracks: Mapping[str, Sequence[float]]) -> tuple[JointSpec, ...]:
    """Every joint, parents before children, with the servos and the given tracks [deg]."""
    zero = (0.0, 0.0, 0.0)
    found = [JointSpec("Stand", "", "Figure", zero, zero)]
    for name, side in SIDES.items():

        def servo(joint: str, down: float, up: float, torque: float, side: float = side) -> DriveSpec:
            low, high = sorted((side * down, side * up))
            return DriveSpec("Z", tuple(tracks[joint]), low, high, 700.0, 14000.0, torque)

        arm, elbow = f"{name}Shoulder", f"{name}Elbow"
        place = (side * SHOULDER[0], *SHOULDER[1:])
        found += [
            JointSpec(arm, "Figure", f"{name}UpperArm", place, zero, servo(arm, -85.0, 100.0, 24.0)),
            JointSpec(
                f"{elbow}Mount", f"{name}UpperArm", f"{name}ElbowServo", (side * (UPPER - SERVO), 0.0, 0.0),
                (-side * SERVO, 0.0, 0.0),
            ),
            JointSpec(elbow, f"{name}ElbowServo", f"{name}Forearm", zero, zero, servo(elbow, -40.0, 130.0, 12.0)),
            JointSpec(f"{name}Wrist", f"{name}Forearm", f"{name}Hand", (side * FORE, 0.0, 0.0), zero),
        ]  # fmt: skip
    return tuple(found)


def scenery() -> tuple[Part, ...]:
    """The stage that she stands on. Not a body, no physics."""
    profile = [(0.78, -0.05), (0.80, -0.045), (0.80, -0.005), (0.79, 0.0)]
    return (Part("Floor", lathe(profile, axis="y", sides=64), "Stage"),)
