"""Process of `tetwild.py`: surface.npz -> tetrahedra.npz.

fTetWild draws the order of the triangles from the operating system's random numbers. This process replaces them by
fixed ones, so that a surface has one mesh, whenever and wherever it is made.
"""

import ctypes
import importlib.util
import mmap
import struct
import sys
import time
import types
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from calmotion.support.operating_system import end_with_parent

_DRAW = b"_ZNSt13random_device9_M_getvalEv"  # std::random_device::operator()
_RELOCATIONS = 4  # SHT_RELA
_WRITABLE = 1 | 2  # PROT_READ | PROT_WRITE
_SIGNATURE = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_void_p)
_KEPT: list[object] = []  # callbacks that native code calls as long as the process lives


def main(source: str, destination: str) -> None:
    """Tetrahedralise the surface of the source file, and write the destination file."""
    end_with_parent()
    # pytetwild 0.4 imports PyVista (and with it VTK) in its package's __init__ only to add a method to PyVista's
    # classes. A package without that __init__ gives the same compiled module and needs NumPy alone.
    spec = importlib.util.find_spec("pytetwild")
    if spec is None or spec.submodule_search_locations is None:
        raise SystemExit("pytetwild is not installed")
    package = types.ModuleType("pytetwild")
    package.__path__ = list(spec.submodule_search_locations)
    sys.modules["pytetwild"] = package
    from pytetwild import PyfTetWildWrapper
    from pytetwild.pytetwild import tetrahedralize

    with np.load(source) as file:
        fix_random_numbers(PyfTetWildWrapper.__file__, int(file["sequence"]))
        points, tets = tetrahedralize(
            np.ascontiguousarray(file["points"]),
            np.ascontiguousarray(file["triangles"]),
            edge_length_abs=float(file["element_size"]),
            epsilon=float(file["envelope"]),
            stop_energy=float(file["stop_energy"]),
            num_opt_iter=int(file["passes"]),
            # up to the element size: a third of the elements, with the same volume error and better angles
            coarsen=True,
            vtk_ordering=True,
            num_threads=1,
        )
    tets = np.ascontiguousarray(tets, dtype=np.int32)
    np.savez(destination, points=points, tets=tets, seconds=time.process_time())


def fix_random_numbers(library: str, sequence: int) -> bool:
    """Let a loaded library draw a fixed sequence from `std::random_device`.

    The library calls it at an address that the loader has written into a table; it gets another address.

    Args:
        library: File of the library, 64-bit ELF.
        sequence: Which sequence.

    Returns:
        Whether it draws from `std::random_device` at all and could be changed; elsewhere meshes differ from run to run.
    """
    try:
        with open("/proc/self/maps", encoding="utf-8") as maps:
            begins = [int(line.split("-")[0], 16) for line in maps if line.rstrip().endswith(f" {library}")]
        slots = [min(begins) + offset for offset in _slots(Path(library).read_bytes(), _DRAW)]
    except (OSError, ValueError, struct.error):  # no Linux, or another format
        return False
    state = [sequence]

    def draw(_: int) -> int:
        state[0] = (1664525 * state[0] + 1013904223) % 2**32  # Knuth's linear congruential generator
        return state[0]

    callback = _SIGNATURE(draw)
    _KEPT.append(callback)
    address = ctypes.cast(callback, ctypes.c_void_p).value
    protect = ctypes.CDLL(None, use_errno=True).mprotect
    for slot in slots:
        page = slot - slot % mmap.PAGESIZE  # a slot is aligned, so that it lies in one page
        if protect(ctypes.c_void_p(page), ctypes.c_size_t(mmap.PAGESIZE), _WRITABLE) != 0:
            return False
        ctypes.c_uint64.from_address(slot).value = address or 0
    return bool(slots)


def _slots(elf: bytes, symbol: bytes) -> Iterator[int]:
    """Offsets of the addresses of a symbol that the loader fills in, from the relocations of a library.

    Source: Tool Interface Standard, Executable and Linking Format; System V ABI, 64-bit.
    """
    if elf[:6] != b"\x7fELF\x02\x01":
        raise ValueError("this is not a little-endian 64-bit ELF file")
    (begin,) = struct.unpack_from("<Q", elf, 40)
    size, count = struct.unpack_from("<HH", elf, 58)
    # type, offset, size and linked section of each section
    sections = [struct.unpack_from("<4xI16xQQI", elf, begin + k * size) for k in range(count)]
    for kind, offset, length, link in sections:
        if kind != _RELOCATIONS or link == 0:
            continue
        symbols = sections[link]
        names = sections[symbols[3]]
        for place in range(offset, offset + length, 24):
            address, info = struct.unpack_from("<QQ", elf, place)
            (name,) = struct.unpack_from("<I", elf, symbols[1] + 24 * (info >> 32))
            start = names[1] + name
            if info >> 32 and elf[start : start + len(symbol) + 1] == symbol + b"\0":
                yield address


if __name__ == "__main__":
    main(*sys.argv[1:])
