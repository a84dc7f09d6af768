"""Gravity, and the shot's settings of the optimisation."""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from pxr import Usd, UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import RetargetSettings, TempoSettings
from calmotion.model.uncertainty import Uncertainty
from calmotion.usd import gf, schemas
from calmotion.usd.calibrations import known_factors, predictions
from calmotion.usd.reading.context import Reading, prims_of
from calmotion.usd.units import EARTH_GRAVITY

MOST_UNCERTAIN = 3.0  # a relative standard deviation: who writes 10 means 10%
_SCHEMA = "CalmRetargetAPI"


def gravity(reading: Reading, bodies: Sequence[str] = ()) -> Array:
    """Gravity [m/s^2], shape [3], world: of the PhysicsScene, else 9.81 down the up axis.

    UsdPhysics: a direction (0, 0, 0) means down, a negative magnitude means that of the Earth. Of several scenes that
    one counts which the bodies name as their `physics:simulationOwner`. `newton:gravityEnabled` switches it off.

    Args:
        bodies: Paths of the bodies.

    Raises:
        ShotError: A direction or magnitude that is not finite.
    """
    up = UsdGeom.GetStageUpAxis(reading.stage)
    down: Array = 0.0 - np.eye(3)["XYZ".index(str(up))]
    scenes = [p for p in prims_of(reading.stage) if p.GetTypeName() == "PhysicsScene"]
    if not scenes:
        reading.note(f"the shot has no PhysicsScene; gravity is {EARTH_GRAVITY} m/s^2 down the {up} axis")
        return EARTH_GRAVITY * down
    owners = _owners(reading.stage, bodies)
    named = [scene for scene in scenes if str(scene.GetPath()) in owners]
    scene = (named or scenes)[0]
    if len(scenes) > 1 and len(named) != 1:
        reading.note(f"{scene.GetPath()}: the shot has several PhysicsScene prims; gravity is taken from this one")
    direction = gf.vector(scene.GetAttribute("physics:gravityDirection").Get(reading.start))
    magnitude = float(scene.GetAttribute("physics:gravityMagnitude").Get(reading.start))
    for name, value in (("physics:gravityDirection", direction), ("physics:gravityMagnitude", magnitude)):
        # a magnitude of -inf is the fallback of UsdPhysics
        bad = np.isnan(value).any() or np.isposinf(value).any() or (name.endswith("n") and np.isinf(value).any())
        if bad:
            raise ShotError(
                "is not finite", path=scene.GetPath(), attribute=name, found=value, remedy="Author a finite value"
            )
    switch = scene.GetAttribute("newton:gravityEnabled")
    if switch and switch.Get(reading.start) is False:
        return np.zeros(3)
    size = float(np.linalg.norm(direction))
    along: Array = down if size == 0.0 else direction / size
    return along * (EARTH_GRAVITY if magnitude < 0.0 else reading.units.acceleration(magnitude))


def _owners(stage: Usd.Stage, bodies: Sequence[str]) -> set[str]:
    """Paths of the scenes that simulate the bodies, where these say so."""
    owners = set()
    for path in bodies:
        prim = stage.GetPrimAtPath(path)
        relationship = prim.GetRelationship("physics:simulationOwner") if prim else None
        owners |= {str(target) for target in relationship.GetForwardedTargets()} if relationship else set()
    return owners


def retarget_settings(reading: Reading, root: str) -> RetargetSettings:
    """The settings of CalmRetargetAPI on the character's root or the nearest prim above it.

    Args:
        root: Path of the deepest prim that holds the whole character.

    Raises:
        ShotError: A value out of range.
    """
    if (told := predictions(reading.stage)) is not None:
        reading.notes.append(told)
    prim = reading.stage.GetPrimAtPath(root)
    while prim and not schemas.is_applied(prim, _SCHEMA):
        prim = prim.GetParent()
    others = [p for p in prims_of(reading.stage) if schemas.is_applied(p, _SCHEMA) and p != prim]
    for other in others:
        if not (prim and prim.GetPath().HasPrefix(other.GetPath())):
            reading.note(f"{other.GetPath()}: {_SCHEMA} is neither on the root of the character nor above it; ignored")
    if not prim:
        return RetargetSettings(uncertainty=Uncertainty(calibrated=known_factors(reading.stage)))
    tolerance, goal = (
        None if (found := _positive(prim, name)) is None else reading.units.length(found)
        for name in ("tolerance", "goal")
    )
    return RetargetSettings(
        tolerance=tolerance,
        goal=goal,
        time_step=_positive(prim, "timeStep"),
        knot_spacing=_positive(prim, "knotSpacing"),
        smoothness=_positive(prim, "smoothness", zero=True),
        reference=schemas.choice(prim, _SCHEMA, "calm:retarget:reference", ("rigid", "static"), "has an unknown value"),
        endpoints=schemas.choice(prim, _SCHEMA, "calm:retarget:endpoints", ("free", "kept"), "has an unknown value"),
        cyclic=bool(schemas.value(prim, _SCHEMA, "calm:retarget:cyclic")),
        uncertainty=_uncertainty(prim),
        tempo=_tempo(reading, prim),
    )


def _tempo(reading: Reading, prim: Usd.Prim) -> TempoSettings:
    """How the tempo may change.

    Raises:
        ShotError: A stretch out of range.
    """
    found = {name: schemas.value(prim, _SCHEMA, f"calm:retime:{name}") for name in ("slowest", "fastest", "pinned")}
    slowest, fastest, pinned = found["slowest"], found["fastest"], found["pinned"]
    schemas.require(1.0 <= slowest < np.inf, prim, "calm:retime:slowest", slowest, "must be 1 or more")
    schemas.require(0.0 < fastest <= 1.0, prim, "calm:retime:fastest", fastest, "must be more than 0, and at most 1")
    codes = np.unique(np.array(pinned if pinned is not None else (), dtype=np.float64))
    times = (codes - reading.start) / prim.GetStage().GetTimeCodesPerSecond()
    return TempoSettings(float(slowest), float(fastest), tuple(times.tolist()))


def _positive(prim: Usd.Prim, name: str, *, zero: bool = False) -> float | None:
    return schemas.automatic(prim, _SCHEMA, f"calm:retarget:{name}", zero=zero)


def _uncertainty(prim: Usd.Prim) -> Uncertainty:
    """The relative standard deviations of the robot's parameters.

    Raises:
        ShotError: One is as large as a percentage.
    """
    names = [field.name for field in fields(Uncertainty) if field.name != "calibrated"]
    given = {name: _positive(prim, f"uncertainty:{name}", zero=True) for name in names}
    known = {name: value for name, value in given.items() if value is not None}
    for name, value in known.items():
        attribute = f"calm:retarget:uncertainty:{name}"
        remedy = "Write it as a share: 0.1 is 10%."
        schemas.require(value <= MOST_UNCERTAIN, prim, attribute, value, "the parameter is not known at all", remedy)
    return Uncertainty(**known, calibrated=known_factors(prim.GetStage()))
