"""What a shot animates by time samples or splines: transforms, values that are held constant, the tempo."""

import dataclasses
from typing import Any

import numpy as np
from pxr import Ts, Usd, UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model.animation import Schedule
from calmotion.model.tempo import TimeMap
from calmotion.usd import schemas
from calmotion.usd.clock import Clock
from calmotion.usd.gf import matrix
from calmotion.usd.reading.context import Reading, is_rigid_body, prims_below, prims_of

_BEYOND = 1.0  # time codes past the first and last knot of a spline that goes on there


def animation_codes(attribute: Usd.Attribute, parts: int = 3) -> list[float]:
    """Time codes of the samples of an attribute; of its spline where it has none: its knots, and points between them.

    USD does not count splines among time samples. Empty where nothing animates the attribute.

    Args:
        parts: Into which each interval between two knots is divided; with three, any curve between equal knots shows.
    """
    codes = list(attribute.GetTimeSamples())
    if codes or not attribute.HasSpline():
        return codes
    return _codes_of_spline(attribute.GetSpline(), parts)


def _codes_of_spline(spline: Ts.Spline, parts: int) -> list[float]:
    knots = np.array(list(spline.GetKnots().keys()), dtype=np.float64)
    if len(knots) == 0:
        return []
    shares = np.arange(parts) / parts
    codes = [*(knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1]]
    ends = ((spline.GetPreExtrapolation(), codes[0] - _BEYOND), (spline.GetPostExtrapolation(), codes[-1] + _BEYOND))
    codes += [code for extrapolation, code in ends if extrapolation.mode != Ts.ExtrapHeld]
    return [float(code) for code in sorted(codes)]


_TOLERANCE = 1e-6  # relative to the size of the transform: rounding errors of single precision


def refuse_moving(reading: Reading, fixed: dict[Usd.Prim, str], others: list[Usd.Prim]) -> None:
    """Refuse animated bodies that a joint fixes to the world; note where other transforms are animated.

    Args:
        fixed: Prims of the bodies with a joint to the world, and the path of that joint.
        others: Prims of the other bodies.

    Raises:
        ShotError: A body is animated although a joint fixes it to the world.
    """
    for prim, joint in fixed.items():
        movement = moves(reading, prim)
        if movement is not None:
            mover, code = movement
            raise ShotError(
                f"the transform that carries the character's root is animated, but {joint} holds it in the world",
                path=mover.GetPath(),
                attribute="xformOpOrder",
                found=f"it moves at time code {code:g}",
                remedy="For a moving root, set physics:kinematicEnabled on its body and remove that joint; otherwise "
                "remove the animation of the root and of the prims above it",
            )
    animated = [p for p in others if codes_of(p)]
    if animated:
        reading.note(
            f"{animated[0].GetPath()}: transforms of bodies are animated ({len(animated)} of them); the motion is "
            "taken from the drives alone"
        )


def codes_of(prim: Usd.Prim) -> list[float]:
    """Time codes at which the local transform of a prim has samples, or splines their knots and points between."""
    xform = UsdGeom.Xformable(prim)
    if not xform:
        return []
    codes = set(xform.GetTimeSamples())  # none of splines
    if xform.TransformMightBeTimeVarying():
        codes.update(code for one in xform.GetOrderedXformOps() for code in animation_codes(one.GetAttr()))
    return sorted(codes)


def switched(prim: Usd.Prim, schema: str, name: str) -> list[tuple[float | None, bool]]:
    """What a switch says at the time codes of its samples, each until the next; without samples its value, at None."""
    attribute = prim.GetAttribute(name)
    codes = attribute.GetTimeSamples() if attribute and schemas.is_applied(prim, schema) else []
    return [(code, bool(attribute.Get(code))) for code in codes] or [(None, bool(schemas.value(prim, schema, name)))]


def schedule_of(prim: Usd.Prim, schema: str, name: str, clock: Clock) -> Schedule:
    """The same over time; a switch without samples is as it is from the first frame on."""
    codes, values = zip(*switched(prim, schema, name), strict=True)
    times = np.zeros(1) if codes[0] is None else clock.seconds(np.array(codes, dtype=np.float64))
    return Schedule(times, np.array(values, bool))


def moving_prims(stage: Usd.Stage) -> list[Usd.Prim]:
    """The prims with animated transforms that carry geometry, and those below them that reset their transforms."""
    found: list[Usd.Prim] = []
    for prim in prims_of(stage):
        xform = UsdGeom.Xformable(prim)
        resets = bool(xform) and xform.GetResetXformStack()
        below = resets and any(prim.GetPath().HasPrefix(other.GetPath()) for other in found)
        if (below or codes_of(prim)) and any(one.IsA(UsdGeom.Gprim) for one in prims_below(prim, _is_pattern)):
            found.append(prim)
    return found


def _is_pattern(prim: Usd.Prim) -> bool:
    return bool(prim.GetTypeName() == "PointInstancer")


def has_splines(prim: Usd.Prim) -> bool:
    """Whether a spline animates the local transform of a prim."""
    xform = UsdGeom.Xformable(prim)
    return bool(xform) and any(one.GetAttr().HasSpline() for one in xform.GetOrderedXformOps())


def carriers(prim: Usd.Prim) -> list[Usd.Prim]:
    """A prim and the prims above it, up to one that resets the transform stack."""
    chain, above = [], prim
    while above and not above.IsPseudoRoot():
        chain.append(above)
        if above.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(above).GetResetXformStack():
            break
        above = above.GetParent()
    return chain


def moves(reading: Reading, prim: Usd.Prim) -> tuple[Usd.Prim, float] | None:
    """The first prim, from a body upwards, that moves the body, with the time code; None if there is none."""
    start = reading.world_matrix(prim)
    for mover in carriers(prim):
        for code in codes_of(mover):
            if code < reading.start:
                continue
            now = matrix(UsdGeom.XformCache(code).GetLocalToWorldTransform(prim))
            if np.max(np.abs(now - start)) > _TOLERANCE * max(1.0, float(np.max(np.abs(start)))):
                return mover, code
    return None


def moves_on_body(prim: Usd.Prim) -> bool:
    """Whether the transform of a prim, or of one between it and its body, is animated."""
    while prim and not is_rigid_body(prim):
        if prim.IsA(UsdGeom.Xformable) and UsdGeom.Xformable(prim).TransformMightBeTimeVarying():
            return True
        prim = prim.GetParent()
    return False


_PREFIXES = ("physics:", "calm:", "drive:", "limit:")
_ANIMATED = (
    "physics:targetPosition", "physics:targetVelocity", "calm:contact:active", "calm:motor:optimize",
    "calm:motor:powered", "calm:target:positionWeight", "calm:target:rotationWeight",
)  # fmt: skip


def hold_constants(stage: Usd.Stage) -> list[str]:
    """Give attributes that have time samples or a spline, and no default, their first value as default, in the session
    layer.

    Returns:
        A note for each attribute whose samples differ.
    """
    notes = []
    for prim in prims_of(stage):
        if not (prim.GetAppliedSchemas() or str(prim.GetTypeName()).startswith(("Physics", "Material"))):
            continue
        for name in prim.GetAuthoredPropertyNames(lambda name: name.startswith(_PREFIXES)):
            attribute = prim.GetAttribute(name)
            codes = animation_codes(attribute) if attribute and not name.endswith(_ANIMATED) else []
            if not codes:
                continue
            values = [attribute.Get(code) for code in codes]
            default = attribute.GetResolveInfo(Usd.TimeCode.Default()).GetSource() == Usd.ResolveInfoSourceDefault
            if not default and values[0] is not None and not prim.IsInstanceProxy():
                with Usd.EditContext(stage, stage.GetSessionLayer()):
                    attribute.Set(values[0])
            used = attribute.Get()
            if any(not _same(value, used) for value in values):
                notes.append(
                    f"{attribute.GetPath()}: it is animated, but does not change in a simulation: {used} is used"
                )
    return notes


def _same(one: Any, other: Any) -> bool:
    return bool(np.array_equal(np.asarray(one), np.asarray(other)))


MAP = "calm:retime:map"
_FEWEST = 4  # pairs, through which a cubic goes


def retime_map(composed: Usd.Stage) -> Array | None:
    """Time codes of the animation and of the performance, shape [n, 2]; None where no result has another tempo.

    Raises:
        ShotError: They are no times of a performance.
    """
    for prim in prims_of(composed):
        attribute = prim.GetAttribute(MAP)
        if attribute and attribute.HasAuthoredValue() and attribute.Get() is not None:
            pairs = np.array(attribute.Get(), dtype=np.float64).reshape(-1, 2)
            rises = (
                len(pairs) >= _FEWEST
                and bool(np.all(np.isfinite(pairs)))
                and bool(np.all(np.diff(pairs, axis=0) > 0.0))
            )
            if not rises:
                raise ShotError(
                    "these are not pairs of ascending time codes",
                    path=str(prim.GetPath()),
                    attribute=MAP,
                    found=f"{len(pairs)} pairs",
                    remedy="Optimise the shot beneath once more with --retime, which writes four pairs or more",
                )
            return pairs
    return None


def tempo_of(clock: Clock, pairs: Array | None) -> tuple[TimeMap | None, Clock]:
    """The tempo that pairs of time codes mean, and the clock of the performance.

    Args:
        pairs: Shape [n, 2]; None: it is performed at its own tempo.
    """
    if pairs is None:
        return None, clock
    animation, performance = (clock.seconds(column) for column in pairs.T)
    return TimeMap(animation, performance), dataclasses.replace(clock, end=float(pairs[-1, 1]))
