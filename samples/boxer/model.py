"""What the boxer adds to the figure: two gloves, a corner of the ring, and a bag. Metres, x forward, z up."""

from __future__ import annotations

import math

from figure.model import SIDES
from kit.author import Look
from kit.robot import BodySpec, JointSpec, Part, TargetSpec
from kit.shapes import Section, ball, cylinder, lathe, skin

KNUCKLES = 0.112  # from the wrist to the front of the glove

LOOKS = {
    "Leather": Look((0.62, 0.02, 0.025), 0.3),
    "Lace": Look((0.85, 0.84, 0.80), 0.6),
    "Canvas": Look((0.36, 0.45, 0.52), 0.8),
    "Apron": Look((0.05, 0.07, 0.13), 0.7),
    "Post": Look((0.42, 0.44, 0.47), 0.3, 0.9),
    "Rope": Look((0.80, 0.79, 0.75), 0.6),
    "Pad": Look((0.75, 0.05, 0.05), 0.5),
}


def gloves() -> tuple[BodySpec, ...]:
    """A glove about each fist, its frame at the wrist; the targets are the knuckles."""
    mitt = skin(
        [Section(0.012, 0.030, 0.031), Section(0.020, 0.036, 0.038), Section(0.042, 0.048, 0.050),
         Section(0.072, 0.056, 0.058, 0.0, 0.002), Section(0.098, 0.050, 0.052, 0.0, 0.001),
         Section(0.113, 0.032, 0.034), Section(0.118, 0.012, 0.014)],
        axis="x", sides=28, squareness=2.3,
    )  # fmt: skip
    cuff = lathe([(0.028, -0.024), (0.034, -0.020), (0.036, 0.010), (0.036, 0.020), (0.032, 0.024)], axis="x", sides=28)
    return tuple(
        BodySpec(
            f"{side}Glove",
            (
                Part("Mitt", mitt, "Leather"),
                Part("Thumb", ball(0.021, stretch=1.0, sides=20, levels=8).moved((0.060, -0.044 * sign, 0.022)),
                     "Leather"),
                Part("Cuff", cuff, "Lace"),
            ),
            0.20,
            targets=(TargetSpec(f"{side}GloveTarget", (KNUCKLES, 0.0, 0.0)),),
        )
        for side, sign in SIDES.items()
    )  # fmt: skip


def laces() -> tuple[JointSpec, ...]:
    """Each glove tied to its hand."""
    zero = (0.0, 0.0, 0.0)
    return tuple(JointSpec(f"{side}Lace", f"{side}Hand", f"{side}Glove", zero, zero) for side in SIDES)


BAG = (0.845, 0.0, 0.93)  # its leather begins where the knuckles of a straight punch stop
BAG_RADIUS, BAG_HEIGHT = 0.135, 0.56


def bag() -> tuple[Part, ...]:
    """A heavy bag in front of the boxer, on a chain from above. The punches stop at it; it has no physics."""
    half, top = 0.5 * BAG_HEIGHT, BAG[2] + 0.5 * BAG_HEIGHT
    leather = lathe(
        [(0.03, -half), (BAG_RADIUS - 0.02, -half + 0.006), (BAG_RADIUS, -half + 0.035), (BAG_RADIUS, half - 0.035),
         (BAG_RADIUS - 0.02, half - 0.006), (0.03, half)],
        sides=40,
    )  # fmt: skip
    band = cylinder(BAG_RADIUS + 0.003, 0.035, sides=40, bevel=0.004)
    hook = lathe([(BAG_RADIUS - 0.03, 0.0), (0.012, 0.13), (0.010, 0.16)], sides=24)
    chain = cylinder(0.008, 0.50, sides=12)
    return (
        Part("Bag", leather.moved(BAG), "Leather"),
        *(
            Part(f"Band{k}", band.moved((BAG[0], BAG[1], BAG[2] + z)), "Apron")
            for k, z in enumerate((-half + 0.09, half - 0.09))
        ),
        Part("Hook", hook.moved((BAG[0], BAG[1], top - 0.002)), "Apron"),
        Part("Chain", chain.moved((BAG[0], BAG[1], top + 0.38)), "Post"),
    )


def scenery() -> tuple[Part, ...]:
    """A ring that is open towards the spectator: canvas, three posts with pads, three ropes on two sides, and the bag.
    Not a body, no physics."""
    half, corners = 0.95, [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
    square = 1.12 * math.sqrt(2.0)  # four points of a circle are a square with this diagonal, not this side
    canvas = skin([Section(-0.03, square, square), Section(0.0, square, square)], sides=4)
    apron = skin([Section(-0.14, square - 0.02, square - 0.02), Section(-0.03, square - 0.02, square - 0.02)], sides=4)
    parts = [Part("Canvas", canvas, "Canvas"), Part("Apron", apron, "Apron"), *bag()]
    for k, (x, y) in enumerate(corners):
        place = (half * x, half * y, 0.0)
        parts += [
            Part(f"Post{k}", cylinder(0.028, 0.80, sides=20).moved((place[0], place[1], 0.40)), "Post"),
            Part(f"Pad{k}", cylinder(0.050, 0.46, sides=20, bevel=0.012).moved((place[0], place[1], 0.50)), "Pad"),
        ]
    for level, z in enumerate((0.32, 0.50, 0.68)):
        along_x, along_y = (cylinder(0.010, 2.0 * half, axis=axis, sides=12) for axis in "xy")
        parts += [
            Part(f"SideRope{level}", along_x.moved((0.0, half, z)), "Rope"),
            Part(f"BackRope{level}", along_y.moved((-half, 0.0, z)), "Rope"),
        ]
    return tuple(parts)
