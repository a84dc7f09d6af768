"""Tetrahedra for flexible bodies."""

from calmotion.host import registration

from .operator import TetrahedralizeFlexibleBodies

__all__ = ["TetrahedralizeFlexibleBodies", "register", "unregister"]

register, unregister = registration(TetrahedralizeFlexibleBodies)
