"""Provenance of a shot: its layers, their hashes, the units of its stage, and the results that it carries."""

import os
from collections.abc import Sequence

from pxr import Sdf, Usd, UsdGeom

from calmotion.model import InputLayer, Provenance
from calmotion.usd import stages
from calmotion.usd.clock import Clock
from calmotion.usd.reading.context import prims_of
from calmotion.usd.units import units_of

_ENCODED = "tn__"  # prefix of names that USD's converters encode (Bootstring)
_PACKAGE = ".usdz"


def provenance_of(path: str, stage: Usd.Stage, clock: Clock, earlier: tuple[str, ...] = ()) -> Provenance:
    """The provenance of a shot.

    Args:
        path: Its file, as it was given.
        earlier: Identifiers of the layers of ours that it carries.
    """
    default, units = stage.GetDefaultPrim(), units_of(stage)
    return Provenance(
        shot=path,
        layers=stages.input_layers(stage, path),
        meters_per_unit=units.meters,
        kilograms_per_unit=units.kilograms,
        up_axis=str(UsdGeom.GetStageUpAxis(stage)),
        time_codes_per_second=clock.time_codes_per_second,
        frames_per_second=clock.frames_per_second,
        start_time_code=clock.start,
        end_time_code=clock.end,
        default_prim=default.GetName() if default else "",
        earlier_layers=tuple(stages.display_name(layer, path) for layer in earlier),
        names=_written_names(stage),
    )


def _written_names(stage: Usd.Stage) -> dict[str, str]:
    """Names of prims that converters had to encode, to the names that their files have."""
    encoded = (prim for prim in prims_of(stage) if prim.GetName().startswith(_ENCODED))
    return {prim.GetName(): prim.GetDisplayName() for prim in encoded if prim.GetDisplayName()}


def notes_of_results(composed: Usd.Stage, path: str, earlier: Sequence[str], inputs: Sequence[InputLayer]) -> list[str]:
    """What a user must know of results that a shot carries.

    Args:
        composed: The stage with them.
        earlier: Identifiers of the layers of results.
        inputs: What the shot without them is composed from.
    """
    root = composed.GetRootLayer()
    if not earlier:
        flat = stages.role_of(root) == stages.ROOT and not root.subLayerPaths
        made = "flattened from a shot with results of Calmotion: the optimised curves count as the intended motion"
        return [f"{root.GetDisplayName()}: {made}"] if flat else []
    names = ", ".join(stages.display_name(layer, path) for layer in earlier)
    notes = [f"the shot carries results of Calmotion ({names}); the intended motion is the animation beneath them"]
    for layer in composed.GetLayerStack(False):
        if layer.identifier not in earlier:
            continue
        changed = _changed_inputs(layer, path, inputs)
        if changed:
            others = f" and {len(changed) - 1} more" if len(changed) > 1 else ""
            notes.append(
                f"{layer.GetDisplayName()}: these results were made for another version of {changed[0]}{others}; their "
                "errors hold for that version"
            )
        lost = _without_prim(layer, composed)
        if lost:
            others = f" and {len(lost) - 1} more" if len(lost) > 1 else ""
            notes.append(f"{layer.GetDisplayName()}: it has results for {lost[0]}{others}, which the shot has not")
    return notes


def _changed_inputs(layer: Sdf.Layer, path: str, inputs: Sequence[InputLayer]) -> list[str]:
    """Files from which a result was made, and which are no longer among those of the shot with the same content.

    Not those of ours, which are muted or only name the others, nor what is in a package now, which is hashed as one.
    """
    origin = layer.customLayerData[stages.METADATA_KEY]
    present, packed = {source.sha256 for source in inputs}, any(source.path.endswith(_PACKAGE) for source in inputs)
    made_from = zip(map(str, origin.get("inputs", [])), map(str, origin.get("sha256", [])), strict=False)
    changed = []
    for name in (name for name, digest in made_from if digest not in present):
        if packed and not name.endswith(_PACKAGE):
            continue
        file = os.path.join(os.path.dirname(os.path.realpath(path)), name)
        found = Sdf.Layer.FindOrOpen(file) if os.path.isfile(file) else None
        if found is None or stages.role_of(found) not in (stages.CURVES, stages.MOTION, stages.ROOT):
            changed.append(name)
    return changed


def _without_prim(layer: Sdf.Layer, stage: Usd.Stage) -> list[str]:
    """Paths of the prims for which a layer has values, and that no layer defines."""
    found: list[str] = []

    def visit(spec: Sdf.Path) -> None:
        prim = spec.GetPrimPath()
        if spec.IsPropertyPath() and str(prim) not in found and not stage.GetPrimAtPath(prim).IsDefined():
            found.append(str(prim))

    layer.Traverse("/", visit)
    return found
