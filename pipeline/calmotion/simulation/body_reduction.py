"""The reduction of a shot's bodies under the loads of the shot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from calmotion.model import Animation, Character, FEMeshes
from calmotion.model.character import with_settings
from calmotion.model.run import RunSettings
from calmotion.multibody.failure import SimulationFailure
from calmotion.multibody.model.model import body_anchors
from calmotion.multibody.model.topology import span_tree
from calmotion.reduction.basis.static_loads import OVERSHOOT
from calmotion.reduction.full_models import FullModels
from calmotion.reduction.load_envelope import LoadEnvelope, directed_load_envelope
from calmotion.reduction.reduced_body import ReducedBody
from calmotion.simulation.bodies import bodies_in_parallel, full_model_of, reduce_bodies
from calmotion.simulation.preparation import grid_of
from calmotion.simulation.rigid_run import shot_load_envelopes


class BodyReduction:
    """The reduction of a shot's bodies, which is repeated to other tolerances from what it has.

    Args:
        character: The character.
        meshes: Of its flexible bodies.
        loads: Loads on each body in the shot; None where they are not known.
        repeats: Whether to keep the full models for further reductions, until `release`.
    """

    def __init__(
        self, character: Character, meshes: FEMeshes | None, loads: Sequence[LoadEnvelope] | None, repeats: bool = False
    ):
        self.character, self.meshes, self.loads = character, meshes, loads
        self._tree = span_tree(character)
        self._repeats = repeats
        self._full: FullModels | None = None

    def bodies(
        self, tolerance: float | None, pairs_share: float = 1.0, progress: Callable[[float, str], None] | None = None
    ) -> list[ReducedBody]:
        """Every body of the character, reduced.

        Args:
            tolerance: Acceptable error [m]; None: the shot's own, or 1 mm.
            pairs_share: Factor of the error that pairs of coordinates outside the quadratic-strain subspace may cause.
            progress: Called with a fraction and the body at hand.

        Raises:
            ShotError: A flexible body without a mesh, or one that cannot be reduced.
        """
        character = with_settings(self.character, lambda own: replace(own, pairs_share=pairs_share * own.pairs_share))
        return reduce_bodies(character, self._tree, self.meshes, progress, self.loads, tolerance, self._models())

    def _models(self) -> FullModels | None:
        if self._full is None and self._repeats and self.meshes is not None:
            from calmotion.reduction.full_models import FullModels

            self._full = FullModels(keeps=True)
        return self._full

    def with_finer_meshes(
        self, tolerance: float | None, wanted: Mapping[int, float], max_nodes: int,
        progress: Callable[[float, str], None] = lambda fraction, message: None, keeps: str = "",
    ) -> BodyReduction:  # fmt: skip
        """The reduction on finer meshes; loads stay those of the shot.

        Args:
            tolerance: As of `bodies`.
            wanted: Relative error of the stiffness that the mesh of a body may have, by body.
            progress: Called with a fraction and the body at hand.
            keeps: As of `MeshController`; with `finer`, elements that the user chose are refined as well.

        Raises:
            ShotError: A body that cannot be reduced.
        """
        from calmotion.reduction.mesh_refinement import MeshController

        assert self.meshes is not None and self.loads is not None
        anchors, models, loads = body_anchors(self.character, self._tree), self._models(), self.loads
        members = {mesh.body: full_model_of(self.character, mesh, anchors[mesh.body]) for mesh in self.meshes.meshes}
        finer = dict(members)

        def refine(index: int) -> None:
            own = members[index]
            controller = MeshController(wanted[index], max_nodes, keeps)
            mesh = controller.refined(own.mesh, own.body, own.attachments, own.root, loads[index], models)
            finer[index] = replace(own, mesh=mesh)

        refined = [b for b, own in members.items() if b in wanted and (keeps == "finer" or not own.mesh.given)]
        bodies_in_parallel(refine, refined, self.character, progress, ": a finer mesh")
        meshes = FEMeshes(tuple(own.mesh for own in finer.values()))
        result = BodyReduction(self.character, meshes, loads, self._repeats and models is not None)
        if models is not None:
            result._full = models.only(finer.values())
        return result

    def with_directions(self, flexible: Sequence[LoadEnvelope]) -> BodyReduction:
        """The reduction for loads in the directions that they have in a simulation of the flexible robot.

        Args:
            flexible: Loads on each body in it.
        """
        if self.loads is None:
            return self
        loads = [directed_load_envelope(*pair, OVERSHOOT) for pair in zip(self.loads, flexible, strict=True)]
        result = BodyReduction(self.character, self.meshes, loads, self._repeats)
        result._full = self._full
        return result

    def release(self) -> None:
        """Free the full models, and keep no more."""
        self._full, self._repeats = None, False


def load_envelopes(
    character: Character, animation: Animation, meshes: FEMeshes | None, options: RunSettings
) -> tuple[LoadEnvelope, ...] | None:
    """Loads on each body in a shot; None without flexible bodies, or where a rigid robot cannot follow it."""
    if len(animation.frame_times) < 2 or not any(body.simulated_flexible for body in character.bodies):
        return None
    try:
        grid, tree = grid_of(character, animation, options), span_tree(character)
        return shot_load_envelopes(character, animation, grid, tree, meshes)
    except SimulationFailure:
        return None  # the flexible robot will say so, with the place


def reduction_for(
    character: Character, animation: Animation, meshes: FEMeshes | None, options: RunSettings, repeats: bool = False
) -> BodyReduction:
    """The reduction of a shot's bodies under its loads; arguments as of `load_envelopes` and `BodyReduction`."""
    return BodyReduction(character, meshes, load_envelopes(character, animation, meshes, options), repeats)
