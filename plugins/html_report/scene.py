"""The 3D player's data: surfaces with their deflections, and motions as deviations from the intended one."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.model import Animation, Character, Motion, Result, SurfaceMesh
from calmotion.support import distinct_names
from calmotion.views import (
    choose_viewpoint,
    floor_below,
    framed,
    modes_of,
    prepare,
    sample_motion,
    split_at_creases,
)
from scipy.spatial.transform import Rotation

from .packing import Packing

DEFAULT_COLOR = (0.55, 0.55, 0.57)
LARGEST = 4_000_000  # letters of a scene, so that a page stays below 8 MB
POSITION, ROTATION = 2e-6, 4e-6  # units in which motions are kept [m], [rad]
SHAPES = 6  # deflections of a body that are kept, the largest ones
SEEN = 2e-5  # size of a deflection below which it is not kept [m]
DIRECTIONS = np.stack(np.meshgrid(*3 * [np.linspace(-1.0, 1.0, 5)]), axis=-1).reshape(-1, 3)
SURFACE = 2.0**-15  # of the extent of a surface: unit of its points


@dataclass(frozen=True)
class Detail:
    """How fine a scene is: largest number of triangles, and largest rate of the samples [Hz]."""

    triangles: int
    rate: float


def scene_of(character: Character, animation: Animation, result: Result, detail: Detail) -> dict[str, Any] | None:
    """The scene, with its arrays in `arrays`; at half the rate until it is small enough. None without any surface."""
    if not any(surface.drawn for body in character.bodies for surface in body.surfaces):
        return None
    rate = detail.rate
    while True:
        packing = Packing()
        scene = _described(character, animation, result, Detail(detail.triangles, rate), packing)
        scene["arrays"] = packing.text()
        if len(scene["arrays"]) <= LARGEST or scene["count"] < 100:
            return scene
        rate *= 0.5


def _described(
    character: Character, animation: Animation, result: Result, detail: Detail, packing: Packing
) -> dict[str, Any]:
    end = float(animation.frame_times[-1])
    count = max(int(np.ceil(end * detail.rate)) + 1, 2)
    times = np.linspace(0.0, end, count)
    reference = sample_motion(result.reference, times)
    runs = [sample_motion(run.motion, times) for run in (result.before, result.after) if run is not None]
    surfaces, deflections = _surfaces(character, result, [reference, *runs], detail, packing)
    names = distinct_names([target.path for target in character.targets])
    errors = result.before.position_errors[result.before.motion.judged]
    return {
        "end": end,
        "count": count,
        "time": result.before.time_of_largest_error,
        "worst": int(np.argmax(errors.max(axis=0))) if errors.size else -1,
        "largest": float(errors.max(initial=0.0)),
        "targets": [names[target.path] for target in character.targets],
        "bodies": [body.path for body in character.bodies],
        "surfaces": surfaces,
        "reference": {
            "positions": _columns(packing, reference.positions, POSITION),
            "rotations": _columns(packing, _continuous(reference.rotations), ROTATION),
            "targets": _columns(packing, reference.target_positions, POSITION),
            "shapes": {str(body): _columns(packing, shapes[0], POSITION) for body, shapes in deflections.items()},
        },
        "runs": [
            {
                "positions": _columns(packing, run.positions - reference.positions, POSITION),
                "rotations": _columns(packing, _turned(run.rotations, reference.rotations), ROTATION),
                "targets": _columns(packing, run.target_positions - reference.target_positions, POSITION),
                "shapes": {
                    str(body): _columns(packing, shapes[number], POSITION) for body, shapes in deflections.items()
                },
            }
            for number, run in enumerate(runs, start=1)
        ],
        **_view(character, result, reference, runs),
    }


def _view(character: Character, result: Result, reference: Motion, runs: list[Motion]) -> dict[str, Any]:
    """From where the scene is seen, the points that have to be in the picture, about their center, and the floor."""
    view = choose_viewpoint(character, result.skins, runs[0])
    cloud = framed(view, character, result.skins, runs)
    center = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    outermost = np.unique(np.argmax((cloud - center) @ DIRECTIONS.T, axis=0))
    return {
        "center": center.tolist(),
        "radius": max(float(np.linalg.norm(cloud - center, axis=1).max()), 1e-3),
        "outermost": (cloud[outermost] - center).tolist(),
        "toward_eye": view.toward_eye.tolist(),
        "up": view.up.tolist(),
        # scenery has a floor of its own
        "floor": None if character.scenery else floor_below(prepare(character, result.skins), reference),
    }


def _columns(packing: Packing, values: Array, unit: float) -> dict[str, Any]:
    """An array of which each row is an instant, as one row for each number."""
    return packing.rounded(values.reshape(len(values), -1).T, unit)


def _continuous(rotations: Array) -> Array:
    """Quaternions of which each lies nearer to the one before than to its opposite; shape [f, b, 4]."""
    products = np.sum(rotations[1:] * rotations[:-1], axis=2)
    signs = np.cumprod(np.concatenate([np.ones((1, rotations.shape[1])), np.sign(products + 1e-12)]), axis=0)
    return np.asarray(rotations * signs[..., None])


def _turned(rotations: Array, reference: Array) -> Array:
    """Rotation vectors, world axes, that turn one pose into another [rad]; [f, b, 3]."""
    first, second = (Rotation.from_quat(q.reshape(-1, 4), scalar_first=True) for q in (rotations, reference))
    return np.asarray((first * second.inv()).as_rotvec()).reshape(*rotations.shape[:2], 3)


def _surfaces(
    character: Character, result: Result, motions: list[Motion], detail: Detail, packing: Packing
) -> tuple[list[dict[str, Any]], dict[int, list[Array]]]:
    """The drawn surfaces, and for each body that bends its coordinates in each motion, shape [f, k] [m]."""
    drawn = [(b, s, surface) for b, body in enumerate(character.bodies) for s, surface in enumerate(body.surfaces)]
    drawn += [(-1, 0, surface) for surface in character.scenery]
    drawn = [row for row in drawn if row[2].drawn]
    most = evenly([len(surface.triangles) for *_, surface in drawn], detail.triangles)
    bases = {b: _basis(result, b, motions) for b in {b for b, *_ in drawn if b >= 0}}
    entries = []
    for b, s, surface in drawn:
        modes = modes_of(result.skins[b], s) if b >= 0 else None
        basis = bases.get(b)
        fields = None if modes is None or basis is None else modes @ basis[1]
        entries.append({"body": b} | _surface(surface, fields, most, packing))
    return entries, {b: found[0] for b, found in bases.items() if found is not None}


def evenly(sizes: Sequence[int], total: int) -> int:
    """The size to which the larger ones are cut so that all are not more than `total`; small ones stay whole."""
    left = total
    for others, size in zip(range(len(sizes), 0, -1), sorted(sizes), strict=True):
        if size * others > left:
            return left // others
        left -= size
    return max(sizes, default=0)


def _basis(result: Result, body: int, motions: list[Motion]) -> tuple[list[Array], Array] | None:
    """The largest deflections of a body: their coordinates in each motion [m], and the elastic coordinates of each."""
    skin, size = result.skins[body], max(motion.elastic[body].shape[1] for motion in motions)
    if skin is None or not size:
        return None
    every = [u if u.shape[1] else np.zeros((len(u), size)) for u in (motion.elastic[body] for motion in motions)]
    fields = np.concatenate([modes.reshape(-1, size) for modes in skin.modes])
    weight = np.linalg.norm(fields, axis=0) / np.sqrt(max(len(fields), 1)) + 1e-30
    _, _, axes = np.linalg.svd(np.concatenate(every) * weight, full_matrices=False)
    directions = (axes[:SHAPES] / weight).T
    largest = np.maximum(np.abs(fields @ directions).max(axis=0, initial=0.0), 1e-30)
    directions /= largest  # then a coordinate is the largest displacement that it makes
    coordinates = [(u * weight) @ axes[:SHAPES].T * largest for u in every]
    kept = np.max([np.abs(rows).max(axis=0, initial=0.0) for rows in coordinates], axis=0) > SEEN
    return ([rows[:, kept] for rows in coordinates], directions[:, kept]) if kept.any() else None


def _surface(surface: SurfaceMesh, fields: Array | None, most: int, packing: Packing) -> dict[str, Any]:
    kept, triangles = thinned(surface.points, surface.triangles, most)
    copies, triangles, normals = split_at_creases(surface.points[kept], triangles)
    points, unit = surface.points[kept][copies], SURFACE * max(float(np.ptp(surface.points, axis=0).max()), 1e-6)
    entry = {
        "color": list(surface.color if surface.color is not None else DEFAULT_COLOR),
        "points": packing.rounded(points.T, unit),
        "normals": packing.rounded(normals.T, 1.0 / 127.0),
        "triangles": packing.rounded(triangles.ravel().astype(float), 1.0),
    }
    if fields is not None:
        entry["fields"] = packing.rounded(np.moveaxis(fields[kept][copies], 2, 0).reshape(fields.shape[2], -1), 1e-4)
    return entry


def thinned(points: Array, triangles: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """A surface for pictures with at most so many triangles: points of one cell of a grid become one of them.

    Source: Rossignac and Borrel 1993, Multi-resolution 3D approximations for rendering complex scenes.

    Returns:
        The points that are kept, shape [k], and triangles in terms of these, shape [t, 3].
    """
    kept, corners = np.unique(triangles, return_inverse=True)
    corners = corners.reshape(-1, 3)
    low, extent = points.min(axis=0), max(float(np.ptp(points, axis=0).max()), 1e-12)
    cells = float(np.sqrt(max(count, 4)))  # along the longest side; a surface has about as many triangles as cells²
    while len(corners) > max(count, 4):
        key = np.floor((points[kept] - low) / extent * cells).astype(int)
        _, first, cell = np.unique(key, axis=0, return_index=True, return_inverse=True)
        joined = cell.ravel()[corners]
        real = np.all(joined != np.roll(joined, 1, axis=1), axis=1)
        _, once = np.unique(np.sort(joined[real], axis=1), axis=0, return_index=True)
        if len(once) <= count or cells < 3.0:
            kept, corners = kept[first], joined[real][np.sort(once)]
            break
        cells *= 0.85
    return kept, corners.astype(np.int32)
