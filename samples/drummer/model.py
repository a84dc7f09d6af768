"""What the drummer adds to the figure: two sticks, a skeleton that carries the animation, and the kit. Metres, z up."""

from __future__ import annotations

from figure.model import SIDES
from kit.author import Look
from kit.robot import BodySpec, JointSpec, Part, TargetSpec, Vector
from kit.shapes import Shape, cylinder, lathe
from kit.skeleton import Bone

GRIP = 0.046  # from the wrist to the middle of the fist
REACH = 0.235  # from there to the tip of the stick

LOOKS = {
    "Hickory": Look((0.62, 0.38, 0.17), 0.5),
    "Lacquer": Look((0.45, 0.02, 0.03), 0.2),
    "Skin": Look((0.86, 0.85, 0.82), 0.6),
    "Chrome": Look((0.55, 0.57, 0.60), 0.2, 0.9),
    "Bronze": Look((0.78, 0.55, 0.16), 0.25, 0.8),
    "Carpet": Look((0.13, 0.06, 0.07), 0.9),
}

BONES = (
    Bone("Pelvis", "", ("PelvisTurn",)),
    Bone("Chest", "Pelvis", ("ChestBend", "ChestLean")),
    Bone("Head", "Chest", ("HeadTurn", "HeadNod")),
    *(
        bone
        for side in SIDES
        for bone in (
            Bone(f"{side}Shoulder", "Chest", (f"{side}ShoulderYaw", f"{side}ShoulderPitch")),
            Bone(f"{side}Elbow", f"{side}Shoulder", (f"{side}Elbow",)),
            Bone(f"{side}Wrist", f"{side}Elbow", (f"{side}Wrist",)),
        )
    ),
)


def sticks() -> tuple[BodySpec, ...]:
    """A stick for each hand, along x, its frame in the middle of the fist; the targets are the tips."""
    stick = lathe(
        [(0.004, -0.080), (0.007, -0.077), (0.0075, 0.10), (0.0035, REACH - 0.020), (0.0055, REACH - 0.013),
         (0.0058, REACH - 0.006), (0.0025, REACH)],
        axis="x", sides=16,
    )  # fmt: skip
    return tuple(
        BodySpec(f"{side}Stick", (Part("Stick", stick, "Hickory"),), 0.055,
                 targets=(TargetSpec(f"{side}TipTarget", (REACH, 0.0, 0.0)),))
        for side in SIDES
    )  # fmt: skip


def grips() -> tuple[JointSpec, ...]:
    """Each stick held in its hand."""
    return tuple(
        JointSpec(f"{side}Grip", f"{side}Hand", f"{side}Stick", (GRIP, 0.0, 0.0), (0.0, 0.0, 0.0)) for side in SIDES
    )


def _drum(name: str, head: Vector, radius: float, depth: float, axis: str = "z") -> tuple[Part, ...]:
    """A drum whose head is centered there and faces along the axis, with its hoops."""

    def disc(part: str, wide: float, length: float, below: float, look: str) -> Part:
        middle = [value - (below + 0.5 * length) * (letter == axis) for value, letter in zip(head, "xyz", strict=True)]
        return Part(f"{name}{part}", cylinder(radius + wide, length, axis=axis, sides=40).moved(middle), look)

    return (
        disc("Shell", 0.0, depth, 0.004, "Lacquer"),
        disc("Head", -0.004, 0.012, 0.0, "Skin"),
        disc("UpperHoop", 0.006, 0.014, 0.005, "Chrome"),
        disc("LowerHoop", 0.006, 0.014, depth - 0.011, "Chrome"),
    )


def _cymbal(radius: float) -> Shape:
    return lathe([(0.006, -0.004), (radius - 0.001, -0.016), (radius, -0.014), (0.035, 0.0), (0.028, 0.010),
                  (0.006, 0.016)], sides=48)  # fmt: skip


def _stand(name: str, top: Vector, foot: float = 0.13) -> tuple[Part, ...]:
    """A pole down to the floor, on a flat cone."""
    x, y, z = top
    base = lathe([(foot - 0.004, 0.0), (foot, 0.004), (0.03, 0.035), (0.012, 0.05)])
    return (
        Part(f"{name}Pole", cylinder(0.010, z - 0.02, sides=16).moved((x, y, 0.5 * z + 0.01)), "Chrome"),
        Part(f"{name}Foot", base.moved((x, y, 0.0)), "Chrome"),
    )


SNARE: Vector = (0.545, 0.11, 0.468)
HAT: Vector = (0.675, -0.155, 0.512)
CRASH: Vector = (0.44, -0.80, 0.68)
BASS: Vector = (1.02, 0.07, 0.21)


def scenery() -> tuple[Part, ...]:
    """The kit of one who drums standing, on a carpet. Not a body, no physics."""
    hat = _cymbal(0.115)
    lower = Shape(hat.points * (1.0, 1.0, -1.0), tuple(face[::-1] for face in hat.faces))
    carpet = lathe([(0.93, -0.02), (0.94, -0.016), (0.94, -0.003), (0.935, 0.0)], sides=64)
    return (
        *_drum("Snare", SNARE, 0.125, 0.10),
        *_stand("Snare", (SNARE[0], SNARE[1], SNARE[2] - 0.10)),
        Part("UpperHat", hat.moved(HAT), "Bronze"),
        Part("LowerHat", lower.moved((HAT[0], HAT[1], HAT[2] - 0.036)), "Bronze"),
        *_stand("Hat", (HAT[0], HAT[1], HAT[2] + 0.05)),
        Part("Crash", _cymbal(0.15).moved(CRASH), "Bronze"),
        *_stand("Crash", (CRASH[0], CRASH[1], CRASH[2] + 0.03)),
        *_drum("Bass", BASS, 0.20, 0.24, "x"),
        Part("Carpet", carpet.moved((0.35, -0.22, 0.0)), "Carpet"),
    )
