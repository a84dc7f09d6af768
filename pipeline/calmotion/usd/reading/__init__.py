"""From a composed stage to a Character, an Animation and a Provenance."""

from calmotion.usd.reading.shot import read_shot

__all__ = ["read_shot"]
