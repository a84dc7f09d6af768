"""Full models of flexible bodies, kept for who reduces the same ones again; links that are copies have one.

What does not depend on the loads or the tolerance is most of a small body's reduction: elements, factors and normal
modes.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

from calmotion.mesh.patches.interface_patches import AttachmentFrame
from calmotion.model.character import Body
from calmotion.model.meshes import FEMesh
from calmotion.reduction.cache import cache_key
from calmotion.reduction.reduce import FullBody
from calmotion.support.operating_system import return_freed_memory

_KEPT = 90_000_000  # numbers in factors of full models, 0.7 GB
_MEANWHILE = 60_000_000  # of those while another one is made
_HANDED_ON = 20_000_000  # of those from a mesher to the reduction, while it makes others
_AT_ONCE = 40_000  # nodes of full models that are worked on at the same time: some gigabyte


@dataclass(frozen=True, eq=False)
class Member:
    """What a full model is made of; arguments of `full_body`."""

    mesh: FEMesh
    body: Body
    attachments: Sequence[AttachmentFrame]
    root: int

    @cached_property
    def key(self) -> str:
        """Hash of what decides the model: elements, material, mass and interfaces, and no prim path.

        A factor of its stiffness needs no factorisation of its own.
        """
        settings, mass, mesh = self.body.flexible, self.body.mass, self.mesh
        assert settings is not None
        frames = [
            (own.frame, own.kind, None if own.surface is None else own.surface.triangles) for own in self.attachments
        ]
        material = (replace(settings.material, path=""), None if mass is None else mass.mass)
        held = (mesh.patches, settings.interface_radius, frames, self.root)
        return cache_key((mesh.points, mesh.tets, material, held))


class _HandedOn:
    """Full models of meshes that were just made, for the reduction that follows; any thread may call."""

    def __init__(self) -> None:
        self._models: dict[str, FullBody] = {}
        self._lock = threading.Lock()

    def put(self, key: str, model: FullBody) -> None:
        """Keep a model where there is room for it."""
        with self._lock:
            if model.entries + _entries(self._models) <= _KEPT:
                self._models[key] = model

    def make_room(self) -> None:
        """Free the largest ones, before another one is made."""
        with self._lock:
            _without_largest(self._models, _HANDED_ON)

    def take(self, key: str) -> FullBody | None:
        """The model of a key, which is kept no longer."""
        with self._lock:
            return self._models.pop(key, None)

    def clear(self) -> None:
        """Free those that nobody took."""
        with self._lock:
            self._models.clear()


def _entries(models: dict[str, FullBody]) -> int:
    return sum(model.entries for model in models.values())


def _without_largest(models: dict[str, FullBody], most: int) -> None:
    """Free the largest models until the others have no more numbers in their factors than that."""
    for key in sorted(models, key=lambda own: models[own].entries, reverse=True):
        if _entries(models) <= most:
            return
        del models[key]


handed_on = _HandedOn()


class _Room:
    """Lets work on large models wait for that of other threads, so that not all of them are in memory at once."""

    def __init__(self, nodes: int):
        self._most, self._taken, self._changed = nodes, 0, threading.Condition()

    @contextmanager
    def of(self, nodes: int) -> Iterator[None]:
        """Context of work on a model of so many nodes; one that is larger than the room has it alone."""
        with self._changed:
            self._changed.wait_for(lambda: not self._taken or self._taken + nodes <= self._most)
            self._taken += nodes
        try:
            yield
        finally:
            return_freed_memory()
            with self._changed:
                self._taken -= nodes
                self._changed.notify_all()


room = _Room(_AT_ONCE)


class FullModels:
    """Full models by what they are made of; any thread may call.

    Args:
        keeps: Whether to keep every model that has room; otherwise those that another body needs as well.
    """

    def __init__(self, keeps: bool):
        self._keeps = keeps
        self._models: dict[str, FullBody] = {}
        self._wanted: dict[str, int] = {}
        self._making: dict[str, threading.Lock] = {}
        self._lock = threading.Lock()

    def expect(self, members: Iterable[Member]) -> None:
        """Announce bodies; a model is kept until the last body that needs it has it."""
        for member in members:
            self._wanted[member.key] = self._wanted.get(member.key, 0) + 1

    def of(self, member: Member) -> FullBody:
        """The model of a body, made at the first call.

        Raises:
            ShotError: As `full_body`.
        """
        # finite elements are loaded for none that is in the cache
        from calmotion.reduction.reduce import full_body

        key = member.key
        with self._lock:
            making = self._making.setdefault(key, threading.Lock())
        with making:  # others that need it wait for it
            found = self._models.get(key) or handed_on.take(key)
            if found is None:
                with self._lock:
                    _without_largest(self._models, _MEANWHILE)
                quality = replace(member.mesh.quality, stiffness_factor=1.0)
                mesh = replace(member.mesh, quality=quality)
                found = full_body(mesh, member.body, member.attachments, member.root)
                found.factorize()  # here, where no other model waits
            with self._lock:
                self._wanted[key] = self._wanted.get(key, 0) - 1
                if self._keeps or self._wanted[key] > 0:
                    self._keep(key, found)
                else:
                    self._models.pop(key, None)
        factor = member.mesh.quality.stiffness_factor
        return found if factor == 1.0 else found.scaled(factor)

    def hand_on(self, member: Member) -> None:
        """Leave the model of a body to the reduction, if it is kept here."""
        found = self._models.pop(member.key, None)
        if found is not None:
            handed_on.put(member.key, found)

    def only(self, members: Iterable[Member]) -> FullModels:
        """The models of some bodies, as far as they are kept here."""
        result = FullModels(self._keeps)
        keys = {member.key for member in members}
        result._models = {key: model for key, model in self._models.items() if key in keys}
        return result

    def _keep(self, key: str, model: FullBody) -> None:
        taken = sum(own.entries for own in self._models.values() if own is not model)
        if taken + model.entries <= _KEPT:
            self._models[key] = model
