"""A sheet of mode shapes: the deformed surface, colored by displacement, and the undeformed outline."""

from pathlib import Path

import numpy as np
from calmotion.mesh import QuadraticMesh
from calmotion.support import replaced

COLUMNS = 4
_WIDTH = 3.2  # of a panel [inch]
_LIGHT = np.array([0.35, -0.5, 0.79])


def draw_modes(
    path: Path, title: str, mesh: QuadraticMesh, shapes: np.ndarray, frequencies: np.ndarray, dpi: int
) -> None:
    """Draw the modes of one body.

    Args:
        path: File of the picture.
        title: Prim path of the body.
        mesh: Its mesh.
        shapes: Displacements to show [m], shape [n, 3, r].
        frequencies: [Hz], shape [r] or longer.
        dpi: Dots per inch.
    """
    from matplotlib import colormaps
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure

    count = shapes.shape[2]
    columns = min(COLUMNS, count)
    rows = -(-count // columns)
    right, up, toward = view(mesh.nodes)
    rest = mesh.nodes @ np.stack([right, up], axis=1)
    shown = np.concatenate([rest, *(rest + shapes[:, :, k] @ np.stack([right, up], axis=1) for k in range(count))])
    width, height = np.ptp(shown, axis=0)
    panel = float(np.clip(_WIDTH * height / width, 0.6, 1.2 * _WIDTH)) + 0.35  # and the title
    figure = Figure(figsize=(_WIDTH * max(columns, 2), panel * rows + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    figure.suptitle(f"{title}, clamped at its root", fontsize=11)
    axes = np.atleast_1d(figure.subplots(rows, columns, squeeze=False)).ravel()
    triangles = mesh.surface[:, :3]
    outline = _silhouette(mesh, toward)
    colors = colormaps["viridis"]
    for k, ax in enumerate(axes):
        ax.set_axis_off()
        ax.set_aspect("equal")
        if k >= count:
            continue
        moved = mesh.nodes + shapes[:, :, k]
        corners = moved[triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
        facing = normal @ toward > 0.0
        light = _LIGHT[0] * right + _LIGHT[1] * up + _LIGHT[2] * toward
        shade = 0.45 + 0.55 * np.clip(normal @ (light / np.linalg.norm(light)), 0.0, 1.0)
        amount = np.linalg.norm(shapes[:, :, k], axis=1)[triangles].mean(axis=1)
        amount = amount / max(float(amount.max(initial=0.0)), np.finfo(float).tiny)
        face = colors(0.15 + 0.85 * amount)
        face[:, :3] *= shade[:, None]
        order = np.argsort(corners.mean(axis=1) @ toward)
        order = order[facing[order]]
        flat = corners @ np.stack([right, up], axis=1)
        ax.add_collection(PolyCollection(flat[order], facecolors=face[order], edgecolors=face[order], linewidths=0.2))
        for a, b in outline:
            ax.plot(rest[[a, b], 0], rest[[a, b], 1], color="0.35", linewidth=0.5, alpha=0.6, zorder=3)
        ax.set_title(f"mode {k + 1}: {frequencies[k]:.4g} Hz", fontsize=9)
        ax.set_xlim(shown[:, 0].min(), shown[:, 0].max())
        ax.set_ylim(shown[:, 1].min(), shown[:, 1].max())
    with replaced(path) as temporary:
        figure.savefig(temporary, dpi=dpi)


def view(nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit vectors to the right, up and towards the eye; the longest extent of the body is horizontal."""
    axes = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)[2]
    long, middle, short = axes
    toward = 0.55 * middle + 0.75 * short + 0.35 * long
    toward /= np.linalg.norm(toward)
    right = long - (long @ toward) * toward
    right /= np.linalg.norm(right)
    return right, np.cross(toward, right), toward


def _silhouette(mesh: QuadraticMesh, toward: np.ndarray) -> np.ndarray:
    """Edges between triangles that face the eye and ones that do not, and visible sharp edges, shape [e, 2]."""
    triangles = mesh.surface[:, :3]
    x = mesh.nodes[triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), np.finfo(float).tiny)
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(triangles)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    pair = np.flatnonzero(np.all(edges[1:] == edges[:-1], axis=1))
    a, b = owner[pair], owner[pair + 1]
    facing = normal @ toward > 0.0
    contour = facing[a] != facing[b]
    sharp = (facing[a] | facing[b]) & (np.einsum("ij,ij->i", normal[a], normal[b]) < 0.6)
    return np.asarray(edges[pair[contour | sharp]])
