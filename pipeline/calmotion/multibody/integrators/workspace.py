"""The arrays that a simulation writes to besides its trajectory."""

from __future__ import annotations

from dataclasses import dataclass

from calmotion.multibody.integrators.newton import Scratch, allocate_scratch
from calmotion.multibody.kernels.assembly import Work, allocate_work
from calmotion.multibody.model.system import Blocks, Factors, System, allocate_blocks, allocate_factors


@dataclass(frozen=True, eq=False)
class Workspace:
    """Everything a simulation writes to besides its trajectory; made once for a system, not shared by threads."""

    work: Work
    blocks: Blocks
    factors: Factors
    scratch: Scratch

    @classmethod
    def for_system(cls, system: System) -> Workspace:
        """Allocate for one system."""
        return cls(allocate_work(system), allocate_blocks(system), allocate_factors(system), allocate_scratch(system))
