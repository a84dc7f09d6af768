"""glTF 2.0 files (.glb): the bodies as a hierarchy of nodes with meshes, and an animation of their joints."""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from calmotion.arrays import Array, IntArray
from calmotion.errors import ShotError
from calmotion.host import PropertyValues
from calmotion.model import SurfaceMesh
from calmotion.support import distinct_names, replaced
from calmotion.version import __version__

from ..command_format import CommandFormat
from ..commands import LINEAR, Commands, MotorCurves, instants

if TYPE_CHECKING:
    from .body_poses import LocalPoses

_FLOAT, _UINT = 5126, 5125
_MAGIC, _JSON, _BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
_GREY = (0.55, 0.55, 0.57)
_MOVES = 1e-9  # what a node that has no animation may move [m], or its quaternion [-]


class GltfFile(CommandFormat):
    """The rigid robot with its geometry and an animation of its joints, in a binary glTF 2.0 file."""

    idname = "export.gltf"
    label = "Write a glTF animation"
    format = "gltf"
    suffix = ".glb"

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """The keyframes."""
        times = instants(curves, rate, fixed_period=True)
        return Commands(LINEAR, times, curves.at(times))

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write bodies and motion."""
        write_gltf(file, curves, rate)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read what the motors do."""
        return read_gltf(files[0], curves)


class _Buffer:
    """The binary part of a file, and what describes it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, int]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: Array | IntArray, kind: str, *, bounds: bool = False, target: int | None = None) -> int:
        """Append an array of shape [n] or [n, k]; the index of its accessor."""
        integer = values.dtype.kind in "ui"
        stored = np.ascontiguousarray(values, np.uint32 if integer else np.float32)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": stored.nbytes}
        self.views.append(view if target is None else view | {"target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": _UINT if integer else _FLOAT,
            "count": len(stored),
            "type": kind,
        }
        if bounds:
            rows = stored.reshape(len(stored), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        self.data += stored.tobytes()
        return len(self.accessors) - 1


def write_gltf(file: str, curves: MotorCurves, rate: float) -> None:
    """Write the bodies and their motion, atomically.

    Args:
        file: File to write.
        curves: Of the motors.
        rate: Keyframes a second [Hz].

    Raises:
        OSError: It cannot be written.
        ShotError: The motors do not determine the motion.
    """
    from .body_poses import body_tree, local_poses, upward

    bodies = body_tree(curves)
    poses = local_poses(bodies, curves, rate)
    buffer = _Buffer()
    nodes: list[dict[str, Any]] = []
    meshes: list[dict[str, Any]] = []
    materials: dict[tuple[float, float, float], int] = {}
    up = upward(bodies.character).as_quat().tolist()
    root: dict[str, Any] = {"name": curves.shot, "rotation": up, "children": []}
    nodes.append(root)
    paths = [body.path for body in bodies.bodies]
    short = distinct_names(paths)
    driven = {motor.joint: motor for motor in curves.motors}
    names = {motor.path: name for motor, name in zip(curves.motors, curves.names, strict=True)}
    for k, path in enumerate(paths):
        node: dict[str, Any] = {"name": short[path], "children": [], "extras": {"path": path}}
        node |= {"translation": poses.translations[0, k].tolist(), "rotation": _xyzw(poses.rotations[0, k]).tolist()}
        motor = driven.get(bodies.tree.joint[k])
        if motor is not None:
            node["extras"] |= {"joint": names[motor.path], "jointPath": motor.path}
        nodes.append(node)
        nodes[_node(bodies.tree.parent[k])]["children"].append(_node(k))
    for k, body in enumerate(bodies.bodies):
        for surface in (one for one in body.surfaces if one.drawn):
            at = (-bodies.pivots[k]).tolist()
            nodes[_node(k)]["children"].append(len(nodes))
            nodes.append({"name": surface.path.rsplit("/", 1)[-1], "mesh": len(meshes), "translation": at})
            meshes.append(_mesh(buffer, surface, materials))
    for surface in (one for one in bodies.character.scenery if one.drawn):
        root["children"].append(len(nodes))
        nodes.append({"name": surface.path.rsplit("/", 1)[-1], "mesh": len(meshes)})
        meshes.append(_mesh(buffer, surface, materials))
    for node in nodes:
        if node.get("children") == []:
            del node["children"]
    content = {
        "asset": {"version": "2.0", "generator": f"Calmotion {__version__}"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(color) for color in materials],
        "animations": [_animation(buffer, poses)],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    _write(file, {key: value for key, value in content.items() if value}, bytes(buffer.data))


def read_gltf(file: str, curves: MotorCurves) -> Commands:
    """Read the motion of the motors: a player interpolates rotations along great circles, which are lines of a hinge.

    Raises:
        ShotError: The file holds another robot.
    """
    from .body_poses import LocalPoses, body_tree, motor_values, near_turn

    bodies = body_tree(curves)
    content, data = _read(file)
    by_path = {node.get("extras", {}).get("path"): index for index, node in enumerate(content["nodes"])}
    animation = content["animations"][0]
    times = _values(content, data, animation["samplers"][0]["input"])
    count = len(bodies.bodies)
    translations, rotations = np.zeros((len(times), count, 3)), np.zeros((len(times), count, 4))
    for k, body in enumerate(bodies.bodies):
        if body.path not in by_path:
            raise ShotError("this file does not hold this robot", path=file, found=f"no node of {body.path}")
        node = content["nodes"][by_path[body.path]]
        translations[:, k], rotations[:, k] = node["translation"], _wxyz(np.array(node["rotation"]))
    component = {by_path[body.path]: k for k, body in enumerate(bodies.bodies)}
    for channel in animation["channels"]:
        sampler, target = animation["samplers"][channel["sampler"]], channel["target"]
        values = _values(content, data, sampler["output"])
        k = component[target["node"]]
        if target["path"] == "translation":
            translations[:, k] = values
        else:
            rotations[:, k] = _wxyz(values)
    found = motor_values(bodies, LocalPoses(times, translations, rotations))
    return Commands(LINEAR, times, near_turn(found, curves))


def _node(component: int) -> int:
    """Index of the node of a component; the first node carries those at the world."""
    return component + 1


def _mesh(buffer: _Buffer, surface: SurfaceMesh, materials: dict[tuple[float, float, float], int]) -> dict[str, Any]:
    color = surface.color or _GREY
    material = materials.setdefault(color, len(materials))
    position = buffer.add(surface.points, "VEC3", bounds=True, target=34962)
    indices = buffer.add(surface.triangles.ravel(), "SCALAR", target=34963)
    primitive = {"attributes": {"POSITION": position}, "indices": indices, "material": material}
    return {"name": surface.path, "primitives": [primitive]}


def _material(color: tuple[float, float, float]) -> dict[str, Any]:
    # surfaces of robots are often open or inverted
    shading = {"baseColorFactor": [*map(float, color), 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"pbrMetallicRoughness": shading, "doubleSided": True}


def _animation(buffer: _Buffer, poses: LocalPoses) -> dict[str, Any]:
    """Channels of the nodes that move; of one at least, since an animation must have some."""
    time = buffer.add(poses.times, "SCALAR", bounds=True)
    samplers: list[dict[str, Any]] = []
    channels: list[dict[str, Any]] = []
    for k in range(poses.translations.shape[1]):
        moves = ("translation", "VEC3", poses.translations[:, k])
        turns = ("rotation", "VEC4", _xyzw(poses.rotations[:, k]))
        for path, kind, values in (moves, turns):
            last = k == poses.translations.shape[1] - 1 and path == "rotation" and not channels
            if np.ptp(values, axis=0).max() > _MOVES or last:
                channels.append({"sampler": len(samplers), "target": {"node": _node(k), "path": path}})
                samplers.append({"input": time, "output": buffer.add(values, kind), "interpolation": "LINEAR"})
    return {"name": "Calmotion", "samplers": samplers, "channels": channels}


def _write(file: str, content: dict[str, Any], data: bytes) -> None:
    text = json.dumps(content, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    total = 12 + 8 + len(text) + 8 + len(data)
    with replaced(file) as temporary, open(temporary, "wb") as stream:
        stream.write(struct.pack("<III", _MAGIC, 2, total))
        stream.write(struct.pack("<II", len(text), _JSON) + text)
        stream.write(struct.pack("<II", len(data), _BINARY) + data)


def _read(file: str) -> tuple[dict[str, Any], bytes]:
    with open(file, "rb") as stream:
        raw = stream.read()
    magic, version, total = struct.unpack_from("<III", raw)
    if magic != _MAGIC or version != 2 or total != len(raw):
        raise ShotError("this is no glTF 2.0 file", path=file)
    size, _ = struct.unpack_from("<II", raw, 12)
    return json.loads(raw[20 : 20 + size]), raw[28 + size :]


def _values(content: dict[str, Any], data: bytes, accessor: int) -> Array:
    """The numbers of an accessor of floats, shape [n] or [n, k]."""
    described = content["accessors"][accessor]
    view = content["bufferViews"][described["bufferView"]]
    columns = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[described["type"]]
    start = view.get("byteOffset", 0) + described.get("byteOffset", 0)
    numbers = np.frombuffer(data, "<f4", described["count"] * columns, start).astype(np.float64)
    return numbers if columns == 1 else numbers.reshape(-1, columns)


def _xyzw(quaternions: Array) -> Array:
    return np.roll(quaternions, -1, axis=-1)


def _wxyz(quaternions: Array) -> Array:
    return np.roll(quaternions, 1, axis=-1)
