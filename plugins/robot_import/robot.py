"""`calmotion import`: a robot's URDF, MJCF or USD file becomes a shot."""

import os
import shutil
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from calmotion.catalogs import Material, known_materials, material_named
from calmotion.errors import ShotError
from calmotion.host import Host, SettingError, has_no_unit, open_host, parse_quantity
from calmotion.model import Animation, Character, MotorTracks, Provenance, Source
from calmotion.support import try_writing
from calmotion.usd import EXTENSIONS, read_shot, refuse_input_as_output, relative_asset, write_layer
from calmotion.version import __version__
from calmotion.workflow import Given, Path, plain, problems_of, read_settings, value_of

from .converters import BrokenMeshes, compiled_values, convert, converter_python, temporary_folder
from .description.descriptions import USD, Description, read_description, repaired
from .masses import too_heavy
from .options import FlexibleLinks, RobotOptions
from .robot_layer import robot_layer

FRAMES_PER_SECOND = 60.0
_UNIFORM = (10.0, 240.0)  # rates of motions that become the rate of the frames [Hz]
_MARKER = "made_by_calmotion_import"


@dataclass(frozen=True, eq=False)
class ImportedRobot:
    """A robot that was imported.

    Attributes:
        layer: The shot, which opens the converted robot and adds motors, motion, flexible links and targets.
        folder: Folder beside it with the converted robot; empty where the robot is USD, which is opened where it is.
        character: What was read of it again.
        animation: Its motion; of one frame where none was given.
        notes: What the user should know, as sentences.
        names: Of prims whose names USD does not allow, to those in the robot's file.
    """

    layer: str
    folder: str
    character: Character
    animation: Animation
    notes: tuple[str, ...]
    names: Mapping[str, str] = field(default_factory=dict)

    def report(self) -> dict[str, Any]:
        """The object that `--json` prints."""
        character, frames = self.character, self.animation.frame_times
        report: dict[str, Any] = plain(
            {
                "command": "import",
                "version": __version__,
                "layer": self.layer,
                "folder": self.folder,
                "robot": character.path,
                "bodies": sum(not body.between for body in character.bodies),
                "flexible": [body.path for body in character.bodies if body.flexible is not None],
                "mass_kg": sum(body.mass.mass for body in character.bodies if body.mass is not None),
                "mass_of_material": [body.path for body in character.bodies if body.flexible and body.mass is None],
                "joints": len(character.joints),
                "motors": [motor.path for motor in character.motors],
                "targets": [target.path for target in character.targets],
                "frames": len(frames),
                "duration_s": float(frames[-1]),
                "notes": self.notes,
                "written_names": dict(self.names),
            }
        )
        return report


# parameters: one for each option of the command, all but the robot by keyword
def import_robot(
    robot: Path,
    *,
    layer: Path,
    motion: Path | None = None,
    flexible: Sequence[str] = (),
    targets: Sequence[str] = (),
    solid: str | None = None,
    motors: Sequence[str] = (),
    packages: Mapping[str, Path] | None = None,
    material_files: Sequence[Path] = (),
    converters: Path | None = None,
    plugins: Sequence[Path] = (),
    settings: Given = None,
    tell: Callable[[str], None] = lambda text: None,
) -> ImportedRobot:
    """Make a shot of a robot's URDF, MJCF or USD file.

    Args:
        robot: A .urdf file, an .xml file of MuJoCo, or a USD file whose joints have no motors, or others than wanted.
        layer: USD layer to write; the converted robot goes into a folder beside it.
        motion: CSV, NPZ or BVH file with a motion of its joints.
        flexible: Links that bend, as `PATTERN=MATERIAL` or `PATTERN=MATERIAL,THICKNESS` (`"*forearm*=abs,3mm"`).
        targets: Patterns of names of links or frames that are targets; none: the outermost points of the robot.
        solid: Material from whose density links without inertia get their mass.
        motors: Patterns of names of joints that motors drive, `all` for all of them; none: those that actuators or
            drives of the file move, else all of them.
        packages: Folders of ROS packages by name.
        material_files: TOML files with more materials.
        converters: Environment that has the converters; None: one of our own is made.
        plugins: Folders with more plugins.
        settings: Settings of operators, such as those that read the motion.
        tell: Told what takes long.

    Raises:
        ShotError: The robot cannot be imported; with what to change.
        SettingError: An argument does not fit.
    """
    target = os.fspath(layer)
    _refuse_wrong_output(target)
    host = open_host([os.fspath(p) for p in plugins])
    host.properties(read_settings(settings))  # wrong names are refused, also where no operator runs
    known = known_materials(material_files)
    links = tuple(flexible_links(text, known) for text in flexible)
    named = {name: os.fspath(folder) for name, folder in (packages or {}).items()}
    is_usd = os.path.splitext(os.fspath(robot))[1].lower() in (*EXTENSIONS, ".usdz")
    description = Description(os.fspath(robot), USD) if is_usd else read_description(os.fspath(robot), named)
    tracks, told = _motion(host, motion, settings) if motion is not None else (None, ())
    material = None if solid is None else material_named(solid, known)[1]
    rate = None if is_usd and tracks is None else frames_per_second(tracks)
    options = RobotOptions(description, links, tuple(targets), material, tracks, rate, tuple(motors))
    if is_usd:
        made = _over_usd(target, options)
    else:
        python = converter_python(None if converters is None else os.fspath(converters), tell)
        made = _Import(target, options).made(python)
    return replace(made, notes=(*told, *made.notes))


def flexible_links(text: str, known: Mapping[str, Material]) -> FlexibleLinks:
    """Links that bend, from `PATTERN=MATERIAL` or `PATTERN=MATERIAL,THICKNESS`.

    Raises:
        SettingError: The text has another form.
        ShotError: There is no such material.
    """
    pattern, equals, rest = text.partition("=")
    material, _, thickness = rest.partition(",")
    if not equals or not pattern.strip() or not material.strip():
        raise SettingError(
            "flexible links are named as PATTERN=MATERIAL or PATTERN=MATERIAL,THICKNESS",
            path="--flexible",
            found=text,
            remedy='Write for example "*forearm*=abs,3mm"; `calmotion materials` lists the materials.',
        )
    wall = parse_quantity(thickness.strip(), "m") if thickness.strip() else None
    if has_no_unit(thickness):
        number = thickness.strip()
        raise SettingError(
            "this thickness has no unit", path="--flexible", found=text, remedy=f"Write {number}mm or {number}m."
        )
    if wall is not None and not 0.0 < wall < 1.0:
        raise SettingError(
            "the thickness of a wall must be above 0 and below 1 m",
            path="--flexible",
            found=text,
            remedy="Write a thickness such as 3mm, or leave it out for a solid link.",
        )
    name, found = material_named(material, known)
    return FlexibleLinks(pattern.strip(), name, found, wall)


def frames_per_second(motion: MotorTracks | None) -> float:
    """Frames a second of a shot with a motion: those of the motion where they are even, else 60."""
    if motion is None or len(motion.times) < 2:
        return FRAMES_PER_SECOND
    steps = np.diff(motion.times)
    rate = 1.0 / float(np.mean(steps))
    # printed times are rounded
    if np.ptp(steps) > 2e-3 * np.mean(steps) + 2e-6 or not _UNIFORM[0] <= rate <= _UNIFORM[1]:
        return FRAMES_PER_SECOND
    return float(round(rate)) if abs(rate - round(rate)) < 1e-3 * rate else rate


def _motion(host: Host, path: Path, settings: Given) -> tuple[MotorTracks, tuple[str, ...]]:
    """A motion, and what its reader tells."""
    run = host.run([Source("", "import", motion=os.fspath(path))], [MotorTracks], settings=read_settings(settings))
    run.finish()
    problems = problems_of(run, [MotorTracks])
    if run.get(MotorTracks) is None and not run.failures():
        raise SettingError(
            "no plugin reads this motion", path="--motion", found=path, remedy="Name a .csv, .npz or .bvh file."
        )
    told = tuple(record.text for result in run.results for record in result.records)
    return value_of(run, MotorTracks, problems), told


def _over_usd(layer: str, options: RobotOptions) -> ImportedRobot:
    """A layer over a robot that is USD, which stays where it is."""
    robot = options.robot.path
    refuse_input_as_output(layer, [robot])
    made, notes = robot_layer(robot, relative_asset(robot, os.path.dirname(os.path.realpath(layer))), options)
    read: list[tuple[Character, Animation, Provenance]] = []
    write_layer(made, layer, lambda path: read.append(read_shot(path, still=True)))
    character, animation, provenance = read[0]
    told = (*notes, *_doubts(character), *character.notes)
    return ImportedRobot(layer, "", character, animation, told, provenance.names)


class _Import:
    """Writes one shot: everything is made in a temporary folder beside it, and moved to its place at the end."""

    def __init__(self, layer: str, options: RobotOptions) -> None:
        self._description, self._layer, self._options = options.robot, layer, options
        self._folder = f"{os.path.splitext(layer)[0]}_robot"

    def made(self, python: str) -> ImportedRobot:
        self._refuse_foreign_folder()
        with temporary_folder(self._layer) as work:
            parts = os.path.join(work, os.path.basename(self._folder))
            converted, warnings, changes, description = self._converted(work, parts, python)
            FilePath(parts, _MARKER).touch()
            asset = f"./{os.path.basename(parts)}/{os.path.basename(converted)}"
            options = self._options
            if options.mjcf:
                options = replace(options, compiled=compiled_values(description, python))
            layer, notes = robot_layer(converted, asset, options)
            layer.documentation = f"The robot of {os.path.basename(self._description.path)}, imported by Calmotion."
            draft = os.path.join(work, os.path.basename(self._layer))
            read: list[tuple[Character, Animation, Provenance]] = []
            write_layer(layer, draft, lambda path: read.append(read_shot(path, still=True)))
            self._move(parts, draft)
        character, animation, provenance = read[0]
        told = (*changes, *self._description.unread, *notes, *(f"converter: {text}" for text in warnings))
        told += (*_doubts(character), *character.notes)
        return ImportedRobot(self._layer, self._folder, character, animation, told, provenance.names)

    def _converted(
        self, work: str, parts: str, python: str
    ) -> tuple[str, tuple[str, ...], tuple[str, ...], Description]:
        """The converted robot, warnings of the converter, what was repaired for it, and what was converted."""
        description, changes = self._description, self._description.faults
        if changes:
            description = repaired(description, _folder(work, "repaired"))
        try:
            return *convert(description, parts, python), changes, description
        except BrokenMeshes as broken:
            shutil.rmtree(parts, ignore_errors=True)
            description = repaired(description, _folder(work, "cleaned"), broken.files)
            names = ", ".join(os.path.basename(file) for file in broken.files)
            changes += (f"meshes are converted without loose points, normals and divisions into parts: {names}",)
            return *convert(description, parts, python), changes, description

    def _move(self, parts: str, draft: str) -> None:
        """Put the converted robot and its layer in their places.

        No system moves a folder over another one: where the program is killed between the first two moves, the folder
        is missing until the next import.
        """
        former = os.path.join(os.path.dirname(draft), "former")
        try:
            with suppress(FileNotFoundError):  # the first import, or another one that runs at once has moved it
                os.rename(self._folder, former)
            os.rename(parts, self._folder)
            os.replace(draft, self._layer)
        except OSError as error:
            for source, target in ((self._folder, parts), (former, self._folder)):
                with suppress(OSError):  # it was not moved, or another import has made one
                    os.rename(source, target)
            raise ShotError(
                "the robot cannot be written", path=self._layer, found=error.strerror, remedy="Choose another output."
            ) from error

    def _refuse_foreign_folder(self) -> None:
        if os.path.lexists(self._folder) and not os.path.isfile(os.path.join(self._folder, _MARKER)):
            raise ShotError(
                "the folder of the converted robot is there already, and was not made by an import",
                path=self._folder,
                remedy="Choose another output, or move the folder.",
            )


def _doubts(character: Character) -> tuple[str, ...]:
    """What can hardly be meant, as sentences for the user."""
    return (*too_heavy(character), *immovable_joints(character))


def immovable_joints(character: Character) -> tuple[str, ...]:
    """A sentence for the user about motors that cannot move: a URDF joint whose limit has no range has that from 0 to
    0."""
    joints = (character.joints[motor.joint] for motor in character.motors)
    held = [joint.path for joint in joints if joint.lower == joint.upper]
    if not held:
        return ()
    which = f"{held[0]} and {len(held) - 1} more joints" if len(held) > 1 else held[0]
    return (f"{which} cannot move: lower and upper limit are the same; a joint without limits is `continuous` in URDF",)


def _folder(parent: str, name: str) -> str:
    path = os.path.join(parent, name)
    os.mkdir(path)
    return path


def _refuse_wrong_output(layer: str) -> None:
    if os.path.splitext(layer)[1].lower() not in EXTENSIONS:
        raise SettingError(
            "the output is not named like a USD layer",
            path="-o",
            found=layer,
            remedy="Name a .usda, .usdc or .usd file.",
        )
    try:
        try_writing(layer)
    except OSError as error:
        raise SettingError(
            "this output cannot be written", path="-o", found=f"{layer}: {error.strerror}", remedy="Choose another."
        ) from error
