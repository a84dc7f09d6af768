"""Formats of `calmotion export` for programs of animation: Bezier keyframes as JSON, BVH, glTF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from calmotion.host import Property, PropertyValues

from ..command_format import CommandFormat
from ..commands import Commands, MotorCurves


class Keyframes(CommandFormat):
    """Cubic Bezier keyframes of the motors as plain JSON; the rate is that of the keyframes."""

    idname = "export.keyframes"
    label = "Write keyframes"
    format = "keyframes"
    suffix = ".json"
    properties: ClassVar[tuple[Property, ...]] = (
        Property("digits", int, 9, minimum=1, maximum=17, description="Significant digits of the values"),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """Keyframes with the slopes of the curves."""
        from ..sampling import bezier_commands

        return bezier_commands(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write the keyframes."""
        from .keyframes import write_keyframes

        write_keyframes(file, commands, curves, properties.digits)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read the keyframes."""
        from .keyframes import read_keyframes

        return read_keyframes(files[0], curves)


class BvhFile(CommandFormat):
    """The rigid robot as a skeleton in a BVH file, y up; players interpolate its channels by lines."""

    idname = "export.bvh"
    label = "Write a BVH motion"
    format = "bvh"
    suffix = ".bvh"
    properties: ClassVar[tuple[Property, ...]] = (
        Property("unit", float, 0.01, unit="m", minimum=1e-9, description="Length of the file's unit"),
        Property("digits", int, 6, minimum=1, maximum=12, description="Digits after the point"),
    )

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """The frames."""
        from .bvh import exact_frames

        return exact_frames(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write skeleton and motion."""
        from .bvh import write_bvh

        write_bvh(file, curves, rate, properties.unit, properties.digits)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read what the motors do."""
        from .bvh import read_bvh

        return read_bvh(files[0], curves, properties.unit)


class GltfFile(CommandFormat):
    """The rigid robot with its geometry and an animation of its joints, in a binary glTF 2.0 file."""

    idname = "export.gltf"
    label = "Write a glTF animation"
    format = "gltf"
    suffix = ".glb"

    def sampled(self, curves: MotorCurves, rate: float, properties: PropertyValues) -> Commands:
        """The keyframes."""
        from .bvh import exact_frames

        return exact_frames(curves, rate)

    def write(
        self, file: str, commands: Commands, curves: MotorCurves, rate: float, properties: PropertyValues
    ) -> tuple[str, ...]:
        """Write bodies and motion."""
        from .gltf import write_gltf

        write_gltf(file, curves, rate)
        return (file,)

    def read(self, files: Sequence[str], curves: MotorCurves, properties: PropertyValues) -> Commands:
        """Read what the motors do."""
        from .gltf import read_gltf

        return read_gltf(files[0], curves)
