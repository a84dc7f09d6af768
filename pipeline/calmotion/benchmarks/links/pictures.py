"""Pictures of the meshes of links, with the parts of the surface that joints hold."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from calmotion.benchmarks.scenes.links import Link, attachments_of
from calmotion.support.files import replaced

if TYPE_CHECKING:
    from calmotion.shot import FEMesh

_WIDTH, _DPI = 6.0, 110  # of a picture [inch], [dots per inch]
_LIGHT = np.array([0.35, 0.5, 0.79])
_BODY, _PATCHES = (0.83, 0.85, 0.88), ((0.90, 0.45, 0.10), (0.15, 0.40, 0.80), (0.20, 0.60, 0.35), (0.55, 0.35, 0.70))


def draw_link(file: Path, title: str, mesh: FEMesh, link: Link) -> None:
    """Draw the surface of a mesh with its edges, and its interface patches coloured, from two sides.

    Args:
        file: Of the picture.
        title: Above it.
        mesh: Of the link.
        link: With its joints.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    from calmotion.reduction.elements.assembly import quadratic_mesh
    from calmotion.reduction.interfaces.interface_patches import interface_patches

    settings = link.body.flexible
    assert settings is not None
    fine = quadratic_mesh(mesh.points, mesh.tets)
    triangles = fine.surface[:, :3]
    corners = fine.nodes[triangles]
    color = np.tile(_BODY, (len(triangles), 1))
    patches = interface_patches(fine, attachments_of(link), settings.interface_radius, link.body.path, mesh.patches)
    for k, patch in enumerate(patches):
        color[np.isin(triangles, patch.nodes).all(axis=1)] = _PATCHES[min(k, len(_PATCHES) - 1)]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    figure = Figure(figsize=(_WIDTH, 0.55 * _WIDTH), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(f"{title}: {len(mesh.tets)} tetrahedra", fontsize=9)
    for ax, side in zip(figure.subplots(1, 2), (1.0, -1.0), strict=True):
        right, up, toward = _view(fine.nodes, side)
        light = _LIGHT[0] * right + _LIGHT[1] * up + _LIGHT[2] * toward
        shade = 0.5 + 0.5 * np.clip(normal @ (light / np.linalg.norm(light)), 0.0, 1.0)
        order = np.argsort(corners.mean(axis=1) @ toward)
        order = order[(normal @ toward > 0.0)[order]]
        flat = corners[order] @ np.stack([right, up], axis=1)
        face = color[order] * shade[order, None]
        ax.add_collection(PolyCollection(flat, facecolors=face, edgecolors=0.75 * face, linewidths=0.25))
        ax.set_axis_off()
        ax.set_aspect("equal")
        ax.autoscale_view()
    with replaced(file) as temporary:
        figure.savefig(temporary, dpi=_DPI, format="png")


def _view(nodes: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors to the right, up and towards the eye, from one of two opposite sides."""
    long, middle, short = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2]
    toward = side * (0.55 * middle + 0.75 * short) + 0.35 * long
    toward /= np.linalg.norm(toward)
    right = side * (long - (long @ toward) * toward)
    right /= np.linalg.norm(right)
    return right, np.cross(toward, right), toward
