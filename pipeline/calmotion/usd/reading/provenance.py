"""Provenance of a shot: its layers, their hashes, and the units of its stage."""

from __future__ import annotations

from typing import TYPE_CHECKING

from calmotion.shot import Provenance
from calmotion.usd import stages
from calmotion.usd.clock import Clock
from calmotion.usd.units import units_of

if TYPE_CHECKING:
    from pxr import Usd


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
