"""The writer's table of contents: a Result becomes a layer and a root layer."""

from __future__ import annotations

import os
from dataclasses import dataclass

from ...errors import ShotError
from ...shot import Animation, Character, MotorCurve, Provenance, Result
from .. import stages
from ..clock import Clock
from ..layers import refuse_input_as_output, write_layer
from . import bake, metadata, motions
from .curves import author_curves, sample_times
from .root import keeps_earlier_curves, root_path, write_root
from .splines import author_splines

BAKES = ("none", "motors", "simulated")


@dataclass(frozen=True)
class WriteOptions:
    """How a result is written.

    Attributes:
        samples_per_second: Density of the motor samples [1/s]; None: the shot's frames.
        splines: Whether motor curves are written as splines instead of samples.
        bake: `none`, `motors` (body transforms of a rigid robot with the new curves) or `simulated` (the predicted
            motion, deformed meshes included).
    """

    samples_per_second: float | None = None
    splines: bool = False
    bake: str = "none"


def write_result(
    character: Character,
    animation: Animation,
    provenance: Provenance,
    result: Result,
    output: str,
    options: WriteOptions | None = None,
) -> tuple[str, str]:
    """Write a result over its shot.

    An optimisation writes the curves that changed, and what is baked. A simulation writes the predicted motion of the
    bodies (with their deformed meshes for `bake="simulated"`).

    Args:
        output: The layer to write; the root layer goes beside it as `<stem>_root.usda`.

    Returns:
        Paths of the layer and of the root layer.

    Raises:
        ShotError: The output is an input, cannot be written, or cannot be baked as asked.
    """
    from pxr import Sdf

    options = options or WriteOptions()
    if options.splines and options.samples_per_second is not None:
        raise ShotError(
            "curves are written as splines or as samples, not as both",
            attribute="--splines",
            found="--samples-per-second as well",
            remedy="Leave one of them out",
        )
    refuse_inputs(provenance, output)
    role = stages.MOTION if result.after is None else stages.CURVES
    clock = Clock(
        provenance.start_time_code,
        provenance.end_time_code,
        provenance.time_codes_per_second,
        provenance.frames_per_second,
    )
    layer = Sdf.Layer.CreateAnonymous(".usda")
    metadata.author_stage_metadata(layer, provenance)
    metadata.author_origin(
        layer,
        role,
        provenance,
        settings=metadata.settings_of(character, result, options.bake, options.samples_per_second, options.splines),
        errors=metadata.errors_of(character, result),
    )
    with Sdf.ChangeBlock():
        written: dict[str, int] = {}
        knots: dict[str, int] = {}
        if role == stages.CURVES:
            curves, meters = _curves_to_write(result, provenance), provenance.meters_per_unit
            if options.splines:
                knots |= author_splines(layer, character, animation, curves, clock, meters)
            else:
                times = sample_times(animation.frame_times, options.samples_per_second)
                written |= author_curves(layer, character, curves, animation.frame_times, times, clock, meters)
    written |= _bake(layer, character, animation, provenance, result, options, clock)
    write_layer(layer, output, lambda temporary: _validate(temporary, written, knots))
    return output, write_root(output, provenance, role)


def refuse_inputs(provenance: Provenance, output: str) -> None:
    """Refuse an output that would overwrite a layer of the shot, with itself or with its root layer.

    Raises:
        ShotError: It would, or it is not named like a layer.
    """
    folder = os.path.dirname(os.path.realpath(provenance.shot))
    inputs = [os.path.join(folder, item.path) for item in provenance.layers]
    inputs += [os.path.join(folder, item) for item in provenance.earlier_layers]
    for name in (output, root_path(output)):
        refuse_input_as_output(name, inputs)


def _curves_to_write(result: Result, provenance: Provenance) -> tuple[MotorCurve, ...]:
    """The curves that changed; all of them where curves of an earlier result would show through."""
    every = keeps_earlier_curves(provenance)
    return tuple(curve for curve in result.curves if curve.changed or every)


def _bake(
    layer, character, animation, provenance, result: Result, options: WriteOptions, clock: Clock
) -> dict[str, int]:
    """Author what is baked into the layer; see `WriteOptions.bake`."""
    if options.bake not in BAKES:
        raise ShotError("unknown bake", found=options.bake, remedy=f"Use one of {', '.join(BAKES)}")
    simulation = result.after or result.before
    simulated_only = result.after is None
    if options.bake == "none" and not simulated_only:
        return {}
    if options.bake == "motors":
        motion = motions.rigid_motion(character, animation, result)
    else:
        motion = motions.simulated_motion(simulation.motion, animation.frame_times)
    muted = stages.earlier_layers(stages.open_stage(provenance.shot)) if provenance.earlier_layers else ()
    stage = stages.open_stage(provenance.shot, muted=muted)
    meters = provenance.meters_per_unit
    written = bake.bake_bodies(layer, stage, character, motion, clock, meters)
    if options.bake == "simulated":
        written |= bake.bake_points(layer, stage, character, result.skins, motion, clock, meters)
    return written


def _validate(temporary: str, written: dict[str, int], knots: dict[str, int]) -> None:
    """Reopen what was written: every attribute must be there, with all its samples, or all knots of its spline."""
    from pxr import Sdf

    layer = Sdf.Layer.OpenAsAnonymous(temporary)
    if not stages.role_of(layer):
        raise ShotError("what was written does not say where it came from", path=temporary, attribute="customLayerData")
    for path, count in written.items():
        found = layer.GetNumTimeSamplesForPath(Sdf.Path(path))
        if found != count:
            raise ShotError("what was written has lost samples", path=path, found=f"{found} of {count}")
    for path, count in knots.items():
        spec = layer.GetAttributeAtPath(Sdf.Path(path))
        found = len(spec.GetSpline().GetKnots()) if spec and spec.HasSpline() else 0
        if found != count:
            raise ShotError("what was written has lost knots", path=path, found=f"{found} of {count}")
