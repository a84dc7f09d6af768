"""A shot that is run again whenever it is saved; what its change leaves as it was is not made again."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from calmotion.host import Operator
from calmotion.model import Animation, Character, FEMeshes, ModelChoices, Provenance, Result, Track
from calmotion.model.curves import held_curve
from calmotion.model.model_choice import run_settings, simplified_character
from calmotion.model.run import Source
from calmotion.model.tolerance import tolerance_of
from calmotion.reduction.cache import cache_key
from calmotion.reduction.load_envelope import LoadEnvelope
from calmotion.simulation.body_reduction import load_envelopes
from calmotion.simulation.compiled_shot import CompiledShot, compile_shot
from calmotion.tolerance.reduced_bodies import (
    DIRECTIONS,
    SUBSPACES,
    TIME_STEP,
    ConvergedReduction,
    ReducedBodies,
    RunMemory,
)
from calmotion.tolerance.reduction import SHARE
from calmotion.workflow.results import SimulationResult
from calmotion.workflow.shot import Shot

SMALL = 0.05  # of the largest component of a load: a component of that size may appear
_POLL = 0.1  # time between two looks at the files [s]


class Watch:
    """Runs of one shot, each of which takes from the one before what is still right.

    Meshes are kept while the simplified character is the same. Reduced bodies are kept while the error of their
    reduction keeps its share of the tolerance: it is taken to grow with the square of the loads. Time step and POD
    subspaces follow from the motion in every run. A search begins with the changes that the last one found.

    Args:
        shot: The shot.
        run: `simulate` or `optimize`, with all arguments but the shot.

    Attributes:
        reused: What the last run took over: `meshes`, `reduction`, `curves`, and what a `RunMemory` names.
        made: What it made anew, of the same, where the shot has it.
    """

    def __init__(self, shot: Shot, run: Callable[[Shot], SimulationResult]):
        self.shot, self._run = shot, run
        self._last: Mapping[type, Any] = {}
        self._key = ""
        self._files: dict[str, object] = {}
        self._error, self._growth = 0.0, 1.0  # of the reduction for its loads [m], and of the loads since then
        self.reused: list[str] = []
        self.made: list[str] = []
        shot.reuse = self._reuse

    def run(self) -> SimulationResult:
        """Read the shot and run it.

        Raises:
            ShotError: The shot cannot be processed; the next run reuses what the last good one made.
        """
        self._files = self._watched()
        self.shot.forget()
        self.reused = []
        if (memory := _memory(self._last)) is not None:
            memory.taken.clear()
        result = self._run(self.shot)
        data = result.outcome.run.data
        if (memory := _memory(data)) is not None:
            self.reused += dict.fromkeys(memory.taken)
        self.made = [name for name in _parts(data) if name not in self.reused]
        if "reduction" not in self.reused:
            self._error = _error_of_reduction(data)
        self._last, self._key = data, _key(simplified_character(data[Character], data.get(ModelChoices)))
        self._files |= {path: state for path, state in self._watched().items() if path not in self._files}
        return result

    def wait(self, seconds: float = float("inf")) -> bool:
        """Wait until a file of the shot changes and stays as it is for a moment; False where time runs out."""
        end = time.monotonic() + seconds
        while (now := self._watched()) == self._files:
            if time.monotonic() > end:
                return False
            time.sleep(_POLL)
        while True:  # a program may still write
            time.sleep(_POLL)
            before, now = now, self._watched()
            if now == before:
                return True

    def _watched(self) -> dict[str, object]:
        """The state of each file that the shot was read from."""
        provenance, character = self._last.get(Provenance), self._last.get(Character)
        paths = {self.shot.path, *([self.shot.motion] if self.shot.motion else [])}
        if provenance is not None:
            names = {layer.path for layer in provenance.layers} - set(provenance.earlier_layers)
            paths |= {os.path.join(os.path.dirname(self.shot.path), name) for name in names}
        if character is not None:
            paths |= {body.flexible.mesh_file for body in character.bodies if body.flexible and body.flexible.mesh_file}
        return {path: _state(path) for path in sorted(paths)}

    def _reuse(self, cls: type[Operator], data: Mapping[type, Any]) -> Sequence[object] | None:
        """What an operator would make, where it is known from the last run."""
        last, made = self._last, cls.provides
        if not last or Character not in data or any(kind not in last for kind in made):
            return None
        character = simplified_character(data[Character], data.get(ModelChoices))
        if made == (FEMeshes,) and _key(character) == self._key:
            self.reused.append("meshes")
            return [last[FEMeshes]]
        if made == (ReducedBodies,) and self._bodies_do(character, data, last[ReducedBodies].reduction):
            self.reused.append("reduction")
            return [last[ReducedBodies]]
        same = ReducedBodies in data and data[ReducedBodies] is last.get(ReducedBodies)
        if made == (CompiledShot,):
            bodies = data[ReducedBodies].bodies if ReducedBodies in data else None
            return [compile_shot(character, self._with_last_changes(data[Animation]), bodies)]
        if made == (ConvergedReduction,) and same:
            found: ConvergedReduction = last[ConvergedReduction]
            compiled: CompiledShot = data[CompiledShot]
            error = self._error * self._growth**2
            return [replace(found, shot=compiled.with_bodies(found.shot.bodies), error_m=error)]
        return None

    def _bodies_do(self, character: Character, data: Mapping[type, Any], reduction: Any) -> bool:
        """Whether the reduced bodies of the last run do for the motion."""
        if reduction is None or reduction.loads is None or data.get(FEMeshes) is not self._last.get(FEMeshes):
            return False
        options = run_settings(data.get(Source), data.get(ModelChoices))
        loads = load_envelopes(character, data[Animation], data[FEMeshes], options)
        if loads is None:
            return False
        self._growth = max(1.0, *map(_growth, loads, reduction.loads))
        return self._error * self._growth**2 <= SHARE * tolerance_of(character, options.tolerance)

    def _with_last_changes(self, animation: Animation) -> Animation:
        """The animation, whose current curves have the changes that the last search found."""
        result, before = self._last.get(Result), self._last[Animation]
        if result is None or result.after is None or result.retimed is not None or not _same_times(animation, before):
            return animation
        times, current = animation.frame_times, list(animation.current)
        for curve in result.curves:
            if curve.changed:
                now, then = (held_curve(one.tracks[curve.motor], times[-1])(times, 0) for one in (animation, before))
                current[curve.motor] = Track(times, now + curve.frame_values - then)
        self.reused.append("curves")
        return replace(animation, current=tuple(current))


def _growth(load: LoadEnvelope, reduced: LoadEnvelope) -> float:
    """Largest ratio of a load on a body, or of its frequency, to that for which the body was reduced."""
    import numpy as np

    if load.closed_chain != reduced.closed_chain:
        return np.inf
    ratios = [load.frequency / reduced.frequency if reduced.frequency else 1.0]
    for name in ("acceleration", "angular_acceleration", "angular_velocity", "force", "moment", "lever_arm"):
        now, then = np.abs(getattr(load, name)), np.abs(getattr(reduced, name))
        if now.shape != then.shape:
            return np.inf
        then = then + SMALL * then.max(initial=0.0)
        ratios.append(
            float(np.divide(now, then, out=np.where(now > 0.0, np.inf, 0.0), where=then > 0.0).max(initial=0.0))
        )
    return max(ratios)


def _error_of_reduction(data: Mapping[type, Any]) -> float:
    return data[ConvergedReduction].error_m if ConvergedReduction in data else 0.0


def _memory(data: Mapping[type, Any]) -> RunMemory | None:
    """What runs with the same bodies leave to each other."""
    found: ConvergedReduction | None = data.get(ConvergedReduction)
    return None if found is None else found.memory


def _parts(data: Mapping[type, Any]) -> list[str]:
    """What a run of a shot could take over from the one before, of those that took time."""
    if FEMeshes not in data or not data[FEMeshes].meshes:
        return []
    memory, result = _memory(data), data.get(Result)
    names = ["meshes", "reduction"]
    if memory is not None and memory.projected is not None:
        names += [SUBSPACES, *([TIME_STEP] if memory.step else [])]
    if memory is not None and result is not None and result.after is not None:
        names.append(DIRECTIONS)
    return names


def _same_times(one: Animation, other: Animation) -> bool:
    import numpy as np

    return np.array_equal(one.frame_times, other.frame_times) and len(one.tracks) == len(other.tracks)


def _key(character: Character) -> str:
    """Hash of a character and of the mesh files that it names."""
    files = [body.flexible.mesh_file for body in character.bodies if body.flexible and body.flexible.mesh_file]
    return cache_key((character, [repr(_state(path)) for path in files]))


def _state(path: str) -> object:
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


def largest_error(result: SimulationResult) -> tuple[str, float, float]:
    """The target with the largest error, the error [m], and its time [s]."""
    path, motion = max(result.targets.items(), key=lambda item: item[1].max_error)
    return path, motion.max_error, float(result.times[int(motion.error.argmax())])
