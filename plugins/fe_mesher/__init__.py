"""Tetrahedra for flexible bodies."""

from __future__ import annotations

from .operator import TetrahedralizeFlexibleBodies

__all__ = ["TetrahedralizeFlexibleBodies", "register", "unregister"]


def register(host):
    """Add the operator."""
    host.register_operator(TetrahedralizeFlexibleBodies)


def unregister(host):
    """Take the operator away."""
    host.unregister_operator(TetrahedralizeFlexibleBodies)
