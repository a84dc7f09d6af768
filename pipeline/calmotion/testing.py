"""For authors of plugins: a host with only their plugin, a small shot, and a check of the rules."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from calmotion.arrays import Array, IntArray
from calmotion.host import Host, Plugin, PluginError, PluginState, Settings
from calmotion.host.discovery import Location, PluginCommand
from calmotion.host.manifest import FILE_NAME
from calmotion.model import (
    WORLD,
    Animation,
    Body,
    Character,
    ElasticMaterial,
    FlexibleSettings,
    Frame,
    Joint,
    MassProperties,
    Motor,
    SurfaceMesh,
    Target,
    TetGeometry,
    Track,
)

LENGTH, WIDTH, DENSITY = 0.4, 0.04, 1200.0


def host_with(*folders: str | Path) -> Host:
    """A host with only the plugins in these folders.

    Raises:
        PluginError: When one of them does not register; its own exception is the cause.
    """
    host = Host()
    for folder in folders:
        plugin = host.add(Location(Path(folder).resolve(), "test"))
        host.load(plugin)
        if _has_failed(plugin):
            raise PluginError(f"the plugin {plugin.id} failed: {plugin.error}") from plugin.error
    return host


def run_operator(
    host: Host, idname: str, values: Iterable[object], settings: Settings | None = None
) -> tuple[object, ...]:
    """Run one operator on given values.

    Args:
        host: A host with the operator's plugin.
        idname: The operator.
        values: The values it requires, and those it may use.
        settings: Idname -> property -> value.

    Returns:
        The values it provides, in the order of `provides`.

    Raises:
        PluginError: When its poll refuses; the message is the reason.
        Exception: What it raises.
    """
    cls = host.operators[idname]
    # The operator alone: what it uses is given or absent, never made.
    run = Host.run(_only(host, idname), values, cls.provides, settings=settings).finish()
    result = run.results[-1]
    if result.error:
        raise result.error
    if not result.success:
        raise PluginError(result.reason)
    return tuple(run.data[kind] for kind in cls.provides)


def _only(host: Host, idname: str) -> Host:
    owner = host.plugin_of(idname)
    alone = Host()
    alone.plugins = [Plugin(owner.id, owner.location, owner.manifest, owner.state, operators=[host.operators[idname]])]
    return alone


def check_plugin(folder: str | Path) -> list[str]:
    """Check a plugin against the rules.

    Its manifest is valid, what it requires is installed, it registers well-formed operators under names of
    its own, `unregister` removes exactly those, and both can be called again; its commands can be called.

    Returns:
        What is wrong, one sentence each; empty when nothing is.
    """
    folder = Path(folder).resolve()
    if not (folder / FILE_NAME).is_file():
        return [f"the folder holds no {FILE_NAME}"]
    host = Host()
    plugin = host.add(Location(folder, "check"))
    problems: list[str] = []
    names: list[list[str]] = []
    for attempt in ("", " when it is called a second time"):
        host.load(plugin)
        if _has_failed(plugin):
            return [*problems, f"register fails{attempt}: {type(plugin.error).__name__}: {plugin.error}"]
        if not plugin.operators and not (plugin.manifest and plugin.manifest.commands):
            problems.append(f"register adds no operator{attempt}, and the manifest names no command")
        names.append([cls.idname for cls in plugin.operators])
        if not attempt:
            problems += _undocumented(plugin)
        forgotten = host.unload(plugin)
        if _has_failed(plugin):
            return [*problems, f"unregister fails{attempt}: {type(plugin.error).__name__}: {plugin.error}"]
        if forgotten:
            problems.append(f"unregister forgets{attempt}: {', '.join(cls.idname for cls in forgotten)}")
    if names[0] != names[-1]:
        problems.append("register adds other operators when it is called a second time")
    return problems + _faults_of_commands(plugin)


def _faults_of_commands(plugin: Plugin) -> list[str]:
    """What keeps the commands of a plugin from being called."""
    if plugin.manifest is None:
        return []
    problems = []
    for entry in plugin.manifest.commands:
        try:
            PluginCommand(entry, plugin.manifest, plugin.location).load()
        except PluginError as error:
            problems.append(str(error))
    return problems


def _has_failed(plugin: Plugin) -> bool:
    """Whether it failed by now: its state changes as the host loads and unloads it."""
    return plugin.state is PluginState.FAILED


def _undocumented(plugin: Plugin) -> list[str]:
    named = [(f"{cls.idname}.{declared.name}", declared) for cls in plugin.operators for declared in cls.properties]
    return [f"the property {name} has no description" for name, declared in named if not declared.description]


def small_shot(flexible: bool = False, frames: int = 25) -> tuple[Character, Animation]:
    """An arm of two beams that lies along x, turns about y, and swings down and back within a second.

    Args:
        flexible: The outer beam bends; it then carries its own tetrahedra.
        frames: Number of frames, 24 a second.

    Returns:
        The character (gravity along -z), and its animation.
    """
    links = [_link("/Arm/Upper", 0.0, False), _link("/Arm/Fore", LENGTH, flexible)]
    # A quarter turn about x takes z, the joint's axis, to y.
    about_y = np.array([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0])
    root, tip = np.zeros(3), np.array([LENGTH, 0.0, 0.0])
    joints = (
        Joint("/Arm/Shoulder", "revolute", WORLD, 0, Frame(root, about_y), Frame(root, about_y)),
        Joint("/Arm/Elbow", "revolute", 0, 1, Frame(tip, about_y), Frame(root, about_y), -2.0, 2.0),
    )
    attribute = "drive:angular:physics:targetPosition"
    character = Character(
        path="/Arm",
        bodies=tuple(links),
        joints=joints,
        motors=tuple(Motor(index, joint.path, attribute) for index, joint in enumerate(joints)),
        targets=(Target("/Arm/Fore/Tip", 1, Frame(tip, np.array([1.0, 0.0, 0.0, 0.0]))),),
        gravity=np.array([0.0, 0.0, -9.81]),
    )
    times = np.arange(frames) / 24.0
    swing = 0.25 * (1.0 - np.cos(2.0 * np.pi * times))
    tracks = (Track(times, swing), Track(times, -0.5 * swing))
    return character, Animation(frame_times=times, tracks=tracks, current=tracks)


def _link(path: str, offset: float, flexible: bool) -> Body:
    points, tets, triangles = beam()
    mass = DENSITY * LENGTH * WIDTH**2
    inertia = mass / 12.0 * np.diag([2.0 * WIDTH**2, LENGTH**2 + WIDTH**2, LENGTH**2 + WIDTH**2])
    material = ElasticMaterial("/Arm/Materials/Plastic", 2.0e9, 0.35, DENSITY)
    return Body(
        path=path,
        rest=Frame(np.array([offset, 0.0, 0.0]), np.array([1.0, 0.0, 0.0, 0.0])),
        mass=None if flexible else MassProperties(mass, np.array([LENGTH / 2.0, 0.0, 0.0]), inertia),
        surfaces=(SurfaceMesh(f"{path}/Skin", points, triangles, displaced=len(points)),),
        tets=TetGeometry(f"{path}/Tets", points, tets) if flexible else None,
        flexible=FlexibleSettings(material) if flexible else None,
    )


def beam(cells: tuple[int, int, int] = (10, 2, 2)) -> tuple[Array, IntArray, IntArray]:
    """A beam along x whose axis starts at the origin, six tetrahedra a cell.

    Args:
        cells: Number of cells along x, y and z.

    Returns:
        Points [m], shape [n, 3]; tetrahedra with positive volumes, shape [m, 4]; the triangles of its surface,
        outward, shape [k, 3].
    """
    nx, ny, nz = cells
    axes = [np.linspace(0.0, LENGTH, nx + 1), *(np.linspace(-WIDTH / 2, WIDTH / 2, n + 1) for n in (ny, nz))]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(points)).reshape(nx + 1, ny + 1, nz + 1)
    tets = []
    # Kuhn's division: one tetrahedron for each order of the axes, along the cell's diagonal; neighbours match.
    for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        corners = np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
        tets.append(np.stack([numbers[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners], axis=1))
    cells_of = np.concatenate(tets)
    a, b, c, d = (points[cells_of[:, i]] for i in range(4))
    flipped = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) < 0.0
    cells_of[flipped] = cells_of[flipped][:, [0, 2, 1, 3]]
    faces = np.concatenate([cells_of[:, face] for face in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])])
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    return points, cells_of.astype(np.int32), faces[first[count == 1]].astype(np.int32)
