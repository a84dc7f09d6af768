"""From a composed stage to a Character, an Animation and a Provenance."""

from .shot import read_shot

__all__ = ["read_shot"]
