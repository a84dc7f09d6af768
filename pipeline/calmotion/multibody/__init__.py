"""The differential-algebraic system of rigid and reduced flexible bodies, its integrators and derivatives.

For who has arrays and no USD (docs/tutorial_multibody.md): `Mechanism` builds a `Model` of bodies, joints and motors;
`simulate` runs it, `linearize` gives the derivative (`jvp`, `vjp`), `natural_modes` its frequencies. Each name is
imported when it is first used.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calmotion.model.character import WORLD
    from calmotion.multibody.failure import SimulationFailure
    from calmotion.multibody.mechanism import Mechanism
    from calmotion.multibody.model.model import Model
    from calmotion.multibody.model.system import State
    from calmotion.multibody.runs import LinearizedRun, ModelRun, linearize, natural_modes, simulate
    from calmotion.reduction.reduced_body import ReducedBody

__all__ = [
    "WORLD",
    "LinearizedRun",
    "Mechanism",
    "Model",
    "ModelRun",
    "ReducedBody",
    "SimulationFailure",
    "State",
    "linearize",
    "natural_modes",
    "simulate",
]

_HOMES = {
    "multibody.failure": ("SimulationFailure",),
    "multibody.mechanism": ("Mechanism",),
    "multibody.model.model": ("Model",),
    "multibody.model.system": ("State",),
    "multibody.runs": ("LinearizedRun", "ModelRun", "linearize", "natural_modes", "simulate"),
    "reduction.reduced_body": ("ReducedBody",),
    "model.character": ("WORLD",),
}


def __getattr__(name: str) -> Any:
    from calmotion.public_names import imported

    return imported(__name__, _HOMES, name)


def __dir__() -> list[str]:
    return sorted(__all__)
