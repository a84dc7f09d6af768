"""Provenance of a shot: its layers, their hashes, the units of its stage, and the results that it carries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from calmotion.shot import Provenance
from calmotion.usd import stages
from calmotion.usd.clock import Clock
from calmotion.usd.units import units_of

if TYPE_CHECKING:
    from pxr import Sdf, Usd


def provenance_of(path: str, stage: Usd.Stage, clock: Clock, earlier: tuple[str, ...] = ()) -> Provenance:
    """The provenance of a shot.

    Args:
        path: Its file, as it was given.
        stage: Its stage.
        clock: Its clock.
        earlier: Identifiers of the layers of ours that it carries.
    """
    from pxr import UsdGeom

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
    )


def notes_of_results(composed: Usd.Stage, path: str, earlier: Sequence[str]) -> list[str]:
    """What a user must know of results that a shot carries.

    Args:
        composed: The stage with them.
        path: Its file.
        earlier: Identifiers of the layers of results.
    """
    root = composed.GetRootLayer()
    if not earlier:
        flat = stages.role_of(root) == stages.ROOT and not root.subLayerPaths
        made = "flattened from a shot with results of Calmotion: the optimised curves count as the intended motion"
        return [f"{root.GetDisplayName()}: {made}"] if flat else []
    names = ", ".join(stages.display_name(layer, path) for layer in earlier)
    notes = [f"the shot carries results of Calmotion ({names}); the intended motion is the animation beneath them"]
    for layer in composed.GetLayerStack(False):
        lost = _without_prim(layer, composed) if layer.identifier in earlier else []
        if lost:
            others = f" and {len(lost) - 1} more" if len(lost) > 1 else ""
            notes.append(f"{layer.GetDisplayName()}: the shot has no {lost[0]}{others}, of which it holds results")
    return notes


def _without_prim(layer: Sdf.Layer, stage: Usd.Stage) -> list[str]:
    """Paths of the prims for which a layer has values, and that no layer defines."""
    found: list[str] = []

    def visit(spec: Sdf.Path) -> None:
        prim = spec.GetPrimPath()
        if spec.IsPropertyPath() and str(prim) not in found and not stage.GetPrimAtPath(prim).IsDefined():
            found.append(str(prim))

    layer.Traverse("/", visit)
    return found
