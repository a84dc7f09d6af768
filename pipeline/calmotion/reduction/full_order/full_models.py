"""Full models of flexible bodies, kept for who reduces the same ones again; links that are alike have one.

What does not depend on the loads or the tolerance is most of a small body's reduction: elements, factors and normal
modes. A robot often has many links that are alike, and its left arm is mostly its right one, turned or mirrored.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from calmotion.model.character import Body
from calmotion.model.meshes import FEMesh
from calmotion.reduction.cache import cache_key

if TYPE_CHECKING:
    from calmotion.mesh.patches.interface_patches import AttachmentFrame
    from calmotion.reduction.reduce import FullBody

_KEPT = 60_000_000  # numbers in factors of full models, half a gigabyte


@dataclass(frozen=True, eq=False)
class Member:
    """What a full model is made of; arguments of `full_body`."""

    mesh: FEMesh
    body: Body
    attachments: Sequence[AttachmentFrame]
    root: int

    @cached_property
    def key(self) -> str:
        """Hash of what decides the model: elements, material, mass and interfaces, and no prim path."""
        frames = [
            (own.frame, own.kind, None if own.surface is None else own.surface.triangles) for own in self.attachments
        ]
        return cache_key((self.kind, self.mesh.points, self.mesh.tets, self.mesh.patches, frames, self.root))

    @cached_property
    def kind(self) -> str:
        """Hash that is equal for bodies that are alike but for a motion or a reflection, and for few others."""
        settings, mass = self.body.flexible, self.body.mass
        assert settings is not None
        material = replace(settings.material, path="")
        size = (len(self.mesh.points), len(self.mesh.tets), len(self.attachments), settings.interface_radius)
        return cache_key((size, material, self.mesh.quality.stiffness_factor, None if mass is None else mass.mass))


class FullModels:
    """Full models by what they are made of; any thread may call.

    Of bodies that are alike the first one announced is factorised, so that results do not depend on which thread comes
    first: those of a body and of one that is turned to it differ by their rounding.

    Args:
        keeps: Whether to keep every model that has room; otherwise those that another body needs as well.
    """

    def __init__(self, keeps: bool):
        self._keeps = keeps
        self._models: dict[str, dict[str, FullBody]] = {}  # by kind and key
        self._first: dict[str, Member] = {}
        self._large: set[str] = set()
        self._wanted: dict[str, int] = {}
        self._making: dict[str, threading.Lock] = {}
        self._lock = threading.Lock()

    def expect(self, members: Iterable[Member]) -> None:
        """Announce bodies, always in the same order; models are kept until the last of their kind has its own."""
        for member in members:
            self._first.setdefault(member.kind, member)
            self._wanted[member.kind] = self._wanted.get(member.kind, 0) + 1

    def of(self, member: Member) -> FullBody:
        """The model of a body, made at the first call.

        Raises:
            ShotError: As `full_body`.
        """
        kind = member.kind
        with self._lock:
            making = self._making.setdefault(kind, threading.Lock())
        with making:  # others that may be alike wait for it
            found = self.known(member) or self._made(member, self._like(member))
            with self._lock:
                self._wanted[kind] = self._wanted.get(kind, 0) - 1
                if self._keeps or self._wanted[kind] > 0:
                    self._keep(member, found)
                else:
                    self._models.pop(kind, None)
        return found

    def _like(self, member: Member) -> FullBody | None:
        """The first body of the same kind, if it is another one and has room."""
        first = self._first.get(member.kind, member)
        if first.key == member.key or member.kind in self._large:
            return None
        found = self.known(first)
        if found is None:
            found = self._made(first)
            with self._lock:
                if not self._keep(first, found):
                    self._large.add(member.kind)
        return found

    def _made(self, member: Member, like: FullBody | None = None) -> FullBody:
        # finite elements are loaded for none that is in the cache
        from calmotion.reduction.full_order.likeness import turn_between
        from calmotion.reduction.reduce import full_body

        made = full_body(member.mesh, member.body, member.attachments, member.root)
        turn = None if like is None else turn_between(like, made)
        if like is not None and turn is not None:
            made.take(like, turn)
        made.factorize()  # here, where no other kind waits
        return made

    def known(self, member: Member) -> FullBody | None:
        """The model of a body, if it is kept."""
        return self._models.get(member.kind, {}).get(member.key)

    def scaled(self, members: Iterable[tuple[Member, Member]]) -> FullModels:
        """Models of bodies whose stiffness alone has changed, as far as these are kept here.

        Args:
            members: Bodies as they were and as they are.
        """
        result = FullModels(self._keeps)
        for before, after in members:
            found = self.known(before)
            if found is not None:
                factor = after.mesh.quality.stiffness_factor / before.mesh.quality.stiffness_factor
                result._models.setdefault(after.kind, {})[after.key] = found.scaled(factor)
        return result

    def _keep(self, member: Member, model: FullBody) -> bool:
        models = self._models.setdefault(member.kind, {})
        taken = sum(own.entries for kind in self._models.values() for own in kind.values() if own is not model)
        if taken + model.entries > _KEPT:
            return False
        models[member.key] = model
        return True
