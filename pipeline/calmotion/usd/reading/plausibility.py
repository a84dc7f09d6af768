"""Robots in other units than their stage says: sizes, weights, densities and inertias that no robot has."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from pxr import UsdGeom

from calmotion.arrays import Array
from calmotion.errors import ShotError
from calmotion.model import Body, Character, ElasticMaterial
from calmotion.model.tolerance import reach
from calmotion.usd.reading.context import Reading
from calmotion.usd.units import EARTH_GRAVITY, StageUnits

LIGHTEST, HEAVIEST = 1e-3, 1e3  # [kg]
SMALLEST, LARGEST = 1e-3, 1e2  # [m]
DENSEST = 22_600.0  # osmium [kg/m^3]
_LIGHTEST_SOLID = 10.0  # a foam of polystyrene [kg/m^3]
_EMPTIEST = 5.0  # mass of a robot over the boxes around its links [kg/m^3]; those of robots have 40 to 2000
_USUAL = 1000.0  # [kg/m^3]
_FRAME = 1e-5  # of a link that stands for a frame [kg]
_GYRATION = 2.0  # largest radius of gyration, of the distance of the farthest point from the centre of mass
_NO_INERTIA = 1e-30  # [kg m^2]
_LEAST_GYRATION = 0.1  # of that of a solid box; those of links of robots are 0.38 and more
_INERTIAS = {
    1e-3: "masses in grams",
    1e-4: "kg cm^2",
    1e-6: "kg mm^2",
    1e-7: "g cm^2",
    1e-9: "g mm^2",
    1e3: "masses in kg where the stage has grams",
    1e4: "kg m^2 where the stage has centimetres",
    1e6: "kg m^2 where the stage has millimetres",
    1e7: "kg m^2 where the stage has grams and centimetres",
    1e9: "kg m^2 where the stage has grams and millimetres",
}
_WEAKEST, _STRONGEST = 0.3, 30.0  # gravity on moons and planets [m/s^2]
_SOFTEST, _STIFFEST = 1e3, 1.3e12  # a gel, diamond: Young's modulus [Pa]
_USUAL_MODULUS = 1e10  # [Pa]
_MODULI = (1e-6, 1e-3, 1e3, 1e6, 1e9)  # kPa, MPa, GPa that were taken for Pa, and the reverse


@dataclass(frozen=True)
class _Link:
    """A link with a mass and geometry.

    Attributes:
        path: Prim path.
        mass: [kg].
        size: Of the box around it, in which a solid is smaller [m], shape [3].
        farthest: Distance of its farthest point from its centre of mass [m].
        gyration: Its largest radius of gyration about the centre of mass [m].
    """

    path: str
    mass: float
    size: Array
    farthest: float
    gyration: float

    @property
    def volume(self) -> float:
        """Of the box around it [m^3]."""
        return float(np.prod(self.size))

    @property
    def box_gyration(self) -> float:
        """Largest radius of gyration of the solid box [m]."""
        edges = np.sort(self.size)[1:]
        return float(np.sqrt(edges @ edges / 12.0))

    @property
    def density(self) -> float:
        """The least that its mean density can be [kg/m^3]."""
        return self.mass / self.volume


def warn_of_units(reading: Reading, path: str, character: Character, resting: Sequence[str]) -> None:
    """Warn of a robot that is too small, large, light, heavy, dense, or has inertias of bodies of another size.

    Args:
        path: Prim that stands for the robot.
        resting: Paths of bodies that are fixed to the world, whose masses nothing shows.
    """
    far, units = reach(character), reading.units
    for doubt in _doubts_of_robot(path, character, far, units):
        reading.warn(doubt)
    if not UsdGeom.StageHasAuthoredMetersPerUnit(reading.stage):
        reading.note(
            f"the root layer has no metersPerUnit, for which USD takes {units.meters:g} m: the robot reaches "
            f"{far:.3g} m. If it is in metres, author metersPerUnit = 1, a factor of {1.0 / units.meters:g}"
        )
    flexible = [(body, body.flexible.material) for body in character.bodies if body.flexible is not None]
    links = [link for body in character.bodies if body.path not in resting and (link := _link(body))]
    for body, material in flexible:
        for doubt in _doubts_of_material(material, body.mass is None, units):
            reading.warn(doubt)
    for doubt in (*_doubts_of_density(links, units), *_doubts_of_inertia(links)):
        reading.warn(doubt)


def _doubts_of_robot(path: str, character: Character, far: float, units: StageUnits) -> Iterator[ShotError]:
    """A weight, a reach and a gravity that no robot has: its units are mostly wrong."""
    masses = [body.mass.mass for body in character.bodies if body.mass is not None]
    total, gravity = float(sum(masses)), float(np.linalg.norm(character.gravity))
    if len(masses) == len(character.bodies) and not LIGHTEST <= total <= HEAVIEST:
        yield ShotError(
            f"the robot weighs {total:.3g} kg",
            path=path,
            attribute="metersPerUnit",
            found=f"{units.meters:g} m, and kilogramsPerUnit {units.kilograms:g} kg",
            remedy="If this is not intended, correct these units of the root layer, physics:mass or physics:density; "
            "simulations and limits depend on it",
        )
    if far > 0.0 and not SMALLEST <= far <= LARGEST:
        yield ShotError(
            f"the robot reaches {far:.3g} m",
            path=path,
            attribute="metersPerUnit",
            found=f"{units.meters:g} m",
            remedy="If this is not intended, correct the unit; gravity and stiffness depend on it",
        )
    if gravity > 0.0 and not _WEAKEST <= gravity <= _STRONGEST:
        yield ShotError(
            "no planet has this gravity",
            path=path,
            attribute="physics:gravityMagnitude",
            found=f"{gravity:.3g} m/s^2, {gravity / units.meters:.4g} in units of {units.meters:g} m",
            remedy=f"On the Earth it is {EARTH_GRAVITY / gravity:.3g} times that: "
            f"author {EARTH_GRAVITY / units.meters:g}",
        )


def _doubts_of_material(material: ElasticMaterial, weighs: bool, units: StageUnits) -> Iterator[ShotError]:
    """A density, where it gives the link its mass, and a modulus that no solid has."""
    stage = f"in the units of the stage, metersPerUnit {units.meters:g} and kilogramsPerUnit {units.kilograms:g}"
    density, modulus = material.density, material.youngs_modulus
    if weighs and not _LIGHTEST_SOLID <= density <= DENSEST:
        factor = 10.0 ** (-3.0 * round(np.log10(density / _USUAL) / 3.0))
        yield ShotError(
            "no solid has this density",
            path=material.path,
            attribute="physics:density",
            found=f"{density:.3g} kg/m^3 {stage}",
            remedy=f"{factor:g} times that would be {factor * density:.4g} kg/m^3",
        )
    if not _SOFTEST <= modulus <= _STIFFEST:
        factor = 1.0 / units.pressure(1.0)  # as though it were authored in Pa
        if not _SOFTEST <= factor * modulus <= _STIFFEST:
            factor = min(_MODULI, key=lambda factor: abs(np.log10(factor * modulus / _USUAL_MODULUS)))
        yield ShotError(
            "no solid has this Young's modulus",
            path=material.path,
            attribute="physics:youngsModulus",
            found=f"{modulus:.3g} Pa {stage}",
            remedy=f"{factor:g} times that would be {factor * modulus:.4g} Pa",
        )


def _doubts_of_density(links: Sequence[_Link], units: StageUnits) -> Iterator[ShotError]:
    """Links that weigh more than a solid box around them can, or a robot that weighs less than air."""
    found, problem = [link for link in links if link.density > DENSEST], "denser than any solid"
    if not found and links and _density(links) < _EMPTIEST:
        found, problem = list(links), "lighter than air"
    if not found:
        return
    first, power = max(found, key=lambda link: link.density), round(np.log10(_density(found) / _USUAL) / 3.0)
    factor = 10.0 ** (power or 1)
    mass = {10.0: 1e-3, 0.1: 1e3}.get(factor)
    grams = f", or masses times {mass:g} (kilogramsPerUnit = {mass * units.kilograms:g})" if mass else ""
    size = " x ".join(f"{length:.3g}" for length in first.size)
    yield ShotError(
        f"this link is {problem}{_others(found)}",
        path=first.path,
        attribute="physics:mass",
        found=f"{first.mass:.3g} kg in {size} m, {first.density:.3g} kg/m^3",
        remedy=f"Lengths times {factor:g} would fit (metersPerUnit = {units.meters * factor:g}){grams}, unless the "
        "geometry is not that of the link",
    )


def _doubts_of_inertia(links: Sequence[_Link]) -> Iterator[ShotError]:
    """Links whose radius of gyration is beyond all their points, or far below that of a box, with a unit that fits
    within a decade."""
    beyond = [link for link in links if link.gyration > _GYRATION * link.farthest]
    below = [link for link in links if link.gyration < _LEAST_GYRATION * link.box_gyration]
    for found, problem in (
        (beyond, "this inertia is that of a larger link"),
        (below, "this inertia is that of a smaller link"),
    ):
        if not found:
            continue
        worst = max(found, key=lambda link: abs(np.log(link.gyration / link.box_gyration)))
        power = {factor: abs(np.log10(factor * (worst.gyration / worst.box_gyration) ** 2)) for factor in _INERTIAS}
        factor = min(power, key=power.__getitem__)
        fits = f"Inertias times {factor:g} ({_INERTIAS[factor]}) would fit" if power[factor] < 1.0 else "Correct it"
        yield ShotError(
            f"{problem}{_others(found)}",
            path=worst.path,
            attribute="physics:diagonalInertia",
            found=f"a radius of gyration of {worst.gyration:.3g} m, where a box of this size has "
            f"{worst.box_gyration:.3g} m",
            remedy=f"{fits}, unless the geometry is not that of the link",
        )


def _others(links: Sequence[_Link]) -> str:
    return f", like {len(links) - 1} more" if len(links) > 1 else ""


def _density(links: Sequence[_Link]) -> float:
    """The least that the mean density of links can be [kg/m^3]."""
    return sum(link.mass for link in links) / sum(link.volume for link in links)


def _link(body: Body) -> _Link | None:
    """A body that has mass and geometry in the shot; None where one is missing, it is flat, or stands for a frame."""
    parts = [surface.points for surface in body.surfaces] + ([body.tets.points] if body.tets is not None else [])
    elsewhere = body.flexible is not None and body.flexible.mesh_file
    if body.mass is None or body.mass.mass <= _FRAME or elsewhere or not parts:
        return None
    points = np.vstack(parts)
    size = np.ptp(points, axis=0) if len(points) else np.zeros(3)
    if not np.prod(size) > 0.0:
        return None
    farthest = float(np.linalg.norm(points - body.mass.center, axis=1).max())
    gyration = float(np.sqrt(max(np.linalg.eigvalsh(body.mass.inertia)[-1], _NO_INERTIA) / body.mass.mass))
    return _Link(body.path, body.mass.mass, size, farthest, gyration)
