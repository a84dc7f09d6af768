"""Parameters that motors of one type share: they are estimated once, and belong to each of these motors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from calmotion.arrays import Array
from calmotion.model import Character

from ..model import kinds
from ..model.estimates import Estimate
from .parameters import Parameter

OWN = 1e-6  # share of the variance that each motor has for itself, so that covariances stay positive


def grouped(parameters: Sequence[Parameter], character: Character) -> tuple[Parameter, ...]:
    """The parameters with one for all motors of a type (`calm:motor:type`), that of the first of them; encoders and
    motors without a type keep their own.

    Args:
        parameters: Of the robot.
        character: With its motors.
    """
    types = {m.path: (m.kind, m.model, m.linear) for m in character.motors if m.kind}
    found: dict[object, Parameter] = {}
    for p in parameters:
        shared = p.kind in kinds.MOTOR_KINDS and p.kind != kinds.ENCODER_OFFSET and p.path in types
        key: object = (p.kind, types[p.path]) if shared else p.name
        first = found.get(key)
        found[key] = p if first is None else replace(first, alike=(*first.alike, (p.path, p.nominal)))
    return tuple(found.values())


def of_each_motor(
    parameters: Sequence[Parameter], estimates: Sequence[Estimate], covariance: Array
) -> tuple[tuple[Estimate, ...], Array]:
    """Estimates of all motors from those of groups, behind the others, and their covariance.

    Args:
        parameters: Of the robot, those of groups among them.
        estimates: Of these, then of the measurement.
        covariance: Of their values, or of their logarithms, shape [n, n].
    """
    rows, owners = list(estimates), list(range(len(estimates)))
    for k, p in enumerate(parameters):
        for path, nominal in p.alike:
            own, scale = estimates[k], nominal / p.nominal if p.logarithmic else 1.0
            value = scale * own.value if p.logarithmic else nominal + own.value - own.nominal
            rows.append(
                replace(
                    own,
                    path=path,
                    nominal=nominal,
                    value=value,
                    prior=scale * own.prior,
                    standard_deviation=scale * own.standard_deviation,
                )
            )
            owners.append(k)
    spread = covariance[np.ix_(owners, owners)]
    behind = np.arange(len(rows)) >= len(estimates)
    return tuple(rows), spread + np.diag(np.where(behind, OWN * np.diag(spread), 0.0))
