"""All kinds of limits of the motors."""

import math
from functools import cache
from importlib import import_module
from inspect import isabstract
from pkgutil import iter_modules

from calmotion.model import limits
from calmotion.model.character import Character
from calmotion.model.limits.base import CurveLimit, MotorLimit


@cache
def kinds_of_limits() -> dict[str, MotorLimit]:
    """Those of the modules of this folder, by name: of curves by their order, then the others."""
    modules = [
        import_module(f"{limits.__name__}.{module.name}")
        for module in iter_modules(limits.__path__)
        if f"{limits.__name__}.{module.name}" != __name__
    ]
    kinds = {kind for module in modules for kind in vars(module).values() if isinstance(kind, type)}
    found = [kind() for kind in kinds if issubclass(kind, MotorLimit) and not isabstract(kind)]
    found.sort(key=lambda kind: (kind.order if isinstance(kind, CurveLimit) else 99, kind.name))
    return {kind.name: kind for kind in found}


def has_limits(character: Character) -> bool:
    """Whether any motor has any limit."""
    joints = (character.joints[motor.joint] for motor in character.motors)
    return any(
        math.isfinite(bound)
        for motor, joint in zip(character.motors, joints, strict=True)
        for kind in kinds_of_limits().values()
        for bound in kind.bounds(motor, joint)
    )
