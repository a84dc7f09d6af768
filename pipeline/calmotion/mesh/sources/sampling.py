"""Places spread evenly over a surface."""

import numpy as np

from calmotion.mesh.repair.closing import Part


def sampled(part: Part, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places on a surface and the outward unit normals there, both of shape [count, 3]; the same ones every time."""
    x = part.points[part.triangles]
    normal = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    area = np.linalg.norm(normal, axis=1)
    upto = np.cumsum(area)
    chosen = np.minimum(np.searchsorted(upto, upto[-1] * (np.arange(count) + 0.5) / count), len(x) - 1)
    weights = np.random.default_rng(3).dirichlet(np.ones(3), count)
    return np.einsum("ij,ijk->ik", weights, x[chosen]), normal[chosen] / area[chosen, None]
