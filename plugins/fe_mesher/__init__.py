"""Tetrahedra for flexible bodies."""

from __future__ import annotations

from calmotion.host import Host

from .operator import TetrahedralizeFlexibleBodies

__all__ = ["TetrahedralizeFlexibleBodies", "register", "unregister"]


def register(host: Host) -> None:
    """Add the operator."""
    host.register_operator(TetrahedralizeFlexibleBodies)


def unregister(host: Host) -> None:
    """Take the operator away."""
    host.unregister_operator(TetrahedralizeFlexibleBodies)
