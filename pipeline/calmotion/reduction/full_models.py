"""Full models of flexible bodies, kept for who reduces the same ones again; links that are copies have one.

What does not depend on the loads or the tolerance is most of a small body's reduction: elements, factors and normal
modes.
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
            found = self._models.get(key)
            if found is None:
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
