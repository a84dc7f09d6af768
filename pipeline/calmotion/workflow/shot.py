"""An opened shot: its file, the plugins that read it, and what they read."""

from __future__ import annotations

import copy
import os
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TypeVar

from calmotion.host import Host, Reuse, Settings, merge, open_host, read_assignment, read_settings_file
from calmotion.model import Animation, Character, Provenance
from calmotion.model.run import OutputPaths, Source
from calmotion.usd import stages
from calmotion.usd.writing.root import root_path
from calmotion.workflow.problems import problems_of, value_of

T = TypeVar("T")
_READ: tuple[type, ...] = (Character, Animation, Provenance)
Path = str | os.PathLike[str]
Given = Mapping[str, object] | Path | None
"""Settings of operators: `{"fe.mesh.element_size": "5mm"}`, `{"fe.mesh": {"element_size": 0.005}}`, or a TOML file."""


class Shot:
    """A shot of a character in USD.

    The file is read when a value of it is first used; `open_shot` reads at once.

    Args:
        path: USD file.
        motion: File with a motion that replaces the tracks of motors, such as a BVH file.
        plugins: Folders with more plugins.
        settings: Settings of operators for every run of this shot.

    Raises:
        SettingError: A folder holds no plugin, or the settings cannot be read.
    """

    def __init__(self, path: Path, motion: Path | None = None, plugins: Iterable[Path] = (), settings: Given = None):
        self._path = os.fspath(path)
        self._motion = None if motion is None else os.fspath(motion)
        self._folder = _working_folder()
        self.settings = read_settings(settings)
        self.settings_file = None if settings is None or isinstance(settings, Mapping) else os.fspath(settings)
        self.host: Host = open_host([os.fspath(folder) for folder in plugins])
        self._read: dict[type, object] = {}
        self.reuse: Reuse | None = None  # values of an earlier run for the next ones, see `watch.Watch`

    def __repr__(self) -> str:
        return f"Shot({self.path!r})"

    @property
    def path(self) -> str:
        """The USD file: as it was named, and absolute once the working folder is another."""
        return self._found(self._path)

    @property
    def motion(self) -> str | None:
        """The file with a motion, in the same way."""
        return None if self._motion is None else self._found(self._motion)

    def _found(self, path: str) -> str:
        return path if _working_folder() == self._folder else os.path.join(self._folder, path)

    @property
    def inputs(self) -> dict[str, str]:
        """Files that the user named to be read, by what they are."""
        named = {"the shot": self.path, "the motion": self.motion, "the settings": self.settings_file}
        return {what: path for what, path in named.items() if path is not None}

    @property
    def known(self) -> tuple[object, ...]:
        """The values that were read of it so far; empty before."""
        return tuple(self._read.values())

    def keep(self, data: Mapping[type, object]) -> None:
        """Keep what a run has read of it, so that the next one need not."""
        self._read |= {kind: data[kind] for kind in _READ if kind in data}

    def forget(self) -> None:
        """Forget what was read: the file has changed."""
        self._read = {}
        for name in ("character", "animation", "provenance"):
            self.__dict__.pop(name, None)

    def unread(self, path: Path | None = None) -> Shot:
        """The same shot, or another file in its place, with the same plugins and settings; nothing of it is read."""
        other = copy.copy(self)
        other.forget()
        if path is not None:
            other._path, other._folder = os.fspath(path), _working_folder()
        return other

    def read(self) -> Shot:
        """Read the file, if that has not happened; returns itself.

        Raises:
            ShotError: The shot cannot be processed; it names every problem that was found (`errors` of a `ShotErrors`).
        """
        if not self._read:
            given = (Source(self.path, "simulate", motion=self.motion), OutputPaths())
            run = self.host.run(given, _READ, settings=self.settings).finish()
            problems = problems_of(run, _READ)
            for kind in _READ:
                value_of(run, kind, problems)
            self.keep(run.data)
        return self

    def _value(self, kind: type[T]) -> T:
        value = self.read()._read[kind]
        assert isinstance(value, kind)
        return value

    @cached_property
    def character(self) -> Character:
        """Bodies, joints, motors and targets, SI units."""
        return self._value(Character)

    @cached_property
    def animation(self) -> Animation:
        """The tracks of the motors, SI units, times in seconds after the first frame."""
        return self._value(Animation)

    @cached_property
    def provenance(self) -> Provenance:
        """Layers of the shot with their hashes, and units of its stage."""
        return self._value(Provenance)

    @property
    def targets(self) -> tuple[str, ...]:
        """Prim paths of the targets."""
        return tuple(target.path for target in self.character.targets)

    @property
    def motors(self) -> tuple[str, ...]:
        """Prim paths of the motors' joints."""
        return tuple(motor.path for motor in self.character.motors)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader noticed, as sentences."""
        return tuple(self.character.notes)


def _working_folder() -> str:
    """The working folder; empty where it was removed."""
    try:
        return os.getcwd()
    except FileNotFoundError:
        return ""


def open_shot(path: Path, *, motion: Path | None = None, plugins: Sequence[Path] = (), settings: Given = None) -> Shot:
    """Read and check a shot.

    Args:
        path: USD file.
        motion: File with a motion that replaces the tracks of motors, such as a BVH file.
        plugins: Folders with more plugins.
        settings: Settings of operators for every run of this shot: `{"fe.mesh.element_size": "5mm"}`, a mapping for
            each operator, or a TOML file.

    Raises:
        ShotError: The shot cannot be processed; every problem is named with prim path, attribute and remedy.
        SettingError: A folder holds no plugin, or a setting does not fit.
    """
    return Shot(path, motion, plugins, settings).read()


def read_settings(given: Given) -> Settings:
    """Settings in any of their forms, as a table for each operator.

    Raises:
        SettingError: A file cannot be read, or a name is not `<operator>.<property>`.
    """
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        return read_settings_file(os.fspath(given))
    tables: list[Settings] = []
    for name, value in given.items():
        if isinstance(value, Mapping):
            tables.append({name: dict(value)})
            continue
        ((operator, properties),) = read_assignment(f"{name}=").items()
        tables.append({operator: dict.fromkeys(properties, value)})
    return merge(tables)


def with_shot(path: str) -> str:
    """A USD file with the shot in it: of a layer of results, the root layer beside it."""
    if os.path.isfile(path) and stages.role_of(stages.open_layer(path)) in stages.RESULTS:
        root = root_path(path)
        if os.path.isfile(root):
            return root
    return path
