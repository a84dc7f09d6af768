"""A shot compiled for simulation: what depends on its bodies, not on the time step or the motors' curves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

from calmotion.model import Animation, Character, Track

if TYPE_CHECKING:
    from calmotion.model.result import Retimed
    from calmotion.multibody.model.model import Model
    from calmotion.multibody.model.topology import Tree
    from calmotion.reduction.reduced_body import ReducedBody


@dataclass(frozen=True, eq=False)
class CompiledShot:
    """A shot with one set of bodies; every simulation of it starts from here, whatever its time step.

    The system is compiled at its first use: many runs on rigid characters never simulate.

    Attributes:
        character: The character, with its simplifications.
        animation: The motors' tracks and moving roots.
    """

    character: Character
    animation: Animation
    _system: _System = field(repr=False)

    @property
    def bodies(self) -> tuple[ReducedBody, ...]:
        """One for each body of the character."""
        return self._system.bodies

    @property
    def tree(self) -> Tree:
        """The spanning tree of the character."""
        return self._system.tree

    @property
    def model(self) -> Model:
        """The compiled multibody system."""
        return self._system.model

    def with_tracks(self, tracks: Sequence[Track]) -> CompiledShot:
        """The same shot with other current curves of the motors; the animator's remain the intended ones."""
        return replace(self, animation=replace(self.animation, current=tuple(tracks)))

    def at(self, retimed: Retimed | None) -> CompiledShot:
        """The same robot in its animation at another tempo; None: as it is."""
        return self if retimed is None else replace(self, animation=retimed.animation, character=retimed.character)

    def with_bodies(self, bodies: Sequence[ReducedBody]) -> CompiledShot:
        """The same shot with other reductions of its bodies."""
        return compile_shot(self.character, self.animation, bodies)

    def with_character(self, character: Character) -> CompiledShot:
        """The same system with a character of other settings: motors that may change, limits, weights of the search."""
        return replace(self, character=character)


class _System:
    """The compiled system of a shot."""

    def __init__(self, character: Character, moving: Sequence[int], bodies: Sequence[ReducedBody] | None):
        self._character, self._moving, self._bodies = character, moving, bodies

    def __getstate__(self) -> dict[str, object]:
        """What another process compiles it from: a compiled model holds addresses of this one's memory."""
        return {"_character": self._character, "_moving": self._moving, "_bodies": self._bodies}

    @cached_property
    def tree(self) -> Tree:
        from calmotion.multibody.model.topology import span_tree

        return span_tree(self._character)

    @cached_property
    def bodies(self) -> tuple[ReducedBody, ...]:
        from calmotion.simulation.bodies import reduce_bodies

        return tuple(reduce_bodies(self._character, self.tree, None) if self._bodies is None else self._bodies)

    @cached_property
    def model(self) -> Model:
        from calmotion.multibody.model.model import compile_model

        return compile_model(self._character, self.tree, self.bodies, self._moving)


def compile_shot(
    character: Character, animation: Animation, bodies: Sequence[ReducedBody] | None = None
) -> CompiledShot:
    """A shot with its bodies, compiled when its system is first used.

    Asking for it raises ShotError where a joint or a loop is not supported, or a flexible body is not reduced.

    Args:
        animation: Its motors' tracks and moving roots.
        bodies: One for each body of the character; None where all are rigid.
    """
    return CompiledShot(character, animation, _System(character, [frame.joint for frame in animation.moving], bodies))
