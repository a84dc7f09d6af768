"""Which parameters of a robot are estimated, their priors, and the values that they have in the shot.

A parameter is searched as x, in standard deviations of its prior: value = nominal exp(spread x) where only factors make
sense, nominal + spread x otherwise. The prior of x is the standard normal distribution.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

import numpy as np
from calmotion.errors import ShotError
from calmotion.model import DRIVE, PRESCRIBED, Motor
from calmotion.retargeting import payload_bodies
from calmotion.simulation import CompiledShot
from calmotion.support import nearest

from ..model import kinds
from ..model.estimates import AXES


@dataclass(frozen=True)
class Parameter:
    """A parameter that is estimated.

    Attributes:
        kind, path, axis, unit: As of `Estimate`.
        nominal: Value in the shot.
        spread: Standard deviation of the prior, of the logarithm where it is logarithmic.
        logarithmic: Whether it is searched as a factor.
        lower: Least value.
        alike: Paths and nominal values of other motors that differ from theirs as this one does.
    """

    kind: str
    path: str
    nominal: float
    spread: float
    unit: str = ""
    axis: int = -1
    logarithmic: bool = True
    lower: float = -np.inf
    alike: tuple[tuple[str, float], ...] = ()

    @property
    def name(self) -> str:
        """Kind, path and component."""
        return f"{self.kind} {self.path}" + (f".{AXES[self.axis]}" if self.axis >= 0 else "")

    @property
    def least(self) -> float:
        """Least x."""
        return -np.inf if self.logarithmic else (self.lower - self.nominal) / self.spread

    def value(self, x: float) -> float:
        """The value at x standard deviations of the prior."""
        return float(self.nominal * np.exp(self.spread * x) if self.logarithmic else self.nominal + self.spread * x)

    def values(self, x: float) -> dict[tuple[str, str, int], float]:
        """The values of all that it stands for, by kind, path and axis."""
        found = {(self.kind, self.path, self.axis): self.value(x)}
        for path, nominal in self.alike:
            found[self.kind, path, self.axis] = replace(self, nominal=nominal).value(x)
        return found

    def slope(self, x: float) -> float:
        """Derivative of the value by x."""
        return self.spread * (self.value(x) if self.logarithmic else 1.0)


def robot_parameters(
    shot: CompiledShot,
    wanted: Sequence[str] = kinds.DEFAULT,
    priors: Mapping[str, float] | None = None,
    efforts: Collection[str] = (),
) -> tuple[Parameter, ...]:
    """The parameters of a robot, and, with each modulus, the grading of the stiffness of its modes.

    Args:
        shot: The shot.
        wanted: Kinds, each by itself or as `KIND:PATTERN` for paths that fit a pattern; a kind that the robot does not
            have gives nothing, a pattern that fits nothing is refused.
        priors: Standard deviations by kind, over `PRIORS`.
        efforts: Paths of motors whose efforts are measured: those of ideal motors tell their rotors.

    Raises:
        ShotError: There is no such kind, a pattern fits nothing, or there is no parameter at all.
    """
    given = {**kinds.PRIORS, **(priors or {})}
    refuse_unknown(wanted, priors or {})
    found: dict[str, Parameter] = {}
    for text in wanted:
        kind, _, pattern = text.partition(":")
        own = [p for p in _of_kind(shot, kind, pattern, given[kind], efforts) if fnmatchcase(p.path, pattern or "*")]
        if pattern and not own:
            paths = sorted({p.path for p in _of_kind(shot, kind, "*", given[kind], efforts)})
            raise ShotError(
                f"no parameter of the robot fits the pattern of {kind}",
                path=shot.character.path,
                attribute="--parameters",
                found=text,
                remedy=f"{nearest(pattern, paths)}Its {kind} parameters are those of {', '.join(paths) or 'nothing'}",
            )
        found |= {p.name: p for p in own}
    if not found:
        raise ShotError(
            "the robot has no parameter of these kinds",
            path=shot.character.path,
            attribute="--parameters",
            found=", ".join(wanted),
            remedy="Make a link flexible (CalmFlexibleBodyAPI) or a motor compliant (calm:motor:model), or name "
            "mass or encoder_offset",
        )
    # without it, the error of the mesh would be taken for another modulus and mass
    moduli = [p for p in found.values() if p.kind == kinds.MODULUS]
    graded = [Parameter(kinds.HIGHER_MODES, p.path, 0.0, given[kinds.HIGHER_MODES], logarithmic=False) for p in moduli]
    return (*found.values(), *graded)


def refuse_unknown(wanted: Sequence[str], priors: Mapping[str, float]) -> None:
    """Refuse kinds that do not exist, and priors out of range.

    Raises:
        ShotError: There is one.
    """
    for attribute, known, names in (
        ("--parameters", kinds.ROBOT_KINDS, [text.partition(":")[0] for text in wanted]),
        ("--prior", tuple(kinds.PRIORS), list(priors)),
    ):
        for name in names:
            if name not in known:
                raise ShotError(
                    "there is no such kind of parameter",
                    attribute=attribute,
                    found=name,
                    remedy=f"{nearest(name, known)}Use {', '.join(known)}",
                )
    for name, value in priors.items():
        if not 0.0 < value < np.inf:
            raise ShotError(
                "the standard deviation of a prior must be positive",
                attribute="--prior",
                found=f"{name}={value:g}",
                remedy=f"Use a relative one, such as {name}={kinds.PRIORS[name]:g}, or leave the parameter out",
            )


def _of_kind(shot: CompiledShot, kind: str, pattern: str, prior: float, efforts: Collection[str]) -> list[Parameter]:
    """All parameters of a kind; masses of bodies within a chain only where a pattern asks for them."""
    character = shot.character
    spread = float(np.log1p(prior)) if kind in kinds.LOGARITHMIC else prior
    if kind in (kinds.MODULUS, kinds.DAMPING, kinds.DENSITY):
        found = {}
        for body in character.bodies:
            if body.flexible is not None and body.simulated_flexible:
                material = body.flexible.material
                value = {
                    kinds.MODULUS: (material.youngs_modulus, "Pa"),
                    # of both coefficients, where they are Rayleigh's
                    kinds.DAMPING: (material.damping_ratio if material.rayleigh is None else 1.0, ""),
                    kinds.DENSITY: (material.density, "kg/m^3"),
                }[kind]
                # the density of a body whose mass is authored follows from that mass
                if value[0] > 0.0 and not (kind == kinds.DENSITY and body.mass is not None):
                    found[material.path] = Parameter(kind, material.path, value[0], spread, value[1])
        return list(found.values())
    if kind in (kinds.MASS, kinds.CENTRE):
        ends, rows = set(payload_bodies(shot)), []
        for index, body in enumerate(character.bodies):
            if body.simulated_flexible or body.mass is None or body.between or not (pattern or index in ends):
                continue
            if kind == kinds.MASS:
                rows.append(Parameter(kind, body.path, body.mass.mass, spread, "kg"))
            else:
                rows += [
                    Parameter(kind, body.path, float(body.mass.center[axis]), spread, "m", axis, False)
                    for axis in range(3)
                ]
        return rows
    # calm:motor:... of a joint is that of all its axes, so that a value of one axis has no place
    alone = [motor for motor in character.motors if motor.path == motor.prim_path]
    return [row for motor in alone for row in _of_motor(motor, kind, spread, motor.path in efforts)]


def _of_motor(motor: Motor, kind: str, spread: float, measured: bool) -> list[Parameter]:
    """The parameter of a kind of one motor, where it has it: a guess of it must be in the shot, but for a delay.

    Args:
        measured: Whether its effort is, which tells the rotor of an ideal motor.
    """
    angle, effort = ("m", "N") if motor.linear else ("rad", "N m")
    if kind == kinds.ENCODER_OFFSET:
        own = 1e-3 if motor.linear and spread == kinds.PRIORS[kinds.ENCODER_OFFSET] else spread
        return [Parameter(kind, motor.path, 0.0, own, angle, logarithmic=False)]
    ideal = motor.model == PRESCRIBED
    if motor.follows is not None or (ideal and not (measured and kind in kinds.OF_ROTOR)):
        return []
    if kind == kinds.DELAY:
        return [Parameter(kind, motor.path, motor.delay, spread, "s", logarithmic=False, lower=0.0)]
    own_value, unit = {
        kinds.POSITION_GAIN: (motor.position_gain, f"{effort}/{angle}"),
        kinds.VELOCITY_GAIN: (motor.velocity_gain, f"{effort} s/{angle}"),
        kinds.GEAR_STIFFNESS: (motor.rotor.gear_stiffness, f"{effort}/{angle}"),
        kinds.ARMATURE: (motor.rotor.armature, "kg" if motor.linear else "kg m^2"),
        kinds.FRICTION: (motor.rotor.friction, effort),
        kinds.VISCOUS_FRICTION: (motor.rotor.viscous_friction, f"{effort} s/{angle}"),
        kinds.LOAD_FRICTION: (motor.rotor.law.share, ""),
        kinds.MAX_TORQUE: (motor.max_torque, effort),
    }[kind]
    if kind not in (kinds.POSITION_GAIN, kinds.VELOCITY_GAIN) and motor.model == DRIVE:
        return []
    return [Parameter(kind, motor.path, own_value, spread, unit)] if 0.0 < own_value < np.inf else []
