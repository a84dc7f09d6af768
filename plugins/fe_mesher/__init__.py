"""Tetrahedra for flexible bodies."""

from __future__ import annotations

from calmotion.host import registration

from .operator import TetrahedralizeFlexibleBodies

__all__ = ["TetrahedralizeFlexibleBodies", "register", "unregister"]

register, unregister = registration(TetrahedralizeFlexibleBodies)
