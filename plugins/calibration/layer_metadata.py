"""What the layer of a calibration tells beside its attributes: all parameters, their covariance, its predictions."""

from typing import Any

import numpy as np
from calmotion.model import Character
from calmotion.recordings import ANGLE, MARKER
from calmotion.support import rotation_from_quaternion
from calmotion.usd import to_doubles, to_strings

from .model import kinds
from .model.estimates import Calibration, Estimate

NARROWER = 0.9  # standard deviation over that of the prior, from which on the recordings tell something


def metadata_of(character: Character, calibration: Calibration) -> dict[str, Any]:
    """What the layer's metadata tell of a calibration of a character."""
    items = calibration.estimates
    known = [k for k, item in enumerate(items) if item.of_robot and _has_factor(item) and _is_narrower(item)]
    relative = np.array([1.0 if items[k].logarithmic else 1.0 / items[k].value for k in known])
    covariance = calibration.covariance[np.ix_(known, known)] * np.outer(relative, relative)
    return {
        "parameters": to_strings(item.name for item in items),
        "values": to_doubles([item.value for item in items]),
        "standard_deviations": to_doubles([item.standard_deviation for item in items]),
        "prior_values": to_doubles([item.nominal for item in items]),
        "prior_standard_deviations": to_doubles([item.prior for item in items]),
        "units": to_strings(item.unit for item in items),
        "identifiable": to_strings(item.name for item in items if item.identifiable),
        "with_this_model_only": to_strings(item.name for item in items if item.disagrees),
        "factors": to_strings(items[k].name for k in known),
        "covariance_of_log_factors": to_doubles(covariance.ravel()),
        "recordings": to_strings(calibration.recordings),
        "recordings_sha256": to_strings(calibration.recordings.values()),
        "channels": to_strings(fit.name for fit in calibration.channels),
        "residual_rms": to_doubles([fit.rms for fit in calibration.channels]),
        "validation_rms": to_doubles([fit.validation_rms for fit in calibration.channels]),
        **_predictions(character, calibration),
    }


def _predictions(character: Character, calibration: Calibration) -> dict[str, float]:
    """How far recordings were from their prediction: at the targets, and the share of what links and motors that give
    do that was not explained; each where it is known."""
    rms, largest = prediction_errors(character, calibration)
    told = {"prediction_rms_m": rms, "prediction_largest_m": largest} if rms > 0.0 else {}
    share = unexplained_share(calibration)
    return told | ({"prediction_share": share} if share else {})


def prediction_errors(character: Character, calibration: Calibration) -> tuple[float, float]:
    """Root mean square and largest difference of recordings from their prediction [m], in samples that were not fitted
    if there are any, at the places that markers and encoders tell of; of the worst channel, 0 where none tells."""
    found = [(0.0, 0.0)]
    for fit in calibration.channels:
        kind, _, path = fit.name.partition(" ")
        held_out = np.isfinite(fit.validation_rms)
        arm = 1.0 if kind == MARKER else _arm(character, path) if kind == ANGLE else 0.0
        found.append((arm * (fit.validation_rms if held_out else fit.rms), arm * fit.largest))
    rms, largest = np.max(found, axis=0)
    return float(rms), float(largest)


def unexplained_share(calibration: Calibration) -> float:
    """The share of what links and motors that give did in its recordings that a calibration leaves unexplained, of the
    channel that it predicts worst; 0 where none tells."""
    shares = [fit.share for fit in calibration.channels if np.isfinite(fit.share)]
    return max(shares, default=0.0)


def _arm(character: Character, path: str) -> float:
    """Distance from a joint to the farthest target [m]; 1 of a slider, whose encoder tells metres."""
    motor = next((own for own in character.motors if own.path == path), None)
    if motor is None or motor.linear:
        return 1.0

    def place(body: int, at: np.ndarray) -> np.ndarray:
        rest = character.bodies[body].rest
        return np.asarray(rest.position + rotation_from_quaternion(rest.rotation) @ at)

    joint = character.joints[motor.joint]
    middle = place(joint.body1, joint.frame1.position)
    ends = [place(target.body, target.frame.position) for target in character.targets]
    return max(float(np.linalg.norm(end - middle)) for end in ends)


def _has_factor(item: Estimate) -> bool:
    """Whether a parameter can be drawn as a factor of its value: one about zero cannot."""
    if item.axis >= 0 or item.kind == kinds.ENCODER_OFFSET:
        return False
    return item.logarithmic or item.value > 3.0 * item.standard_deviation


def _is_narrower(item: Estimate) -> bool:
    """Whether the recordings tell something about a parameter; of the others, `--robust` takes what the shot says."""
    found, before = item.standard_deviation, item.prior
    if item.logarithmic:
        found, before = found / item.value, before / item.nominal
    return found < NARROWER * before
