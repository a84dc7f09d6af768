"""The figure that drums and boxes: a child-sized robot, 1.2 m tall, with thirteen servos. Metres, x forward, z up.

Its feet stand. The pelvis turns, the chest bends and leans, the head turns and nods; an arm turns about the vertical,
lifts, and bends at elbow and wrist. At angle zero the arms point straight ahead, and every body frame has the axes of
the world. Links of the arms are slender and bend; hands are empty, and a shot puts into them what it needs.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from kit.author import Look, Plastic
from kit.character import Character
from kit.parts import printed_link
from kit.robot import BodySpec, DriveSpec, JointSpec, Part, Vector
from kit.shapes import Section, Shape, cylinder, lathe, skin

PELVIS, CHEST, NECK, HEAD = (0.0, 0.0, 0.55), (0.0, 0.0, 0.655), (0.0, 0.0, 0.935), (0.0, 0.0, 0.975)
SHOULDER = (0.0, 0.175, 0.875)
UPPER, FORE = 0.25, 0.235  # shoulder to elbow, elbow to wrist
SERVO = 0.033  # radius of the elbow's case; the upper arm ends where it begins
UPPER_SLIM, FORE_SLIM = 0.0109, 0.0096  # half the thickness of the links
SIDES = {"Left": 1.0, "Right": -1.0}
ZERO = (0.0, 0.0, 0.0)

NYLON = Plastic("Nylon", youngs_modulus=1.7e9, poissons_ratio=0.39, density=1010.0, damping_ratio=0.02)

LOOKS = {
    "Shell": Look((0.82, 0.80, 0.76), 0.35),
    "Blue": Look((0.04, 0.20, 0.46), 0.45),
    "Graphite": Look((0.06, 0.065, 0.075), 0.4),
    "Steel": Look((0.42, 0.44, 0.47), 0.3, 0.9),
    "Orange": Look((0.90, 0.32, 0.04), 0.4),
    "Visor": Look((0.015, 0.02, 0.03), 0.1),
    "Glow": Look((0.25, 0.85, 0.90), 0.2),
}

REST = {"ShoulderYaw": 0.0, "ShoulderPitch": 82.0, "Elbow": -24.0, "Wrist": 8.0}
"""How the arms hang [deg]; everything else is at zero."""


def _lower(sections: Sequence[tuple[float, float, float, float]], squareness: float) -> Shape:
    """A part of a leg: heights, half-widths, and how far forward."""
    return skin([Section(z, a, b, ahead) for z, a, b, ahead in sections], sides=24, squareness=squareness)


def _leg(name: str, side: float) -> tuple[Part, ...]:
    boot = skin(
        [Section(-0.075, 0.030, 0.022, 0.0, 0.034), Section(-0.062, 0.046, 0.036, 0.0, 0.036),
         Section(0.040, 0.052, 0.038, 0.0, 0.038), Section(0.095, 0.050, 0.028, 0.0, 0.028),
         Section(0.125, 0.026, 0.014, 0.0, 0.016)],
        axis="x", sides=24, squareness=3.2,
    )  # fmt: skip
    cuff = _lower([(0.066, 0.034, 0.036, -0.015), (0.072, 0.042, 0.043, -0.015), (0.094, 0.042, 0.043, -0.015),
                   (0.100, 0.036, 0.037, -0.015)], 2.6)  # fmt: skip
    shin = _lower([(0.10, 0.034, 0.035, -0.012), (0.14, 0.040, 0.041, -0.010), (0.22, 0.046, 0.043, -0.008),
                   (0.255, 0.040, 0.038, -0.004), (0.262, 0.032, 0.030, -0.004)], 2.6)  # fmt: skip
    thigh = _lower([(0.312, 0.034, 0.034, 0.0), (0.322, 0.044, 0.043, 0.0), (0.40, 0.054, 0.050, 0.0),
                    (0.465, 0.052, 0.046, 0.0), (0.475, 0.040, 0.038, 0.0)], 2.6)  # fmt: skip
    place = (0.0, 0.078 * side, 0.0)
    return (
        Part(f"{name}Boot", boot.moved(place), "Orange"),
        Part(f"{name}Cuff", cuff.moved(place), "Graphite"),
        Part(f"{name}Shin", shin.moved(place), "Shell"),
        Part(f"{name}Knee", cylinder(0.036, 0.084, axis="y", bevel=0.006).moved((0.0, place[1], 0.285)), "Graphite"),
        Part(f"{name}Thigh", thigh.moved(place), "Shell"),
    )


def _trunk() -> tuple[BodySpec, ...]:
    hips = skin(
        [Section(0.445, 0.045, 0.075), Section(0.46, 0.068, 0.118), Section(0.50, 0.078, 0.130),
         Section(0.535, 0.074, 0.118), Section(0.546, 0.060, 0.095)],
        sides=32, squareness=3.0,
    )  # fmt: skip
    waist = skin(
        [Section(0.004, 0.056, 0.082), Section(0.012, 0.064, 0.094), Section(0.040, 0.062, 0.090),
         Section(0.062, 0.050, 0.066), Section(0.068, 0.040, 0.054)],
        sides=32, squareness=2.8,
    )  # fmt: skip
    chest = skin(
        [Section(0.036, 0.048, 0.070), Section(0.046, 0.062, 0.092), Section(0.110, 0.078, 0.118),
         Section(0.180, 0.088, 0.132), Section(0.225, 0.084, 0.130), Section(0.255, 0.064, 0.098),
         Section(0.268, 0.044, 0.062)],
        sides=32, squareness=2.8,
    )  # fmt: skip
    emblem = cylinder(0.030, 0.016, axis="x", bevel=0.004).moved((0.086, 0.0, 0.165))
    collars = [
        Part(
            f"{name}Collar", cylinder(0.031, 0.060, axis="y", bevel=0.004).moved((0.0, side * 0.126, 0.220)), "Graphite"
        )
        for name, side in SIDES.items()
    ]
    return (
        BodySpec(
            "Legs",
            (*(part for name, side in SIDES.items() for part in _leg(name, side)), Part("Hips", hips, "Blue")),
            9.0,
        ),
        BodySpec("Waist", (Part("Belt", waist, "Graphite"),), 1.4),
        BodySpec("Spine", (Part("Case", cylinder(0.036, 0.088, axis="y", bevel=0.005), "Steel"),), 0.7),
        BodySpec("Chest", (Part("Vest", chest, "Blue"), Part("Emblem", emblem, "Orange"), *collars), 3.6),
    )


def _head() -> tuple[BodySpec, ...]:
    skull = skin(
        [Section(0.012, 0.050, 0.048), Section(0.022, 0.074, 0.072), Section(0.060, 0.096, 0.098),
         Section(0.110, 0.103, 0.108), Section(0.160, 0.098, 0.104), Section(0.200, 0.078, 0.084),
         Section(0.222, 0.048, 0.052), Section(0.230, 0.020, 0.022)],
        sides=36, squareness=2.3,
    )  # fmt: skip
    visor = skin(
        [Section(0.074, 0.076, 0.046), Section(0.098, 0.076, 0.046), Section(0.106, 0.068, 0.038)],
        axis="x", sides=32, squareness=3.6,
    ).moved((0.0, 0.0, 0.112))  # fmt: skip
    eyes = [
        Part(f"{name}Eye", cylinder(0.017, 0.008, axis="x", sides=24, bevel=0.002).moved((0.107, side * 0.034, 0.116)),
             "Glow")
        for name, side in SIDES.items()
    ]  # fmt: skip
    ears = [
        Part(f"{name}Ear", cylinder(0.036, 0.026, axis="y", bevel=0.006).moved((0.0, side * 0.114, 0.108)), "Orange")
        for name, side in SIDES.items()
    ]
    return (
        BodySpec("Neck", (Part("Case", cylinder(0.033, 0.072, bevel=0.004).moved((0.0, 0.0, 0.022)), "Steel"),), 0.25),
        BodySpec("Head", (Part("Skull", skull, "Shell"), Part("Visor", visor, "Visor"), *eyes, *ears), 1.7),
    )


def _link(name: str, end: float, slim: float) -> BodySpec:
    """A link that bends."""
    return BodySpec(name, (Part("Link", printed_link(end, slim), "Shell"),), None, interface_radius=0.028)


def _arm(name: str) -> tuple[BodySpec, ...]:
    fist = skin(
        [Section(0.014, 0.018, 0.018), Section(0.022, 0.029, 0.030), Section(0.045, 0.034, 0.036),
         Section(0.068, 0.031, 0.033), Section(0.078, 0.018, 0.020)],
        axis="x", sides=24, squareness=2.8,
    )  # fmt: skip
    shoulder = lathe([(0.026, -0.040), (0.036, -0.034), (0.042, -0.020), (0.044, 0.0), (0.042, 0.016), (0.034, 0.032),
                      (0.020, 0.041), (0.008, 0.044)])  # fmt: skip
    return (
        BodySpec(f"{name}Shoulder", (Part("Case", shoulder, "Steel"),), 0.45),
        _link(f"{name}UpperArm", UPPER - SERVO, UPPER_SLIM),
        BodySpec(f"{name}ElbowServo", (Part("Case", cylinder(SERVO, 0.060, axis="y"), "Steel"),), 0.17),
        _link(f"{name}Forearm", FORE, FORE_SLIM),
        BodySpec(
            f"{name}Hand",
            (
                Part("Wrist", cylinder(0.024, 0.050, axis="y", bevel=0.004), "Steel"),
                Part("Fist", fist, "Graphite"),
            ),
            0.13,
        ),
    )


def bodies() -> tuple[BodySpec, ...]:
    """Every body, parents before children."""
    return (*_trunk(), *_head(), *(body for name in SIDES for body in _arm(name)))


def at_rest() -> dict[str, tuple[float, ...]]:
    """The one angle of each motor [deg] of a figure that nothing animates."""
    trunk = dict.fromkeys(("PelvisTurn", "ChestBend", "ChestLean", "HeadTurn", "HeadNod"), (0.0,))
    return trunk | {f"{side}{motor}": (angle,) for side in SIDES for motor, angle in REST.items()}


def joints(tracks: Mapping[str, Sequence[float]]) -> tuple[JointSpec, ...]:
    """Every joint, parents before children, with the servos and the given tracks [deg]."""

    def servo(name: str, axis: str, low: float, high: float, speed: float, torque: float) -> DriveSpec:
        return DriveSpec(axis, tuple(tracks[name]), low, high, speed, 40.0 * speed, torque)

    def between(low: Vector, high: Vector) -> Vector:
        return (high[0] - low[0], high[1] - low[1], high[2] - low[2])

    found = [
        JointSpec("Stand", "", "Legs", ZERO, ZERO),
        JointSpec("PelvisTurn", "Legs", "Waist", PELVIS, ZERO, servo("PelvisTurn", "Z", -90.0, 90.0, 500.0, 90.0)),
        JointSpec("ChestBend", "Waist", "Spine", between(PELVIS, CHEST), ZERO,
                  servo("ChestBend", "Y", -35.0, 55.0, 400.0, 120.0)),
        JointSpec("ChestLean", "Spine", "Chest", ZERO, ZERO, servo("ChestLean", "X", -40.0, 40.0, 400.0, 120.0)),
        JointSpec("HeadTurn", "Chest", "Neck", between(CHEST, NECK), ZERO,
                  servo("HeadTurn", "Z", -80.0, 80.0, 500.0, 12.0)),
        JointSpec("HeadNod", "Neck", "Head", between(NECK, HEAD), ZERO,
                  servo("HeadNod", "Y", -40.0, 50.0, 500.0, 12.0)),
    ]  # fmt: skip
    for name, side in SIDES.items():
        yaw, pitch, elbow, wrist = (f"{name}{motor}" for motor in REST)
        upper, servo_body, fore, hand = (f"{name}{body}" for body in ("UpperArm", "ElbowServo", "Forearm", "Hand"))
        x, y, z = between(CHEST, SHOULDER)
        found += [
            JointSpec(yaw, "Chest", f"{name}Shoulder", (x, side * y, z), ZERO,
                      servo(yaw, "Z", -80.0, 80.0, 800.0, 45.0)),
            JointSpec(pitch, f"{name}Shoulder", upper, ZERO, ZERO, servo(pitch, "Y", -70.0, 115.0, 800.0, 45.0)),
            JointSpec(f"{name}ElbowMount", upper, servo_body, (UPPER - SERVO, 0.0, 0.0), (-SERVO, 0.0, 0.0)),
            JointSpec(elbow, servo_body, fore, ZERO, ZERO, servo(elbow, "Y", -150.0, 20.0, 1200.0, 30.0)),
            JointSpec(wrist, fore, hand, (FORE, 0.0, 0.0), ZERO, servo(wrist, "Y", -85.0, 85.0, 1200.0, 10.0)),
        ]  # fmt: skip
    return tuple(found)


FIGURE = Character(
    name="Figure",
    note="A child-sized robot that drums and boxes, drawn for Calmotion. Built by samples/figure/build.py.",
    bodies=bodies(),
    joints=joints(at_rest()),
    looks=LOOKS,
    plastic=NYLON,
    rate=24.0,
    tolerance=0.003,
)
