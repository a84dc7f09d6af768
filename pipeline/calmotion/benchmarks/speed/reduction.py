"""Run time and memory of a reduction, and the accuracy of its modes.

`calmotion bench reduction [--nodes 50000] [--modes 30]` reduces a slender and a bulky link of that many
nodes, clamped at one end and with a moving interface at the other, each in a separate process, so that the peak
memory is that of one reduction.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from calmotion.benchmarks.common.parsers import bench_parser
from calmotion.linear_algebra.blas_threads import one_blas_thread
from calmotion.shot.character import Array, ElasticMaterial, FlexibleSettings, IntArray
from calmotion.support.memory import peak_memory

T = TypeVar("T")

# extent [m]; the bulky one is the worst case for a direct solver
SHAPES = {"slender": (1.6, 0.16, 0.16), "bulky": (0.3, 0.3, 0.3)}
STEEL = ElasticMaterial("/Looks/Steel", 2.1e11, 0.3, 7850.0)


def box_mesh(size: tuple[float, float, float], nodes: int) -> tuple[Array, IntArray]:
    """A box in tetrahedra whose quadratic mesh has about as many nodes; points [m], shape [n, 3], and tets."""
    from skfem import MeshTet

    from calmotion.geometry.tetrahedra import oriented_tets

    extent = np.array(size)
    # c cells along an edge carry 2 c + 1 nodes
    scales = 0.5 * (nodes / extent.prod()) ** (1.0 / 3.0) * np.linspace(0.8, 1.2, 81)
    choices = np.maximum(1, np.round(extent * scales[:, None])).astype(int)
    cells = choices[np.abs(np.prod(2 * choices + 1, axis=1) - nodes).argmin()]
    mesh = MeshTet.init_tensor(*(np.linspace(0.0, s, c + 1) for s, c in zip(extent, cells, strict=True)))
    points = np.ascontiguousarray(mesh.p.T)
    return points, oriented_tets(points, mesh.t.T)[0]


@one_blas_thread()
def measure(shape: str, nodes: int, modes: int) -> dict[str, Any]:
    """Reduces one link in this process.

    Returns:
        nodes, elements, seconds and processor seconds of each stage, entries of the factor, peak memory [GB] of
        this process, the largest residual |K x - omega^2 M x| / |K x| of the fixed-interface modes, their largest error
        of orthonormality, and the lowest and highest frequency [Hz] of the basis.
    """
    from calmotion.reduction.basis.craig_bampton import reduced_basis
    from calmotion.reduction.basis.fixed_interface import FixedInterface, ritz_modes
    from calmotion.reduction.elements.assembly import assemble

    seconds: dict[str, tuple[float, float]] = {}

    def timed(stage: str, action: Callable[[], T]) -> T:
        begin, begin_cpu = time.perf_counter(), time.process_time()
        result = action()
        seconds[stage] = time.perf_counter() - begin, time.process_time() - begin_cpu
        return result

    # compiled kernels are kept on disk: they are not part of a reduction
    small = assemble(*box_mesh((1.0, 1.0, 1.0), 27), STEEL)
    reduced_basis(small, _end(small, 0.0), [], [], FlexibleSettings(STEEL, mode_count=1))
    length = SHAPES[shape][0]
    points, tets = box_mesh(SHAPES[shape], nodes)
    model = timed("matrices", lambda: assemble(points, tets, STEEL))
    root, tip, center = _end(model, 0.0), _end(model, length), np.array(SHAPES[shape]) * [1.0, 0.5, 0.5]
    fixed = timed("factor, constraint modes", lambda: FixedInterface.of(model, root, [tip], [center]))
    columns = timed(f"{modes} fixed-interface modes", lambda: fixed.lowest(modes))
    omega_squared, U = timed("coupled modes", lambda: ritz_modes(model, columns))
    shapes = timed("shapes", lambda: columns @ U[:, :modes])
    X = columns[fixed.interior, 6:]
    KX, MX = fixed.K @ X, fixed.M @ X
    values = np.einsum("ij,ij->j", X, KX)
    residual = np.linalg.norm(KX - values * MX, axis=0) / np.linalg.norm(KX, axis=0)
    f = np.sqrt(omega_squared[: shapes.shape[1]]) / (2.0 * np.pi)
    return {
        "nodes": len(model.mesh.nodes),
        "elements": len(model.mesh.tets),
        "seconds": seconds,
        "factor": fixed.solver.entries,
        "memory": peak_memory(),
        "residual": float(residual.max()),
        "orthonormality": float(np.abs(X.T @ MX - np.eye(X.shape[1])).max()),
        "frequencies": (float(f[0]), float(f[-1])),
    }


def _end(model: Any, x: float) -> Any:
    return np.flatnonzero(np.abs(model.mesh.nodes[:, 0] - x) < 1e-9)


def report(shape: str, result: dict[str, Any]) -> str:
    """What was measured, as lines of text."""
    lowest, highest = result["frequencies"]
    lines = [f"{shape} link: {result['nodes']} nodes, {result['elements']} quadratic tetrahedra"]
    seconds = result["seconds"] | {"all": np.sum(list(result["seconds"].values()), axis=0)}
    # on a machine that others use too the processor's time is the one that tells
    lines += [f"  {stage:<30} {wall:8.2f} s ({cpu:.2f} s of processor)" for stage, (wall, cpu) in seconds.items()]
    lines += [
        f"  {'peak memory':<30} {result['memory']:8.2f} GB (factor: {8e-9 * result['factor']:.2f} GB)",
        f"  {'residual of modes':<30} {result['residual']:8.1e}",
        f"  {'orthonormality':<30} {result['orthonormality']:8.1e}",
        f"  {'frequencies':<30} {lowest:.6g} to {highest:.6g} Hz",
    ]
    return "\n".join(lines)


def main(arguments: list[str] | None = None) -> int:
    """The command."""
    parser = bench_parser("reduction", __doc__)
    parser.add_argument("--nodes", type=int, default=50000, help="approximate number of nodes of the quadratic mesh")
    parser.add_argument("--modes", type=int, default=30, help="modes of the reduced body")
    parser.add_argument("--shape", choices=[*SHAPES], help="only this shape")
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.child:
        print(json.dumps(measure(options.shape, options.nodes, options.modes)))
        return 0
    for shape in [options.shape] if options.shape else SHAPES:
        command = [sys.executable, "-m", "calmotion.benchmarks.speed.reduction", "--child", "--shape", shape]
        command += ["--nodes", str(options.nodes), "--modes", str(options.modes)]
        child = subprocess.run(command, stdout=subprocess.PIPE, text=True)
        if child.returncode:
            return child.returncode
        print(report(shape, json.loads(child.stdout)), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
